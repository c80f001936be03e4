SELECT n.rig, n.suite, n.verdict, count(*) AS nights, max(n.started_at) AS last_started_at
FROM night n
WHERE n.started_s >= $1 AND n.started_s < $2
GROUP BY n.rig, n.suite, n.verdict
ORDER BY n.rig, n.suite, n.verdict

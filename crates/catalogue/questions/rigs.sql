SELECT s.rig_kind, s.rig_name, s.host, count(*) AS sessions, CAST(sum(s.planned) AS BIGINT) AS planned,
       CAST(sum(s.valid) AS BIGINT) AS valid, max(s.started_at) AS last_started_at
FROM session s
WHERE s.started_s >= $1 AND s.started_s < $2
GROUP BY s.rig_kind, s.rig_name, s.host
ORDER BY sessions DESC, s.rig_kind, s.rig_name, s.host

SELECT f.kind, CAST(sum(f.presses) AS BIGINT) AS presses, count(*) AS sessions
FROM press_fault f JOIN session s ON s.session_id = f.session_id
WHERE s.started_s >= $1 AND s.started_s < $2
GROUP BY f.kind
ORDER BY presses DESC, f.kind

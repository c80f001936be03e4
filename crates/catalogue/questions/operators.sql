SELECT s.operator, count(*) AS sessions, CAST(sum(s.planned) AS BIGINT) AS planned, CAST(sum(s.valid) AS BIGINT) AS valid,
       CAST(sum(s.valid) AS DOUBLE PRECISION) / nullif(sum(s.planned), 0) AS valid_share
FROM session s
WHERE s.started_s >= $1 AND s.started_s < $2
GROUP BY s.operator
ORDER BY sessions DESC, s.operator

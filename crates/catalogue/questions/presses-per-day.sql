SELECT substr(s.started_at, 1, 10) AS day, count(*) AS sessions, CAST(sum(s.valid) AS BIGINT) AS valid,
       CAST(sum(s.invalid + s.excluded) AS BIGINT) AS not_valid, sum(s.duration_s) / 3600.0 AS hours
FROM session s
WHERE s.started_s >= $1 AND s.started_s < $2
GROUP BY substr(s.started_at, 1, 10)
ORDER BY day

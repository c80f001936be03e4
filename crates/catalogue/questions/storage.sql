SELECT substr(s.started_at, 1, 7) AS month, count(DISTINCT s.session_id) AS sessions, count(*) AS files,
       CAST(sum(f.size_bytes) AS DOUBLE PRECISION) / 1e9 AS gigabytes
FROM session_file f JOIN session s ON s.session_id = f.session_id
GROUP BY substr(s.started_at, 1, 7)
ORDER BY month

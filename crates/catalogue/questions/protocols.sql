SELECT s.protocol_name, s.protocol_sha256, count(*) AS sessions, count(DISTINCT s.prototype) AS prototypes,
       min(s.started_at) AS first_started_at, max(s.started_at) AS last_started_at
FROM session s
GROUP BY s.protocol_name, s.protocol_sha256
ORDER BY s.protocol_name, first_started_at, s.protocol_sha256

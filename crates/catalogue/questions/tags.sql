SELECT t.tag, count(*) AS sessions, min(s.started_at) AS first_started_at, max(s.started_at) AS last_started_at
FROM tag t JOIN session s ON s.session_id = t.session_id
GROUP BY t.tag
ORDER BY sessions DESC, t.tag

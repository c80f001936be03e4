SELECT s.started_at, s.prototype, s.operator, a.rmse_mm, f.store, f.name
FROM tag t
JOIN session s ON s.session_id = t.session_id
JOIN session_file f ON f.session_id = s.session_id AND f.is_source = 1
LEFT JOIN analysis a ON a.session_id = s.session_id AND a.name = 'official' AND a.is_valid = 1
WHERE t.tag = $1
ORDER BY s.started_s DESC, s.session_id
LIMIT $2

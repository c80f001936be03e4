SELECT s.started_at, s.prototype, a.version, a.problem, f.store, f.name
FROM session s
JOIN session_file f ON f.session_id = s.session_id AND f.is_source = 1
LEFT JOIN analysis a ON a.session_id = s.session_id AND a.name = 'official'
WHERE a.name IS NULL OR a.problem IS NOT NULL OR a.version < (SELECT max(version) FROM analysis)
ORDER BY s.started_s DESC, s.session_id
LIMIT $1

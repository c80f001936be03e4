SELECT s.started_at, s.prototype, s.rig_name, a.name AS analysis, a.version, f.store, f.name
FROM analysis a
JOIN session s ON s.session_id = a.session_id
JOIN session_file f ON f.session_id = s.session_id AND f.is_source = 1
WHERE a.name = 'official' AND a.is_valid = 0
ORDER BY s.started_s DESC, s.session_id
LIMIT $1

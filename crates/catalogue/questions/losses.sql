SELECT s.started_at, s.rig_name, s.host, s.lost_bytes, s.raw_bytes, f.store, f.name
FROM session s JOIN session_file f ON f.session_id = s.session_id AND f.is_source = 1
WHERE s.lost_bytes > 0 AND s.started_s >= $1 AND s.started_s < $2
ORDER BY s.lost_bytes DESC, s.session_id
LIMIT $3

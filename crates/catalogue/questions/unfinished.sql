SELECT s.started_at, s.prototype, s.rig_name, s.ended, s.content_sha256 IS NOT NULL AS is_sealed, s.valid, s.planned, f.store,
       f.name
FROM session s JOIN session_file f ON f.session_id = s.session_id AND f.is_source = 1
WHERE s.content_sha256 IS NULL OR s.ended IS NULL OR s.ended <> 'completed'
ORDER BY s.started_s DESC, s.session_id
LIMIT $1

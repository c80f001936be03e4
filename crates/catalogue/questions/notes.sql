SELECT s.started_at, s.prototype, n.noted_at, n.author, n.text, f.name
FROM note n
JOIN session s ON s.session_id = n.session_id
JOIN session_file f ON f.session_id = s.session_id AND f.is_source = 1
WHERE lower(n.text) LIKE '%' || replace(replace(replace(lower($1), '!', '!!'), '%', '!%'), '_', '!_') || '%' ESCAPE '!'
ORDER BY s.started_s DESC, s.session_id, n.position
LIMIT $2

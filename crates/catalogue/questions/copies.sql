SELECT s.started_at, s.prototype, count(*) AS files, CAST(sum(f.is_sealed) AS BIGINT) AS sealed_files, min(f.name) AS one_name,
       max(f.name) AS other_name, s.session_id
FROM session_file f JOIN session s ON s.session_id = f.session_id
GROUP BY s.session_id, s.started_at, s.started_s, s.prototype
HAVING count(*) > 1
ORDER BY s.started_s DESC, s.session_id
LIMIT $1

-- Of presses that were made.
SELECT p.verdict, p.cause, p.camera, count(*) AS presses, count(DISTINCT p.session_id) AS sessions,
       min(s.started_at) AS first_at, max(s.started_at) AS last_at
FROM session s
JOIN analysis a ON a.session_id = s.session_id AND a.name = 'official' AND a.is_valid = 1
JOIN press p ON p.session_id = s.session_id
WHERE s.prototype = $1 AND p.role <> 'sync' AND p.verdict IN ('invalid', 'excluded')
GROUP BY p.verdict, p.cause, p.camera
ORDER BY presses DESC, p.verdict, p.cause, coalesce(p.camera, '')

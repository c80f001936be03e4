SELECT s.rig_kind, s.protocol_name, p.planned_depth_mm, count(DISTINCT p.session_id) AS sessions, count(*) AS presses,
       avg(p.error_mm) AS mean_error_mm, max(p.error_mm) AS worst_error_mm
FROM session s
JOIN analysis a ON a.session_id = s.session_id AND a.name = 'official' AND a.is_valid = 1
JOIN press p ON p.session_id = s.session_id
WHERE s.prototype = $1 AND p.role = 'score' AND p.verdict = 'valid' AND p.error_mm IS NOT NULL
GROUP BY s.rig_kind, s.protocol_name, p.planned_depth_mm
ORDER BY s.rig_kind, s.protocol_name, p.planned_depth_mm

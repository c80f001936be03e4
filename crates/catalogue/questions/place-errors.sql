SELECT s.rig_kind, s.protocol_name, p.planned_x_mm, p.planned_y_mm, substr(s.started_at, 1, 7) AS month,
       count(DISTINCT p.session_id) AS sessions, count(*) AS presses, avg(p.error_mm) AS mean_error_mm,
       max(p.error_mm) AS worst_error_mm, avg(p.estimate_x_mm - p.measured_x_mm) AS bias_x_mm,
       avg(p.estimate_y_mm - p.measured_y_mm) AS bias_y_mm
FROM session s
JOIN analysis a ON a.session_id = s.session_id AND a.name = 'official' AND a.is_valid = 1
JOIN press p ON p.session_id = s.session_id
WHERE s.prototype = $1 AND p.role = 'score' AND p.verdict = 'valid' AND p.error_mm IS NOT NULL
  AND s.started_s >= $2 AND s.started_s < $3
GROUP BY s.rig_kind, s.protocol_name, p.planned_x_mm, p.planned_y_mm, substr(s.started_at, 1, 7)
ORDER BY s.rig_kind, s.protocol_name, p.planned_x_mm, p.planned_y_mm, month

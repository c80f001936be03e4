SELECT s.started_at, s.rig_kind, s.protocol_name, CASE WHEN a.is_valid = 1 THEN a.rmse_mm END AS rmse_mm,
       CASE WHEN a.is_valid = 1 THEN a.rmse_low_mm END AS rmse_low_mm,
       CASE WHEN a.is_valid = 1 THEN a.rmse_high_mm END AS rmse_high_mm, a.rmse_n AS presses, a.is_valid, s.session_id
FROM session s LEFT JOIN analysis a ON a.session_id = s.session_id AND a.name = $2
WHERE s.prototype = $1
ORDER BY s.started_s,
         (SELECT min(f.name) FROM session_file f WHERE f.session_id = s.session_id AND f.is_source = 1), s.session_id

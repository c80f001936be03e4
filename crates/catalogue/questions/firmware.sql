SELECT d.serial, d.firmware, s.rig_kind, s.protocol_name, count(*) AS sessions, min(s.started_at) AS first_started_at, max(s.started_at) AS last_started_at,
       avg(a.rmse_mm) AS mean_rmse_mm
FROM device d
JOIN session s ON s.session_id = d.session_id
LEFT JOIN analysis a ON a.session_id = s.session_id AND a.name = 'official' AND a.is_valid = 1 AND a.located_rate >= 0.5
WHERE d.role = $1
GROUP BY d.serial, d.firmware, s.rig_kind, s.protocol_name
ORDER BY d.serial, s.rig_kind, s.protocol_name, first_started_at, d.firmware

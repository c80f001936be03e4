SELECT s.software, s.rig_kind, s.protocol_name, count(*) AS sessions, min(s.started_at) AS first_started_at, max(s.started_at) AS last_started_at,
       avg(a.rmse_mm) AS mean_rmse_mm
FROM session s LEFT JOIN analysis a ON a.session_id = s.session_id AND a.name = 'official' AND a.is_valid = 1 AND a.located_rate >= 0.5
GROUP BY s.software, s.rig_kind, s.protocol_name
ORDER BY s.rig_kind, s.protocol_name, first_started_at, s.software

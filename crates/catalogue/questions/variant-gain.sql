SELECT s.prototype, s.rig_kind, s.protocol_name, count(*) AS sessions, avg(o.rmse_mm) AS official_rmse_mm, avg(v.rmse_mm) AS variant_rmse_mm,
       avg(v.rmse_mm - o.rmse_mm) AS mean_difference_mm,
       NULLIF(v.changed_json, '[]') AS changes
FROM analysis v
JOIN analysis o ON o.session_id = v.session_id AND o.name = 'official'
JOIN session s ON s.session_id = v.session_id
WHERE v.name = $1 AND v.is_valid = 1 AND o.is_valid = 1 AND v.located_rate >= 0.5 AND o.located_rate >= 0.5 AND v.rmse_mm IS NOT NULL AND o.rmse_mm IS NOT NULL
  AND s.content_sha256 IS NOT NULL
GROUP BY s.prototype, s.rig_kind, s.protocol_name, v.changed_json
ORDER BY mean_difference_mm, s.prototype, s.rig_kind, s.protocol_name, v.changed_json

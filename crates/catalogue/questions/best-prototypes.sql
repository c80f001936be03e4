-- As in `skinrig prototypes`, only sealed sessions of one protocol, one kind of rig (simulated: one level, and the same faults on
-- purpose) and one set of changes are comparable, and
-- the RMSE of fewer than half of the attempted presses is that of the easy ones. Headlines are measured mostly where presses
-- calibrated; a model that fits those places closely looks better there than it is.
SELECT s.prototype, s.rig_kind, s.protocol_name, count(*) AS sessions, avg(a.left_out_rmse_mm) AS left_out_rmse_mm,
       avg(a.rmse_mm) AS mean_rmse_mm, min(a.rmse_mm) AS best_rmse_mm, max(a.rmse_mm) AS worst_rmse_mm,
       CAST(sum(a.rmse_n) AS BIGINT) AS presses, NULLIF(a.changed_json, '[]') AS changes,
       CASE WHEN s.rig_kind = 'simulated' THEN s.rig_name END AS simulation
FROM analysis a JOIN session s ON s.session_id = a.session_id
WHERE a.name = $2 AND a.is_valid = 1 AND a.located_rate >= 0.5 AND a.left_out_rmse_mm IS NOT NULL AND s.content_sha256 IS NOT NULL
GROUP BY s.prototype, s.rig_kind, CASE WHEN s.rig_kind = 'simulated' THEN s.rig_name END, s.protocol_name, a.changed_json
HAVING count(*) >= $1
ORDER BY avg(a.left_out_rmse_mm), s.prototype, s.rig_kind, simulation, s.protocol_name, a.changed_json

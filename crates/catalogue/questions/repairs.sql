-- As in `best-prototypes`, only sessions of one protocol and one kind of rig are comparable.
WITH result (prototype, rig_kind, protocol_name, sessions, mean_rmse_mm) AS (
    SELECT s.prototype, s.rig_kind, s.protocol_name, count(*), avg(a.rmse_mm)
    FROM session s JOIN analysis a ON a.session_id = s.session_id AND a.name = 'official' AND a.is_valid = 1 AND a.located_rate >= 0.5
    WHERE a.rmse_mm IS NOT NULL
    GROUP BY s.prototype, s.rig_kind, s.protocol_name
)
SELECT p.name, p.relation, p.parent, own.rig_kind, own.protocol_name, before.sessions AS parent_sessions,
       before.mean_rmse_mm AS parent_mean_rmse_mm, own.sessions, own.mean_rmse_mm,
       own.mean_rmse_mm - before.mean_rmse_mm AS difference_mm
FROM prototype p
JOIN result own ON own.prototype = p.name
JOIN result before ON before.prototype = p.parent AND before.rig_kind = own.rig_kind AND before.protocol_name = own.protocol_name
WHERE p.relation = $1
ORDER BY difference_mm, p.name, own.rig_kind, own.protocol_name

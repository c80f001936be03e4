WITH result (prototype, sessions, mean_rmse_mm) AS (
    SELECT s.prototype, count(*), avg(a.rmse_mm)
    FROM session s JOIN analysis a ON a.session_id = s.session_id AND a.name = 'official' AND a.is_valid = 1 AND a.located_rate >= 0.5
    WHERE a.rmse_mm IS NOT NULL
    GROUP BY s.prototype
)
SELECT p.name, p.relation, p.parent, before.sessions AS parent_sessions, before.mean_rmse_mm AS parent_mean_rmse_mm,
       own.sessions, own.mean_rmse_mm, own.mean_rmse_mm - before.mean_rmse_mm AS difference_mm
FROM prototype p
JOIN result own ON own.prototype = p.name
JOIN result before ON before.prototype = p.parent
WHERE p.relation = $1
ORDER BY difference_mm, p.name

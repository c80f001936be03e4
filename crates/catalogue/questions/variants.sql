SELECT a.name AS analysis, count(*) AS sessions, avg(CASE WHEN a.is_valid = 1 AND a.located_rate >= 0.5 THEN a.rmse_mm END) AS mean_rmse_mm,
       min(a.version) AS oldest_version,
       max(a.version) AS newest_version,
       NULLIF(a.changed_json, '[]') AS changes
FROM analysis a
GROUP BY a.name, a.changed_json
ORDER BY sessions DESC, a.name, a.changed_json

SELECT a.name AS analysis, count(*) AS sessions, avg(CASE WHEN a.is_valid = 1 THEN a.rmse_mm END) AS mean_rmse_mm, min(a.version) AS oldest_version,
       max(a.version) AS newest_version
FROM analysis a
GROUP BY a.name
ORDER BY sessions DESC, a.name

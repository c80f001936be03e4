SELECT substr(s.started_at, 1, 7) AS month, d.serial, count(*) AS sessions, avg(c.drift_ppm) AS mean_drift_ppm,
       min(c.drift_ppm) AS least_drift_ppm, max(c.drift_ppm) AS most_drift_ppm, max(c.residual_rms_us) AS worst_residual_us
FROM clock_fit c
JOIN analysis a ON a.session_id = c.session_id AND a.name = c.analysis AND a.is_valid = 1
JOIN session s ON s.session_id = c.session_id
JOIN device d ON d.session_id = c.session_id AND d.role = $1
WHERE c.map = $1 || '_from_box' AND c.analysis = 'official' AND s.started_s >= $2 AND s.started_s < $3
GROUP BY substr(s.started_at, 1, 7), d.serial
ORDER BY month, d.serial

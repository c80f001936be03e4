SELECT d.role, d.model, d.serial, count(DISTINCT d.firmware) AS firmwares, count(DISTINCT d.session_id) AS sessions,
       min(s.started_at) AS first_started_at, max(s.started_at) AS last_started_at
FROM device d JOIN session s ON s.session_id = d.session_id
GROUP BY d.role, d.model, d.serial
ORDER BY d.role, sessions DESC, d.serial, d.model

SELECT substr(s.started_at, 1, 7) AS month, s.rig_name, count(*) AS sessions, avg(v.value) AS mean_value,
       min(v.value) AS least_value, max(v.value) AS most_value, avg(v.standard_error) AS mean_standard_error
FROM calibration_value v
JOIN analysis a ON a.session_id = v.session_id AND a.name = v.analysis AND a.is_valid = 1
JOIN session s ON s.session_id = v.session_id
WHERE v.parameter = $1 AND v.analysis = 'official' AND s.started_s >= $2 AND s.started_s < $3
GROUP BY substr(s.started_at, 1, 7), s.rig_name
ORDER BY month, s.rig_name

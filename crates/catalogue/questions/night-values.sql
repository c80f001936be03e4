SELECT n.started_at, n.rig, n.night_id, v.value, v.unit, v.verdict, n.software, n.skin
FROM night_value v JOIN night n ON n.sha256 = v.sha256
WHERE v.check_name = $1 AND v.subject = $2 AND v.metric = $3 AND n.started_s >= $4 AND n.started_s < $5
ORDER BY n.started_s, n.rig, n.night_id, n.sha256

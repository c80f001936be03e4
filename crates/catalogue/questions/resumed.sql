SELECT s.started_at, s.prototype, s.rig_name, count(*) AS legs, max(l.started_at) AS last_leg_at, s.ended, s.session_id
FROM leg l JOIN session s ON s.session_id = l.session_id
GROUP BY s.session_id, s.started_at, s.started_s, s.prototype, s.rig_name, s.ended
HAVING count(*) > 1
ORDER BY s.started_s DESC, s.session_id
LIMIT $1

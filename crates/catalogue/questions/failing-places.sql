-- Presses that were made, calibration included, without those that a person or an imported schedule left out. Not seen: a camera saw
-- nothing, or the rays do not meet on the skin. Invalid: the rig failed.
SELECT s.rig_kind, s.protocol_name, p.planned_x_mm, p.planned_y_mm, count(DISTINCT p.session_id) AS sessions,
       count(*) AS presses, CAST(sum(CASE WHEN p.verdict = 'excluded' THEN 1 ELSE 0 END) AS BIGINT) AS not_seen,
       CAST(sum(CASE WHEN p.verdict = 'invalid' THEN 1 ELSE 0 END) AS BIGINT) AS invalid,
       CAST(sum(CASE WHEN p.verdict = 'valid' THEN 0 ELSE 1 END) AS DOUBLE PRECISION) / count(*) AS failed_share
FROM session s
JOIN analysis a ON a.session_id = s.session_id AND a.name = 'official' AND a.is_valid = 1
JOIN press p ON p.session_id = s.session_id
WHERE s.prototype = $1 AND p.role <> 'sync' AND p.verdict <> 'missed'
  AND (p.cause IS NULL OR p.cause NOT IN ('by_hand', 'by_selection', 'excluded'))
GROUP BY s.rig_kind, s.protocol_name, p.planned_x_mm, p.planned_y_mm
HAVING sum(CASE WHEN p.verdict = 'valid' THEN 0 ELSE 1 END) > 0
ORDER BY failed_share DESC, presses DESC, s.rig_kind, s.protocol_name, p.planned_x_mm, p.planned_y_mm
LIMIT $2

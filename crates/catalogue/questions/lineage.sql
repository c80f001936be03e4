WITH RECURSIVE before (name, generation) AS (
    SELECT DISTINCT name, CAST(0 AS BIGINT) FROM prototype WHERE name = $1
    UNION
    SELECT p.parent, b.generation - 1 FROM prototype p JOIN before b ON p.name = b.name
    WHERE p.parent IS NOT NULL AND b.generation > -1000
),
later (name, generation) AS (
    SELECT DISTINCT name, CAST(0 AS BIGINT) FROM prototype WHERE name = $1
    UNION
    SELECT p.name, l.generation + 1 FROM prototype p JOIN later l ON p.parent = l.name
    WHERE l.generation < 1000
),
family (name, generation) AS (SELECT name, generation FROM before UNION SELECT name, generation FROM later)
SELECT f.generation, f.name, min(p.relation) AS relation, min(p.parent) AS parent, min(p.made_on) AS made_on,
       count(DISTINCT s.session_id) AS sessions
FROM family f
LEFT JOIN prototype p ON p.name = f.name
LEFT JOIN session s ON s.prototype = f.name
GROUP BY f.generation, f.name
ORDER BY f.generation, f.name

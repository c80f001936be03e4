-- What an operator can ask for: `pause_now` (off the skin first) and `halt` (motors off at once) join the kinds of interruption.
PRAGMA user_version = 4;

-- SQLite changes a CHECK only by making the table anew; it is still empty here.
CREATE TABLE interruption_by_operator (
    id     INTEGER PRIMARY KEY,
    t_ns   INTEGER NOT NULL,
    kind   TEXT NOT NULL CHECK (kind IN ('pause', 'pause_now', 'resume', 'stop', 'abort', 'halt', 'fault')),
    reason TEXT NOT NULL
) STRICT;
INSERT INTO interruption_by_operator SELECT * FROM interruption;
DROP TABLE interruption;
ALTER TABLE interruption_by_operator RENAME TO interruption;

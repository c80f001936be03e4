-- A completed session goes on, too, when the rig has cost it presses: `previous_status` of a leg may be `completed`.
PRAGMA user_version = 10;

-- SQLite cannot change a CHECK: the table is made anew, with the columns that it had. `previous_seal` refers to its rows; that is held
-- against them when the transaction ends.
PRAGMA defer_foreign_keys = ON;

CREATE TABLE leg_before AS SELECT * FROM leg;

DROP TABLE leg;

-- As in schema 5, where the columns are described.
CREATE TABLE leg (
    number            INTEGER PRIMARY KEY CHECK (number >= 2),
    operator          TEXT NOT NULL,
    started_at        TEXT NOT NULL,
    host              TEXT NOT NULL,
    software          TEXT NOT NULL,
    command_line      TEXT NOT NULL,
    origin_ns         INTEGER NOT NULL CHECK (origin_ns > 0),
    camera1_origin_us INTEGER NOT NULL CHECK (camera1_origin_us >= 0),
    camera2_origin_us INTEGER NOT NULL CHECK (camera2_origin_us >= 0),
    first_seq_1       INTEGER NOT NULL CHECK (first_seq_1 >= 0),
    first_seq_2       INTEGER NOT NULL CHECK (first_seq_2 >= 0),
    devices_before    INTEGER NOT NULL CHECK (devices_before >= 0),
    preflight_before  INTEGER NOT NULL CHECK (preflight_before >= 0),
    -- How the leg before ended, moved here from `run_end`; all null: it was cut off. One that was completed has no reason.
    previous_status   TEXT CHECK (previous_status IN ('completed', 'stopped', 'faulted')),
    previous_reason   TEXT,
    previous_end_ns   INTEGER,
    previous_tree_sha256 BLOB CHECK (length(previous_tree_sha256) = 32),
    CHECK ((previous_status IS NULL) = (previous_end_ns IS NULL)),
    CHECK ((previous_reason IS NULL) = (previous_status IS NULL OR previous_status = 'completed')),
    CHECK (previous_tree_sha256 IS NULL OR previous_status IS NOT NULL)
) STRICT;

INSERT INTO leg SELECT * FROM leg_before ORDER BY number;

DROP TABLE leg_before;

-- A session that was cut off, stopped or broken off by a fault goes on in a further *leg*: another life of the running process.
PRAGMA user_version = 5;

-- One row per leg after the first, whose beginning is the row of `session`. In every leg the host's clock, the cameras' clocks and
-- the chunks' numbers begin anew; what is stored is joined to one line each: the times of a leg are moved by its origins, its
-- chunks numbered on from its first ones. The raw bytes stay as they came: who decodes a camera's bytes starts its decoder anew at
-- a leg's first chunk and adds the leg's origin.
CREATE TABLE leg (
    number            INTEGER PRIMARY KEY CHECK (number >= 2),
    operator          TEXT NOT NULL,
    -- Civil time, RFC 3339. For people: nothing is computed from it, and the pause before the leg is not its difference.
    started_at        TEXT NOT NULL,
    host              TEXT NOT NULL,
    software          TEXT NOT NULL,
    command_line      TEXT NOT NULL,
    -- Where the leg's clocks begin: a whole second, one to two seconds after the last time recorded before. 0 for a camera
    -- of which nothing was.
    origin_ns         INTEGER NOT NULL CHECK (origin_ns > 0),
    camera1_origin_us INTEGER NOT NULL CHECK (camera1_origin_us >= 0),
    camera2_origin_us INTEGER NOT NULL CHECK (camera2_origin_us >= 0),
    -- The first chunk of the leg, `chunk.seq`.
    first_seq_1       INTEGER NOT NULL CHECK (first_seq_1 >= 0),
    first_seq_2       INTEGER NOT NULL CHECK (first_seq_2 >= 0),
    -- How many rows of `device` and `preflight` belong to the legs before.
    devices_before    INTEGER NOT NULL CHECK (devices_before >= 0),
    preflight_before  INTEGER NOT NULL CHECK (preflight_before >= 0),
    -- How the leg before ended, moved here from `run_end`; all null: it was cut off.
    previous_status   TEXT CHECK (previous_status IN ('stopped', 'faulted')),
    previous_reason   TEXT,
    previous_end_ns   INTEGER,
    -- The tree hash of its seal, moved here from `seal`; null: it was not sealed.
    previous_tree_sha256 BLOB CHECK (length(previous_tree_sha256) = 32),
    CHECK ((previous_status IS NULL) + (previous_reason IS NULL) + (previous_end_ns IS NULL) IN (0, 3)),
    CHECK (previous_tree_sha256 IS NULL OR previous_status IS NOT NULL)
) STRICT;

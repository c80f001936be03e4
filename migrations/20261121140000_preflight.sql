-- What was checked before a run was armed; rigs of stand-ins; where a press touched the surface.
PRAGMA user_version = 3;

-- One row per check, in the order in which they were made. A run with a failed check was never armed.
CREATE TABLE preflight (
    id        INTEGER PRIMARY KEY,
    name      TEXT NOT NULL,
    expected  TEXT NOT NULL,
    -- What there was; for a skipped check why it was not made.
    found     TEXT NOT NULL,
    verdict   TEXT NOT NULL CHECK (verdict IN ('passed', 'failed', 'skipped')),
    -- What to do about a failed check.
    next_step TEXT,
    CHECK ((verdict = 'failed') = (next_step IS NOT NULL))
) STRICT;

-- Height at which the press touched the surface, skin frame; null when the surface was taken to be at z = 0, or not found.
-- `measured_depth_mm` counts from it where it is there.
ALTER TABLE attempt ADD COLUMN touched_mm REAL;

-- `rig_kind` learns a word: `emulated`, production drivers over stand-ins for the hardware. SQLite changes a CHECK only by
-- making the table anew; it is still empty here.
CREATE TABLE session_with_emulated (
    id              INTEGER PRIMARY KEY CHECK (id = 1),
    session_id      TEXT NOT NULL CHECK (length(session_id) = 32),
    protocol_text   TEXT NOT NULL,
    protocol_name   TEXT NOT NULL,
    protocol_sha256 TEXT NOT NULL CHECK (length(protocol_sha256) = 64),
    overrides_json  TEXT NOT NULL CHECK (json_valid(overrides_json)),
    plan_json       TEXT NOT NULL CHECK (json_valid(plan_json)),
    plan_sha256     TEXT NOT NULL CHECK (length(plan_sha256) = 64),
    seed            TEXT NOT NULL,
    rig_kind        TEXT NOT NULL CHECK (rig_kind IN ('simulated', 'replayed', 'imported', 'emulated', 'bench')),
    rig_name        TEXT NOT NULL,
    rig_json        TEXT NOT NULL CHECK (json_valid(rig_json)),
    stream_format_1 TEXT NOT NULL CHECK (stream_format_1 IN ('evt2', 'evt21', 'evt21_legacy', 'evt3')),
    stream_format_2 TEXT NOT NULL CHECK (stream_format_2 IN ('evt2', 'evt21', 'evt21_legacy', 'evt3')),
    prototype       TEXT NOT NULL,
    operator        TEXT NOT NULL,
    started_at      TEXT NOT NULL,
    host            TEXT NOT NULL,
    software        TEXT NOT NULL,
    command_line    TEXT NOT NULL
) STRICT;
INSERT INTO session_with_emulated SELECT * FROM session;
DROP TABLE session;
ALTER TABLE session_with_emulated RENAME TO session;

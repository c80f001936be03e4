-- What the nights of a bench, or of several, found: one row per night and one per measured value, so that a metric can be followed
-- over months. Everything here also stands in each night's own `night.json`: a lost history is rebuilt from these.
--
-- Values are in the unit beside them. Times are civil, RFC 3339, UTC. Rows are added and never changed.
-- Every table is STRICT: a column holds its type or the write fails.

-- 'skrh' in ASCII: tells a history from any other SQLite file by its first page, without a query.
PRAGMA application_id = 1936421480;
-- The version of this schema. A reader refuses versions above the one it knows.
PRAGMA user_version = 1;

-- One night: one pass of a suite over a bench.
CREATE TABLE night (
    id           INTEGER PRIMARY KEY,
    -- As the night calls itself: `2026-11-20T02-00-00Z-nightly`.
    night_id     TEXT NOT NULL,
    started      TEXT NOT NULL,
    suite        TEXT NOT NULL,
    suite_sha256 TEXT NOT NULL,
    rig          TEXT NOT NULL,
    rig_kind     TEXT NOT NULL,
    rig_sha256   TEXT NOT NULL,
    -- What ran. A metric that moves in the night in which one of these changes has its probable cause there.
    software     TEXT NOT NULL,
    analysis     INTEGER NOT NULL,
    skin         TEXT,
    verdict      TEXT NOT NULL,
    -- The night's folder, relative to the folder of this file when it lies below it.
    folder       TEXT NOT NULL,
    -- The golden session, relative to `folder`.
    golden       TEXT,
    -- SHA-256 of the night's JSON: the same night added twice is added once, another one under its name is refused.
    sha256       TEXT NOT NULL CHECK (length(sha256) = 64),
    -- Two benches may begin their nights in the same second.
    UNIQUE (rig, night_id)
) STRICT;

-- The firmware of each device in a night.
CREATE TABLE firmware (
    night   INTEGER NOT NULL REFERENCES night (id),
    -- `robot`, `camera1`, ...
    device  TEXT NOT NULL,
    version TEXT NOT NULL,
    PRIMARY KEY (night, device)
) STRICT, WITHOUT ROWID;

-- One check of a night, with its verdict after the rules of repeats.
CREATE TABLE check_made (
    night    INTEGER NOT NULL REFERENCES night (id),
    name     TEXT NOT NULL,
    verdict  TEXT NOT NULL,
    -- How often it was made; 0: skipped.
    attempts INTEGER NOT NULL CHECK (attempts >= 0),
    PRIMARY KEY (night, name)
) STRICT, WITHOUT ROWID;

-- One value of every attempt. The last attempt's is the night's.
CREATE TABLE measurement (
    night     INTEGER NOT NULL,
    check_name TEXT NOT NULL,
    -- From 1.
    attempt   INTEGER NOT NULL CHECK (attempt >= 1),
    subject   TEXT NOT NULL,
    metric    TEXT NOT NULL,
    -- NULL: not measured.
    value     REAL,
    unit      TEXT NOT NULL,
    -- The limit that was stated before; all NULL: for the record.
    at_least  REAL,
    at_most   REAL,
    margin    REAL,
    -- 95 % interval, and the samples behind the value.
    low       REAL,
    high      REAL,
    n         INTEGER,
    verdict   TEXT NOT NULL,
    -- Of the device's part of the check: a device that was at fault makes all its values INVALID.
    part_verdict TEXT NOT NULL,
    PRIMARY KEY (night, check_name, subject, metric, attempt),
    FOREIGN KEY (night, check_name) REFERENCES check_made (night, name)
) STRICT, WITHOUT ROWID;

-- A change that somebody knows and takes as it is: a new skin, a new baseline of the software. From this night on the series is
-- learnt anew.
CREATE TABLE acceptance (
    id       INTEGER PRIMARY KEY,
    rig      TEXT NOT NULL,
    night_id TEXT NOT NULL,
    -- NULL: all series of the rig.
    series   TEXT,
    reason   TEXT NOT NULL CHECK (length(reason) > 0),
    by       TEXT NOT NULL,
    at       TEXT NOT NULL,
    FOREIGN KEY (rig, night_id) REFERENCES night (rig, night_id)
) STRICT;

-- What a lab has recorded: sessions with their analyses, tags, notes and devices, nights, and prototypes with their origin.
-- Everything here is read from files; a lost catalogue is rebuilt from them.
--
-- The same text serves SQLite and PostgreSQL, hence the names of the types. Units are in the column names. Truth is 0 or 1.
-- `started_at` and other civil times are RFC 3339, UTC; `started_s` is the same instant in seconds since 1970.

-- One row per session, keyed by the random identifier that the session gave itself: two benches with the same name or clock do not
-- clash.
CREATE TABLE session (
    session_id      TEXT NOT NULL PRIMARY KEY CHECK (length(session_id) = 32),
    -- The tree hash of its seal, hexadecimal; null: not sealed.
    content_sha256  TEXT CHECK (length(content_sha256) = 64),
    started_at      TEXT NOT NULL,
    -- Null: `started_at` is not RFC 3339.
    started_s       BIGINT,
    prototype       TEXT NOT NULL,
    operator        TEXT NOT NULL,
    protocol_name   TEXT NOT NULL,
    protocol_sha256 TEXT NOT NULL,
    plan_sha256     TEXT NOT NULL,
    -- A JSON array of `key=value`.
    overrides_json  TEXT NOT NULL,
    -- Decimal: seeds may exceed 2^63 - 1.
    seed            TEXT NOT NULL,
    rig_kind        TEXT NOT NULL,
    rig_name        TEXT NOT NULL,
    host            TEXT NOT NULL,
    software        TEXT NOT NULL,
    -- `completed`, `stopped` or `faulted`; null: cut off.
    ended           TEXT,
    -- From the start to the end on the host's clock; null: cut off.
    duration_s      DOUBLE PRECISION,
    -- Calibrating and scored presses, by their last attempts; then sync presses.
    planned         BIGINT NOT NULL,
    valid           BIGINT NOT NULL,
    missed          BIGINT NOT NULL,
    invalid         BIGINT NOT NULL,
    excluded        BIGINT NOT NULL,
    sync_planned    BIGINT NOT NULL,
    sync_valid      BIGINT NOT NULL,
    -- Of the seal; null: not sealed.
    raw_bytes       BIGINT,
    stored_bytes    BIGINT,
    lost_bytes      BIGINT,
    cd_events       BIGINT,
    chunks          BIGINT,
    pose_samples    BIGINT,
    -- Why tags and later notes are missing here; null: they are not.
    tags_problem    TEXT
);

CREATE INDEX session_by_prototype ON session (prototype, started_s);
CREATE INDEX session_by_start ON session (started_s);
CREATE INDEX session_by_protocol ON session (protocol_name, protocol_sha256);

-- The files of a session: one, or several when it was copied (`skinrig salvage` makes such a copy). The row of `session` is that of
-- the file with `is_source`: a sealed one before an unsealed one, then the shorter name.
CREATE TABLE session_file (
    session_id  TEXT NOT NULL REFERENCES session (session_id) ON DELETE CASCADE,
    -- Folder: empty for that of an embedded catalogue, else computer and path.
    store       TEXT NOT NULL,
    name        TEXT NOT NULL,
    size_bytes  BIGINT NOT NULL,
    is_sealed   BIGINT NOT NULL,
    is_source   BIGINT NOT NULL,
    -- Digest of sizes and times of the file and of those beside it when they were read. Another one now: the entry is stale.
    fingerprint TEXT NOT NULL,
    PRIMARY KEY (session_id, store, name)
);

CREATE INDEX session_file_by_name ON session_file (store, name);

-- Session files that could not be read.
CREATE TABLE unreadable_file (
    store       TEXT NOT NULL,
    name        TEXT NOT NULL,
    fingerprint TEXT NOT NULL,
    reason      TEXT NOT NULL,
    PRIMARY KEY (store, name)
);

-- The legs of a session: more than one when it was resumed.
CREATE TABLE leg (
    session_id TEXT NOT NULL REFERENCES session (session_id) ON DELETE CASCADE,
    number     BIGINT NOT NULL,
    operator   TEXT NOT NULL,
    started_at TEXT NOT NULL,
    host       TEXT NOT NULL,
    software   TEXT NOT NULL,
    ended      TEXT,
    PRIMARY KEY (session_id, number)
);

-- Presses whose last attempt was invalid, by kind of fault. A press with two kinds counts for both.
CREATE TABLE press_fault (
    session_id TEXT NOT NULL REFERENCES session (session_id) ON DELETE CASCADE,
    kind       TEXT NOT NULL,
    presses    BIGINT NOT NULL,
    PRIMARY KEY (session_id, kind)
);

-- Devices as they reported themselves, each identity once per session and role.
CREATE TABLE device (
    session_id TEXT NOT NULL REFERENCES session (session_id) ON DELETE CASCADE,
    -- `indenter`, `camera1`, `camera2` or `trigger_box`.
    role       TEXT NOT NULL,
    model      TEXT NOT NULL,
    serial     TEXT NOT NULL,
    firmware   TEXT NOT NULL,
    PRIMARY KEY (session_id, role, serial, firmware, model)
);

CREATE INDEX device_by_serial ON device (role, serial);

-- Analyses beside a session.
CREATE TABLE analysis (
    session_id   TEXT NOT NULL REFERENCES session (session_id) ON DELETE CASCADE,
    -- `official`, or the name of the variant.
    name         TEXT NOT NULL,
    -- Why the results cannot be used; then all other columns are null.
    problem      TEXT,
    version      BIGINT,
    results_hash TEXT,
    -- 0: INVALID, its numbers must not be used.
    is_valid     BIGINT,
    -- A JSON array of `key=value`: what a variant changes.
    changed_json TEXT,
    -- Metrics of the scored presses, which never calibrate, with 95 % intervals and their number.
    rmse_mm      DOUBLE PRECISION,
    rmse_low_mm  DOUBLE PRECISION,
    rmse_high_mm DOUBLE PRECISION,
    rmse_n       BIGINT,
    median_mm    DOUBLE PRECISION,
    p95_mm       DOUBLE PRECISION,
    bias_x_mm    DOUBLE PRECISION,
    bias_y_mm    DOUBLE PRECISION,
    repeat_std_mm DOUBLE PRECISION,
    located_rate DOUBLE PRECISION,
    PRIMARY KEY (session_id, name)
);

CREATE INDEX analysis_by_name ON analysis (name, rmse_mm);

-- Fits between two clocks, for example `camera1_from_box`.
CREATE TABLE clock_fit (
    session_id      TEXT NOT NULL,
    analysis        TEXT NOT NULL,
    map             TEXT NOT NULL,
    -- How much faster the first clock runs than the second.
    drift_ppm       DOUBLE PRECISION,
    residual_rms_us DOUBLE PRECISION,
    residual_max_us DOUBLE PRECISION,
    n               BIGINT NOT NULL,
    PRIMARY KEY (session_id, analysis, map),
    FOREIGN KEY (session_id, analysis) REFERENCES analysis (session_id, name) ON DELETE CASCADE
);

CREATE INDEX clock_fit_by_map ON clock_fit (map, analysis);

-- Calibrations of the two cameras, as an analysis fitted them.
CREATE TABLE calibration (
    session_id     TEXT NOT NULL,
    analysis       TEXT NOT NULL,
    model          TEXT NOT NULL,
    -- Over the presses that calibrate.
    rmse_before_mm DOUBLE PRECISION,
    rmse_after_mm  DOUBLE PRECISION,
    n              BIGINT NOT NULL,
    PRIMARY KEY (session_id, analysis),
    FOREIGN KEY (session_id, analysis) REFERENCES analysis (session_id, name) ON DELETE CASCADE
);

-- Fitted parameters of a calibration; their units are those of the analysis.
CREATE TABLE calibration_value (
    session_id     TEXT NOT NULL,
    analysis       TEXT NOT NULL,
    parameter      TEXT NOT NULL,
    value          DOUBLE PRECISION,
    standard_error DOUBLE PRECISION,
    PRIMARY KEY (session_id, analysis, parameter),
    FOREIGN KEY (session_id, analysis) REFERENCES calibration (session_id, analysis) ON DELETE CASCADE
);

CREATE INDEX calibration_value_by_parameter ON calibration_value (parameter, analysis);

CREATE TABLE tag (
    session_id TEXT NOT NULL REFERENCES session (session_id) ON DELETE CASCADE,
    tag        TEXT NOT NULL,
    PRIMARY KEY (session_id, tag)
);

CREATE INDEX tag_by_name ON tag (tag);

-- Notes of the run and later ones.
CREATE TABLE note (
    session_id TEXT NOT NULL REFERENCES session (session_id) ON DELETE CASCADE,
    position   BIGINT NOT NULL,
    -- Civil time of a later note; null: a note of the run.
    noted_at   TEXT,
    author     TEXT,
    text       TEXT NOT NULL,
    PRIMARY KEY (session_id, position)
);

-- Nights, keyed by the digest of what they measured.
CREATE TABLE night (
    sha256     TEXT NOT NULL PRIMARY KEY CHECK (length(sha256) = 64),
    night_id   TEXT NOT NULL,
    rig        TEXT NOT NULL,
    rig_kind   TEXT NOT NULL,
    suite      TEXT NOT NULL,
    started_at TEXT NOT NULL,
    started_s  BIGINT,
    software   TEXT NOT NULL,
    analysis   BIGINT NOT NULL,
    skin       TEXT,
    verdict    TEXT NOT NULL,
    folder     TEXT NOT NULL
);

CREATE INDEX night_by_rig ON night (rig, started_s);

-- Measured values of a night, of the last attempt at each check.
CREATE TABLE night_value (
    sha256     TEXT NOT NULL REFERENCES night (sha256) ON DELETE CASCADE,
    check_name TEXT NOT NULL,
    subject    TEXT NOT NULL,
    metric     TEXT NOT NULL,
    value      DOUBLE PRECISION,
    unit       TEXT NOT NULL,
    verdict    TEXT NOT NULL,
    PRIMARY KEY (sha256, check_name, subject, metric)
);

-- Prototypes and where they come from, as `prototypes.yaml` in a folder of sessions declares them.
CREATE TABLE prototype (
    store     TEXT NOT NULL,
    name      TEXT NOT NULL,
    -- `molded_from`, `repaired` or `recut`; null: no predecessor.
    relation  TEXT,
    parent    TEXT,
    made_on   TEXT,
    note      TEXT,
    PRIMARY KEY (store, name),
    CHECK ((relation IS NULL) = (parent IS NULL))
);

CREATE INDEX prototype_by_parent ON prototype (parent);

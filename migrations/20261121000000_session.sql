-- One file holds one session: what was planned, what was tried, what happened, and every raw byte of both cameras.
--
-- Units are in the column names. `_ns`: nanoseconds on the host clock, from the session's start. `_us`: microseconds on
-- one camera's own clock, unwrapped; its origin and rate are unrelated to the host's. `_mm`, `_n` (newton), `_mm_s`.
-- Positions are in the skin frame: x and y in the plane of the skin, z out of it, z = 0 the touched surface.
-- Every table is STRICT: a column holds its type or the write fails.

-- 'skrg' in ASCII: tells a session from any other SQLite file by its first page, without a query.
PRAGMA application_id = 1936421479;
-- The version of this schema. A reader refuses versions above the one it knows.
PRAGMA user_version = 1;

-- What was known before anything moved. Exactly one row, written first.
CREATE TABLE session (
    id              INTEGER PRIMARY KEY CHECK (id = 1),
    -- 128 random bits as lower-case hex: names this session whatever its file is called.
    session_id      TEXT NOT NULL CHECK (length(session_id) = 32),
    -- The protocol as its author wrote it, byte for byte: together with `overrides_json` the identity of the experiment.
    protocol_text   TEXT NOT NULL,
    protocol_name   TEXT NOT NULL,
    protocol_sha256 TEXT NOT NULL CHECK (length(protocol_sha256) = 64),
    -- A JSON array of `key=value`: what the command line changed in the protocol.
    overrides_json  TEXT NOT NULL CHECK (json_valid(overrides_json)),
    -- The compiled plan. `plan_sha256` is taken over this very text.
    plan_json       TEXT NOT NULL CHECK (json_valid(plan_json)),
    plan_sha256     TEXT NOT NULL CHECK (length(plan_sha256) = 64),
    -- The seed of everything random, decimal. Text, because SQLite's integers end at 2^63 - 1 and seeds do not.
    seed            TEXT NOT NULL,
    rig_kind        TEXT NOT NULL CHECK (rig_kind IN ('simulated', 'replayed', 'imported', 'bench')),
    rig_name        TEXT NOT NULL,
    rig_json        TEXT NOT NULL CHECK (json_valid(rig_json)),
    -- How the bytes of camera 1 and camera 2 encode events.
    stream_format_1 TEXT NOT NULL CHECK (stream_format_1 IN ('evt2', 'evt21', 'evt21_legacy', 'evt3')),
    stream_format_2 TEXT NOT NULL CHECK (stream_format_2 IN ('evt2', 'evt21', 'evt21_legacy', 'evt3')),
    prototype       TEXT NOT NULL,
    operator        TEXT NOT NULL,
    -- Civil time, RFC 3339. For people: nothing is computed from it.
    started_at      TEXT NOT NULL,
    host            TEXT NOT NULL,
    software        TEXT NOT NULL,
    command_line    TEXT NOT NULL
) STRICT;

-- Where the skin lies: p_robot = r * p_skin + t, one row per robot axis. Numbers, not JSON: text would round them.
CREATE TABLE robot_from_skin (
    axis INTEGER PRIMARY KEY CHECK (axis IN (0, 1, 2)),
    r_x  REAL NOT NULL,
    r_y  REAL NOT NULL,
    r_z  REAL NOT NULL,
    t_mm REAL NOT NULL
) STRICT;

-- Who took part, as the devices say it themselves. A device that is configured again gets another row; the last one holds.
CREATE TABLE device (
    id       INTEGER PRIMARY KEY,
    role     TEXT NOT NULL CHECK (role IN ('indenter', 'camera1', 'camera2', 'trigger_box')),
    model    TEXT NOT NULL,
    serial   TEXT NOT NULL,
    firmware TEXT NOT NULL
) STRICT;

-- What was asked of a device, and what it then reported: the two may differ, and the second is the truth.
CREATE TABLE setting (
    device    INTEGER NOT NULL REFERENCES device (id),
    position  INTEGER NOT NULL CHECK (position >= 0),
    name      TEXT NOT NULL,
    requested TEXT NOT NULL,
    read_back TEXT NOT NULL,
    PRIMARY KEY (device, position)
) STRICT, WITHOUT ROWID;

-- The plan's presses. `role` keeps presses that calibrate apart from presses that score; `sync` presses do neither.
CREATE TABLE press (
    id         INTEGER PRIMARY KEY CHECK (id >= 0),
    role       TEXT NOT NULL CHECK (role IN ('sync', 'calibrate', 'score')),
    repetition INTEGER NOT NULL CHECK (repetition >= 0),
    location   INTEGER NOT NULL CHECK (location >= 0),
    x_mm       REAL NOT NULL,
    y_mm       REAL NOT NULL,
    depth_mm   REAL NOT NULL
) STRICT;

-- The journal. A row appears, durable, before the robot moves for a press (intent), and gets its verdict when the attempt is
-- over (outcome). A row with an intent and no verdict is an attempt that was cut off. Rows are never removed: a repeated press is
-- a new attempt that names the one before it.
CREATE TABLE attempt (
    press             INTEGER NOT NULL REFERENCES press (id),
    number            INTEGER NOT NULL CHECK (number >= 1),
    -- The attempt that this one repeats: `number - 1`, none for the first.
    previous          INTEGER,
    -- Null only for a press that was never attempted (verdict `missed`).
    intent_ns         INTEGER,
    verdict           TEXT CHECK (verdict IN ('valid', 'missed', 'invalid', 'excluded')),
    -- Why, for every verdict but `valid`.
    reason            TEXT,
    -- The measured moments of the press: all six or none.
    approach_ns       INTEGER,
    contact_ns        INTEGER,
    at_depth_ns       INTEGER,
    retract_ns        INTEGER,
    release_ns        INTEGER,
    clear_ns          INTEGER,
    -- Ground truth: the mean measured tip during the hold.
    measured_x_mm     REAL,
    measured_y_mm     REAL,
    measured_depth_mm REAL,
    peak_force_n      REAL,
    -- 1 when moments and position come from a schedule (imported data), 0 when they were measured.
    scheduled         INTEGER CHECK (scheduled IN (0, 1)),
    PRIMARY KEY (press, number),
    FOREIGN KEY (press, previous) REFERENCES attempt (press, number),
    CHECK (previous IS CASE number WHEN 1 THEN NULL ELSE number - 1 END),
    CHECK (intent_ns IS NOT NULL OR verdict = 'missed'),
    CHECK ((verdict IS NULL) = (scheduled IS NULL)),
    CHECK ((verdict IS NULL OR verdict = 'valid') = (reason IS NULL)),
    CHECK ((measured_x_mm IS NULL) = (measured_y_mm IS NULL)),
    CHECK ((approach_ns IS NULL) + (contact_ns IS NULL) + (at_depth_ns IS NULL) + (retract_ns IS NULL)
           + (release_ns IS NULL) + (clear_ns IS NULL) IN (0, 6))
) STRICT;

-- Every motion command given to the robot. The commanded and measured paths are in `pose_block`.
CREATE TABLE command (
    id         INTEGER PRIMARY KEY,
    t_ns       INTEGER NOT NULL,
    x_mm       REAL NOT NULL,
    y_mm       REAL NOT NULL,
    z_mm       REAL NOT NULL,
    speed_mm_s REAL NOT NULL
) STRICT;

-- The pose stream (1 kHz and more), in blocks: one row per sample would be ten times larger and a hundred times slower.
-- `data` is `samples` records of 64 bytes, little-endian: int64 t_ns, then eight-byte floats commanded x y z, measured x y z (mm),
-- force (N; NaN when the robot has none). numpy: [('t_ns', '<i8'), ('commanded', '<f8', 3), ('measured', '<f8', 3), ('force_n', '<f8')].
CREATE TABLE pose_block (
    id       INTEGER PRIMARY KEY,
    first_ns INTEGER NOT NULL,
    last_ns  INTEGER NOT NULL CHECK (last_ns >= first_ns),
    samples  INTEGER NOT NULL CHECK (samples >= 1),
    -- SHA-256 of `data`.
    sha256   BLOB NOT NULL CHECK (length(sha256) = 32),
    data     BLOB NOT NULL CHECK (length(data) = 64 * samples)
) STRICT;

-- Reading a span of time must not walk over all blocks.
CREATE INDEX pose_block_by_time ON pose_block (last_ns);

-- The coded marks that the trigger box sent: the host's side of the clock alignment.
CREATE TABLE mark (
    id             INTEGER PRIMARY KEY,
    t_ns           INTEGER NOT NULL,
    kind           TEXT NOT NULL CHECK (kind IN ('approach', 'contact', 'at_depth', 'retract', 'release')),
    press          INTEGER NOT NULL REFERENCES press (id),
    -- Half width of the interval in which `t_ns` certainly lies.
    uncertainty_ns INTEGER NOT NULL CHECK (uncertainty_ns >= 0)
) STRICT;

-- Camera bytes, exactly as they came. `stored` gives back `raw_bytes` bytes through `codec` (docs/session-file.md).
-- The blob is the last column, so that reading the others does not touch it.
CREATE TABLE chunk (
    camera        INTEGER NOT NULL CHECK (camera IN (1, 2)),
    -- 0, 1, 2, ... per camera, without gaps.
    seq           INTEGER NOT NULL CHECK (seq >= 0),
    -- When the last byte reached the host.
    host_ns       INTEGER NOT NULL,
    -- Bytes known to be lost between the chunk before and this one. Not 0: data are missing here.
    lost_before   INTEGER NOT NULL CHECK (lost_before >= 0),
    codec         TEXT NOT NULL CHECK (codec IN ('none', 'th-rle')),
    raw_bytes     INTEGER NOT NULL CHECK (raw_bytes >= 0),
    -- CRC-32 (zlib) of the bytes as they came: proves the decoding.
    raw_crc32     INTEGER NOT NULL CHECK (raw_crc32 BETWEEN 0 AND 4294967295),
    -- SHA-256 of `stored`: the identity of the content, and what the tree hash is made of.
    stored_sha256 BLOB NOT NULL CHECK (length(stored_sha256) = 32),
    -- What one decoding in stream order found in these bytes; times are null for a chunk without time words.
    first_us      INTEGER,
    last_us       INTEGER,
    cd_events     INTEGER NOT NULL CHECK (cd_events >= 0),
    on_events     INTEGER NOT NULL CHECK (on_events BETWEEN 0 AND cd_events),
    trigger_edges INTEGER NOT NULL CHECK (trigger_edges >= 0),
    stored        BLOB NOT NULL,
    PRIMARY KEY (camera, seq),
    CHECK ((first_us IS NULL) = (last_us IS NULL))
) STRICT;

-- Trigger edges, decoded from the chunks for convenience: the camera's side of the clock alignment. `position` counts them
-- within their chunk, so that (seq, position) is stream order.
CREATE TABLE trigger_edge (
    camera   INTEGER NOT NULL,
    seq      INTEGER NOT NULL,
    position INTEGER NOT NULL CHECK (position >= 0),
    t_us     INTEGER NOT NULL CHECK (t_us >= 0),
    channel  INTEGER NOT NULL CHECK (channel BETWEEN 0 AND 255),
    rising   INTEGER NOT NULL CHECK (rising IN (0, 1)),
    PRIMARY KEY (camera, seq, position),
    FOREIGN KEY (camera, seq) REFERENCES chunk (camera, seq)
) STRICT, WITHOUT ROWID;

-- What broke the normal course.
CREATE TABLE interruption (
    id     INTEGER PRIMARY KEY,
    t_ns   INTEGER NOT NULL,
    kind   TEXT NOT NULL CHECK (kind IN ('pause', 'resume', 'stop', 'abort', 'fault')),
    reason TEXT NOT NULL
) STRICT;

-- Remarks by the operator or by skinrig.
CREATE TABLE note (
    id   INTEGER PRIMARY KEY,
    t_ns INTEGER NOT NULL,
    text TEXT NOT NULL
) STRICT;

-- How the run ended. No row: it was cut off.
CREATE TABLE run_end (
    id     INTEGER PRIMARY KEY CHECK (id = 1),
    t_ns   INTEGER NOT NULL,
    status TEXT NOT NULL CHECK (status IN ('completed', 'stopped', 'faulted')),
    reason TEXT,
    CHECK ((status = 'completed') = (reason IS NULL))
) STRICT;

-- One row per table above, written when the session is sealed: says which table was altered when the tree hash differs.
CREATE TABLE table_digest (
    name   TEXT PRIMARY KEY,
    rows   INTEGER NOT NULL CHECK (rows >= 0),
    sha256 BLOB NOT NULL CHECK (length(sha256) = 32)
) STRICT, WITHOUT ROWID;

-- The last row ever written. No row: the session is not sealed. Presses are counted by their last attempt; sync presses apart.
CREATE TABLE seal (
    id             INTEGER PRIMARY KEY CHECK (id = 1),
    planned        INTEGER NOT NULL,
    valid          INTEGER NOT NULL,
    missed         INTEGER NOT NULL,
    invalid        INTEGER NOT NULL,
    excluded       INTEGER NOT NULL,
    sync_planned   INTEGER NOT NULL,
    sync_valid     INTEGER NOT NULL,
    sync_missed    INTEGER NOT NULL,
    sync_invalid   INTEGER NOT NULL,
    sync_excluded  INTEGER NOT NULL,
    chunks         INTEGER NOT NULL,
    raw_bytes      INTEGER NOT NULL,
    stored_bytes   INTEGER NOT NULL,
    lost_bytes     INTEGER NOT NULL,
    cd_events      INTEGER NOT NULL,
    trigger_edges  INTEGER NOT NULL,
    pose_samples   INTEGER NOT NULL,
    -- SHA-256 over the rows of `table_digest`: the identity of the content.
    tree_sha256    BLOB NOT NULL CHECK (length(tree_sha256) = 32),
    -- SHA-256 over the whole file with these 32 bytes taken as zero: covers every byte that SQLite itself never looks at.
    file_sha256    BLOB NOT NULL CHECK (length(file_sha256) = 32),
    CHECK (planned = valid + missed + invalid + excluded),
    CHECK (sync_planned = sync_valid + sync_missed + sync_invalid + sync_excluded)
) STRICT;

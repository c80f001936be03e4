-- The seals that further legs took off: what each of them covered can be proven from the rows that belonged to it.
PRAGMA user_version = 9;

-- The leg that tried it. Null in a session of an older schema: one of the legs before the session was brought up to this one.
ALTER TABLE attempt ADD COLUMN leg INTEGER CHECK (leg >= 1);

-- One row per leg that took a seal off: the row of `seal` as it was. Rows of earlier legs are never changed or removed, so that the
-- hash can be computed again from those of them that belonged to it (docs/session-file.md, "The chain of seals").
CREATE TABLE previous_seal (
    -- The leg that took it off.
    leg            INTEGER PRIMARY KEY REFERENCES leg (number),
    -- The schema that the file had then: which tables and columns the hash covers. Null, with all counts: the seal was taken off by a
    -- version of skinrig that kept no more than the tree hash.
    schema_version INTEGER CHECK (schema_version >= 1),
    planned        INTEGER,
    valid          INTEGER,
    missed         INTEGER,
    invalid        INTEGER,
    excluded       INTEGER,
    sync_planned   INTEGER,
    sync_valid     INTEGER,
    sync_missed    INTEGER,
    sync_invalid   INTEGER,
    sync_excluded  INTEGER,
    chunks         INTEGER,
    raw_bytes      INTEGER,
    stored_bytes   INTEGER,
    lost_bytes     INTEGER,
    cd_events      INTEGER,
    trigger_edges  INTEGER,
    pose_samples   INTEGER,
    -- As in `leg.previous_tree_sha256`.
    tree_sha256    BLOB NOT NULL CHECK (length(tree_sha256) = 32),
    -- Which file it was. It cannot be computed again.
    file_sha256    BLOB CHECK (length(file_sha256) = 32),
    CHECK ((schema_version IS NULL) + (planned IS NULL) + (valid IS NULL) + (missed IS NULL) + (invalid IS NULL)
           + (excluded IS NULL) + (sync_planned IS NULL) + (sync_valid IS NULL) + (sync_missed IS NULL)
           + (sync_invalid IS NULL) + (sync_excluded IS NULL) + (chunks IS NULL) + (raw_bytes IS NULL)
           + (stored_bytes IS NULL) + (lost_bytes IS NULL) + (cd_events IS NULL) + (trigger_edges IS NULL)
           + (pose_samples IS NULL) + (file_sha256 IS NULL) IN (0, 19))
) STRICT;

INSERT INTO previous_seal (leg, tree_sha256)
    SELECT number, previous_tree_sha256 FROM leg WHERE previous_tree_sha256 IS NOT NULL;

-- The rows of `table_digest` that belonged to it.
CREATE TABLE previous_table_digest (
    leg    INTEGER NOT NULL REFERENCES previous_seal (leg),
    name   TEXT NOT NULL,
    rows   INTEGER NOT NULL CHECK (rows >= 0),
    sha256 BLOB NOT NULL CHECK (length(sha256) = 32),
    PRIMARY KEY (leg, name)
) STRICT, WITHOUT ROWID;

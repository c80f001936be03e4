-- A list of sessions reads a page of each and not its plan, which lies before these columns and may have megabytes.
PRAGMA user_version = 7;

-- Covers what the list shows. Part of no digest: it repeats columns of `session`. A session of an older schema does without.
CREATE INDEX IF NOT EXISTS session_headline
    ON session (session_id, started_at, prototype, operator, protocol_name, rig_kind, rig_name);

-- Messages about runs: where each was sent, its occasion and its result. Contains no secrets.
PRAGMA user_version = 12;

-- Written after `run_end`.
CREATE TABLE notification (
    id        INTEGER PRIMARY KEY,
    -- The leg that it is about.
    leg       INTEGER NOT NULL CHECK (leg >= 1),
    channel   TEXT NOT NULL CHECK (channel IN ('mail', 'webhook', 'command')),
    -- skinrig-model, `Occasion`.
    occasion  TEXT NOT NULL,
    subject   TEXT NOT NULL,
    -- Civil times of the occasion and of the result, RFC 3339.
    raised_at TEXT NOT NULL,
    ended_at  TEXT NOT NULL,
    -- Number of tries that ended.
    tries     INTEGER NOT NULL CHECK (tries >= 0),
    -- Why it was not sent, as text and as JSON (skinrig-model, `NotificationFault`). Null: the receiver accepted it.
    reason    TEXT,
    cause     TEXT CHECK (json_valid(cause)),
    CHECK ((reason IS NULL) = (cause IS NULL))
) STRICT;

-- Touches felt while the session was recorded. The analysis after the run does not use them.

PRAGMA user_version = 13;

CREATE TABLE touch (
    id          INTEGER PRIMARY KEY,
    -- Host time at which the run had the estimate; of a reaction, at which the robot had accepted the new set point.
    t_ns        INTEGER NOT NULL,
    -- Events up to this host time are in it, by the clock fits of the estimator, and the standard deviation of that.
    until_ns    INTEGER NOT NULL,
    until_sd_ns INTEGER NOT NULL CHECK (until_sd_ns >= 0),
    kind        TEXT NOT NULL CHECK (kind IN ('started', 'onset', 'position', 'withdrawn', 'release', 'skipped', 'stopped', 'lifted')),
    -- Attempt under way; null between presses.
    press       INTEGER,
    attempt     INTEGER,
    -- Position, skin frame.
    x_mm        REAL,
    y_mm        REAL,
    -- Its 95 % region, an ellipse: semi-axes, and direction of the longer one from the x axis, counter-clockwise.
    major_mm    REAL CHECK (major_mm > 0),
    minor_mm    REAL CHECK (minor_mm > 0),
    angle_deg   REAL,
    -- Log likelihood ratio of an onset against the background, nats.
    llr         REAL,
    CHECK ((press IS NULL) = (attempt IS NULL)),
    CHECK ((x_mm IS NULL) = (y_mm IS NULL)),
    CHECK ((major_mm IS NULL) = (minor_mm IS NULL) AND (major_mm IS NULL) = (angle_deg IS NULL)),
    CHECK (major_mm IS NULL OR x_mm IS NOT NULL)
) STRICT;

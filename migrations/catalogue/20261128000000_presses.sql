-- Presses of sessions, and the counts that a list of sessions shows.
--
-- Entries of earlier versions have neither: they become stale, and `skinrig catalogue register` reads their files again.

-- Presses of the official analysis, one row per planned press. Sessions without usable results have none. `analysis` tells whether the
-- analysis is INVALID: then positions and errors must not be used.
CREATE TABLE press (
    session_id      TEXT NOT NULL REFERENCES session (session_id) ON DELETE CASCADE,
    -- Number in the plan, from 1.
    press           BIGINT NOT NULL,
    -- `sync`, `calibrate` or `score`.
    role            TEXT NOT NULL,
    location        BIGINT NOT NULL,
    repetition      BIGINT NOT NULL,
    -- Positions in the skin frame.
    planned_x_mm    DOUBLE PRECISION NOT NULL,
    planned_y_mm    DOUBLE PRECISION NOT NULL,
    planned_depth_mm DOUBLE PRECISION NOT NULL,
    -- Null: not measured.
    measured_x_mm   DOUBLE PRECISION,
    measured_y_mm   DOUBLE PRECISION,
    -- `valid`, `missed`, `invalid` or `excluded`.
    verdict         TEXT NOT NULL,
    -- Kind of the cause, such as `no_cluster`; `missed`, `invalid` and `excluded` are causes of the journal. Null: valid.
    cause           TEXT,
    -- `camera1` or `camera2`, if the cause is in one of them.
    camera          TEXT,
    -- Null: no estimate.
    estimate_x_mm   DOUBLE PRECISION,
    estimate_y_mm   DOUBLE PRECISION,
    -- Distance of the estimate from the measured position.
    error_mm        DOUBLE PRECISION,
    -- 95 % region of the estimate: semi-axes, and the direction of the longer one, counter-clockwise from the x axis.
    region_major_mm DOUBLE PRECISION,
    region_minor_mm DOUBLE PRECISION,
    region_angle_deg DOUBLE PRECISION,
    PRIMARY KEY (session_id, press)
);

-- The rest of the counts of sync presses.
ALTER TABLE session ADD COLUMN sync_missed BIGINT NOT NULL DEFAULT 0;
ALTER TABLE session ADD COLUMN sync_invalid BIGINT NOT NULL DEFAULT 0;
ALTER TABLE session ADD COLUMN sync_excluded BIGINT NOT NULL DEFAULT 0;
-- Of the seal; null: not sealed.
ALTER TABLE session ADD COLUMN trigger_edges BIGINT;

-- No file has this fingerprint.
UPDATE session_file SET fingerprint = '';

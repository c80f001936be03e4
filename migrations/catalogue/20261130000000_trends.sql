-- Whatever `skinrig hil trend` needs to judge the nights of a catalogue as it judges a history.
--
-- Nights of earlier versions lack it: registering them again adds it.

-- SHA-256 of the suite's text; null: registered by an earlier version.
ALTER TABLE night ADD COLUMN suite_sha256 TEXT;
-- SHA-256 of the rig file's text.
ALTER TABLE night ADD COLUMN rig_sha256 TEXT;
-- The golden session, relative to `folder`.
ALTER TABLE night ADD COLUMN golden TEXT;
-- Firmware: an array of pairs of device and version.
ALTER TABLE night ADD COLUMN firmware_json TEXT NOT NULL DEFAULT '[]';

-- The limit stated in advance; all null: for the record.
ALTER TABLE night_value ADD COLUMN at_least DOUBLE PRECISION;
ALTER TABLE night_value ADD COLUMN at_most DOUBLE PRECISION;
ALTER TABLE night_value ADD COLUMN margin DOUBLE PRECISION;
-- 95 % interval, and the number of samples behind the value.
ALTER TABLE night_value ADD COLUMN low DOUBLE PRECISION;
ALTER TABLE night_value ADD COLUMN high DOUBLE PRECISION;
ALTER TABLE night_value ADD COLUMN n BIGINT;
-- Of the device's part of the check: INVALID for a device at fault.
ALTER TABLE night_value ADD COLUMN part_verdict TEXT;
-- How often the check was made.
ALTER TABLE night_value ADD COLUMN attempts BIGINT;

-- Changes that somebody accepted, as the history in a folder of nights has them: from this night on the series starts anew.
CREATE TABLE night_acceptance (
    -- The folder of the history.
    store       TEXT NOT NULL,
    -- In the order of the history, from 1.
    position    BIGINT NOT NULL,
    rig         TEXT NOT NULL,
    night_id    TEXT NOT NULL,
    -- Null: all series of the bench.
    series      TEXT,
    reason      TEXT NOT NULL,
    accepted_by TEXT NOT NULL,
    accepted_at TEXT NOT NULL,
    PRIMARY KEY (store, position)
);

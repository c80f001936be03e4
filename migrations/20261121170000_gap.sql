-- The time that was lost with bytes of a camera, as a span.
PRAGMA user_version = 6;

-- One row per chunk with `lost_before` above 0, written with it. From this row on whoever decodes the camera's bytes carries nothing
-- over: the word that the loss tore is let go, and events up to the next time base word have no time; so were the facts of the chunk
-- and the edges in it found. A lossy chunk without a row was recorded before this table was, or fills a place that a salvage left
-- empty: its facts were found by a decoder that knew of no loss.
CREATE TABLE gap (
    camera  INTEGER NOT NULL,
    seq     INTEGER NOT NULL,
    -- The last camera time known to be good before the loss; null: none in this leg.
    from_us INTEGER CHECK (from_us >= 0),
    -- The first camera time after it, filled in when it comes; null: none came in this leg.
    to_us   INTEGER CHECK (to_us >= 0),
    PRIMARY KEY (camera, seq),
    FOREIGN KEY (camera, seq) REFERENCES chunk (camera, seq)
) STRICT, WITHOUT ROWID;

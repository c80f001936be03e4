-- Depth that a felt touch has reached. Sessions before this schema have none.
PRAGMA user_version = 14;

ALTER TABLE touch ADD COLUMN depth_mm REAL CHECK (depth_mm >= 0);
-- Its 95 % interval reaches so far to both sides.
ALTER TABLE touch ADD COLUMN depth_within_mm REAL
    CHECK ((depth_within_mm IS NULL) = (depth_mm IS NULL) AND (depth_within_mm IS NULL OR depth_within_mm > 0));

-- What the trigger box reported on its own clock: with the cameras' trigger edges and the host's exchanges with the box, the ties
-- between all clocks of a session.

PRAGMA user_version = 2;

-- `box_us` is microseconds on the box's own clock since its last reset; its origin and rate are unrelated to the host's and the
-- cameras'. Which of the other columns a row has depends on `what`:
--   exchange  the box read its clock between `sent_ns` and `received_ns` of the host, certainly
--   mark      the first pulse of the train for `kind` of `press` rose at `box_us`
--   sync      the first pulse of the periodic train number `count` (modulo 2^17) rose at `box_us`
--   input     an edge at the box's input
--   reset     the box lost its clock, noticed by the host at `received_ns`: times before and after do not compare
CREATE TABLE box_report (
    -- In the order in which the box reported them.
    id          INTEGER PRIMARY KEY,
    -- When the controller took the report, host clock. For replay; no clock is fitted to it.
    taken_ns    INTEGER NOT NULL,
    what        TEXT NOT NULL CHECK (what IN ('exchange', 'mark', 'sync', 'input', 'reset')),
    box_us      INTEGER CHECK (box_us >= 0),
    sent_ns     INTEGER,
    received_ns INTEGER,
    kind        TEXT CHECK (kind IN ('approach', 'contact', 'at_depth', 'retract', 'release')),
    -- As the box said it: no reference to `press`, so that a wrong report is data and not the end of a run.
    press       INTEGER CHECK (press >= 0),
    count       INTEGER CHECK (count BETWEEN 0 AND 131071),
    rising      INTEGER CHECK (rising IN (0, 1)),
    CHECK ((box_us IS NULL) = (what = 'reset')),
    CHECK ((sent_ns IS NOT NULL) = (what = 'exchange')),
    CHECK ((received_ns IS NOT NULL) = (what IN ('exchange', 'reset'))),
    CHECK ((kind IS NOT NULL) = (what = 'mark')),
    CHECK ((press IS NOT NULL) = (what = 'mark')),
    CHECK ((count IS NOT NULL) = (what = 'sync')),
    CHECK ((rising IS NOT NULL) = (what = 'input')),
    CHECK (what <> 'exchange' OR sent_ns <= received_ns)
) STRICT;

-- What made an attempt invalid, as names that programs decide by; the reason beside it is for people.
PRAGMA user_version = 8;

-- Kinds of faults with a blank between two: data_lost, no_data, data_late, storm, late, aside, paused, run_ended, surface, no_force,
-- unmeasured, hold. Null: none, or the session was recorded before this column.
ALTER TABLE attempt ADD COLUMN faults TEXT;

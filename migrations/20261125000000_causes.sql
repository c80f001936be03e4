-- Causes as types: programs decide by them, and the text beside them is for people.
PRAGMA user_version = 11;

-- Each is JSON: the kind as text, or an object whose only key is the kind and whose value holds its fields
-- (skinrig-model, `fault`). Null beside a reason: the session was recorded before this column.
ALTER TABLE attempt ADD COLUMN cause TEXT CHECK (json_valid(cause));

ALTER TABLE interruption ADD COLUMN cause TEXT CHECK (json_valid(cause));

ALTER TABLE run_end ADD COLUMN cause TEXT CHECK (json_valid(cause));

-- `run_end.cause` of the leg before.
ALTER TABLE leg ADD COLUMN previous_cause TEXT CHECK (json_valid(previous_cause));

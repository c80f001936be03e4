-- The RMSE where no press calibrated.
--
-- Entries of earlier versions do not have it: they become stale, and `skinrig catalogue register` reads their files again.

-- Null: not known, as in results of earlier versions.
ALTER TABLE analysis ADD COLUMN left_out_rmse_mm DOUBLE PRECISION;

-- No file has this fingerprint.
UPDATE session_file SET fingerprint = '';

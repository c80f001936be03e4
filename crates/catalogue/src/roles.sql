-- Roles of a catalogue on PostgreSQL, and their rights. Repeating it changes nothing; after an update of the schema it gives the
-- rights on new tables. A role belongs to the whole server, its rights to this database.
DO $$
DECLARE
    role TEXT;
BEGIN
    FOREACH role IN ARRAY ARRAY['skinrig_read', 'skinrig_annotate', 'skinrig_record', 'skinrig_admin'] LOOP
        IF NOT EXISTS (SELECT FROM pg_roles WHERE rolname = role) THEN
            EXECUTE format('CREATE ROLE %I NOLOGIN', role);
        END IF;
    END LOOP;
    -- Who owns tables may change them; the schema needs both rights to get new ones.
    EXECUTE format('GRANT USAGE ON SCHEMA %I TO skinrig_read', current_schema());
    EXECUTE format('GRANT USAGE, CREATE ON SCHEMA %I TO skinrig_admin', current_schema());

    GRANT skinrig_read TO skinrig_annotate, skinrig_record;
    GRANT skinrig_admin TO CURRENT_USER;

    GRANT SELECT ON session, session_file, unreadable_file, leg, press_fault, device, analysis, clock_fit, calibration,
        calibration_value, press, tag, note, night, night_value, night_acceptance, prototype, _sqlx_migrations TO skinrig_read;

    GRANT INSERT, DELETE ON tag, note TO skinrig_annotate;

    GRANT INSERT, UPDATE, DELETE ON session, session_file, unreadable_file, leg, press_fault, device, analysis, clock_fit, calibration,
        calibration_value, press, tag, note, night, night_value, night_acceptance, prototype TO skinrig_record;

    ALTER TABLE session OWNER TO skinrig_admin;
    ALTER TABLE session_file OWNER TO skinrig_admin;
    ALTER TABLE unreadable_file OWNER TO skinrig_admin;
    ALTER TABLE leg OWNER TO skinrig_admin;
    ALTER TABLE press_fault OWNER TO skinrig_admin;
    ALTER TABLE device OWNER TO skinrig_admin;
    ALTER TABLE analysis OWNER TO skinrig_admin;
    ALTER TABLE clock_fit OWNER TO skinrig_admin;
    ALTER TABLE calibration OWNER TO skinrig_admin;
    ALTER TABLE calibration_value OWNER TO skinrig_admin;
    ALTER TABLE press OWNER TO skinrig_admin;
    ALTER TABLE tag OWNER TO skinrig_admin;
    ALTER TABLE note OWNER TO skinrig_admin;
    ALTER TABLE night OWNER TO skinrig_admin;
    ALTER TABLE night_value OWNER TO skinrig_admin;
    ALTER TABLE night_acceptance OWNER TO skinrig_admin;
    ALTER TABLE prototype OWNER TO skinrig_admin;
    ALTER TABLE _sqlx_migrations OWNER TO skinrig_admin;
END $$

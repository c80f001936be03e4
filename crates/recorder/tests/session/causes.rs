//! Causes as types: every kind reads back from the session file, whatever its text; sessions with text alone are still read.

use skinrig_model::*;
use skinrig_recorder::{RecorderError, SessionReader, SessionWriter, verify};

use crate::cause_examples::{
    SERIAL, check_examples, decided, ended_run, interruptions, missed, trips, verdicts,
};
use crate::common::{Evt2, change, further_leg, header, outcome};

/// A session with every cause, ended by `end`.
fn records(end: RunEnd) -> Vec<Record> {
    let (verdicts, missed) = (verdicts(), missed());
    let count = verdicts.len() + missed.len();
    let mut out = vec![Record::Started(Box::new(header(count as u32)))];
    let mut presses = (0..).map(PressId::from_index);
    let mut t = 0;
    let mut next = || AttemptId {
        press: presses.next().unwrap(),
        number: 1,
    };
    for verdict in verdicts {
        let attempt = next();
        out.push(Record::Intent {
            attempt,
            t: HostTime(t),
        });
        out.push(Record::Outcome(outcome(attempt, t, verdict)));
        t += 20_000_000;
    }
    for reason in missed {
        out.push(Record::Missed(next(), reason));
    }
    let t = HostTime(t);
    for (kind, reason) in interruptions() {
        out.push(Record::Interruption { kind, t, reason });
    }
    out.push(Record::Ended { t, end });
    out
}

fn write(path: &std::path::Path, end: RunEnd, seal: bool) {
    let mut writer = SessionWriter::create(path).unwrap();
    for record in records(end) {
        writer.accept(record).unwrap();
    }
    if seal {
        writer.finish().unwrap();
    }
}

fn check_causes(path: &std::path::Path, end: &RunEnd) {
    let reader = SessionReader::open(path).unwrap();
    let stored: Vec<PressVerdict> = reader
        .presses()
        .unwrap()
        .into_iter()
        .map(|(_, attempts)| attempts[0].outcome.clone().unwrap().verdict)
        .collect();
    let missed = missed().into_iter().map(PressVerdict::Missed);
    let expected: Vec<PressVerdict> = verdicts().into_iter().chain(missed).collect();
    assert_eq!(stored, expected);
    let stored = reader.interruptions().unwrap().into_iter();
    assert!(stored.map(|i| (i.kind, i.reason)).eq(interruptions()));
    assert_eq!(
        reader.end().unwrap().map(|(_, end)| end).as_ref(),
        Some(end)
    );
}

#[test]
fn a_decided_campaign_reads_back_and_takes_no_further_leg() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("decided.session.sqlite");
    write(&path, decided(), true);
    check_causes(&path, &decided());
    assert!(matches!(
        SessionWriter::resume::<Evt2>(&path),
        Err(RecorderError::AlreadyCompleted { .. })
    ));
}

/// Through the file, and on as the end of an earlier leg. Their text plays no part: other words in the columns for people
/// change no cause.
#[test]
fn every_cause_reads_back_whatever_its_text() {
    check_examples();
    let folder = tempfile::tempdir().unwrap();
    let mut ends = vec![ended_run()];
    ends.extend(
        [
            StopReason::Stop,
            StopReason::Abort,
            StopReason::Halt,
            StopReason::Recorded {
                text: "another program".to_owned(),
            },
        ]
        .map(RunEnd::Stopped),
    );
    for (n, end) in ends.into_iter().enumerate() {
        let path = folder.path().join(format!("{n}.session.sqlite"));
        write(&path, end.clone(), true);
        check_causes(&path, &end);
        let report = verify::<Evt2>(&path).unwrap();
        assert_eq!((report.problems, report.sealed), (vec![], true));

        let mut leg = SessionWriter::resume::<Evt2>(&path).unwrap();
        let known = SessionReader::open(&path).unwrap().history().unwrap();
        leg.accept(further_leg(&known).remove(0)).unwrap();
        drop(leg);
        let legs = || SessionReader::open(&path).unwrap().legs().unwrap();
        let ended = |leg: &skinrig_recorder::LegRow| leg.end.clone().map(|(_, end)| end);
        assert_eq!(ended(&legs()[0]), Some(end.clone()));

        let reworded = folder.path().join(format!("{n}.reworded.session.sqlite"));
        write(&reworded, end.clone(), false);
        change(
            &reworded,
            &[
                "UPDATE attempt SET reason = 'reworded' WHERE reason IS NOT NULL",
                "UPDATE interruption SET reason = 'reworded'",
                "UPDATE run_end SET reason = 'reworded' WHERE reason IS NOT NULL",
            ],
        );
        check_causes(&reworded, &end);
    }
}

/// What sessions hold does not depend on any text: these are their kinds and fields.
#[test]
fn stored_forms_are_kinds_and_fields() {
    fn stored(value: &impl serde::Serialize) -> String {
        serde_json::to_string(value).unwrap()
    }
    let lost = RunFault::Device(DeviceError::Lost {
        role: DeviceRole::Camera2,
        serial: SERIAL.to_owned(),
        detail: "unplugged".to_owned(),
    });
    let end = RunEnd::fault(lost).and_fault(NotAtRest::NotDisarmed);
    assert_eq!(
        stored(&end),
        r#"{"faulted":[{"device":{"lost":{"role":"camera2","serial":"A 1","detail":"unplugged"}}},{"not_at_rest":"not_disarmed"}]}"#
    );
    assert_eq!(
        stored(&RunEnd::Stopped(StopReason::Halt)),
        r#"{"stopped":"halt"}"#
    );
    assert_eq!(
        stored(&InvalidReason::Faults(Causes::one(PressFault::DataLost {
            camera: CameraId::One,
            bytes: 64
        }))),
        r#"{"faults":[{"data_lost":{"camera":"camera1","bytes":64}}]}"#
    );
    assert_eq!(
        stored(&InvalidReason::LegEnded { leg: 2 }),
        r#"{"leg_ended":{"leg":2}}"#
    );
    assert_eq!(
        stored(&trips()[0]),
        r#"{"force":{"limit_n":8.0,"found_n":"inf","t":5}}"#
    );
    assert!(serde_json::from_str::<RunEnd>(r#"{"faulted":[]}"#).is_err());
}

/// As schema 10 wrote it: text alone, and the kinds of the faults.
#[test]
fn causes_of_older_sessions_are_their_text() {
    let folder = tempfile::tempdir().unwrap();
    for was_sealed in [false, true] {
        let path = folder.path().join(format!("{was_sealed}.session.sqlite"));
        write(&path, ended_run(), false);
        change(
            &path,
            &[
                "ALTER TABLE attempt DROP COLUMN cause",
                "ALTER TABLE interruption DROP COLUMN cause",
                "ALTER TABLE run_end DROP COLUMN cause",
                "ALTER TABLE leg DROP COLUMN previous_cause",
                "DROP TABLE notification",
                "DROP TABLE touch",
                "DELETE FROM _sqlx_migrations WHERE version >= 20261125000000",
                "PRAGMA user_version = 10",
            ],
        );
        if was_sealed {
            let ended = SessionWriter::open_ended::<Evt2>(&path).unwrap();
            ended.finish().unwrap();
        }
        let end = RunEnd::fault(RunFault::Recorded {
            text: ended_run().reason().unwrap(),
        });
        let check = || {
            let reader = SessionReader::open(&path).unwrap();
            let verdicts = verdicts().into_iter();
            for ((_, attempts), written) in reader.presses().unwrap().iter().zip(verdicts) {
                let read = &attempts[0].outcome.as_ref().unwrap().verdict;
                assert_eq!(read.kind(), written.kind());
                assert_eq!(read.reason(), written.reason());
                assert_eq!(read.fault_kinds(), written.fault_kinds());
                let by_text = written.reason().unwrap().starts_with("cut off: ");
                assert_eq!(read.is_cut_off(), by_text);
            }
            let read = reader.interruptions().unwrap();
            let texts = read.iter().map(|i| i.reason.to_string());
            assert!(texts.eq(interruptions().iter().map(|(_, reason)| reason.to_string())));
            assert_eq!(read[6].reason, InterruptionReason::End(end.clone()));
            reader.legs().unwrap()[0].end.clone().map(|(_, end)| end)
        };
        assert_eq!(check(), Some(end.clone()));

        // A further leg upgrades the schema; the earlier leg's causes are still their text, and its seal is still proven.
        let known = SessionReader::open(&path).unwrap().history().unwrap();
        let mut leg = SessionWriter::resume::<Evt2>(&path).unwrap();
        leg.accept(further_leg(&known).remove(0)).unwrap();
        drop(leg);
        assert_eq!(check(), Some(end));
        let report = verify::<Evt2>(&path).unwrap();
        assert_eq!(report.problems, []);
    }
}

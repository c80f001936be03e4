//! Tests of the history file: each night is stored once and read back unchanged, and damaged files
//! are rejected.
#![expect(clippy::unwrap_used, reason = "a failing test may panic")]

use std::path::Path;

use skinrig_hil::history::{AppendOutcome, Filter, HistoryError, accept, append, load, suites};
use skinrig_model::{Limit, Notification, NotificationChannel, Occasion};
use skinrig_nightly::night::{Attempt, CheckResult, Measurement, NIGHT_VERSION, Part};
use skinrig_nightly::trend::{Acceptance, History};
use skinrig_nightly::{GoldenSession, Night, NightExit, Verdict, Versions};

fn measured(metric: &str, value: Option<f64>) -> Measurement {
    let limit = Limit::at_least(90.0).with_margin(5.0);
    Measurement {
        metric: metric.to_owned(),
        value,
        unit: "%".to_owned(),
        interval: Some([80.25, 99.5]),
        n: Some(40),
        needs: 10,
        limit: Some(limit),
        verdict: Verdict::of_measurement(value, Some(40), 10, Some(&limit)),
        note: None,
    }
}

fn attempt(value: Option<f64>) -> Attempt {
    let part = Part {
        subject: "skin".to_owned(),
        measurements: vec![measured("located", value), measured("valid", Some(100.0))],
        verdict: Verdict::Pass,
    };
    Attempt {
        began_s: 0.0,
        took_s: 1.0,
        parts: vec![part],
        evidence: Vec::new(),
        verdict: Verdict::Pass,
        cause: None,
        rule: None,
    }
}

/// Night number `day` with one attempt at the golden check per value.
fn night(day: u32, rig: &str, values: &[Option<f64>]) -> Night {
    let check = CheckResult {
        name: "golden".to_owned(),
        title: "golden skin".to_owned(),
        planned_s: 60.0,
        attempts: values.iter().copied().map(attempt).collect(),
        skipped: None,
        verdict: Verdict::Marginal,
        repeats: None,
        cause: None,
        rule: None,
        witnesses: Vec::new(),
    };
    Night {
        version: NIGHT_VERSION,
        id: format!("2026-11-{day:02}T02-00-00Z-nightly"),
        suite: "nightly".to_owned(),
        suite_sha256: "5".repeat(64),
        rig: rig.to_owned(),
        rig_kind: "emulated".to_owned(),
        rig_sha256: "6".repeat(64),
        versions: Versions {
            software: "0.1.0 (abc)".to_owned(),
            analysis: 3,
            firmware: vec![
                ("camera1".to_owned(), "1.2".to_owned()),
                ("trigger box".to_owned(), "7".to_owned()),
            ],
            skin: Some("golden-1".to_owned()),
        },
        started: format!("2026-11-{day:02}T02:00:00Z"),
        took_s: 600.0,
        planned_s: 500.0,
        budget_s: 1200.0,
        finished: true,
        ended_early: None,
        lease_note: None,
        notifications: Vec::new(),
        checks: vec![check],
        golden: Some(GoldenSession {
            session: "golden.session.sqlite".to_owned(),
            report: None,
            results_sha256: None,
        }),
        verdict: Verdict::Marginal,
        exit: NightExit::Pass,
    }
}

#[test]
fn nights_are_read_back_unchanged_in_any_order_and_added_only_once() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("history.sqlite");
    let nights = [
        night(3, "b1", &[Some(97.0), None, Some(0.1 + 0.2)]),
        night(4, "b1", &[Some(96.0)]),
        night(5, "b1", &[None]),
    ];
    let other = night(3, "b2", &[Some(1.0)]);
    for night in [&nights[1], &other, &nights[2], &nights[0]] {
        let own = folder.path().join(&night.id);
        std::fs::create_dir_all(&own).unwrap();
        assert_eq!(append(&path, night, &own).unwrap(), AppendOutcome::Added);
        assert_eq!(
            append(&path, night, &own).unwrap(),
            AppendOutcome::AlreadyPresent
        );
    }
    // Messages are sent after a night is added: they do not make it another night.
    let told = Night {
        notifications: vec![Notification {
            channel: NotificationChannel::Command,
            occasion: Occasion::NightMarginal,
            subject: "night MARGINAL".to_owned(),
            raised_at: "2026-11-03T02:10:00Z".to_owned(),
            ended_at: "2026-11-03T02:10:01Z".to_owned(),
            tries: 1,
            fault: None,
        }],
        ..nights[0].clone()
    };
    assert_eq!(
        append(&path, &told, folder.path()).unwrap(),
        AppendOutcome::AlreadyPresent
    );
    let mut expected = History::default();
    for night in &nights {
        expected.push(night, night.id.clone());
    }
    let one = Filter {
        rig: Some("b1".to_owned()),
        suite: None,
    };
    assert_eq!(load(&path, &one).unwrap(), expected);
    let located = &expected.series[0];
    assert_eq!(located.name, "golden/skin/located");
    assert_eq!(
        (located.points[0].value, located.points[0].attempts),
        (Some(0.1 + 0.2), 3)
    );
    let all = suites(&path).unwrap();
    let named: Vec<_> = all.iter().map(|l| (l.rig.as_str(), l.nights)).collect();
    assert_eq!(named, [("b1", 3), ("b2", 1)]);

    let mut forged = nights[0].clone();
    forged.checks[0].attempts.pop();
    let mut cut_off = night(9, "b1", &[]);
    cut_off.finished = false;
    let e = append(&path, &cut_off, folder.path()).unwrap_err();
    assert!(matches!(e, HistoryError::InvalidNight { .. }), "{e}");
    let e = append(&path, &forged, folder.path()).unwrap_err();
    assert!(matches!(e, HistoryError::ConflictingNight { .. }), "{e}");
    assert_eq!(load(&path, &one).unwrap(), expected);

    let later = folder.path().join("later.json");
    let mut unknown = nights[0].clone();
    unknown.version = 999;
    std::fs::write(&later, serde_json::to_vec(&unknown).unwrap()).unwrap();
    let e = skinrig_hil::history::read_night(&later).unwrap_err();
    assert!(e.to_string().contains("version 999"), "{e}");
}

#[test]
fn two_programs_add_to_one_history_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("history.sqlite");
    std::thread::scope(|threads| {
        for rig in ["b1", "b2", "b3", "b4"] {
            let path = &path;
            threads.spawn(move || {
                for day in 1..=5 {
                    append(path, &night(day, rig, &[Some(97.0)]), Path::new("x")).unwrap();
                }
            });
        }
    });
    let all = suites(&path).unwrap();
    assert_eq!(all.iter().map(|l| l.nights).collect::<Vec<_>>(), [5; 4]);
}

#[test]
fn acceptances_are_stored_and_must_name_existing_nights_and_series() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("history.sqlite");
    append(&path, &night(1, "b1", &[Some(97.0)]), folder.path()).unwrap();
    let acceptance = Acceptance {
        series: Some("golden/skin/located".to_owned()),
        night: "2026-11-01T02-00-00Z-nightly".to_owned(),
        reason: "another skin".to_owned(),
        by: "ada".to_owned(),
        at: "2026-11-02T08:00:00Z".to_owned(),
    };
    let history = load(&path, &Filter::default()).unwrap();
    accept(&path, &history, &acceptance).unwrap();
    let unknown = Acceptance {
        night: "2026-11-09T02-00-00Z-nightly".to_owned(),
        ..acceptance.clone()
    };
    assert!(accept(&path, &history, &unknown).is_err());
    let unknown = Acceptance {
        series: Some("golden/skin/lokated".to_owned()),
        ..acceptance.clone()
    };
    let e = accept(&path, &history, &unknown).unwrap_err().to_string();
    assert!(e.contains("golden/skin/lokated"), "{e}");
    let read = load(&path, &Filter::default()).unwrap();
    assert_eq!(read.accepted, [acceptance]);
}

/// The error of `append` for a file with these bytes, which must stay unchanged.
fn refused(bytes: &[u8]) -> HistoryError {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("history.sqlite");
    std::fs::write(&path, bytes).unwrap();
    let e = append(&path, &night(1, "b1", &[None]), folder.path()).unwrap_err();
    assert_eq!(std::fs::read(&path).unwrap(), bytes);
    assert!(load(&path, &Filter::default()).is_err());
    e
}

#[test]
fn foreign_newer_and_damaged_files_are_rejected_and_left_unchanged() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("history.sqlite");
    let missing = load(&path, &Filter::default()).unwrap_err();
    assert!(matches!(missing, HistoryError::Missing { .. }), "{missing}");
    for day in 1..=28 {
        append(&path, &night(day, "b1", &[Some(97.0)]), folder.path()).unwrap();
    }
    let sound = std::fs::read(&path).unwrap();

    let e = refused(b"name,value\n");
    assert!(matches!(e, HistoryError::Foreign { .. }), "{e}");
    let mut other = sound.clone();
    other[68..72].copy_from_slice(b"skrg");
    let e = refused(&other);
    assert!(matches!(e, HistoryError::Foreign { .. }), "{e}");
    let mut newer = sound.clone();
    newer[60..64].copy_from_slice(&2u32.to_be_bytes());
    let e = refused(&newer);
    assert!(matches!(e, HistoryError::Newer { .. }), "{e}");
    assert!(e.to_string().contains("newer skinrig"), "{e}");
    let mut torn = sound.clone();
    let middle = sound.len() / 2;
    torn[middle..middle + 4096].fill(0xa5);
    let e = refused(&torn);
    assert!(e.to_string().contains("--rebuild"), "{e}");
    let e = refused(&sound[..sound.len() - 4096]);
    assert!(e.to_string().contains("--rebuild"), "{e}");
}

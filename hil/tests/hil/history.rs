//! Tests of the history file: each night is stored once and read back unchanged, and damaged files
//! are rejected.
#![expect(clippy::unwrap_used, reason = "a failing test may panic")]

use std::path::Path;

use skinrig_hil::history::{AppendOutcome, HistoryError, accept, append, load, suites};
use skinrig_model::{Limit, Notification, NotificationChannel, Occasion};
use skinrig_nightly::night::{Attempt, CheckResult, Measurement, NIGHT_VERSION, Part};
use skinrig_nightly::trend::{Acceptance, Filter, History};
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
    let measurements = vec![measured("located", value), measured("valid", Some(100.0))];
    let verdict = Verdict::worst(measurements.iter().map(|m| m.verdict));
    let part = Part {
        subject: "skin".to_owned(),
        measurements,
        verdict,
    };
    Attempt {
        began_s: 0.0,
        took_s: 1.0,
        parts: vec![part],
        evidence: Vec::new(),
        verdict,
        cause: None,
        rule: None,
    }
}

/// Night number `day` with one attempt at the golden check per value.
fn night(day: u32, rig: &str, values: &[Option<f64>]) -> Night {
    let attempts: Vec<Attempt> = values.iter().copied().map(attempt).collect();
    let last = attempts.last().map(|a| a.verdict);
    let verdict = Verdict::worst(last.into_iter().chain([Verdict::Marginal]));
    let check = CheckResult {
        name: "golden".to_owned(),
        title: "golden skin".to_owned(),
        planned_s: 60.0,
        attempts,
        skipped: None,
        verdict,
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
        verdict,
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
        ..Filter::default()
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
fn a_bench_and_its_emulation_share_no_history() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("history.sqlite");
    let emulated = night(1, "b1", &[Some(97.0)]);
    let mut real = night(2, "b1", &[Some(97.0)]);
    real.rig_kind = "bench".to_owned();
    for night in [&emulated, &real] {
        append(&path, night, folder.path()).unwrap();
    }
    let of = |kind: Option<&str>| {
        let filter = Filter {
            rig_kind: kind.map(str::to_owned),
            ..Filter::default()
        };
        let nights = load(&path, &filter).unwrap().nights;
        nights.into_iter().map(|n| n.id).collect::<Vec<_>>()
    };
    assert_eq!(of(Some("emulated")), [emulated.id]);
    assert_eq!(of(Some("bench")), [real.id.clone()]);
    assert_eq!(of(None), [real.id], "those of the newest night");
}

#[test]
fn nights_that_cannot_be_are_refused_with_what_is_wrong() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("history.sqlite");
    let refused = |change: &dyn Fn(&mut Night), expected: &str| {
        let mut night = night(1, "b1", &[Some(97.0)]);
        change(&mut night);
        let e = append(&path, &night, folder.path()).unwrap_err();
        let found = matches!(e, HistoryError::InvalidNight { .. });
        assert!(found && e.to_string().contains(expected), "{e}");
    };
    for started in ["yesterday", "", "2026-11-01T02:00:00+05:00"] {
        refused(&|n| n.started = started.to_owned(), "a time in UTC");
    }
    refused(&|n| n.checks.push(n.checks[0].clone()), "golden twice");
    refused(
        &|n| {
            let part = &mut n.checks[0].attempts[0].parts[0];
            part.measurements.push(part.measurements[0].clone());
        },
        "skin/located twice in the check golden",
    );
    refused(
        &|n| n.versions.firmware.push(("camera1".into(), "2".into())),
        "two firmware versions of camera1",
    );
    refused(
        &|n| n.checks[0].attempts[0].parts[0].measurements[0].interval = Some([3.0, 1.0]),
        "the interval 3 to 1 of skin/located",
    );
    refused(
        &|n| {
            n.verdict = Verdict::Pass;
            n.checks[0].verdict = Verdict::Fail;
        },
        "PASS above FAIL among its checks",
    );
    refused(
        &|n| n.checks[0].attempts[0].parts[0].measurements[0].value = Some(1.0),
        "above FAIL in the check golden",
    );
    // Those after them are added.
    append(&path, &night(2, "b1", &[Some(97.0)]), folder.path()).unwrap();
}

#[test]
fn rows_that_differ_from_their_night_are_damage() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("history.sqlite");
    let night = night(1, "b1", &[Some(40.125)]);
    append(&path, &night, folder.path()).unwrap();
    let sound = std::fs::read(&path).unwrap();
    // As SQLite stores them.
    let (from, to) = (40.125f64.to_be_bytes(), 41.125f64.to_be_bytes());
    let stored = sound.windows(8).position(|w| w == from);
    let mut edited = sound;
    match stored {
        Some(at) => edited[at..at + 8].copy_from_slice(&to),
        None => panic!("the value is not in the file"),
    }
    std::fs::write(&path, &edited).unwrap();
    let e = append(&path, &night, folder.path()).unwrap_err();
    assert!(matches!(e, HistoryError::Damaged { .. }), "{e}");
    assert!(
        e.to_string().contains("the values of its night.json"),
        "{e}"
    );
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

/// The example of the documentation: every night is accepted, INVALID ones too, and both planted changes are found.
#[test]
fn the_simulated_history_shows_its_planted_changes() {
    let folder = tempfile::tempdir().unwrap();
    crate::simulated_history::write(folder.path());
    let history = load(&folder.path().join("history.sqlite"), &Filter::default()).unwrap();
    assert!(history.nights.len() > 110, "{}", history.nights.len());
    assert!(history.nights.iter().any(|n| n.verdict == Verdict::Invalid));
    let report = skinrig_nightly::trend::judge(&history);
    for planted in ["noise_lit/camera2/rate", "golden/skin/press_events"] {
        let named = report.charts.iter().find(|c| c.series.name == planted);
        assert!(named.unwrap().open_excursion().is_some(), "{planted}");
    }
}

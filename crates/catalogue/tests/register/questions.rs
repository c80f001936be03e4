//! Every question has the answer that the entries give.

use std::collections::{BTreeMap, BTreeSet};
use std::time::{Duration, Instant};

use skinrig_catalogue::{Answer, Catalogue, CatalogueError, Question, SessionEntry, Value};

use crate::support::Lab;
use crate::synthetic;

/// Values for the parameters without a default.
const GIVEN: [(&str, &str); 7] = [
    ("prototype", "mold 7"),
    ("tag", "wet"),
    ("text", "LAMP 7"),
    ("parameter", "yaw_1_deg"),
    ("check", "trigger_loopback"),
    ("subject", "camera1"),
    ("metric", "jitter"),
];

pub(crate) fn ask(catalogue: &mut Catalogue, name: &str, given: &[(&str, &str)]) -> Answer {
    let question = Question::find(name).unwrap();
    let own = |(key, value): &(&str, &str)| ((*key).to_owned(), (*value).to_owned());
    let mut values: Vec<(String, String)> = given.iter().map(own).collect();
    for (key, value) in GIVEN {
        let takes = question.parameters.iter().any(|p| p.name == key);
        if takes && !values.iter().any(|(k, _)| k == key) {
            values.push((key.to_owned(), value.to_owned()));
        }
    }
    if name == "variant-gain" {
        values.push(("analysis".into(), "locator=direct".into()));
    }
    catalogue.ask(question, &values).unwrap()
}

/// A lab with `count` sessions, 60 prototypes and `nights` nights.
pub(crate) fn fill(
    catalogue: &mut Catalogue,
    lab: &Lab,
    count: u32,
    nights: u32,
) -> Vec<SessionEntry> {
    synthetic::write_prototypes(lab.path());
    catalogue.refresh(lab.path(), false).unwrap();
    let folder = lab.path().join("nights");
    std::fs::create_dir(&folder).unwrap();
    synthetic::write_nights(&folder, nights);
    let found = catalogue.register_nights(&folder).unwrap();
    assert_eq!(
        (found.registered, found.unreadable.len()),
        (nights as usize, 0)
    );
    let again = catalogue.register_nights(&folder).unwrap();
    assert_eq!((again.registered, again.unchanged), (0, nights as usize));
    let sessions = synthetic::sessions(count, 1);
    catalogue.add(&sessions).unwrap();
    sessions.into_iter().map(|(_, session)| session).collect()
}

pub(crate) fn real(value: &Value) -> f64 {
    match value {
        Value::Real(value) => *value,
        other => panic!("expected a number, found {other:?}"),
    }
}

/// Equal rows, numbers up to rounding: the databases add in different orders.
pub(crate) fn is_equal(one: &[Value], other: &[Value]) -> bool {
    let equal = |(one, other): (&Value, &Value)| match (one, other) {
        (Value::Real(a), Value::Real(b)) => (a - b).abs() <= 1e-9 * (1.0 + a.abs()),
        (one, other) => one == other,
    };
    one.len() == other.len() && one.iter().zip(other).all(equal)
}

pub(crate) fn text(value: &Value) -> &str {
    value.as_text().unwrap()
}

/// Official, usable RMSE of a session.
pub(crate) fn rmse(session: &SessionEntry) -> Option<f64> {
    let official = session.analyses.iter().find(|a| a.name == "official")?;
    let figures = official.figures.as_ref().ok().filter(|f| f.is_valid)?;
    let is_of_the_skin = figures.located_rate.is_some_and(|share| share >= 0.5);
    figures.rmse_mm.value.filter(|_| is_of_the_skin)
}

/// RMSE where no press calibrated, of those.
fn left_out_rmse(session: &SessionEntry) -> Option<f64> {
    rmse(session)?;
    let official = session.analyses.iter().find(|a| a.name == "official")?;
    official.figures.as_ref().ok()?.left_out_rmse_mm
}

pub(crate) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

#[test]
fn answers_are_those_of_the_entries() {
    let lab = Lab::with_sessions(0);
    let mut catalogue = lab.open();
    let sessions = fill(&mut catalogue, &lab, 300, 20);
    let mut ask = |name, given: &[(&str, &str)]| ask(&mut catalogue, name, given);

    // Prototypes with three sealed sessions and more, by mean RMSE where no press calibrated.
    let mut groups: BTreeMap<(&str, &str, Option<&str>), Vec<f64>> = BTreeMap::new();
    assert!(
        sessions
            .iter()
            .any(|s| s.content_sha256.is_none() && rmse(s).is_some())
    );
    for s in sessions.iter().filter(|s| s.content_sha256.is_some()) {
        let of = &s.headline;
        // Of simulations the levels, and the faults on purpose, are apart.
        let simulation = (of.rig_kind == "simulated").then_some(of.rig_name.as_str());
        let key = (of.prototype.as_str(), of.rig_kind.as_str(), simulation);
        groups.entry(key).or_default().extend(left_out_rmse(s));
    }
    let mut expected: Vec<_> = groups.iter().filter(|(_, all)| all.len() >= 3).collect();
    expected.sort_by(|a, b| mean(a.1).total_cmp(&mean(b.1)));
    let answer = ask("best-prototypes", &[]);
    assert_eq!(answer.rows.len(), expected.len());
    for (row, ((prototype, kind, _), all)) in answer.rows.iter().zip(expected) {
        assert_eq!((text(&row[0]), text(&row[1])), (*prototype, *kind));
        assert_eq!(row[3], Value::Integer(all.len() as i64));
        assert!((real(&row[4]) - mean(all)).abs() < 1e-12);
    }

    // Drift of camera 1 over 2025 in valid analyses, by month and serial number.
    let mut drift: BTreeMap<(&str, &str), Vec<f64>> = BTreeMap::new();
    for s in sessions
        .iter()
        .filter(|s| s.headline.started_at.starts_with("2025"))
    {
        let of = |a: &&skinrig_catalogue::AnalysisEntry| a.name == "official";
        let figures = s
            .analyses
            .iter()
            .find(of)
            .and_then(|a| a.figures.as_ref().ok());
        let valid = figures.filter(|f| f.is_valid);
        let clocks = valid.map(|f| f.clocks.as_slice()).unwrap_or_default();
        let clock = clocks.iter().find(|c| c.map == "camera1_from_box");
        let camera = s.devices.iter().find(|d| d[0] == "camera1").unwrap();
        if let Some(clock) = clock {
            let key = (&s.headline.started_at[..7], camera[2].as_str());
            drift.entry(key).or_default().extend(clock.drift_ppm);
        }
    }
    let answer = ask(
        "clock-drift",
        &[("since", "2025-01-01"), ("until", "2025-12-31")],
    );
    assert_eq!(answer.rows.len(), drift.len());
    for (row, ((month, serial), all)) in answer.rows.iter().zip(&drift) {
        assert_eq!((text(&row[0]), text(&row[1])), (*month, *serial));
        assert!((real(&row[3]) - mean(all)).abs() < 1e-9);
    }

    // The text of a note is no pattern.
    for text in ["lamp_7", "lamp%"] {
        assert_eq!(ask("notes", &[("text", text)]).rows.len(), 0);
    }

    // Faults, operators, tags, notes, unfinished and resumed sessions.
    let mut faults: BTreeMap<&str, i64> = BTreeMap::new();
    for (kind, presses) in sessions.iter().flat_map(|s| &s.faults) {
        *faults.entry(kind).or_default() += i64::try_from(*presses).unwrap();
    }
    let answer = ask("press-faults", &[]);
    let found = answer
        .rows
        .iter()
        .map(|r| (text(&r[0]), r[1].as_integer().unwrap()));
    assert_eq!(found.collect::<BTreeMap<_, _>>(), faults);
    let count = |of: &dyn Fn(&SessionEntry) -> bool| sessions.iter().filter(|s| of(s)).count();
    let all = [("limit", "100000")];
    for (name, expected) in [
        ("tagged", count(&|s| s.tags.contains("wet"))),
        ("unfinished", count(&|s| s.content_sha256.is_none())),
        ("resumed", count(&|s| s.legs.len() > 1)),
        (
            "losses",
            count(&|s| s.totals.is_some_and(|t| t.lost_bytes > 0)),
        ),
        ("copies", 0),
        (
            "notes",
            sessions
                .iter()
                .flat_map(|s| &s.notes)
                .filter(|n| n.text.starts_with("lamp 7"))
                .count(),
        ),
        (
            "invalid",
            count(&|s| {
                let of = s.analyses.iter().find(|a| a.name == "official");
                of.is_some_and(|a| a.figures.as_ref().is_ok_and(|f| !f.is_valid))
            }),
        ),
        (
            "not-analyzed",
            count(&|s| {
                let of = s.analyses.iter().find(|a| a.name == "official");
                of.is_none_or(|a| a.figures.as_ref().map_or(true, |f| f.version < 14))
            }),
        ),
    ] {
        assert_eq!(ask(name, &all).rows.len(), expected, "{name}");
    }
    assert_eq!(ask("tagged", &[("limit", "2")]).rows.len(), 2);

    // Sums and distinct values.
    let valid: u64 = sessions.iter().map(|s| s.presses.valid).sum();
    for name in ["operators", "rigs", "presses-per-day"] {
        let answer = ask(name, &[]);
        let at = answer.columns.iter().position(|c| c == "valid").unwrap();
        let sum: i64 = answer
            .rows
            .iter()
            .map(|r| r[at].as_integer().unwrap())
            .sum();
        assert_eq!(sum, i64::try_from(valid).unwrap(), "{name}");
    }
    let serials: BTreeSet<_> = sessions
        .iter()
        .flat_map(|s| &s.devices)
        .map(|d| &d[2])
        .collect();
    assert_eq!(ask("devices", &[]).rows.len(), serials.len());
    assert_eq!(ask("night-values", &[]).rows.len(), 20);
    assert_eq!(ask("night-verdicts", &[]).rows[0][3], Value::Integer(20));
    // 7 comes from 3, 3 from 1, 1 from 0; from it come 14, 15, 28 to 31 and 56 to 59.
    let answer = ask("lineage", &[]);
    let names: Vec<_> = answer
        .rows
        .iter()
        .map(|r| (r[0].as_integer().unwrap(), text(&r[1])))
        .collect();
    assert_eq!(names.len(), 3 + 1 + 2 + 4 + 4);
    assert_eq!(
        names[..5],
        [
            (-3, "mold 0"),
            (-2, "mold 1"),
            (-1, "mold 3"),
            (0, "mold 7"),
            (1, "mold 14")
        ]
    );
    assert_eq!(names[13], (3, "mold 59"));
    // The rest answers at all.
    for question in Question::all() {
        if question.name != "copies" {
            let found = ask(question.name, &[]).rows.len();
            assert!(found > 0, "{}", question.name);
        }
    }
}

#[test]
fn wrong_parameters_are_rejected() {
    let lab = Lab::with_sessions(0);
    let mut catalogue = lab.open();
    let mut ask = |name: &str, given: &[(&str, &str)]| {
        let own = |(key, value): &(&str, &str)| ((*key).to_owned(), (*value).to_owned());
        let given: Vec<_> = given.iter().map(own).collect();
        catalogue.ask(Question::find(name).unwrap(), &given)
    };
    for (name, given, part) in [
        ("tagged", &[][..], "tag=VALUE"),
        ("tagged", &[("tag", "a"), ("limit", "0")], "a count from 1"),
        ("tagged", &[("tag", "a"), ("tags", "b")], "among tag, limit"),
        ("rigs", &[("since", "2025-02-30")], "a day"),
        ("tags", &[("tag", "a")], "no parameters"),
        ("clock-drift", &[("camera", "camera3")], "camera1, camera2"),
        (
            "rigs",
            &[("since", "2026-02-01"), ("until", "2026-01-01")],
            "since no later than until",
        ),
    ] {
        let error = ask(name, given).unwrap_err();
        assert!(matches!(error, CatalogueError::Parameter { .. }));
        assert!(error.to_string().contains(part), "{error}");
    }
    // Values are data, never part of a statement.
    let hostile = "'; DROP TABLE session; --";
    assert_eq!(ask("tagged", &[("tag", hostile)]).unwrap().rows.len(), 0);
    assert_eq!(ask("rigs", &[]).unwrap().rows.len(), 0);
}

/// Registers 10,000 sessions and asks everything; returns the rate and the slowest of five answers per question, as text.
pub(crate) fn measure(catalogue: &mut Catalogue, lab: &Lab, database: &str) -> String {
    const SESSIONS: u32 = 10_000;
    const ALONE: usize = 2_000;
    const BATCH: usize = 32;
    fill(catalogue, lab, 0, 365);
    let sessions = synthetic::sessions(SESSIONS, 1);
    let (alone, together) = sessions.split_at(ALONE);
    let mut text = String::new();
    for (sessions, batch) in [(alone, 1), (together, BATCH)] {
        let since = Instant::now();
        for batch in sessions.chunks(batch) {
            catalogue.add(batch).unwrap();
        }
        let rate = sessions.len() as f64 / since.elapsed().as_secs_f64();
        text += &format!(
            "{database}: {} sessions, {batch} per transaction: {rate:.0}/s\n",
            sessions.len()
        );
    }
    let mut worst = Duration::ZERO;
    for question in Question::all() {
        let slowest = (0..5).map(|_| {
            let since = Instant::now();
            ask(catalogue, question.name, &[]);
            since.elapsed()
        });
        let slowest = slowest.max().unwrap();
        worst = worst.max(slowest);
        text += &format!(
            "{:18} {:6.1} ms\n",
            question.name,
            slowest.as_secs_f64() * 1e3
        );
    }
    text + &format!("slowest answer     {:6.1} ms\n", worst.as_secs_f64() * 1e3)
}

#[test]
#[ignore = "measures, 15 s: SKINRIG_CI_LONG=1 .ci/run, or cargo test --release -p skinrig-catalogue -- --ignored --nocapture"]
fn ten_thousand_sessions_in_sqlite() {
    let lab = Lab::with_sessions(0);
    println!("{}", measure(&mut lab.open(), &lab, "SQLite"));
    // Read from files, without results.
    let lab = Lab::with_sessions(300);
    let mut catalogue = lab.open();
    let since = Instant::now();
    assert_eq!(
        catalogue
            .refresh(lab.path(), false)
            .unwrap()
            .registered
            .len(),
        300
    );
    let rate = 300.0 / since.elapsed().as_secs_f64();
    println!("SQLite: 300 recorded sessions, read and registered: {rate:.0}/s");
}

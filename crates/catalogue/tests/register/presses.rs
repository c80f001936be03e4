//! Questions on presses have the answers that the entries give.

use std::collections::{BTreeMap, BTreeSet};

use skinrig_catalogue::{AnalysisFigures, PressEntry, SessionEntry, Value};

use crate::questions::{ask, fill, mean, real, rmse, text};
use crate::support::Lab;

/// Kind of rig, protocol, and planned position, mm.
type Place = (String, String, i64, i64);

/// The prototype with most usable sessions.
fn prototype(sessions: &[SessionEntry]) -> &str {
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    for session in sessions.iter().filter(|s| rmse(s).is_some()) {
        *counts.entry(&session.headline.prototype).or_default() += 1;
    }
    counts.into_iter().max_by_key(|(_, n)| *n).unwrap().0
}

/// The presses of a prototype that were made, without those of unusable analyses and sync presses.
fn made(sessions: &[SessionEntry]) -> Vec<(&SessionEntry, &PressEntry)> {
    let own = prototype(sessions);
    let usable = |s: &&SessionEntry| s.headline.prototype == own && rmse(s).is_some();
    let presses = |session| {
        let made = |p: &&PressEntry| p.role.name() != "sync" && p.verdict.name() != "missed";
        let all = official(session).presses.iter().filter(made);
        all.map(move |press| (session, press))
    };
    sessions.iter().filter(usable).flat_map(presses).collect()
}

fn official(session: &SessionEntry) -> &AnalysisFigures {
    let found = session.analyses.iter().find(|a| a.name == "official");
    found.unwrap().figures.as_ref().unwrap()
}

fn place(session: &SessionEntry, press: &PressEntry) -> Place {
    let line = &session.headline;
    let [x, y] = [press.planned_x_mm, press.planned_y_mm].map(|mm| mm as i64);
    (line.rig_kind.clone(), line.protocol_name.clone(), x, y)
}

fn place_of(row: &[Value]) -> Place {
    let word = |at: usize| text(&row[at]).to_owned();
    (word(0), word(1), real(&row[2]) as i64, real(&row[3]) as i64)
}

fn whole(value: &Value) -> i64 {
    value.as_integer().unwrap()
}

#[test]
fn failing_places_come_worst_first() {
    let lab = Lab::with_sessions(0);
    let mut catalogue = lab.open();
    let sessions = fill(&mut catalogue, &lab, 300, 0);
    let own = ("prototype", prototype(&sessions));
    let mut places: BTreeMap<Place, [i64; 2]> = BTreeMap::new();
    let mut causes: BTreeMap<_, i64> = BTreeMap::new();
    for (session, press) in made(&sessions) {
        let fails = i64::from(press.verdict.name() != "valid");
        if fails == 1 {
            let camera = press.camera.map(|c| c.to_string());
            *causes.entry((press.cause.clone(), camera)).or_default() += 1;
        }
        if press.cause.as_deref() != Some("by_hand") {
            let count = places.entry(place(session, press)).or_default();
            *count = [count[0] + 1, count[1] + fails];
        }
    }
    places.retain(|_, count| count[1] > 0);
    let answer = ask(
        &mut catalogue,
        "failing-places",
        &[own, ("limit", "100000")],
    );
    assert_eq!(answer.rows.len(), places.len());
    let mut last = f64::INFINITY;
    for row in &answer.rows {
        let [made, failed] = places[&place_of(row)];
        assert_eq!(
            [whole(&row[5]), whole(&row[6]) + whole(&row[7])],
            [made, failed]
        );
        assert_eq!(real(&row[8]), failed as f64 / made as f64);
        assert!(real(&row[8]) <= last, "{row:?}");
        last = real(&row[8]);
    }
    let answer = ask(&mut catalogue, "failure-causes", &[own]);
    let counts: BTreeSet<i64> = answer.rows.iter().map(|row| whole(&row[3])).collect();
    assert_eq!(counts, causes.values().copied().collect());
    assert_eq!(answer.rows.len(), causes.len(), "{causes:?}");
    assert!(causes.len() > 3, "{causes:?}");
}

#[test]
fn errors_are_those_of_scored_presses_that_count() {
    let lab = Lab::with_sessions(0);
    let mut catalogue = lab.open();
    let sessions = fill(&mut catalogue, &lab, 300, 0);
    let own = ("prototype", prototype(&sessions));
    let mut months: BTreeMap<(Place, String), Vec<f64>> = BTreeMap::new();
    let mut depths: BTreeMap<_, Vec<f64>> = BTreeMap::new();
    let counts = |p: &PressEntry| p.verdict.name() == "valid" && p.role.name() == "score";
    for (session, press) in made(&sessions).into_iter().filter(|(_, p)| counts(p)) {
        let place = place(session, press);
        let depth = (
            place.0.clone(),
            place.1.clone(),
            press.planned_depth_mm as i64,
        );
        depths.entry(depth).or_default().extend(press.error_mm);
        let month = session.headline.started_at[..7].to_owned();
        months
            .entry((place, month))
            .or_default()
            .extend(press.error_mm);
    }
    let is_same = |row: &[Value], all: &[f64]| {
        let worst = all.iter().copied().fold(0.0, f64::max);
        let same = (real(&row[1]) - mean(all)).abs() < 1e-9 && real(&row[2]) == worst;
        same && whole(&row[0]) == all.len() as i64
    };
    let answer = ask(&mut catalogue, "place-errors", &[own]);
    assert_eq!(answer.rows.len(), months.len());
    for row in &answer.rows {
        let all = &months[&(place_of(row), text(&row[4]).to_owned())];
        assert!(is_same(&row[6..9], all), "{row:?}");
    }
    let answer = ask(&mut catalogue, "depth-errors", &[own]);
    assert_eq!(answer.rows.len(), depths.len());
    for row in &answer.rows {
        let depth = (
            text(&row[0]).to_owned(),
            text(&row[1]).to_owned(),
            real(&row[2]) as i64,
        );
        assert!(is_same(&row[4..7], &depths[&depth]), "{row:?}");
    }
    assert!(depths.len() > 1 && months.len() > depths.len());
}

//! Which differences between two sessions are told, and how severe each is.
#![expect(clippy::unwrap_used, reason = "tests")]

use std::collections::BTreeMap;

use skinrig_analysis::result::{AlignmentStatus, PressResult};
use skinrig_compare::{Severity, Subject, differences};
use skinrig_model::{PressRole, Verdict};

use crate::causes::planted::{PlantedCause, record};

/// Two skins of one bench whose cameras stand at the same place.
fn pair() -> [Subject; 2] {
    let mut pair = [('A', 1), ('B', 2)].map(|(letter, seed)| {
        let mut skin = record(seed, PlantedCause::Nothing).skin(letter, None);
        let facts = &mut skin.sessions[0].facts;
        facts.origin = Some("bench".to_owned());
        facts.prototype = "skin".to_owned();
        skin
    });
    let [a, b] = pair
        .each_mut()
        .map(|s| s.sessions[0].analysis.calibration.as_mut().unwrap());
    assert_eq!(a.names, b.names);
    b.values.clone_from(&a.values);
    pair
}

/// Severity of the differences by key, without those of the unchanged pair.
fn found(
    subjects: &[Subject],
    usual: &BTreeMap<&str, Severity>,
) -> BTreeMap<&'static str, Severity> {
    let all = differences(subjects, &[]).into_iter();
    let mut all: BTreeMap<_, _> = all.map(|d| (d.key, d.severity)).collect();
    all.retain(|key, severity| usual.get(key) != Some(severity));
    all
}

fn scored(of: &mut Subject) -> impl Iterator<Item = &mut PressResult> {
    let presses = of.sessions.iter_mut().flat_map(|s| &mut s.analysis.presses);
    presses.filter(|p| p.role == PressRole::Score)
}

/// Presses without a position.
fn lose<'a>(presses: impl Iterator<Item = &'a mut PressResult>) {
    for press in presses {
        let mut json = serde_json::to_value(&*press).unwrap();
        json["verdict"] = "excluded".into();
        json["cause"] = serde_json::json!({"no_cluster": {"camera": "camera1"}});
        *press = serde_json::from_value(json).unwrap();
    }
}

fn miss_calibrating(of: &mut Subject, count: usize) {
    let presses = of.sessions[0].analysis.presses.iter_mut();
    let calibrating = presses.filter(|p| p.role == PressRole::Calibrate);
    calibrating
        .take(count)
        .for_each(|p| p.verdict = Verdict::Missed);
}

fn brighten(of: &mut Subject, times: f64) {
    for view in scored(of).flat_map(|p| &mut p.views).flatten() {
        view.idle_rate_per_s *= times;
    }
}

/// Moves the calibrated value of the first parameter by so many standard errors of the difference.
fn move_camera(pair: &mut [Subject; 2], errors: f64) {
    let [a, b] = pair;
    let [a, b] = [a, b].map(|s| s.sessions[0].analysis.calibration.as_mut().unwrap());
    let both = libm::hypot(a.standard_errors[0].unwrap(), b.standard_errors[0].unwrap());
    b.values[0] = a.values[0] + errors * both;
}

fn depth(of: &mut Subject, shallow: impl Fn(u32) -> bool) {
    for press in scored(of) {
        press.depth_mm = if shallow(press.location.index()) {
            1.0
        } else {
            2.0
        };
    }
}

/// One press fewer at the locations of `at`.
fn thin(of: &mut Subject, at: impl Fn(u32) -> bool) {
    let last = scored(of).map(|p| p.repetition).max().unwrap();
    let presses = &mut of.sessions[0].analysis.presses;
    presses.retain(|p| p.repetition != last || !at(p.location.index()));
}

fn shift(of: &mut Subject, at: impl Fn(u32) -> bool) {
    for press in scored(of).filter(|p| at(p.location.index())) {
        press.planned.x_mm += 4.0;
    }
}

#[test]
fn each_difference_has_its_severity() {
    use Severity::{Blocking, Confounding, Harmless};
    type Change = fn(&mut [Subject; 2]);
    type Expected = &'static [(&'static str, Severity)];
    let base = pair();
    let usual = differences(&base, &[]).into_iter();
    let usual: BTreeMap<&str, Severity> = usual.map(|d| (d.key, d.severity)).collect();
    assert_eq!(usual.get("mounting"), Some(&Confounding), "{usual:?}");
    assert!(!usual.values().any(|s| *s == Blocking), "{usual:?}");
    let cases: [(&str, Change, Expected); 22] = [
        ("nothing", |_| (), &[]),
        (
            "another status of the clocks",
            |p| p[1].sessions[0].analysis.alignment.status = AlignmentStatus::Valid,
            &[("certificate", Confounding)],
        ),
        (
            "an invalid session",
            |p| p[0].sessions[0].analysis.alignment.status = AlignmentStatus::Invalid,
            &[("alignment", Blocking)],
        ),
        (
            "no press located",
            |p| lose(scored(&mut p[1])),
            &[("no-results", Blocking)],
        ),
        (
            "fewer than half located",
            |p| lose(scored(&mut p[1]).take(26)),
            &[("few-located", Blocking)],
        ),
        ("half located", |p| lose(scored(&mut p[1]).take(25)), &[]),
        (
            "no location shared",
            |p| shift(&mut p[1], |_| true),
            &[("locations", Blocking)],
        ),
        (
            "a location shared",
            |p| shift(&mut p[1], |k| k > 0),
            &[("locations", Blocking)],
        ),
        (
            "two locations shared",
            |p| shift(&mut p[1], |k| k > 1),
            &[("locations", Harmless)],
        ),
        (
            "a session twice",
            |p| p[1].sessions[0].facts.session_id = p[0].sessions[0].facts.session_id.clone(),
            &[("same-session", Blocking)],
        ),
        (
            "a recording twice",
            |p| p[1].sessions[0].analysis = p[0].sessions[0].analysis.clone(),
            &[("same-session", Blocking)],
        ),
        (
            "two skins simulated alike",
            |p| {
                p[1].sessions[0].analysis = p[0].sessions[0].analysis.clone();
                for skin in p {
                    skin.sessions[0].facts.origin = Some("simulated".to_owned());
                }
            },
            &[("same-session", Blocking)],
        ),
        (
            "a simulation twice on one side",
            |p| {
                let mut again = p[1].sessions[0].clone();
                again.facts.session_id = "f".repeat(32);
                again.facts.origin = Some("simulated".to_owned());
                p[1].sessions[0].facts.origin = Some("simulated".to_owned());
                p[1].sessions.push(again);
            },
            &[("same-session", Blocking)],
        ),
        (
            "two calibrating presses fewer",
            |p| miss_calibrating(&mut p[1], 2),
            &[],
        ),
        (
            "a quarter fewer calibrating presses",
            |p| miss_calibrating(&mut p[1], 6),
            &[("evaluation", Confounding)],
        ),
        ("a quarter brighter", |p| brighten(&mut p[1], 1.2), &[]),
        (
            "brighter by half",
            |p| brighten(&mut p[1], 1.5),
            &[("ambient", Confounding)],
        ),
        (
            "cameras nearly where they were",
            |p| move_camera(p, 3.9),
            &[],
        ),
        (
            "cameras elsewhere",
            |p| move_camera(p, 4.1),
            &[("camera-locations", Harmless)],
        ),
        (
            "other shares of depths",
            |p| {
                depth(&mut p[0], |k| k % 2 == 0);
                depth(&mut p[1], |k| k % 2 == 0 && k < 18);
            },
            &[("depth-shares", Blocking)],
        ),
        (
            "other shares of locations",
            |p| thin(&mut p[1], |k| k < 15),
            &[("location-shares", Blocking)],
        ),
        ("a few presses fewer", |p| thin(&mut p[1], |k| k < 5), &[]),
    ];
    for (name, change, expected) in cases {
        let mut subjects = base.clone();
        change(&mut subjects);
        let found = found(&subjects, &usual);
        let expected: BTreeMap<&str, Severity> = expected.iter().copied().collect();
        let told: BTreeMap<&str, Severity> = expected
            .keys()
            .filter_map(|key| Some((*key, *found.get(key)?)))
            .collect();
        assert_eq!(told, expected, "{name}: {found:?}");
        let further = found.iter().filter(|(key, _)| !expected.contains_key(*key));
        let severe: Vec<_> = further.filter(|(_, s)| **s == Blocking).collect();
        assert!(severe.is_empty(), "{name}: {severe:?}");
        if expected.is_empty() {
            assert!(found.is_empty(), "{name}: {found:?}");
        }
    }
}

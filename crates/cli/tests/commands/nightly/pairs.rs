//! Two faults at once: neither passes, and each is reported with its own cause.

use std::collections::BTreeSet;
use std::time::Instant;

use serde_json::Value;
use skinrig_emulated_bench::{ArmFault, When};
use skinrig_model::{CameraId, RigFault};

use super::{NightResult, Nights};
use crate::emulated_bench::in_real_time;

/// A fault and its symptom in a night, unless another fault hides it.
pub(super) struct FaultCase {
    /// Name in the printed results.
    pub name: &'static str,
    plant: fn(&mut Nights),
    /// The check that finds it.
    check: &'static str,
    /// Symptom in that check.
    shows: Symptom,
    /// Other devices that evidence may name, because measuring them needs this one.
    also: &'static [&'static str],
    /// Faults that this one hides.
    hides: &'static [&'static str],
}

enum Symptom {
    Evidence {
        kind: &'static str,
        subject: &'static str,
        cause: &'static str,
    },
    Limit {
        subject: &'static str,
        metric: &'static str,
    },
}

use Symptom::{Evidence, Limit};

const fn rig_evidence(kind: &'static str, subject: &'static str) -> Symptom {
    Evidence {
        kind,
        subject,
        cause: "rig",
    }
}

const fn absent(subject: &'static str) -> Symptom {
    Evidence {
        kind: "absent",
        subject,
        cause: "infrastructure",
    }
}

/// Faults of the arm, hidden by those that prevent measuring it.
const ARM: &[&str] = &[
    "robot slow",
    "frame too low",
    "robot stalled",
    "robot lost",
    "robot without power",
];

pub(super) const FAULTS: &[FaultCase] = &[
    FaultCase {
        name: "camera 2 unplugged",
        plant: |n| n.inject(RigFault::CameraUnplugged(CameraId::Two)),
        check: "identity",
        shows: absent("camera2"),
        also: &[],
        hides: &["camera 2 drops data", "line of camera 2 cut"],
    },
    FaultCase {
        name: "setting of camera 1 ignored",
        plant: |n| {
            // The bias keeps its default, and the rig file requests another value.
            n.edit_rig(
                "    serial: \"00000001\"\n",
                "    serial: \"00000001\"\n    biases: {bias_diff_on: 400}\n",
            );
            n.inject(RigFault::CameraSettingIgnored(CameraId::One));
        },
        check: "settings",
        shows: rig_evidence("read_back", "camera1"),
        also: &[],
        // A camera that cannot be configured measures nothing.
        hides: &["storm in camera 1", "line of camera 1 noisy"],
    },
    FaultCase {
        name: "storm in camera 1",
        plant: |n| n.inject(RigFault::CameraStorm(CameraId::One)),
        check: "noise_lit",
        shows: Limit {
            subject: "camera1",
            metric: "hot_pixels",
        },
        also: &[],
        hides: &[],
    },
    FaultCase {
        name: "camera 2 drops data",
        plant: |n| n.inject(RigFault::CameraDrops(CameraId::Two)),
        check: "test_pattern",
        shows: rig_evidence("data_lost", "camera2"),
        also: &[],
        hides: &["line of camera 2 cut"],
    },
    FaultCase {
        name: "lamps stay on",
        plant: |n| n.lamps_obey("true"),
        check: "noise_dark",
        shows: Limit {
            subject: "camera1",
            metric: "rate",
        },
        also: &[],
        hides: &[],
    },
    FaultCase {
        name: "lamps' program fails",
        plant: |n| n.lamps_obey("false"),
        check: "noise_dark",
        shows: rig_evidence("state", "computer"),
        also: &[],
        hides: &["lamps stay on"],
    },
    FaultCase {
        name: "line of camera 2 cut",
        plant: |n| n.inject(RigFault::LineCut(CameraId::Two)),
        check: "trigger_loopback",
        shows: rig_evidence("trigger_fault", "camera2"),
        also: &[],
        hides: &[],
    },
    FaultCase {
        name: "line of camera 1 noisy",
        plant: |n| n.inject(RigFault::LineNoisy(CameraId::One)),
        check: "trigger_loopback",
        shows: rig_evidence("trigger_fault", "camera1"),
        also: &[],
        hides: &[],
    },
    FaultCase {
        name: "trigger box silent",
        plant: |n| n.inject(RigFault::BoxSilent),
        check: "identity",
        shows: absent("trigger box"),
        also: &[],
        hides: &[
            "line of camera 1 noisy",
            "line of camera 2 cut",
            "trigger box noisy",
            "other firmware in the box",
        ],
    },
    FaultCase {
        name: "other firmware in the box",
        plant: |n| n.edit_rig("  port: ", "  firmware: \"9.9.9\"\n  port: "),
        check: "identity",
        shows: rig_evidence("other_device", "trigger box"),
        also: &[],
        hides: &[
            "line of camera 1 noisy",
            "line of camera 2 cut",
            "trigger box noisy",
        ],
    },
    FaultCase {
        name: "robot slow",
        plant: |n| n.inject(RigFault::RobotSlow),
        check: "step_response",
        shows: Limit {
            subject: "robot",
            metric: "settling",
        },
        also: &["robot"],
        // Friction shifts the force at which a touch is detected.
        hides: &["frame too low"],
    },
    FaultCase {
        name: "frame too low",
        // The surface is found 0.2 mm above its position in the file, where a touch registers 0.3 mm below it.
        plant: |n| n.edit_rig("-2 mm, -20 mm]", "-2 mm, -20.5 mm]"),
        check: "depth",
        shows: Limit {
            subject: "robot",
            metric: "height",
        },
        also: &[],
        hides: &[],
    },
    FaultCase {
        name: "robot stalled",
        plant: |n| n.arm(When::IntoMove(0.1), ArmFault::Stalled),
        check: "repeatability",
        shows: rig_evidence("state", "robot"),
        also: &[],
        hides: ARM,
    },
    FaultCase {
        name: "robot lost",
        plant: |n| n.arm(When::IntoMove(1.0), ArmFault::Lost),
        check: "repeatability",
        shows: rig_evidence("device_lost", "robot"),
        also: &[],
        hides: ARM,
    },
    FaultCase {
        name: "robot without power",
        plant: |n| n.inject(RigFault::RobotPowerLost),
        check: "robot_state",
        shows: rig_evidence("state", "robot"),
        also: &[],
        hides: ARM,
    },
    FaultCase {
        name: "trigger box noisy",
        plant: |n| n.inject(RigFault::BoxNoisy),
        check: "trigger_loopback",
        shows: Evidence {
            kind: "",
            subject: "trigger box",
            cause: "rig",
        },
        also: &["camera1", "camera2"],
        hides: &["line of camera 1 noisy", "line of camera 2 cut"],
    },
];

/// All pairs, in a fixed order.
pub(super) fn pairs_in_order() -> Vec<[&'static FaultCase; 2]> {
    let with = |i: usize| FAULTS[i + 1..].iter().map(move |b| [&FAULTS[i], b]);
    (0..FAULTS.len()).flat_map(with).collect()
}

/// The two faults with these names.
pub(super) fn pair_by_name(names: [&str; 2]) -> [&'static FaultCase; 2] {
    names.map(|name| FAULTS.iter().find(|f| f.name == name).unwrap())
}

/// Injects two faults into a fresh bench and runs the checks that find them. `Err` lists problems of the night, `None` without a bench.
pub(super) fn run_pair([a, b]: [&FaultCase; 2]) -> Option<Result<String, String>> {
    let mut nights = Nights::start()?;
    let began = Instant::now();
    for fault in [a, b] {
        (fault.plant)(&mut nights);
    }
    let mut only = vec![a.check];
    if b.check != a.check {
        only.push(b.check);
    }
    // Checks that move the arm need `robot_state`.
    if ["repeatability", "step_response", "depth"]
        .iter()
        .any(|c| only.contains(c))
    {
        only.insert(0, "robot_state");
    }
    let night = nights.night(&only.join(","));
    let summary = format!(
        "{} + {}: {} s, exit {}",
        a.name,
        b.name,
        began.elapsed().as_secs(),
        night.exit
    );
    let wrong: Vec<String> = find_problems(a, b, &night);
    Some(match wrong.is_empty() {
        true => Ok(summary),
        false => Err(format!("{summary}: {}\n{}", wrong.join("; "), night.stderr)),
    })
}

/// Unexpected or missing statements of the night.
fn find_problems(a: &FaultCase, b: &FaultCase, night: &NightResult) -> Vec<String> {
    let mut wrong = Vec::new();
    let verdict = &night.night["verdict"];
    if night.exit == 0 || verdict == "PASS" || verdict == "MARGINAL" {
        wrong.push(format!("{verdict} with exit {}", night.exit));
    }
    for (fault, other) in [(a, b), (b, a)] {
        if !other.hides.contains(&fault.name) {
            wrong.extend(missing_symptom(fault, night));
        }
        // Even a check whose fault is hidden must not pass.
        let verdict = &night.check(fault.check)["verdict"];
        if verdict == "PASS" || verdict == "MARGINAL" {
            wrong.push(format!("{}: {} is {verdict}", fault.name, fault.check));
        }
    }
    // No healthy device is blamed.
    let mut guilty: BTreeSet<&str> = BTreeSet::from(["computer"]);
    for fault in [a, b] {
        guilty.extend(fault.also);
        let (Evidence { subject, .. } | Limit { subject, .. }) = fault.shows;
        guilty.insert(subject);
    }
    for evidence in evidence(night.night["checks"].as_array().unwrap()) {
        let subject = evidence["subject"].as_str().unwrap();
        if !guilty.contains(subject) {
            wrong.push(format!("{subject} is blamed: {}", evidence["what"]));
        }
    }
    wrong
}

/// Missing part of a symptom that should be visible.
fn missing_symptom(fault: &FaultCase, night: &NightResult) -> Option<String> {
    let check = night.check(fault.check);
    let name = fault.name;
    match fault.shows {
        Evidence {
            kind,
            subject,
            cause,
        } => {
            let there = evidence([check])
                .any(|e| (kind.is_empty() || e["kind"] == kind) && e["subject"] == subject);
            // Of two equally bad causes the one that is not infrastructure is reported.
            let named_cause = check["cause"].as_str().unwrap_or("none");
            let fits = named_cause == cause || named_cause == "rig";
            (!there || !fits)
                .then(|| format!("{name}: cause {named_cause}, evidence there: {there}"))
        }
        Limit { subject, metric } => {
            let judged = night.metric_verdict(fault.check, subject, metric);
            let named_cause = check["cause"].as_str().unwrap_or("none");
            (judged != "FAIL" || named_cause != "rig")
                .then(|| format!("{name}: {metric} of {subject} {judged}, cause {named_cause}"))
        }
    }
}

fn evidence<'a>(checks: impl IntoIterator<Item = &'a Value>) -> impl Iterator<Item = &'a Value> {
    let attempts = checks
        .into_iter()
        .flat_map(|c| c["attempts"].as_array().unwrap());
    attempts.flat_map(|a| a["evidence"].as_array().unwrap())
}

/// Sample of pairs: every fault that no other night of this program injects, once.
const DEVICES: [[&str; 2]; 5] = [
    ["camera 2 unplugged", "setting of camera 1 ignored"],
    ["camera 2 drops data", "trigger box silent"],
    ["line of camera 2 cut", "line of camera 1 noisy"],
    ["lamps' program fails", "robot stalled"],
    ["other firmware in the box", "robot lost"],
];
const CONDITIONS: [[&str; 2]; 2] = [
    ["robot without power", "trigger box noisy"],
    ["frame too low", "storm in camera 1"],
];

fn assert_pairs(pairs: &[[&str; 2]]) {
    for pair in pairs {
        in_real_time(|| match run_pair(pair_by_name(*pair)) {
            None => (),
            Some(Ok(summary)) => eprintln!("ok: {summary}"),
            Some(Err(wrong)) => panic!("{wrong}"),
        });
    }
}

#[test]
fn pairs_of_broken_devices_are_reported_with_both_causes() {
    assert_pairs(&DEVICES);
}

#[test]
fn pairs_of_bad_conditions_are_reported_with_both_causes() {
    assert_pairs(&CONDITIONS);
}

#[test]
#[ignore = "half an hour of real time: SKINRIG_CI_LONG=1 .ci/run, or cargo test -p skinrig --test commands -- --ignored --nocapture all_pairs"]
fn all_pairs_of_faults_are_reported_with_both_causes() {
    let (from, to) = range(std::env::var("SKINRIG_PAIRS").ok());
    let pairs = pairs_in_order();
    let n = pairs.len();
    let mut failed = Vec::new();
    for (i, pair) in pairs.into_iter().enumerate() {
        if !(from..=to).contains(&(i + 1)) {
            continue;
        }
        match run_pair(pair) {
            None => return,
            Some(Ok(summary)) => eprintln!("pair {} of {n}: ok: {summary}", i + 1),
            Some(Err(wrong)) => {
                eprintln!("pair {} of {n}: WRONG: {wrong}", i + 1);
                failed.push(i + 1);
            }
        }
    }
    assert_eq!(failed, [0; 0], "pairs with a wrong verdict or cause");
}

/// First and last pair, counted from 1, from `SKINRIG_PAIRS=20-40`; all without it.
fn range(given: Option<String>) -> (usize, usize) {
    let Some(given) = given else {
        return (1, usize::MAX);
    };
    let (from, to) = given.split_once('-').unwrap_or((&given, &given));
    (from.parse().unwrap(), to.parse().unwrap())
}

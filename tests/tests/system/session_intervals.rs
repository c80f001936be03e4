//! How often the intervals of a session hold the mean over sessions of one skin, each at locations and with a calibration of its own.

use std::collections::BTreeMap;

use rayon::prelude::*;
use skinrig_analysis::result::{Analysis, Estimate};
use skinrig_model::SimLevel;
use skinrig_sim::SimConfig;
use skinrig_statistics::seeded;
use skinrig_tests::planned;

use crate::simulated::simulated;

const PROTOCOL: &str = "
skinrig: 1
name: intervals
operator: tests
prototype: {id: none}
scene: {level: optical}
sync: {count: 3, interval: 1.5 s, at: [10 mm, 2 mm], pause_after: 1 s}
path:
  points: POINTS
repetitions: {count: 2, between: {return_to_start: true, pause: 1 s}}
depth: 2 mm
motion: {period: 3 s, hold: 150 ms}
limits:
  workspace: {min: [-40 mm, -48 mm, -4 mm], max: [60 mm, 52 mm, 30 mm]}
  max_depth: 3 mm
  max_speed: 100 mm/s
  max_force: 5 N
triggers: {marks: [contact, retract]}
evaluation: {calibrate: [1], score: [2]}
";

/// Locations of a session.
const LOCATIONS: usize = 40;
/// Seed of skin and rig.
const SKIN: u64 = 5;

type Figure = (&'static str, fn(&Analysis) -> Option<Estimate>);

const FIGURES: [Figure; 9] = [
    ("RMSE", |a| Some(a.scored.rmse_mm)),
    ("RMSE x", |a| Some(a.scored.rmse_x_mm)),
    ("median error", |a| Some(a.scored.median_mm)),
    ("RMSE where no press calibrated", |a| a.left_out_rmse()),
    ("events/s in presses", |a| {
        Some(a.bit_rates.as_ref()?.press_events_per_s)
    }),
    ("events/s between them", |a| {
        Some(a.bit_rates.as_ref()?.idle_events_per_s)
    }),
    ("CMRE", |a| Some(a.cmre.as_ref()?.percent)),
    ("median latency", |a| Some(a.latency.as_ref()?.median_ms)),
    ("latency width", |a| Some(a.latency.as_ref()?.width_ms)),
];

/// The analysis of one session of the skin at locations drawn with this seed.
fn session(seed: u64) -> Analysis {
    let mut rng = seeded::generator(seed, 0);
    let points: Vec<String> = (0..LOCATIONS)
        .map(|_| {
            let [x, y] = [3.0, 2.0].map(|middle| middle + 28.0 * seeded::signed_unit(&mut rng));
            format!("[{x:.3} mm, {y:.3} mm]")
        })
        .collect();
    let text = PROTOCOL.replace("POINTS", &format!("[{}]", points.join(", ")));
    let (protocol, plan) = planned(text.trim_start()).expect("a plan");
    let (report, analysis) = simulated(&protocol, &plan, &SimConfig::new(SKIN, SimLevel::Optical));
    assert!(report.valid > LOCATIONS);
    analysis
}

/// How many of the intervals hold the mean of these sessions, and how many there are.
fn held(sessions: &[&Analysis], figure: fn(&Analysis) -> Option<Estimate>) -> (usize, usize) {
    let estimates: Vec<Estimate> = sessions.iter().filter_map(|a| figure(a)).collect();
    let values: Vec<f64> = estimates.iter().filter_map(|e| e.value).collect();
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let ends: Vec<_> = estimates.iter().filter_map(|e| e.low.zip(e.high)).collect();
    let about = ends
        .iter()
        .filter(|(low, high)| (*low..=*high).contains(&mean));
    (about.count(), ends.len())
}

#[test]
#[ignore = "minutes: SKINRIG_CI_LONG=1 .ci/run, or cargo test --release -p skinrig-tests --test system session_intervals -- --ignored --nocapture"]
fn intervals_of_a_session_over_a_hundred_sessions() {
    let all: Vec<Analysis> = (0..100u64).into_par_iter().map(session).collect();
    let all: Vec<&Analysis> = all.iter().collect();
    // Sessions choose their locator, and some have too few locations to be sure of the better one.
    let mut by_locator: BTreeMap<&str, Vec<&Analysis>> = BTreeMap::new();
    for analysis in &all {
        let locator = analysis.locator.as_ref().expect("a locator").locator;
        by_locator.entry(locator.name()).or_default().push(analysis);
    }
    for (locator, sessions) in &by_locator {
        println!("{locator}: {} sessions", sessions.len());
    }
    for (name, figure) in FIGURES {
        let (together, n) = held(&all, figure);
        let apart = by_locator.values().map(|sessions| held(sessions, figure));
        let (apart, n_apart) = apart.fold((0, 0), |sum, one| (sum.0 + one.0, sum.1 + one.1));
        assert_eq!((n, n > 90), (n_apart, true), "{name}");
        let [together, apart] = [together, apart].map(|held| 100.0 * held as f64 / n as f64);
        println!("{name}: {together:.0} %, with the same locator {apart:.0} %, of {n}");
        assert!(apart >= 85.0, "{name}: {apart}");
    }
}

//! Differences between simulation levels in the figures that a scene can set tolerances on, over simulated skins with equal seeds.

use skinrig_model::SimLevel;
use skinrig_model::level_bias::{LevelBias, SceneFigure, level_bias};
use skinrig_protocol::{Plan, Protocol};
use skinrig_sim::SimConfig;
use skinrig_statistics::distributions::student_quantile;
use skinrig_statistics::seeded;
use skinrig_tests::planned;

use crate::simulated::simulated;

const PROTOCOL: &str = "
skinrig: 1
name: levels
operator: tests
prototype: {id: none}
scene: {level: optical}
sync: {count: 3, interval: 1.5 s, at: [10 mm, 2 mm], pause_after: 1 s}
path:
  meander: {origin: [X mm, Y mm], pitch: PITCH mm, columns: 5, rows: 5, line_direction: y}
repetitions: {count: 3, between: {return_to_start: true, pause: 1 s}}
depth: 2 mm
motion: {period: 3 s, hold: 150 ms}
limits:
  workspace: {min: [-40 mm, -48 mm, -4 mm], max: [60 mm, 52 mm, 30 mm]}
  max_depth: 3 mm
  max_speed: 100 mm/s
  max_force: 5 N
triggers: {marks: [contact, retract]}
evaluation: {calibrate: [1], score: [2, 3]}
analysis: {min_samples: 20}
";

/// Pitches of the squares of 25 locations, mm.
const PITCHES_MM: [f64; 4] = [10.0, 11.0, 12.0, 14.0];
/// The skin's middle and half the side of a square around it in which they lie, mm.
const MIDDLE_MM: [f64; 2] = [10.0, 2.0];
const REACH_MM: f64 = 40.0;

/// The campaign of a skin: a square of its own, somewhere on the skin.
fn campaign(seed: u64) -> (Protocol, Plan) {
    let mut rng = seeded::generator(seed, 0);
    loop {
        let pitch = PITCHES_MM[seeded::index(&mut rng, PITCHES_MM.len())];
        let room_mm = 2.0 * REACH_MM - 4.0 * pitch;
        let [x, y] = MIDDLE_MM.map(|middle| {
            let steps = seeded::index(&mut rng, room_mm as usize + 1);
            middle - REACH_MM + steps as f64
        });
        let text = PROTOCOL
            .replace("X mm", &format!("{x} mm"))
            .replace("Y mm", &format!("{y} mm"))
            .replace("PITCH", &pitch.to_string());
        // Some squares have a corner beside the skin.
        if let Ok(found) = planned(text.trim_start()) {
            return found;
        }
    }
}

/// The figures of one simulated session, by [`SceneFigure::ALL`]; rates in events per second.
fn figures(seed: u64, level: SimLevel) -> [f64; 4] {
    let (protocol, plan) = campaign(seed);
    let (report, analysis) = simulated(&protocol, &plan, &SimConfig::new(seed, level));
    assert_eq!(report.valid, 78);
    let rates = analysis.bit_rates.expect("rates");
    let onsets = analysis.latency.and_then(|l| l.from_contact);
    let onset_ms = onsets.and_then(|o| o.median_ms.value);
    [
        analysis.scored.rmse_mm.value,
        onset_ms,
        rates.press_events_per_s.value,
        rates.idle_events_per_s.value,
    ]
    .map(|figure| figure.expect("every figure"))
}

/// Mean of the geometric level's difference in each figure, and the interval that holds that of another session with 95 %
/// probability (Student's t over skins and paths).
fn measured(seeds: std::ops::RangeInclusive<u64>) -> [LevelBias; 4] {
    let mut differences: [Vec<f64>; 4] = Default::default();
    for seed in seeds {
        let [geometric, optical] =
            [SimLevel::Geometric, SimLevel::Optical].map(|level| figures(seed, level));
        for (k, figure) in SceneFigure::ALL.into_iter().enumerate() {
            let difference = geometric[k] - optical[k];
            differences[k].push(match figure {
                SceneFigure::LocalisationRmse | SceneFigure::Latency => difference,
                SceneFigure::EventRate | SceneFigure::IdleRate => 100.0 * difference / optical[k],
            });
        }
    }
    differences.map(|d| {
        let n = d.len() as f64;
        let mean = d.iter().sum::<f64>() / n;
        let square = d.iter().map(|x| (x - mean).powi(2)).sum::<f64>();
        let half = student_quantile(0.975, n - 1.0) * (square / (n - 1.0) * (1.0 + 1.0 / n)).sqrt();
        LevelBias {
            mean,
            low: mean - half,
            high: mean + half,
        }
    })
}

#[test]
#[ignore = "minutes: SKINRIG_CI_LONG=1 .ci/run, or cargo test --release -p skinrig-tests --test system level_bias -- --ignored --nocapture"]
fn level_bias_over_forty_skins() {
    let all = measured(1..=40);
    for (figure, LevelBias { mean, low, high }) in SceneFigure::ALL.into_iter().zip(all) {
        println!(
            "{}: LevelBias::new({mean:.2}, {low:.2}, {high:.2}), {}",
            figure.name(),
            figure.unit()
        );
    }
    for (figure, LevelBias { mean, low, high }) in SceneFigure::ALL.into_iter().zip(all) {
        // The table has these very skins, to two decimals.
        let table = level_bias(SimLevel::Geometric, figure).expect("a bias");
        for (found, table) in [(mean, table.mean), (low, table.low), (high, table.high)] {
            assert!((found - table).abs() < 0.006, "{}: {table}", figure.name());
        }
    }
}

#[test]
fn level_bias_is_still_that_of_the_simulator() {
    for (figure, found) in SceneFigure::ALL.into_iter().zip(measured(41..=42)) {
        let table = level_bias(SimLevel::Geometric, figure).expect("a bias");
        // Four standard errors of the mean of two sessions: half the interval is about two standard deviations of one.
        let most = 1.4 * 0.5 * (table.high - table.low);
        assert!(
            (found.mean - table.mean).abs() <= most,
            "{}: measured {:.2}, table {table:?}; measure the table again",
            figure.name(),
            found.mean
        );
    }
}

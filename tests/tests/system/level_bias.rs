//! Differences between simulation levels in the figures that a scene can set tolerances on, over simulated skins with equal seeds.

use skinrig_analysis::analyze;
use skinrig_model::SimLevel;
use skinrig_model::level_bias::{LevelBias, SceneFigure, level_bias};
use skinrig_results::{AnalysisOptions, Session};
use skinrig_sim::{SimConfig, simulated_rig};
use skinrig_statistics::distributions::student_quantile;
use skinrig_tests::{planned, record};

const PROTOCOL: &str = "
skinrig: 1
name: levels
operator: tests
prototype: {id: none}
scene: {level: optical}
sync: {count: 3, interval: 1.5 s, at: [10 mm, 2 mm], pause_after: 1 s}
path:
  meander: {origin: [-22 mm, -26 mm], pitch: 14 mm, columns: 5, rows: 5, line_direction: y}
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

/// The figures of one simulated session, by [`SceneFigure::ALL`]; rates in events per second.
fn figures(seed: u64, level: SimLevel) -> [f64; 4] {
    let (protocol, plan) = planned(PROTOCOL.trim_start()).expect("a valid protocol");
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("level.session.sqlite");
    let rig = simulated_rig(&SimConfig::new(seed, level));
    let report = record(&protocol, &plan, rig, &path, |_, _| {}).expect("a session");
    assert_eq!(report.valid, 78);
    let opened = Session::open(&path, AnalysisOptions::default()).expect("a session");
    let aligned = opened.read_input().expect("its input").align();
    let analysis = analyze(&aligned.input, &aligned.events).expect("an analysis");
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

/// Mean and 95 % interval (Student's t over skins) of the geometric level's difference in each figure.
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
        let half = student_quantile(0.975, n - 1.0) * (square / (n - 1.0) / n).sqrt();
        LevelBias {
            mean,
            low: mean - half,
            high: mean + half,
        }
    })
}

#[test]
#[ignore = "minutes: SKINRIG_CI_LONG=1 .ci/run, or cargo test --release -p skinrig-tests --test system level_bias -- --ignored --nocapture"]
fn level_bias_over_twenty_skins() {
    for (figure, found) in SceneFigure::ALL.into_iter().zip(measured(1..=20)) {
        let LevelBias { mean, low, high } = found;
        println!(
            "{}: LevelBias::new({mean:.2}, {low:.2}, {high:.2}), {}",
            figure.name(),
            figure.unit()
        );
        // The table has these very skins, to two decimals.
        let table = level_bias(SimLevel::Geometric, figure).expect("a bias");
        for (found, table) in [(mean, table.mean), (low, table.low), (high, table.high)] {
            assert!((found - table).abs() < 0.006, "{}: {table}", figure.name());
        }
    }
}

#[test]
fn level_bias_is_still_that_of_the_simulator() {
    for (figure, found) in SceneFigure::ALL.into_iter().zip(measured(21..=22)) {
        let table = level_bias(SimLevel::Geometric, figure).expect("a bias");
        // Four standard errors of the mean of two skins, from the interval of twenty.
        let most = 6.0 * 0.5 * (table.high - table.low);
        assert!(
            (found.mean - table.mean).abs() <= most,
            "{}: measured {:.2}, table {table:?}; measure the table again",
            figure.name(),
            found.mean
        );
    }
}

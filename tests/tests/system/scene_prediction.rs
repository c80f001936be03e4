//! How often sessions of a right scene differ from its predictions.

use rayon::prelude::*;
use skinrig_analysis::analyze;
use skinrig_compare::scene::{FigurePrediction, SessionFigure, SessionFigures, predict};
use skinrig_model::SimLevel;
use skinrig_results::event_statistics;
use skinrig_sim::SimConfig;
use skinrig_tests::planned;

use crate::simulated::aligned;

const PROTOCOL: &str = "
skinrig: 1
name: predictions
operator: tests
prototype: {id: none}
scene: {level: optical}
sync: {count: 3, interval: 1.5 s, at: [10 mm, 2 mm], pause_after: 1 s}
path:
  points: [[-25 mm, -18 mm], [5 mm, -20 mm], [30 mm, -15 mm], [-20 mm, 3 mm], [12 mm, 0 mm], [28 mm, 8 mm], [-22 mm, 24 mm],
    [3 mm, 25 mm]]
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
analysis: {study_presses: 0}
";

const SESSIONS: usize = 200;
const REPLICATES: usize = 20;

fn session(seed: u64) -> SessionFigures {
    let (protocol, plan) = planned(PROTOCOL.trim_start()).expect("a plan");
    let config = SimConfig::new(seed, SimLevel::Optical);
    aligned(&protocol, &plan, &config, |_, session| {
        let analysis = analyze(&session.input, &session.events).expect("an analysis");
        let cameras = event_statistics(&session.events, Some(&analysis)).expect("events");
        SessionFigures::of(&analysis, &cameras)
    })
}

#[test]
#[ignore = "minutes: SKINRIG_CI_LONG=1 .ci/run, or cargo test --release -p skinrig-tests --test system scene_prediction -- --ignored --nocapture"]
fn sessions_of_a_right_scene_over_two_hundred_sessions() {
    let all: Vec<SessionFigures> = (0..SESSIONS as u64).into_par_iter().map(session).collect();
    let predictions: Vec<Vec<FigurePrediction>> = (0..SESSIONS)
        .map(|k| {
            let others = (1..=REPLICATES).map(|step| all[(k + step) % SESSIONS].clone());
            predict(&all[k], &others.collect::<Vec<_>>())
        })
        .collect();
    for (at, figure) in SessionFigure::ALL.iter().enumerate() {
        let rows = || predictions.iter().map(|rows| rows[at]);
        let held = rows().filter(|row| {
            let inside = |p: skinrig_compare::scene::Predicted| {
                row.session.is_some_and(|x| (p.low..=p.high).contains(&x))
            };
            row.predicted.is_some_and(inside)
        });
        let held = 100.0 * held.count() as f64 / SESSIONS as f64;
        let rejected = rows().filter(FigurePrediction::differs).count();
        println!("{figure:?}: interval holds {held:.1} %, {rejected} rejected");
        assert!(held >= 90.0, "{figure:?}: {held}");
    }
    let rejected = predictions
        .iter()
        .filter(|rows| rows.iter().any(FigurePrediction::differs))
        .count();
    let percent = 100.0 * rejected as f64 / SESSIONS as f64;
    println!("rejected: {percent:.1} % of {SESSIONS}");
    // 5 %, and three binomial standard errors.
    assert!(percent < 9.6, "{percent}");
}

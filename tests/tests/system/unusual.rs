//! Sound sessions of unusual protocols: no law of the audit takes what the protocol asked for as a fault.

use skinrig_model::SimLevel;

use crate::audit::analysed;

/// Twelve locations.
const MEANDER: &str =
    "{meander: {origin: [-20 mm, -18 mm], pitch: 15 mm, columns: 4, rows: 3, line_direction: y}}";
const QUICK: &str = "{period: 2.5 s}";

/// A protocol with this path, these motions, this depth and number of repetitions, the first of which calibrates.
fn protocol(path: &str, motion: &str, depth: &str, repetitions: u32) -> String {
    format!(
        "\
skinrig: 1
name: unusual
operator: tests
prototype: {{id: none}}
scene: {{level: geometric}}
path: {path}
repetitions: {{count: {repetitions}}}
{depth}
motion: {motion}
limits: {{workspace: {{min: [-40 mm, -48 mm, -4 mm], max: [60 mm, 52 mm, 30 mm]}}, max_depth: 3 mm, max_speed: 100 mm/s, max_force: 5 N}}
triggers: {{marks: [contact, retract]}}
evaluation: {{calibrate: [1], score: [2-{repetitions}]}}
analysis: {{bootstrap_resamples: 20, study_presses: 0}}
"
    )
}

/// Fails if a session of this protocol has findings.
fn is_sound(protocol: &str) {
    let analysis = analysed(protocol, SimLevel::Geometric, 1, Vec::new());
    let findings = &analysis.findings;
    assert!(findings.is_empty(), "{findings:#?}");
    assert!(analysis.is_valid(), "{:#?}", analysis.warnings);
}

#[test]
fn one_location_pressed_many_times() {
    let path = "{points: [[10 mm, 2 mm]]}";
    is_sound(&protocol(path, QUICK, "depth: 2 mm", 30));
}

/// They have no bursts, whose few chance ones must not prove another clock.
#[test]
fn slow_presses() {
    let slow = "{period: 16 s, indent: 0.5 mm/s, retract: 1 mm/s}";
    is_sound(&protocol(MEANDER, slow, "depth: 2 mm", 2));
}

#[test]
fn long_holds() {
    let long = "{period: 12 s, hold: 8 s}";
    is_sound(&protocol(MEANDER, long, "depth: 2 mm", 2));
}

#[test]
fn shortest_holds() {
    let short = "{period: 2.5 s, hold: 1 ms}";
    is_sound(&protocol(MEANDER, short, "depth: 2 mm", 2));
}

#[test]
fn depths_in_listed_order() {
    let depths = "depths: [0.5 mm, 1 mm, 1.5 mm, 2 mm, 2.5 mm]";
    is_sound(&protocol(MEANDER, QUICK, depths, 2));
}

#[test]
fn locations_on_a_line() {
    let path =
        "{meander: {origin: [-20 mm, 0 mm], pitch: 3 mm, columns: 14, rows: 1, line_direction: x}}";
    is_sound(&protocol(path, QUICK, "depth: 2 mm", 2));
}

#[test]
fn two_locations() {
    let path = "{points: [[10 mm, 2 mm], [-10 mm, -12 mm]]}";
    is_sound(&protocol(path, QUICK, "depth: 2 mm", 6));
}

#[test]
fn near_locations() {
    let path =
        "{meander: {origin: [0 mm, 0 mm], pitch: 0.5 mm, columns: 4, rows: 4, line_direction: x}}";
    is_sound(&protocol(path, QUICK, "depth: 2 mm", 2));
}

//! The surface check: its limits and its effect on the plan.

use skinrig_protocol::{Surface, TouchSearch};

use crate::common::{demo, parse, shipped};

fn with(section: &str) -> Result<skinrig_protocol::Protocol, skinrig_protocol::Diagnostics> {
    // Touching presses take longer than the demo's.
    let slow = ["sync.interval=10s", "motion.period=10s"];
    parse(&format!("{}\n{section}\n", shipped("demo.yaml")), &slow)
}

#[test]
fn a_plan_without_a_check_omits_it() {
    let text = serde_json::to_string(&demo(&[]).compile()).unwrap();
    assert!(!text.contains("surface_check") && !text.contains("max_consecutive_invalid"));
    let changed = demo(&["limits.max_consecutive_invalid=0"]).compile();
    assert_eq!(changed.max_consecutive_invalid, 0);
    assert_ne!(changed.digest(), demo(&[]).compile().digest());
}

#[test]
fn a_check_uses_the_touch_settings_of_the_presses() {
    let at = demo(&[]).locations[0];
    let points = format!(
        "surface_check: {{points: [[{} mm, {} mm]]}}",
        at.x_mm, at.y_mm
    );
    let check = |protocol: skinrig_protocol::Protocol| {
        protocol.check(&protocol.compile()).unwrap();
        protocol.compile().surface_check.unwrap()
    };
    let plain = check(with(&points).unwrap());
    assert_eq!((plain.points.len(), plain.tolerance_mm), (1, 0.3));
    assert!(!plain.each_repetition);
    // The defaults of `press`.
    assert_eq!(plain.search, TouchSearch::default());
    let touch = with(&format!("{points}\npress: {{surface: touch}}")).unwrap();
    assert_eq!(touch.surface, Some(Surface::Touch(TouchSearch::default())));
    let fast = with(&format!(
        "{points}\npress: {{surface: touch, speed: 3 mm/s}}"
    ))
    .unwrap();
    assert_eq!(check(fast).search.speed_mm_s, 3.0);
}

#[test]
fn a_check_stays_on_the_skin_and_within_the_search() {
    let off = with("surface_check: {points: [[500 mm, 0 mm]]}").unwrap();
    let error = off.check(&off.compile()).unwrap_err().to_string();
    assert!(error.contains("not on the skin"), "{error}");
    assert!(error.contains("x leaves the workspace"), "{error}");
    assert!(error.contains("surface_check.points"), "{error}");
    let wide = with("surface_check: {points: [[0 mm, 0 mm]], tolerance: 1 mm}");
    let error = wide.unwrap_err().to_string();
    assert!(error.contains("the search would miss a surface"), "{error}");
    let none = with("surface_check: {points: []}").unwrap_err().to_string();
    assert!(none.contains("surface_check.points"), "{none}");
}

#[test]
fn the_time_of_the_checks_is_in_the_plans() {
    let lasts = |section: &str| {
        let plan = with(section).unwrap().compile();
        let repetitions = plan.steps.iter().filter(
            |s| matches!(s, skinrig_protocol::plan::Step::Begin { repetition } if repetition.is_some()),
        );
        (plan.summary().duration_s, repetitions.count() as f64)
    };
    let none = lasts("").0;
    let (once, repetitions) = lasts("surface_check: {points: [[10 mm, 2 mm], [0 mm, 0 mm]]}");
    let each = lasts("surface_check: {points: [[10 mm, 2 mm], [0 mm, 0 mm]], at: each_repetition}");
    // A touch searches 1 mm at 2 mm/s after 300 ms of tare, besides its travels.
    let check = once - none;
    assert!(check > 2.0 * 0.8 && check < 60.0, "{check}");
    assert!(((each.0 - none) - (1.0 + repetitions) * check).abs() < 1e-6);
}

//! Fewer locations in calibrating repetitions: the plan and its diagnostics.

use skinrig_model::PressRole;
use skinrig_protocol::{Diagnostics, Protocol};

use crate::common::{demo, parse, shipped};

/// The demo, of which the first repetition of three calibrates.
fn with(section: &str) -> Result<Protocol, Diagnostics> {
    parse(&format!("{}\n{section}\n", shipped("demo.yaml")), &[])
}

#[track_caller]
fn refused(section: &str, parts: &[&str]) {
    let error = with(section).expect_err(section).render(false);
    for part in parts {
        assert!(
            error.contains(part),
            "{section}: {part} is missing\n{error}"
        );
    }
}

#[test]
fn calibrating_repetitions_press_the_chosen_locations() {
    let protocol = with("calibrate_at: {locations: 27}").unwrap();
    let plan = protocol.compile();
    protocol.check(&plan).unwrap();
    let of = |role, repetition| {
        let all = plan.presses.iter();
        let all = all.filter(move |p| p.role == role && p.repetition.index() == repetition);
        all.map(|p| p.location.index()).collect::<Vec<_>>()
    };
    let chosen = of(PressRole::Calibrate, 0);
    assert!(chosen.len() == 27 && chosen.is_sorted(), "{chosen:?}");
    assert_eq!(of(PressRole::Score, 1), (0..81).collect::<Vec<_>>());
    assert!(!demo(&[]).compile().to_json().contains("calibrate_at"));
    refused(
        "calibrate_at: {locations: 82}",
        &["calibrate_at.locations", "at most 81"],
    );
    refused(
        "calibrate_at: {locations: 0}",
        &["calibrate_at.locations", "1 to 300"],
    );
    let text = format!("{}\ncalibrate_at: {{locations: 9}}\n", shipped("demo.yaml"));
    let none = [
        "evaluation.calibrate=[]",
        "evaluation.score=[1-3]",
        "analysis.calibration=none",
    ];
    let error = parse(&text, &none).unwrap_err().to_string();
    assert!(error.contains("no repetition calibrates"), "{error}");
    let large = [
        "path.meander.columns=40",
        "path.meander.rows=40",
        "path.meander.pitch=1mm",
    ];
    let error = parse(&text, &large).unwrap_err().to_string();
    assert!(
        error.contains("too many locations to choose from"),
        "{error}"
    );
}

//! The simulation level that needs and tolerances of a scene choose.

use skinrig_model::{ScenePart, SimLevel};

use crate::common::{parse, shipped};

/// Level of the demo with this section in place of its needs.
fn level(scene: &str) -> SimLevel {
    let text = shipped("demo.yaml");
    let needs = "  needs: [event_rates, localisation, optical_error]\n";
    assert!(text.contains(needs));
    let text = text.replace(needs, &format!("  {scene}\n"));
    let protocol = parse(&text, &[]).unwrap_or_else(|e| panic!("{scene}: {e}"));
    protocol.scene.level
}

#[test]
fn the_cheapest_level_within_needs_and_tolerances_is_taken() {
    use SimLevel::{Geometric, Kinematic, Optical};
    const CAMERAS: &str = "cameras:\n    camera1: {position: [45 mm, -38 mm], half_field_of_view: 60 deg}\n    camera2: {position: [45 mm, 42 mm], half_field_of_view: 60 deg}";
    for (scene, expected) in [
        ("needs: [motion]", Kinematic),
        (
            "needs: [motion]\n  tolerances: {event_rate: 30 %}",
            Geometric,
        ),
        ("tolerances: {event_rate: 30 %}", Geometric),
        (
            "tolerances: {event_rate: 30 %, localisation_rmse: 0.5 mm}",
            Geometric,
        ),
        ("tolerances: {event_rate: 10 %}", Optical),
        (
            "tolerances: {event_rate: 30 %, localisation_rmse: 0.2 mm}",
            Optical,
        ),
        ("tolerances: {latency: 1 ms}", Optical),
        ("tolerances: {idle_rate: 10 %}", Optical),
        (
            "needs: [latency]\n  tolerances: {event_rate: 30 %}",
            Optical,
        ),
        ("parts: [readout]", Optical),
        (CAMERAS, Geometric),
        // Differences are measured for the published cameras only.
        (
            &format!("tolerances: {{event_rate: 30 %}}\n  {CAMERAS}"),
            Optical,
        ),
    ] {
        assert_eq!(level(scene), expected, "{scene}");
    }
}

#[test]
fn parts_are_listed_once_and_need_the_optical_level() {
    let parsed = |scene: &str| {
        let text = shipped("demo.yaml").replace(
            "  needs: [event_rates, localisation, optical_error]\n",
            &format!("  {scene}\n"),
        );
        parse(&text, &[])
    };
    let found = parsed("parts: [readout, weak_presses]")
        .unwrap()
        .scene
        .parts;
    assert_eq!(found, [ScenePart::Readout, ScenePart::WeakPresses]);
    for (scene, expected) in [
        ("parts: [readout, readout]", "each part once"),
        (
            "parts: [readout]\n  level: geometric",
            "because of `scene.parts`",
        ),
        ("parts: [read_out]", "did you mean"),
    ] {
        let error = parsed(scene).unwrap_err().to_string();
        assert!(error.contains(expected), "{scene}: {error}");
    }
}

#[test]
fn the_shipped_scene_of_the_paper_has_every_part() {
    let protocol = parse(&shipped("paper.yaml"), &[]).unwrap();
    assert_eq!(protocol.scene.parts, ScenePart::ALL);
    assert_eq!(protocol.scene.level, SimLevel::Optical);
}

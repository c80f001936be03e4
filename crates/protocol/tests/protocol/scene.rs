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
            "needs: [motion]\n  tolerances: {event_rate: 75 %}",
            Geometric,
        ),
        ("tolerances: {event_rate: 75 %}", Geometric),
        (
            "tolerances: {event_rate: 75 %, localisation_rmse: 1.6 mm}",
            Geometric,
        ),
        ("tolerances: {event_rate: 70 %}", Optical),
        (
            "tolerances: {event_rate: 75 %, localisation_rmse: 1.5 mm}",
            Optical,
        ),
        ("tolerances: {latency: 1 ms}", Optical),
        ("tolerances: {idle_rate: 10 %}", Optical),
        (
            "needs: [latency]\n  tolerances: {event_rate: 75 %}",
            Optical,
        ),
        ("parts: [readout]", Optical),
        (CAMERAS, Geometric),
        // Levels are compared for the published cameras only.
        (
            &format!("tolerances: {{event_rate: 75 %}}\n  {CAMERAS}"),
            Optical,
        ),
    ] {
        assert_eq!(level(scene), expected, "{scene}");
    }
}

#[test]
fn where_levels_are_not_compared_tolerances_take_the_optical_one() {
    let with = |scene: &str, change: (&str, &str)| {
        let text = shipped("demo.yaml").replace(
            "  needs: [event_rates, localisation, optical_error]\n",
            &format!("  {scene}\n"),
        );
        assert!(text.contains(change.0));
        parse(&text.replace(change.0, change.1), &[])
    };
    for change in [
        ("depth: 2 mm", "depth: 1 mm"),
        ("depth: 2 mm", "depths: [2 mm, 2.5 mm]"),
        ("hold: 150 ms", "hold: 200 ms"),
        ("indent: 20 mm/s", "indent: 25 mm/s"),
        ("columns: 9", "columns: 2"),
        ("depth: 2 mm", "depth: 2 mm\nanalysis: {min_samples: 400}"),
        (
            "depth: 2 mm",
            "depth: 2 mm\nanalysis: {window_after_contact: 30 ms}",
        ),
        ("depth: 2 mm", "depth: 2 mm\nanalysis: {locator: geometry}"),
        (
            "outline: paper",
            "outline: {centre: [10 mm, 2 mm], width: 90 mm, height: 90 mm, chamfer: 0 mm, radius: 10 mm}",
        ),
    ] {
        let tolerant = "tolerances: {event_rate: 75 %}";
        match with(tolerant, change) {
            Ok(protocol) => assert_eq!(protocol.scene.level, SimLevel::Optical, "{change:?}"),
            Err(e) => panic!("{change:?}: {e}"),
        }
        let named = with(&format!("{tolerant}\n  level: geometric"), change);
        let error = named.unwrap_err().to_string();
        assert!(error.contains("not measured for these presses"), "{error}");
        // Without tolerances, nobody relies on the differences.
        let level = with("needs: [motion]", change).unwrap().scene.level;
        assert_eq!(level, SimLevel::Kinematic);
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
fn constants_of_a_skin_need_the_optical_level() {
    let changed = |change: &str| parse(&shipped("demo.yaml"), &["scene.needs=[motion]", change]);
    for change in [
        "scene.skin.light_loss=0.7",
        "scene.skin.press_scatter=1.2 mm",
        "scene.skin.depth_scatter=8 %",
        "scene.skin.weak_presses=3 %",
        "scene.skin.pod_offset=1 mm",
        "scene.noise=1.5",
        "scene.twin_of=K7",
    ] {
        let scene = changed(change)
            .unwrap_or_else(|e| panic!("{change}: {e}"))
            .scene;
        assert_eq!(scene.level, SimLevel::Optical, "{change}");
        let key = change.split(['.', '=']).nth(1).unwrap();
        let both = parse(&shipped("demo.yaml"), &[change, "scene.level=geometric"]);
        let error = both.unwrap_err().to_string();
        assert!(
            error.contains(&format!("because of `scene.{key}`")),
            "{error}"
        );
    }
    let skin = changed("scene.skin.weak_presses=3 %")
        .unwrap()
        .scene
        .skin
        .unwrap();
    assert_eq!((skin.weak_presses, skin.light_loss), (Some(0.03), 1.0));
    assert_eq!(
        (
            skin.press_scatter_mm,
            skin.depth_scatter,
            skin.pod_offset_mm
        ),
        (None, None, None)
    );
    // The centre of a pod of 3 mm lies within it.
    for change in [
        "scene.skin.pod_offset=3 mm",
        "scene.noise=0",
        "scene.skin.light_loss=0",
    ] {
        assert!(changed(change).is_err(), "{change}");
    }
}

#[test]
fn the_shipped_scene_of_the_paper_has_every_part() {
    let protocol = parse(&shipped("paper.yaml"), &[]).unwrap();
    assert_eq!(protocol.scene.parts, ScenePart::ALL);
    assert_eq!(protocol.scene.level, SimLevel::Optical);
}

#[test]
fn cameras_that_see_no_angles_are_refused() {
    let cameras = |one: &str, two: &str| {
        let camera = |place: &str| format!("{{position: {place}, half_field_of_view: 60 deg}}");
        let both = format!("camera1: {}, camera2: {}", camera(one), camera(two));
        parse(
            &shipped("demo.yaml"),
            &[&format!("scene.cameras={{{both}}}")],
        )
    };
    let refused = |one: &str, two: &str, parts: &[&str]| {
        let text = cameras(one, two).unwrap_err().render(false);
        for part in parts {
            assert!(text.contains(part), "expected {part:?} in {text}");
        }
    };
    assert!(cameras("[45 mm, -38 mm]", "[45 mm, 42 mm]").is_ok());
    // The centre of the outline, where its axis points.
    refused(
        "[10 mm, 2 mm]",
        "[45 mm, 42 mm]",
        &[
            "scene.cameras.camera1.position",
            "stands at the point it aims at",
        ],
    );
    refused(
        "[45 mm, 42 mm]",
        "[45 mm, 42 mm]",
        &[
            "scene.cameras",
            "nearly parallel at every location",
            "sine of at least 0.05",
            "at most 0.0000",
        ],
    );
}

//! Properties of the parts: each changes the events, none when it is off, and calls divide anywhere.

use skinrig_model::{CameraId, ScenePart};

use super::tests::{P, press, run, scene, tip};
use super::{OpticalConfig, OpticalModel, Parts};
use crate::scene::PixelEvent;

fn model(parts: &[ScenePart]) -> OpticalModel {
    let config = OpticalConfig {
        parts: Parts::of_paper(parts),
        ..OpticalConfig::default()
    };
    OpticalModel::with_config(&scene(CameraId::One), config, 1).unwrap()
}

/// Events of a press and of the time after it.
fn events(parts: &[ScenePart]) -> Vec<PixelEvent> {
    let mut tips = press(P, 2.0);
    tips.extend((501..1_000).map(|ms| tip(ms, P.x_mm, P.y_mm, 1.0)));
    run(&mut model(parts), &tips)
}

#[test]
fn each_part_changes_the_events() {
    let none = events(&[]);
    for part in ScenePart::ALL {
        // A weak press is drawn for one in thirty; the readout is idle at these rates.
        if ![ScenePart::WeakPresses, ScenePart::Readout].contains(&part) {
            assert_ne!(events(&[part]), none, "{part:?}");
        }
    }
}

#[test]
fn all_parts_together_do_not_depend_on_the_division_into_calls() {
    let tips = press(P, 2.0);
    let whole = run(&mut model(&ScenePart::ALL), &tips);
    assert!(whole.is_sorted_by_key(|e| e.t_ns));
    for size in [2, 7, 100] {
        let mut divided = model(&ScenePart::ALL);
        let mut found = Vec::new();
        for piece in tips.chunks(size) {
            found.extend(run(&mut divided, piece));
        }
        assert_eq!(found, whole, "{size} tips per call");
    }
}

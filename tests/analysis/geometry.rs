//! Triangulation: the cases that the public solver gets wrong, the grid, and projected points.

#![expect(clippy::unwrap_used, reason = "tests")]

use proptest::prelude::*;
use serde_json::Value;
use skinrig_analysis::result::LocationOutcome;
use skinrig_analysis::triangulate::{intersect, locate, locate_angles};
use skinrig_model::{LensModel, Point2, SkinOutline, StereoGeometry};

const SKIN: SkinOutline = SkinOutline::PAPER;

fn fixture(text: &str) -> Vec<Value> {
    let value: Value = serde_json::from_str(text).unwrap();
    value["cases"].as_array().unwrap().clone()
}

fn numbers(value: &Value) -> Vec<f64> {
    let list = value.as_array().unwrap();
    list.iter()
        .map(|v| v.as_f64().unwrap_or(f64::NAN))
        .collect()
}

fn near(found: f64, expected: f64) -> bool {
    (found - expected).abs() <= 1e-9 * (1.0 + expected.abs())
}

#[test]
fn every_case_of_the_public_solver_comes_out_right() {
    let cases = fixture(include_str!("fixtures/geometry.json"));
    assert_eq!(cases.len(), 68);
    for case in &cases {
        let name = &case["case"];
        let parameters: [f64; 8] = numbers(&case["camera_parameters"]).try_into().unwrap();
        let geometry = StereoGeometry::paper_like(parameters);
        let angles: [f64; 2] = numbers(&case["angles_deg"]).try_into().unwrap();
        let outcome = locate_angles(&geometry, &SKIN, angles);
        assert_eq!(
            outcome.name(),
            case["status"].as_str().unwrap(),
            "{name}: {outcome:?}"
        );
        if let Some(columns) = case.get("columns") {
            let columns: Vec<f64> = numbers(columns);
            let by_columns = locate(&geometry, &SKIN, [Some(columns[0]), Some(columns[1])]);
            assert_eq!(by_columns.name(), outcome.name(), "{name}");
            if let (Some(a), Some(b)) = (by_columns.estimate(), outcome.estimate()) {
                assert!(a.distance_mm(b) < 1e-9, "{name}");
            }
        }
        let hit = intersect(&geometry, angles);
        let Some(at) = case["at"].as_array() else {
            continue;
        };
        let ranges = numbers(&case["ranges_mm"]);
        // Far away the result is as uncertain as 1 / sine.
        let slack = 1.0 / hit.sine.abs();
        for (found, expected) in [
            (hit.at.x_mm, at[0].as_f64().unwrap()),
            (hit.at.y_mm, at[1].as_f64().unwrap()),
            (hit.range_mm[0], ranges[0]),
            (hit.range_mm[1], ranges[1]),
        ] {
            let close = (found - expected).abs() <= 1e-13 * (100.0 + expected.abs()) * slack;
            assert!(close, "{name}: found {found}, expected {expected}");
        }
        assert!(near(hit.sine, case["sine"].as_f64().unwrap()), "{name}");
    }
}

#[test]
fn grid_points_that_the_public_solver_moves_stay_fixed() {
    let cases = fixture(include_str!("fixtures/grid.json"));
    assert_eq!(cases.len(), 46);
    for case in &cases {
        let (at, angles) = (numbers(&case["at"]), numbers(&case["angles_deg"]));
        let outcome = locate_angles(&StereoGeometry::PAPER, &SKIN, [angles[0], angles[1]]);
        let found = outcome.estimate().unwrap();
        assert!(found.distance_mm(Point2::new(at[0], at[1])) < 1e-9);
    }
}

#[test]
fn the_complete_grid_is_located_exactly() {
    let mut observed = 0;
    for i in -8i32..=8 {
        for j in -8i32..=8 {
            let p = Point2::new(10.0 + 4.0 * f64::from(i), 2.0 + 4.0 * f64::from(j));
            let angles = StereoGeometry::PAPER
                .cameras
                .map(|c| c.angle_of_point_deg(p));
            let outcome = locate_angles(&StereoGeometry::PAPER, &SKIN, angles);
            assert!(
                matches!(outcome, LocationOutcome::Located { .. }),
                "{p:?}: {outcome:?}"
            );
            assert!(outcome.estimate().unwrap().distance_mm(p) < 1e-10);
            observed += 1;
        }
    }
    assert_eq!(observed, 289);
}

#[test]
fn missing_views_and_impossible_cameras_are_missing() {
    let g = StereoGeometry::PAPER;
    for columns in [
        [None, Some(300.0)],
        [Some(300.0), None],
        [None, None],
        [Some(f64::NAN), Some(300.0)],
        [Some(300.0), Some(f64::INFINITY)],
    ] {
        assert_eq!(locate(&g, &SKIN, columns), LocationOutcome::Missing);
    }
    let mut blind = g;
    blind.cameras[0].position = blind.cameras[0].aim;
    assert_eq!(
        locate(&blind, &SKIN, [Some(300.0), Some(300.0)]),
        LocationOutcome::Missing
    );
}

#[test]
fn right_angles_and_the_axis_are_ordinary_directions() {
    let g = StereoGeometry::paper_like([60.0, 2.0, 10.0, 52.0, 0.0, 0.0, 0.0, 0.0]);
    // Camera 1 looks along -x, camera 2 along -y.
    let on_axis = locate_angles(&g, &SKIN, [0.0, 0.0]);
    assert!(
        on_axis
            .estimate()
            .unwrap()
            .distance_mm(Point2::new(10.0, 2.0))
            < 1e-12
    );
    // Clockwise by 90 degrees from -x is +y; from -y it is -x.
    let hit = intersect(&g, [90.0, -90.0]);
    assert!(
        hit.at.distance_mm(Point2::new(60.0, 52.0)) < 1e-9,
        "{hit:?}"
    );
    assert!(matches!(
        locate_angles(&g, &SKIN, [-90.0, 90.0]),
        LocationOutcome::Behind { .. }
    ));
    assert!(matches!(
        locate_angles(&g, &SKIN, [0.0, 90.0]),
        LocationOutcome::Parallel { .. }
    ));
}

proptest! {
    #[test]
    fn rays_through_a_point_intersect_at_it(
        x in -40.0f64..60.0, y in -48.0f64..52.0,
        x1 in 40.0f64..55.0, y1 in -50.0f64..-30.0, x2 in 40.0f64..55.0, y2 in 30.0f64..40.0,
        skew1 in -5.0f64..5.0, skew2 in -5.0f64..5.0, w1 in -0.9f64..0.9, w2 in -0.9f64..0.9,
    ) {
        let p = Point2::new(x, y);
        let g = StereoGeometry::paper_like([x1, y1, x2, y2, skew1, skew2, w1, w2]);
        prop_assume!(g.cameras.iter().all(|c| c.position.distance_mm(p) > 0.5));
        let angles = g.cameras.map(|c| c.angle_of_point_deg(p));
        let hit = intersect(&g, angles);
        prop_assume!(hit.sine.abs() > 1e-6);
        prop_assert!(hit.at.distance_mm(p) < 1e-11 / hit.sine.abs(), "{hit:?}");
        prop_assert!(hit.range_mm.iter().all(|r| *r > 0.0));
        prop_assert_eq!(locate_angles(&g, &SKIN, angles).name(),
            if SKIN.contains(hit.at) { "located" } else { "outside" });
        // The same through columns, where both cameras see the point.
        if let [Some(u1), Some(u2)] = g.cameras.map(|c| c.column_of_point(p)) {
            let found = locate(&g, &SKIN, [Some(u1), Some(u2)]).estimate().unwrap();
            prop_assert!(found.distance_mm(p) < 1e-9 / hit.sine.abs());
        }
    }

    #[test]
    fn no_panic_on_any_numbers(
        u1 in prop::num::f64::ANY, u2 in prop::num::f64::ANY, w in prop::num::f64::ANY,
        x in prop::num::f64::ANY,
    ) {
        let mut g = StereoGeometry::PAPER;
        g.cameras[1].position.x_mm = x;
        g.cameras[0].lens = LensModel::Exponential { half_fov_deg: 60.0, w };
        let outcome = locate(&g, &SKIN, [Some(u1), Some(u2)]);
        if let LocationOutcome::Located { at, .. } = outcome {
            prop_assert!(SKIN.contains(at) && at.x_mm.is_finite() && at.y_mm.is_finite());
        }
    }
}

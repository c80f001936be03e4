//! Invariances of the geometry: scaling and translating coordinates only scales and translates the result.

use proptest::strategy::Strategy;
use proptest::test_runner::{Config, TestRunner};
use skinrig_analysis::triangulate::locate;
use skinrig_model::{CameraModel, Point2, SkinOutline, StereoGeometry};

use crate::numerics::bounds::{self, UNIT, Watch};

fn moved(p: Point2, factor: f64, by: [f64; 2]) -> Point2 {
    Point2::new(factor * p.x_mm + by[0], factor * p.y_mm + by[1])
}

/// Geometry and outline in other units (`factor`), then shifted.
fn transformed(
    g: &StereoGeometry,
    skin: &SkinOutline,
    factor: f64,
    by: [f64; 2],
) -> (StereoGeometry, SkinOutline) {
    let camera = |c: CameraModel| CameraModel {
        position: moved(c.position, factor, by),
        aim: moved(c.aim, factor, by),
        ..c
    };
    let skin = SkinOutline {
        centre: moved(skin.centre, factor, by),
        width_mm: factor * skin.width_mm,
        height_mm: factor * skin.height_mm,
        chamfer_mm: factor * skin.chamfer_mm,
        radius_mm: factor * skin.radius_mm,
    };
    let cameras = g.cameras.map(camera);
    (StereoGeometry { cameras }, skin)
}

type Case = ((f64, f64, f64, f64), (f64, f64), (f64, f64));

/// Camera positions about the published ones, columns of both cameras, distortions.
fn cases() -> impl Strategy<Value = Case> {
    (
        (40.0..55.0, -45.0..-30.0, 40.0..55.0, 30.0..42.0),
        (0.0..640.0, 0.0..640.0),
        (-1.0..1.0, -1.0..1.0),
    )
}

/// A runner that writes no files.
pub(crate) fn runner(cases: u32) -> TestRunner {
    TestRunner::new(Config {
        cases,
        failure_persistence: None,
        ..Config::default()
    })
}

fn check(case: &Case, bound: &Watch, factor: f64, by: [f64; 2]) {
    let ((x1, y1, x2, y2), (u1, u2), (w1, w2)) = *case;
    let g = StereoGeometry::paper_like([x1, y1, x2, y2, 0.7, -0.3, w1, w2]);
    let (h, skin) = transformed(&g, &SkinOutline::PAPER, factor, by);
    let columns = [Some(u1), Some(u2)];
    let (computed, there) = (
        locate(&g, &SkinOutline::PAPER, columns),
        locate(&h, &skin, columns),
    );
    let sine = |o| match o {
        skinrig_analysis::result::LocationOutcome::Located { sine, .. }
        | skinrig_analysis::result::LocationOutcome::Outside { sine, .. } => sine,
        _ => f64::NAN,
    };
    let (Some(p), Some(q)) = (computed.estimate(), there.estimate()) else {
        // Parallel and behind depend on numbers that are invariant up to rounding.
        if computed.name() != there.name() {
            let near = [sine(computed), sine(there)]
                .iter()
                .all(|s| s.is_nan() || s.abs() < 1e-8);
            assert!(near, "{computed:?} {there:?} for {case:?}");
        }
        return;
    };
    let expected = moved(p, factor, by);
    let reach = [(x1, y1), (x2, y2)]
        .map(|(x, y)| p.distance_mm(Point2::new(x, y)))
        .into_iter()
        .fold(0.0, f64::max);
    // Coordinates far from zero have coarse last bits; neither cameras nor points can be more accurate.
    let size = factor * (reach + 100.0) + by[0].abs() + by[1].abs();
    // Rounding of the axis ends rotates the axis, which moves the point in proportion to the range.
    let lever = (reach + 100.0) / 40.0;
    let error = q.distance_mm(expected) * sine(computed).abs() / (UNIT * size * lever);
    bound.record(error, format!("{case:?}, factor {factor}, by {by:?}"));
}

#[test]
fn metres_and_millimetres_locate_alike() {
    let watch = Watch::new(&bounds::SCALE);
    let mut runner = runner(2000);
    runner
        .run(&(cases(), 0usize..4), |(case, k)| {
            check(&case, &watch, [1e-3, 1e3, 25.4, 1.0 / 1024.0][k], [0.0; 2]);
            Ok(())
        })
        .unwrap();
}

#[test]
fn a_skin_a_kilometre_from_the_origin_is_located_as_well_as_its_coordinates_allow() {
    let watch = Watch::new(&bounds::TRANSLATION);
    let mut runner = runner(2000);
    runner
        .run(&(cases(), -1e6..1e6, -1e6..1e6), |(case, dx, dy)| {
            check(&case, &watch, 1.0, [dx, dy]);
            Ok(())
        })
        .unwrap();
}

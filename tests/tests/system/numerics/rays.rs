//! Two rays, from a right angle to a millionth of a millionth of a degree; contacts at degenerate geometries.

use skinrig_analysis::result::LocationOutcome;
use skinrig_analysis::triangulate::{PARALLEL_SINE, intersect, locate_angles};
use skinrig_model::{CameraModel, Point2, SkinOutline, StereoGeometry};

use crate::numerics::bounds::{self, UNIT, Watch};
use crate::numerics::precise;

const SKIN: SkinOutline = SkinOutline::PAPER;

/// Cameras about the published positions, deterministic.
fn geometries() -> impl Iterator<Item = StereoGeometry> {
    (0..12u32).map(|i| {
        let step = |k: u32, low: f64, high: f64| {
            let share = f64::from((i * 7919 + k * 104_729) % 1009) / 1008.0;
            low + share * (high - low)
        };
        StereoGeometry::paper_like([
            step(1, 35.0, 58.0),
            step(2, -47.0, -25.0),
            step(3, 35.0, 58.0),
            step(4, 25.0, 45.0),
            0.0,
            0.0,
            0.0,
            0.0,
        ])
    })
}

/// Heading of a camera's axis, degrees counter-clockwise from x.
fn heading(camera: &CameraModel) -> f64 {
    let (dx, dy) = (
        camera.aim.x_mm - camera.position.x_mm,
        camera.aim.y_mm - camera.position.y_mm,
    );
    libm::atan2(dy, dx).to_degrees()
}

#[test]
fn rays_from_a_right_angle_to_a_millionth_of_a_millionth_of_a_degree_apart() {
    let (sine, meet, range) = (
        Watch::new(&bounds::SINE),
        Watch::new(&bounds::MEET),
        Watch::new(&bounds::RANGE),
    );
    let (mut parallel, mut resolved) = (0, 0);
    for g in geometries() {
        let baseline = g.cameras[0].position.distance_mm(g.cameras[1].position);
        let turn = heading(&g.cameras[1]) - heading(&g.cameras[0]);
        for first in [-89.0, -40.3, 0.0, 17.25, 63.0] {
            let powers = (-12..=1).flat_map(|p| [1.0, 3.7].map(|m| m * 10f64.powi(p)));
            for apart in powers.chain([45.0, 90.0]).flat_map(|a| [a, -a]) {
                // Clockwise angles: ray 2 is `apart` degrees counter-clockwise of ray 1.
                let angles = [first, first + turn - apart];
                let exact = precise::intersect(&g, angles.map(precise::real));
                let hit = intersect(&g, angles);
                let at = format!("{apart:e}° apart, {angles:?}");
                sine.record(precise::error(hit.sine, &exact.sine) / UNIT, &at);
                let s = precise::near(&exact.sine).abs();
                let outcome = locate_angles(&g, &SKIN, angles);
                // The threshold itself is accurate to the error of a sine.
                if s < PARALLEL_SINE - 8.0 * UNIT {
                    assert!(matches!(outcome, LocationOutcome::Parallel { .. }), "{at}");
                    parallel += 1;
                    continue;
                }
                assert!(!matches!(outcome, LocationOutcome::Parallel { .. }), "{at}");
                resolved += 1;
                let place = exact.at.unwrap();
                let ranges = exact.ranges.each_ref().map(|r| precise::near(r).abs());
                let reach = baseline + ranges[0].min(ranges[1]);
                meet.record(precise::distance(hit.at, &place) * s / UNIT / reach, &at);
                for (k, r) in ranges.into_iter().enumerate() {
                    let error = precise::error(hit.range_mm[k], &exact.ranges[k]);
                    range.record(error * s / UNIT / (baseline + r), &at);
                }
            }
        }
    }
    assert!(parallel > 250 && resolved > 2000, "{parallel} {resolved}");
}

#[test]
fn a_contact_near_the_baseline_is_as_good_as_its_sine_or_parallel() {
    let trip = Watch::new(&bounds::ROUND_TRIP);
    for g in geometries() {
        let [one, two] = g.cameras.map(|c| c.position);
        let (wx, wy) = (two.x_mm - one.x_mm, two.y_mm - one.y_mm);
        let baseline = libm::hypot(wx, wy);
        for share in [0.1, 0.5, 0.83] {
            for height in [30.0, 1.0, 1e-3, 1e-6, 3e-8, 1e-10, 0.0] {
                // To the left of the skin, where the presses are.
                let (nx, ny) = (-wy / baseline, wx / baseline);
                let p = Point2::new(
                    one.x_mm + share * wx + height * nx,
                    one.y_mm + share * wy + height * ny,
                );
                let angles = g.cameras.map(|c| c.angle_of_point_deg(p));
                let [r1, r2] = [one.distance_mm(p), two.distance_mm(p)];
                let s = baseline * height / (r1 * r2);
                let outcome = locate_angles(&g, &SKIN, angles);
                let at = format!("{height:e} mm off the baseline: {outcome:?}");
                if s < 0.5 * PARALLEL_SINE {
                    assert!(matches!(outcome, LocationOutcome::Parallel { .. }), "{at}");
                } else if s > 2.0 * PARALLEL_SINE {
                    let error = outcome.estimate().unwrap().distance_mm(p);
                    trip.record(error * s / UNIT / (baseline + r1.min(r2)), &at);
                }
            }
        }
    }
}

#[test]
fn a_ray_through_the_other_camera_ends_at_or_behind_it() {
    let trip = Watch::new(&bounds::ROUND_TRIP);
    for g in geometries() {
        for k in 0..2 {
            let camera = g.cameras[k].position;
            for own in [-75.0, -20.0, 0.0, 33.3, 80.0] {
                let mut angles = [own; 2];
                angles[1 - k] = g.cameras[1 - k].angle_of_point_deg(camera);
                let hit = intersect(&g, angles);
                let baseline = g.cameras[1 - k].position.distance_mm(camera);
                let error = hit.at.distance_mm(camera);
                let size = baseline + camera.distance_mm(Point2::default());
                let at = format!("camera {}, {own}°: {hit:?}", k + 1);
                trip.record(error * hit.sine.abs() / UNIT / size, &at);
                match locate_angles(&g, &SKIN, angles) {
                    LocationOutcome::Located { at: found, .. }
                    | LocationOutcome::Outside { at: found, .. } => assert_eq!(found, hit.at),
                    LocationOutcome::Behind { .. } => {
                        let rounding = -1e-13 / hit.sine.abs();
                        let barely = |r: &f64| *r < 0.0 && *r > rounding;
                        assert!(hit.range_mm.iter().any(barely), "{at}");
                    }
                    other => panic!("{other:?} at {at}"),
                }
            }
        }
    }
}

#[test]
fn behind_and_in_front_are_distinguished_up_to_rounding() {
    let g = StereoGeometry::PAPER;
    let camera = g.cameras[1];
    for angle in [-30.0, 0.0, 12.0] {
        let [dx, dy] = camera.direction(angle);
        for distance in [40.0, 1.0, 1e-3, 1e-9, 1e-12] {
            for (side, name) in [(1.0, "located"), (-1.0, "behind")] {
                let p = Point2::new(
                    camera.position.x_mm + side * distance * dx,
                    camera.position.y_mm + side * distance * dy,
                );
                let angles = [g.cameras[0].angle_of_point_deg(p), angle];
                let found = locate_angles(&g, &SKIN, angles);
                if distance < 1e-9 {
                    // Below the rounding of the coordinates both results are correct.
                    assert!(["located", "behind"].contains(&found.name()), "{found:?}");
                } else if SKIN.contains(p) || side < 0.0 {
                    assert_eq!(found.name(), name, "{distance:e} mm: {found:?}");
                }
            }
        }
    }
}

#[test]
fn the_principal_point_and_its_neighbours_are_ordinary() {
    let (angle, trip) = (
        Watch::new(&bounds::POINT_ANGLE),
        Watch::new(&bounds::ROUND_TRIP),
    );
    for g in geometries() {
        for k in 0..=18 {
            let off = if k == 0 { 0.0 } else { 10f64.powi(2 - k) };
            let p = Point2::new(10.0 - off, 2.0 + 0.5 * off);
            for camera in &g.cameras {
                let exact = precise::angle_of_point(camera, p);
                let unit = UNIT * 180.0 / std::f64::consts::PI;
                let error = precise::error(camera.angle_of_point_deg(p), &exact);
                angle.record(error / unit, format!("{off:e} mm from the axis"));
            }
            let angles = g.cameras.map(|c| c.angle_of_point_deg(p));
            let hit = intersect(&g, angles);
            let reach = hit.range_mm[0].abs() + hit.range_mm[1].abs();
            trip.record(
                hit.at.distance_mm(p) * hit.sine.abs() / UNIT / reach,
                format!("{off:e} mm from the principal point"),
            );
        }
    }
}

#[test]
fn estimates_of_extreme_geometry_are_finite_or_missing() {
    let mut far = StereoGeometry::PAPER;
    far.cameras[0].position = Point2::new(-8e307, 8e307);
    far.cameras[0].aim = Point2::new(8e307, 8e307);
    far.cameras[1].position = Point2::new(1e308, -1e308);
    for first in [-60.0, 0.0, 30.0, 90.0] {
        for second in [-60.0, 0.0, 30.0, 45.0] {
            let outcome = locate_angles(&far, &SKIN, [first, second]);
            if let Some(at) = outcome.estimate() {
                assert!(at.x_mm.is_finite() && at.y_mm.is_finite(), "{outcome:?}");
            }
        }
    }
    for p in [
        Point2::new(f64::NAN, 2.0),
        Point2::new(10.0, f64::NAN),
        Point2::new(f64::NAN, f64::NAN),
        Point2::new(f64::INFINITY, 2.0),
        Point2::new(10.0, f64::NEG_INFINITY),
    ] {
        assert!(!SKIN.contains(p) && !SKIN.box_contains(p), "{p:?}");
    }
}

//! The lens at the end of its range: |W s| up to 1, where the angle stops growing with the column.

use skinrig_model::{CameraModel, LensModel, Point2};

use crate::numerics::bounds::{self, UNIT, Watch};
use crate::numerics::precise;

fn camera(w: f64) -> CameraModel {
    CameraModel {
        position: Point2::new(44.25, -31.98),
        aim: Point2::new(10.0, 2.0),
        skew_deg: 0.0,
        lens: LensModel::Exponential {
            half_fov_deg: 60.0,
            w,
        },
    }
}

const DISTORTIONS: [f64; 11] = [
    -1.0,
    -0.999_999_999,
    -0.6,
    -0.17,
    0.0,
    0.074,
    0.5,
    0.9,
    0.999,
    0.999_999_999,
    1.0,
];

/// A point on the ray of a column, at 40 mm.
fn point_of(camera: &CameraModel, u: f64) -> Point2 {
    let [dx, dy] = camera.direction(camera.angle_of_column_deg(u));
    Point2::new(
        camera.position.x_mm + 40.0 * dx,
        camera.position.y_mm + 40.0 * dy,
    )
}

#[test]
fn the_angle_of_a_column_is_right_to_the_last_bits() {
    let angle = Watch::new(&bounds::LENS_ANGLE);
    for w in DISTORTIONS {
        let camera = camera(w);
        for i in 0..=2560 {
            let u = f64::from(i) * 0.25;
            let exact = precise::angle_of_column(w, u);
            let error = precise::error(camera.angle_of_column_deg(u), &exact);
            let size = precise::near(&exact).abs();
            let relative = if error == 0.0 {
                0.0
            } else {
                error / size / UNIT
            };
            angle.record(relative, format!("W = {w}, u = {u}"));
        }
    }
}

#[test]
fn columns_and_angles_are_inverse_while_the_angle_grows() {
    let backward = Watch::new(&bounds::LENS_BACKWARD);
    let fold = Watch::new(&bounds::LENS_FOLD);
    let mut observed = 0;
    for w in DISTORTIONS {
        let camera = camera(w);
        for i in 0..=640 {
            let p = point_of(&camera, f64::from(i));
            let expected = precise::angle_of_point(&camera, p);
            let at = format!("W = {w}, u = {i}");
            // The very edge of the field of view may be on either side.
            let Some(u) = camera.column_of_point(p) else {
                assert!(i == 0 || i == 640, "{at}");
                continue;
            };
            observed += 1;
            let shown = precise::angle_of_column(w, u);
            backward.record(
                precise::near(&(shown - &expected)).abs() / (UNIT * 180.0),
                &at,
            );
            // Where the slope vanishes the column is accurate only to the root of the rounding error.
            if i % 64 == 1 || !(4..637).contains(&i) {
                fold.record((u - precise::column_of_angle(w, &expected)).abs(), &at);
            }
        }
    }
    assert!(observed > 11 * 638);
}

#[test]
fn beyond_the_fold_the_column_is_the_one_nearer_the_axis() {
    // W > 1 folds the image: the angle grows up to s = 1 / W and falls again; two columns show the same point.
    for w in [1.2, 1.5, 2.0] {
        let camera = camera(w);
        for s in [0.1, 0.3, 0.49] {
            for side in [-1.0, 1.0] {
                let u = 320.0 + 320.0 * s * side;
                let found = camera.column_of_point(point_of(&camera, u));
                assert!(
                    found.is_some_and(|f| (f - u).abs() < 1e-6),
                    "W = {w}, u = {u}: {found:?}"
                );
            }
        }
    }
}

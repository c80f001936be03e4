//! The reference: plain formulas on 256-bit floating-point numbers, correctly rounded, from an independent crate.
//!
//! It shares no code or formulas with the code under test: rays meet where their line equations hold simultaneously
//! (Cramer's rule on normal forms), columns come from bisection over 80 steps, sums are exact to 70 digits.

use dashu_float::FBig;
use dashu_float::round::mode::HalfEven;
use skinrig_model::{CameraModel, Point2, StereoGeometry};

/// A number with 256 bits (77 digits).
pub(crate) type Real = FBig<HalfEven, 2>;

const BITS: usize = 256;

/// The exact value of a finite `x`.
pub(crate) fn real(x: f64) -> Real {
    Real::try_from(x).unwrap().with_precision(BITS).value()
}

/// The nearest double.
pub(crate) fn near(x: &Real) -> f64 {
    x.to_f64().value()
}

/// `|fast - exact|`, rounded only at the end; infinite for anything but a finite `fast`.
pub(crate) fn error(fast: f64, exact: &Real) -> f64 {
    if fast.is_finite() {
        near(&(real(fast) - exact)).abs()
    } else {
        f64::INFINITY
    }
}

/// Distance of a point from its exact position.
pub(crate) fn distance(fast: Point2, exact: &[Real; 2]) -> f64 {
    let [x, y] = exact;
    libm::hypot(error(fast.x_mm, x), error(fast.y_mm, y))
}

fn radians(degrees: Real) -> Real {
    degrees * Real::pi(BITS) / real(180.0)
}

/// The paper's lens with 60° of half field of view and distortion `w`: angle from the axis in degrees at `s`.
fn lens_angle(w: f64, s: &Real) -> Real {
    let size = if *s < real(0.0) {
        -s.clone()
    } else {
        s.clone()
    };
    s * real(60.0) * (-real(w) * size).exp()
}

/// The angle at which that lens shows column `u`, degrees from the axis.
pub(crate) fn angle_of_column(w: f64, u: f64) -> Real {
    lens_angle(w, &((real(u) - real(320.0)) / real(320.0)))
}

/// The column at which that lens (|W| at most 1) shows `angle_deg`, by bisection.
pub(crate) fn column_of_angle(w: f64, angle_deg: &Real) -> f64 {
    let (mut low, mut high) = (real(-1.0), real(1.0));
    for _ in 0..80 {
        let middle = (&low + &high) / real(2.0);
        if lens_angle(w, &middle) < *angle_deg {
            low = middle;
        } else {
            high = middle;
        }
    }
    near(&(real(320.0) + real(320.0) * low))
}

/// Viewing angle of a point in degrees, skew included: clockwise from the axis.
pub(crate) fn angle_of_point(camera: &CameraModel, p: Point2) -> Real {
    let [ax, ay] = from(camera.position, camera.aim);
    let [bx, by] = from(camera.position, p);
    let clockwise = &ay * &bx - &ax * &by;
    clockwise.atan2(&(&ax * &bx + &ay * &by)) * real(180.0) / Real::pi(BITS)
}

fn from(a: Point2, b: Point2) -> [Real; 2] {
    [real(b.x_mm) - real(a.x_mm), real(b.y_mm) - real(a.y_mm)]
}

/// Intersection of two rays.
pub(crate) struct RayIntersection {
    /// Position; `None` if the lines are exactly parallel.
    pub at: Option<[Real; 2]>,
    /// Signed distance from each camera along its ray; zero without an intersection.
    pub ranges: [Real; 2],
    /// Sine of the angle from ray 1 to ray 2.
    pub sine: Real,
}

/// Intersects the rays at these angles (degrees).
pub(crate) fn intersect(geometry: &StereoGeometry, angles_deg: [Real; 2]) -> RayIntersection {
    let unit = |k: usize| {
        let camera = &geometry.cameras[k];
        let [ax, ay] = from(camera.position, camera.aim);
        let (sin, cos) = radians(angles_deg[k].clone()).sin_cos();
        let length = (&ax * &ax + &ay * &ay).sqrt();
        [
            (&ax * &cos + &ay * &sin) / &length,
            (&ay * &cos - &ax * &sin) / &length,
        ]
    };
    let d = [unit(0), unit(1)];
    let sine = &d[0][0] * &d[1][1] - &d[0][1] * &d[1][0];
    // Each line as `a x + b y = c` with the normal (a, b) = (-dy, dx).
    let line = |k: usize| {
        let p = geometry.cameras[k].position;
        let (a, b) = (-d[k][1].clone(), d[k][0].clone());
        let c = &a * real(p.x_mm) + &b * real(p.y_mm);
        (a, b, c)
    };
    let ((a1, b1, c1), (a2, b2, c2)) = (line(0), line(1));
    let determinant = &a1 * &b2 - &a2 * &b1;
    if determinant == real(0.0) {
        let ranges = [real(0.0), real(0.0)];
        return RayIntersection {
            at: None,
            ranges,
            sine,
        };
    }
    let x = (&c1 * &b2 - &c2 * &b1) / &determinant;
    let y = (&a1 * &c2 - &a2 * &c1) / &determinant;
    let range = |k: usize| {
        let p = geometry.cameras[k].position;
        (&x - real(p.x_mm)) * &d[k][0] + (&y - real(p.y_mm)) * &d[k][1]
    };
    let ranges = [range(0), range(1)];
    RayIntersection {
        at: Some([x, y]),
        ranges,
        sine,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_reference_knows_values_from_tables() {
        // sin 1°, e^-1, atan2 in the second quadrant; 50 digits from mathematical tables, as far as a double shows.
        let one = radians(real(1.0)).sin();
        assert_eq!(near(&one), 0.017_452_406_437_283_51);
        assert_eq!(near(&real(-1.0).exp()), 0.367_879_441_171_442_33);
        assert_eq!(
            near(&real(1.0).atan2(&real(-1.0))),
            0.75 * std::f64::consts::PI
        );
        // A third has an error that only higher precision shows.
        let third = real(1.0) / real(3.0);
        let rounding = error(1.0 / 3.0, &third);
        assert!((1.8e-17..1.9e-17).contains(&rounding), "{rounding}");
    }
}

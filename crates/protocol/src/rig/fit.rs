//! The rigid motion that takes one set of points closest to another.
//!
//! Least squares over rotations and translations: the singular vectors of the points' cross-covariance give the
//! rotation (Kabsch, Acta Cryst. A32 (1976) 922; the sign of its determinant as in A34 (1978) 827).

use nalgebra::{Matrix3, Vector3};
use skinrig_model::{Point3, RigidTransform};

/// The transform for which the sum of squared distances of `pairs` (from, to) is smallest. The rotation is proper even
/// when a reflection would fit better. Meaningless for fewer than three points or points on one line
/// (see [`off_line_mm`]).
pub(super) fn rigid<To, From>(
    pairs: &[(Point3<From>, Point3<To>)],
) -> Option<RigidTransform<To, From>> {
    let n = pairs.len() as f64;
    let from: Vec<Vector3<f64>> = pairs.iter().map(|p| p.0.to_array().into()).collect();
    let to: Vec<Vector3<f64>> = pairs.iter().map(|p| p.1.to_array().into()).collect();
    let mean_from = from.iter().sum::<Vector3<f64>>() / n;
    let mean_to = to.iter().sum::<Vector3<f64>>() / n;
    let covariance: Matrix3<f64> = from
        .iter()
        .zip(&to)
        .map(|(p, q)| (p - mean_from) * (q - mean_to).transpose())
        .sum();
    let svd = covariance.svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    let proper = (v_t.transpose() * u.transpose()).determinant().signum();
    let flip = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, proper));
    let rotation = v_t.transpose() * flip * u.transpose();
    let shift = mean_to - rotation * mean_from;
    let row = |i: usize| [rotation[(i, 0)], rotation[(i, 1)], rotation[(i, 2)]];
    Some(RigidTransform::new(
        [row(0), row(1), row(2)],
        [shift.x, shift.y, shift.z],
    ))
}

/// Distance of the farthest of `points` from their best line, mm; 0 if all lie on one.
pub(super) fn off_line_mm(points: &[[f64; 3]]) -> f64 {
    let n = points.len() as f64;
    let points: Vec<Vector3<f64>> = points.iter().map(|p| Vector3::from(*p)).collect();
    let mean = points.iter().sum::<Vector3<f64>>() / n;
    let covariance: Matrix3<f64> = points
        .iter()
        .map(|p| (p - mean) * (p - mean).transpose())
        .sum();
    let along = covariance.symmetric_eigen();
    let line = along.eigenvectors.column(along.eigenvalues.imax());
    points
        .iter()
        .map(|p| {
            let d = p - mean;
            (d - line * line.dot(&d)).norm()
        })
        .fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use skinrig_model::{Robot, Skin};

    fn turn(yaw: f64, pitch: f64, roll: f64, shift: [f64; 3]) -> RigidTransform<Robot, Skin> {
        super::super::frame::rotated(yaw, pitch, roll, shift)
    }

    proptest! {
        #[test]
        fn any_motion_is_recovered(
            yaw in -180.0f64..180.0, pitch in -40.0f64..40.0, roll in -40.0f64..40.0,
            shift in prop::array::uniform3(-100.0f64..100.0),
            extra in prop::collection::vec(prop::array::uniform3(-50.0f64..50.0), 0..5),
        ) {
            let truth = turn(yaw, pitch, roll, shift);
            let mut points = vec![[-40.0, -30.0, 0.0], [45.0, -35.0, 0.0], [5.0, 40.0, 0.0]];
            points.extend(extra);
            let pairs: Vec<_> = points
                .iter()
                .map(|p| Point3::<Skin>::new(p[0], p[1], p[2]))
                .map(|p| (p, truth.apply(p)))
                .collect();
            let found = rigid(&pairs).unwrap();
            for (p, q) in &pairs {
                prop_assert!(found.apply(*p).distance_mm(*q) < 1e-9);
            }
            let (a, b) = (found.rotation, truth.rotation);
            for i in 0..3 {
                for j in 0..3 {
                    prop_assert!((a[i][j] - b[i][j]).abs() < 1e-9);
                }
            }
        }

        #[test]
        fn no_motion_nearby_fits_better(
            noise in prop::collection::vec(prop::array::uniform3(-0.5f64..0.5), 5),
            nudge in prop::array::uniform6(-1.0f64..1.0),
        ) {
            let truth = turn(20.0, 3.0, -5.0, [1.0, 2.0, -15.0]);
            let points = [[-40.0, -30.0, 0.0], [45.0, -35.0, 0.0], [5.0, 40.0, 0.0], [0.0, 0.0, 0.0], [40.0, 40.0, 0.0]];
            let pairs: Vec<_> = points
                .iter()
                .zip(&noise)
                .map(|(p, e)| {
                    let p = Point3::<Skin>::new(p[0], p[1], p[2]);
                    let q = truth.apply(p).to_array();
                    (p, Point3::<Robot>::new(q[0] + e[0], q[1] + e[1], q[2] + e[2]))
                })
                .collect();
            let cost = |t: &RigidTransform<Robot, Skin>| -> f64 {
                pairs.iter().map(|(p, q)| t.apply(*p).distance_mm(*q).powi(2)).sum()
            };
            let best = rigid(&pairs).unwrap();
            let [a, b, c, x, y, z] = nudge;
            let small: RigidTransform<Robot, Robot> = {
                let t = turn(a, b, c, [x, y, z]);
                RigidTransform::new(t.rotation, t.translation_mm)
            };
            let mut other = best;
            for i in 0..3 {
                for j in 0..3 {
                    other.rotation[i][j] = (0..3).map(|k| small.rotation[i][k] * best.rotation[k][j]).sum();
                }
                other.translation_mm[i] += small.translation_mm[i];
            }
            prop_assert!(cost(&best) <= cost(&other) + 1e-9);
        }
    }

    #[test]
    fn points_on_a_line_are_detected() {
        let line = [[0.0, 0.0, 0.0], [10.0, 5.0, 1.0], [20.0, 10.0, 2.0]];
        assert!(off_line_mm(&line) < 1e-9);
        let bent = [[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [5.0, 9.0, 0.0]];
        assert!(
            (off_line_mm(&bent) - 6.0).abs() < 1.5,
            "{}",
            off_line_mm(&bent)
        );
    }
}

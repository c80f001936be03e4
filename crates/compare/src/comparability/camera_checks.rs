//! Owns checks of camera observations: idle event rates, calibrated camera positions, and how well their rays determine a position.

use skinrig_model::{Point2, StereoGeometry};

use super::difference::{Difference, Severity, difference};
use crate::locations::{Attempt, Locations};
use crate::subject::Subject;

/// Idle event rates that differ by a larger factor indicate other light or other noise.
const IDLE_FACTOR: f64 = 1.25;
/// Calibrated parameters that differ by more standard errors indicate moved cameras.
const MOVED_SIGMAS: f64 = 4.0;
/// Errors on the skin per error in the image that differ by a larger factor are another measurement. Cameras remounted by 5 mm change
/// them by up to 9 %. Our choice.
const SPREAD_FACTOR: f64 = 1.1;

/// Compares idle event rates, because ambient light itself is not recorded.
pub(super) fn ambient(subjects: &[Subject], locations: &Locations) -> Option<Difference> {
    let idle = |s: &Subject| {
        let rate = |p: &Attempt<'_>| {
            let views = [p.press.views[0]?, p.press.views[1]?];
            let known = views.iter().all(|v| v.idle_s > 0.0);
            known.then(|| views[0].idle_rate_per_s + views[1].idle_rate_per_s)
        };
        let rates: Vec<f64> = locations.attempts(s).filter_map(|p| rate(&p)).collect();
        (!rates.is_empty()).then(|| rates.iter().sum::<f64>() / rates.len() as f64)
    };
    let rates: Option<Vec<f64>> = subjects.iter().map(idle).collect();
    let rates = rates?;
    let (low, high) = rates
        .iter()
        .fold((f64::INFINITY, 0.0f64), |(l, h), r| (l.min(*r), h.max(*r)));
    (high > IDLE_FACTOR * low).then(|| {
        let values = rates
            .iter()
            .map(|r| format!("{:.2} kev/s", r * 1e-3))
            .collect();
        let reason = "light, noise or biases differ; ambient light itself is not recorded";
        difference(
            "ambient",
            "idle event rate",
            Severity::Confounding,
            values,
            reason,
        )
    })
}

/// Compares the calibrated parameters of each skin's first session with those of the first skin.
pub(super) fn cameras(subjects: &[Subject]) -> Vec<Difference> {
    let calibration = |s: &Subject| {
        s.sessions
            .first()
            .and_then(|s| s.analysis.calibration.clone())
    };
    let all: Option<Vec<_>> = subjects.iter().map(calibration).collect();
    let Some(all) = all else { return Vec::new() };
    let Some(first) = all.first() else {
        return Vec::new();
    };
    let moved = |name: &str| {
        let of = |c: &skinrig_analysis::result::CalibrationResult| {
            let i = c.names.iter().position(|n| n == name)?;
            Some((c.values[i], c.standard_errors[i]?))
        };
        let (a, sa) = of(first)?;
        let values: Option<Vec<_>> = all.iter().map(of).collect();
        let values = values?;
        let far = values
            .iter()
            .any(|(b, sb)| (b - a).abs() > MOVED_SIGMAS * libm::hypot(sa, *sb));
        far.then(|| {
            let values = values
                .iter()
                .map(|(v, se)| format!("{v:.2} ± {se:.2}"))
                .collect();
            let what = format!("calibrated {name}");
            let reason = "the cameras stood elsewhere; each session's own calibration absorbs it";
            difference(
                "camera-locations",
                &what,
                Severity::Harmless,
                values,
                reason,
            )
        })
    };
    first.names.iter().filter_map(|n| moved(n)).collect()
}

/// Compares the error of a position for an error of 1° in both viewing angles: what it is, the calibration does not change.
pub(super) fn ray_geometry(subjects: &[Subject], locations: &Locations) -> Option<Difference> {
    let of = |s: &Subject| {
        let geometry = &s.sessions.first()?.analysis.geometry;
        let each = locations.attempts(s);
        let mut all: Vec<f64> = each
            .map(|p| spread_mm(geometry, locations.at(p.location)))
            .collect();
        all.sort_unstable_by(f64::total_cmp);
        all.get(all.len() / 2).copied()
    };
    let spreads: Option<Vec<f64>> = subjects.iter().map(of).collect();
    let spreads = spreads?;
    let (low, high) = spreads
        .iter()
        .fold((f64::INFINITY, 0.0f64), |(l, h), s| (l.min(*s), h.max(*s)));
    (high > SPREAD_FACTOR * low).then(|| {
        let values = spreads.iter().map(|s| format!("{s:.2} mm")).collect();
        let reason = "the cameras' rays meet at other angles or distances, so the same error in the images is another error on the skin";
        difference(
            "camera-geometry",
            "error of a position for 1° in both images",
            Severity::Confounding,
            values,
            reason,
        )
    })
}

/// Standard deviation of a position at `at` for one of 1° in both viewing angles, mm. With distances r1 and r2 and the angle c between the
/// rays, an error e1 of the first angle moves the intersection by r1 e1 / sin c along the second ray, and the other way around.
fn spread_mm(geometry: &StereoGeometry, at: Point2) -> f64 {
    let [one, two] = geometry.cameras.each_ref().map(|camera| {
        let from = camera.position;
        [at.x_mm - from.x_mm, at.y_mm - from.y_mm]
    });
    let squares = |v: [f64; 2]| v[0] * v[0] + v[1] * v[1];
    let sine = (one[0] * two[1] - one[1] * two[0]) / (squares(one) * squares(two)).sqrt();
    ((squares(one) + squares(two)).sqrt() / sine.abs()).to_radians()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_at_a_right_angle_spread_by_their_length() {
        let mut geometry = StereoGeometry::PAPER;
        geometry.cameras[0].position = Point2::new(30.0, 0.0);
        geometry.cameras[1].position = Point2::new(0.0, 40.0);
        let at = Point2::new(0.0, 0.0);
        assert!((spread_mm(&geometry, at) - 50.0f64.to_radians()).abs() < 1e-12);
        // Closer together: the same distances, at 30 degrees.
        geometry.cameras[1].position = Point2::new(40.0 * 0.75f64.sqrt(), 20.0);
        assert!((spread_mm(&geometry, at) - 100.0f64.to_radians()).abs() < 1e-12);
    }
}

//! Owns checks of camera observations: idle event rates and calibrated camera positions.

use super::difference::{Difference, Severity, difference};
use crate::locations::{Attempt, Locations};
use crate::subject::Subject;

/// Idle event rates that differ by a larger factor indicate other light or other noise.
const IDLE_FACTOR: f64 = 1.25;
/// Calibrated parameters that differ by more standard errors indicate moved cameras.
const MOVED_SIGMAS: f64 = 4.0;

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

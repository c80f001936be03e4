//! Law: a camera clock aligns with the host clock, and its drift is plausible for a crystal.

use skinrig_model::CameraId;

use super::finding::finding;
use super::statistics::median;
use crate::input::SessionInput;
use crate::result::{Analysis, Evidence, Fault, Finding, Law, RateSeries};

/// Largest plausible rate difference between two clocks, ppm: the tolerance of Ethernet crystals (IEEE 802.3, 100BASE-X: 125
/// MHz within 100 ppm). Board crystals are specified within 10 to 50 ppm, so even two at opposite extremes are below this.
pub(crate) const MAX_DRIFT_PPM: f64 = 100.0;
/// A drift exceeds the bound if the excess is more than this many standard errors.
const SIGMAS: f64 = 3.0;
/// Minimum number of presses with times for an alignment (`clock::fit_rates`).
const MIN_PRESSES: usize = 4;

pub(super) fn findings(input: &SessionInput, analysis: &Analysis) -> Vec<Finding> {
    let timed = input
        .outcomes
        .iter()
        .flatten()
        .filter(|o| o.timing.is_some());
    let timed = timed.count();
    let judge = |camera: CameraId| -> Option<Finding> {
        let Some(fit) = analysis.clocks[camera.index()] else {
            // Too few presses are not a clock fault.
            if timed < MIN_PRESSES {
                return None;
            }
            let fault = if has_bursts(&analysis.rates[camera.index()]) {
                Fault::ClockWrong
            } else {
                Fault::CameraBlind
            };
            let evidence = Evidence::NoAlignment {
                presses: timed,
                camera,
            };
            return Some(finding(Law::ClockDrift, fault, Some(camera), evidence));
        };
        let (size, error) = (fit.drift_ppm.abs(), fit.drift_se_ppm);
        // With three points the error of the line is unknown, and `NaN` is not evidence.
        (size - SIGMAS * error > MAX_DRIFT_PPM).then(|| {
            let evidence = Evidence::ClockDrift {
                camera,
                limit_ppm: MAX_DRIFT_PPM,
                drift_ppm: fit.drift_ppm,
                error_ppm: error,
                n: fit.n,
            };
            finding(Law::ClockDrift, Fault::ClockWrong, Some(camera), evidence)
        })
    };
    CameraId::ALL.into_iter().filter_map(judge).collect()
}

/// True if the busiest hundredth of the session exceeds the median by more than Poisson noise.
pub(crate) fn has_bursts(series: &RateSeries) -> bool {
    let counts = series
        .mean_per_s
        .iter()
        .map(|r| f64::from(*r) * series.bin_s);
    let mut counts: Vec<f64> = counts.collect();
    let Some(usual) = median(counts.clone()) else {
        return false;
    };
    let busy = crate::metrics::quantile(&mut counts, 0.99).unwrap_or(usual);
    busy > usual + 6.0 * (usual + 1.0).sqrt()
}

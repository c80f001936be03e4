//! Fits the clock to the presses themselves, by finding the planned rhythm in the event rates.
//!
//! No start time is needed. The search has four steps:
//! 1. Scale the rate (10 ms bins) to an *activity* between 0 (idle) and 1 (as busy as presses).
//! 2. Apply a matched filter at every offset: expected press spans against the mean activity around them, for a few drifts
//!    up to 200 ppm, so that hours of presses line up.
//! 3. Refine offset and drift robustly by each press's lag against the session's mean press. Put the onset of the mean press
//!    at the measured contacts.
//! 4. Score every other alignment: all bursts of both cameras, planned or not, against the plan at every shift. Use the
//!    likeliest pair of shifts and state its odds against all others together.

use super::NO_TIME_US;
use super::activity::Activity;
use super::bursts::Bursts;
use super::error::RatesError;
use super::line::Line;
use super::refine::{UNKNOWN_DRIFT, refine};
use super::search::{MAX_DRIFT, Map, first_map};
use super::shifts::{SAME_US, ShiftChoice, choose};
use super::span::PressSpan;
use super::tally::Plan;
use crate::rates::RateHistogram;
use crate::result::{ClockFit, ClockMethod, RatesDetections, RatesEvidence, WarningCause};

/// Clock of one camera from event rates, with its warnings.
#[derive(Debug, Clone, PartialEq)]
pub struct RatesFit {
    /// The fit.
    pub fit: ClockFit,
    /// Warnings about this camera.
    pub warnings: Vec<WarningCause>,
}

/// The clocks of both cameras from event rates.
#[derive(Debug, Clone, PartialEq)]
pub struct RatesAlignment {
    /// Per requested camera: its clock, or why there is none.
    pub cameras: [Option<Result<RatesFit, RatesError>>; 2],
    /// Certainty of the alignment; `None` without any clock.
    pub evidence: Option<RatesEvidence>,
}

/// Longest session to search, bins (46 hours of 10 ms).
const MAX_BINS: f64 = 16_777_216.0;
/// Lags with a larger scatter are suspicious, µs.
const SUSPICIOUS_RMS_US: f64 = 40_000.0;
/// Maximum iterations: the choice among all shifts is repeated from its own result.
const ROUNDS: usize = 3;

/// Finds the clocks of both cameras, or of one, from their rate histograms and the presses in time order. Both are scored
/// together, because their bursts coincide, planned or not.
#[must_use]
pub fn align_by_rates(rates: [Option<&RateHistogram>; 2], presses: &[PressSpan]) -> RatesAlignment {
    let (first, second) = rayon::join(
        || rates[0].map(|r| Camera::new(r, presses)),
        || rates[1].map(|r| Camera::new(r, presses)),
    );
    let mut cameras = [first, second];
    let plan = Plan::new(presses);
    let mut choice: Option<ShiftChoice> = None;
    for _ in 0..ROUNDS {
        let trains = [0, 1].map(|k| match &cameras[k] {
            Some(Ok(camera)) => Some(Bursts::new(&camera.activity, presses, camera.map)),
            _ => None,
        });
        if trains.iter().all(Option::is_none) {
            break;
        }
        match choose(&plan, [trains[0].as_ref(), trains[1].as_ref()]) {
            Ok(found) => choice = Some(found),
            Err(why) => {
                cameras = cameras.map(|c| c.map(|_| Err(why)));
                choice = None;
                break;
            }
        }
        let shift_us = choice.map_or([0.0; 2], |c| c.shift_us);
        let mut settled = true;
        for (camera, shift_us) in cameras.iter_mut().zip(shift_us) {
            if let Some(Ok(found)) = camera
                && shift_us.abs() > SAME_US
            {
                settled = false;
                if let Err(why) = found.shift(presses, shift_us) {
                    *camera = Some(Err(why));
                }
            }
        }
        if settled {
            break;
        }
    }
    let sights = |k: usize| {
        let tally = choice?.tally;
        matches!(cameras[k], Some(Ok(_))).then_some(RatesDetections {
            expected: tally.expected[k],
            found: tally.found[k],
            unexplained: tally.unexplained[k],
            strays: tally.strays[k],
        })
    };
    let evidence = choice.map(|choice| RatesEvidence {
        log_odds: choice.log_odds,
        runner_up_s: choice
            .runner_up_us
            .map(|other| [0, 1].map(|k| (other[k] - choice.shift_us[k]) * 1e-6)),
        period_s: plan.period_us() * 1e-6,
        cameras: [sights(0), sights(1)],
    });
    RatesAlignment {
        cameras: cameras.map(|c| c.map(|c| c.map(|c| c.result(presses)))),
        evidence,
    }
}

/// Finds the clock of one camera alone: see [`align_by_rates`].
///
/// # Errors
/// Why no alignment was found.
pub fn fit_rates(
    rates: &RateHistogram,
    presses: &[PressSpan],
) -> Result<(RatesFit, RatesEvidence), RatesError> {
    let found = align_by_rates([Some(rates), None], presses);
    let [first, _] = found.cameras;
    match (first, found.evidence) {
        (Some(Ok(fit)), Some(evidence)) => Ok((fit, evidence)),
        (Some(Err(why)), _) => Err(why),
        _ => Err(RatesError::NoBursts),
    }
}

/// One camera and the present estimate of its clock.
struct Camera {
    start_us: f64,
    activity: Activity,
    map: Map,
    line: Line,
}

impl Camera {
    /// An alignment that may still be off by whole periods.
    fn new(rates: &RateHistogram, presses: &[PressSpan]) -> Result<Self, RatesError> {
        if presses.len() < 4 {
            return Err(RatesError::FewPresses {
                found: presses.len(),
            });
        }
        let span_us = presses[presses.len() - 1].release_us - presses[0].contact_us;
        if !(0.0..=MAX_BINS * rates.bin_us() as f64).contains(&span_us) {
            return Err(RatesError::Span {
                span_s: span_us * 1e-6,
            });
        }
        if rates.start_us() >= NO_TIME_US {
            return Err(RatesError::BrokenTimeBase {
                start_us: rates.start_us(),
            });
        }
        let activity = Activity::new(rates, presses)?;
        let map = first_map(&activity, presses, 0.0);
        let (mut map, mut line) = refine(&activity, presses, map)?;
        if line.drift.abs() > MAX_DRIFT {
            // The refined drift differs from the first search by more than the lags allow: search again around it.
            map = first_map(&activity, presses, line.drift);
            (map, line) = refine(&activity, presses, map)?;
        }
        Ok(Self {
            start_us: rates.start_us() as f64,
            activity,
            map,
            line,
        })
    }

    /// Shifts the presses to later times and refines the clock there.
    fn shift(&mut self, presses: &[PressSpan], shift_us: f64) -> Result<(), RatesError> {
        self.map.offset_us += shift_us * (1.0 + self.map.drift);
        (self.map, self.line) = refine(&self.activity, presses, self.map)?;
        Ok(())
    }

    fn result(self, presses: &[PressSpan]) -> RatesFit {
        let Self { map, line, .. } = &self;
        let mut warnings = Vec::new();
        if line.drift_se > UNKNOWN_DRIFT {
            warnings.push(WarningCause::DriftUnknown {
                drift_ppm: line.drift * 1e6,
                standard_error_ppm: line.drift_se * 1e6,
            });
        }
        if line.rms_us > SUSPICIOUS_RMS_US {
            let rms_ms = line.rms_us * 1e-3;
            warnings.push(WarningCause::PressesScatter { rms_ms });
        }
        let n = line.n() as u32;
        RatesFit {
            fit: ClockFit {
                method: ClockMethod::EventRates,
                offset_us: self.start_us + map.offset_us,
                drift_ppm: map.drift * 1e6,
                drift_se_ppm: line.drift_se * 1e6,
                residual_rms_us: line.rms_us,
                residual_max_us: line.max_us,
                n,
                rejected: presses.len() as u32 - n,
            },
            warnings,
        }
    }
}

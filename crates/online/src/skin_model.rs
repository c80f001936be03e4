//! Everything learnt from the calibration presses of a session, as a plain value for the process that feels touches.

use serde::{Deserialize, Serialize};
use skinrig_analysis::locator::{FittedLocator, LocatorModelError};
use skinrig_analysis::result::{ClockFit, HotPixels, LocatorResult};
use skinrig_model::{AnalysisSettings, SkinOutline, StereoGeometry};

use crate::depth::DepthModel;
use crate::model::TouchModel;
use crate::position::PositionEstimator;
use crate::settling::Settling;

/// Model of a skin, learnt from the calibration presses of a session.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SkinModel {
    pub(crate) settings: AnalysisSettings,
    pub(crate) outline: SkinOutline,
    pub(crate) geometry: StereoGeometry,
    pub(crate) locator: Option<LocatorResult>,
    /// Pixels of each camera that do not count for positions.
    pub(crate) hot_pixels: [HotPixels; 2],
    /// Clock of each camera.
    pub(crate) clocks: [ClockFit; 2],
    pub(crate) touches: TouchModel,
    /// Threshold of the detector, nats.
    pub(crate) threshold: f64,
    /// How far positions still move; `None` if the presses are too few for regions.
    pub(crate) settling: Option<Settling>,
    /// How deep touches are; `None` if the depth of the presses was not measured, or they are too few.
    pub(crate) depths: Option<DepthModel>,
    /// The longest window of a press, µs: later events of a touch do not count for its position, they would add only noise.
    pub(crate) longest_window_us: Option<i64>,
    /// Idle time behind the threshold, s.
    pub(crate) idle_s: f64,
    /// Middle of the presses behind the clock fits, host µs.
    pub(crate) clocks_at_us: f64,
}

impl SkinModel {
    pub(crate) fn positions(&self) -> Result<PositionEstimator, LocatorModelError> {
        let locator = FittedLocator::restored(self.locator.as_ref(), self.geometry)?;
        Ok(PositionEstimator::with(
            &self.settings,
            &self.hot_pixels,
            locator,
            self.outline,
        ))
    }

    /// The same for a recording of the skin that is played this much faster (at least 1).
    #[must_use]
    pub fn played_faster(&self, factor: f64) -> Self {
        let faster = |fit: ClockFit| ClockFit {
            offset_us: fit.offset_us / factor,
            ..fit
        };
        Self {
            clocks: self.clocks.map(faster),
            longest_window_us: self.longest_window_us.map(|us| (us as f64 / factor) as i64),
            touches: self.touches.thinned(factor),
            ..self.clone()
        }
    }

    /// Clock fit of each camera.
    #[must_use]
    pub const fn clocks(&self) -> &[ClockFit; 2] {
        &self.clocks
    }

    /// Standard deviation of host times made from the cameras', at this host time, µs: of the fits' offsets, and of their rates with
    /// the time since the presses behind them; the worse camera counts.
    #[must_use]
    pub fn time_sd_us(&self, at_us: f64) -> f64 {
        let of = |fit: &ClockFit| {
            let offset = fit.residual_rms_us / libm::sqrt(fit.n.max(1) as f64);
            libm::hypot(
                offset,
                1e-6 * fit.drift_se_ppm * (at_us - self.clocks_at_us),
            )
        };
        of(&self.clocks[0]).max(of(&self.clocks[1]))
    }

    /// Threshold of the detector, nats.
    #[must_use]
    pub const fn threshold(&self) -> f64 {
        self.threshold
    }

    /// Idle time behind the threshold, s.
    #[must_use]
    pub const fn idle_s(&self) -> f64 {
        self.idle_s
    }

    /// Number of places at which a touch is known.
    #[must_use]
    pub fn places(&self) -> usize {
        self.touches.places()
    }

    /// Events per second of both cameras on an idle skin.
    #[must_use]
    pub fn idle_per_s(&self) -> f64 {
        self.touches.idle_per_s()
    }

    /// Whether positions have regions.
    #[must_use]
    pub const fn has_regions(&self) -> bool {
        self.settling.is_some()
    }

    /// Whether touches have depths.
    #[must_use]
    pub const fn has_depths(&self) -> bool {
        self.depths.is_some()
    }

    /// Whether touches away from the calibration presses have depths.
    #[must_use]
    pub fn has_depths_elsewhere(&self) -> bool {
        let depths = self.depths.as_ref();
        depths.is_some_and(DepthModel::is_known_elsewhere)
    }
}

#[cfg(test)]
impl SkinModel {
    /// A skin with these touches, and a locator of nominal rays.
    pub(crate) fn nominal(touches: TouchModel, clocks: [ClockFit; 2], threshold: f64) -> Self {
        Self {
            settings: AnalysisSettings::default(),
            outline: SkinOutline::PAPER,
            geometry: StereoGeometry::PAPER,
            locator: None,
            hot_pixels: Default::default(),
            clocks,
            touches,
            threshold,
            settling: None,
            depths: None,
            longest_window_us: None,
            idle_s: 10.0,
            clocks_at_us: 0.0,
        }
    }
}

//! Training data of the detector: calibration presses and the idle times between them, never scored presses.

use skinrig_analysis::Analysis;
use skinrig_analysis::result::{ClockFit, PressResult};
use skinrig_model::{AnalysisSettings, CameraId, PressId, PressRole, Verdict, WindowAnchor};

/// A press without a camera clock or without enough calibration presses to learn from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum TrainingError {
    /// No clock.
    #[error("{0} has no clock fit: there is no common time to detect touches in")]
    NoClock(CameraId),
    /// Too few presses.
    #[error(
        "expected at least {least} valid calibration presses that another one follows (idle time beside scored presses teaches \
         nothing), found {found}; where roles alternate from press to press there are none"
    )]
    FewPresses {
        /// Number found.
        found: usize,
        /// Number needed.
        least: usize,
    },
    /// Too few idle seconds for a false-alarm rate.
    #[error(
        "expected at least {least_s} s of idle time between calibration presses, found {found_s}"
    )]
    ShortIdle {
        /// Whole seconds found.
        found_s: u64,
        /// Seconds needed.
        least_s: u64,
    },
}

/// Fewest presses to learn from.
const LEAST_PRESSES: usize = 8;

/// A calibration press. Times: host, µs.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TrainingPress {
    pub press: PressId,
    pub at: [f64; 2],
    pub location: u32,
    pub columns: [Option<f64>; 2],
    pub contact_us: f64,
    pub at_depth_us: f64,
    pub release_us: f64,
    /// Contact of the next press if that is in the training too.
    pub next_contact_us: Option<f64>,
}

/// Calibration presses of an analysis with the clocks of its cameras.
#[derive(Debug, Clone, PartialEq)]
pub struct Training {
    pub(crate) clocks: [ClockFit; 2],
    /// In order of time.
    pub(crate) presses: Vec<TrainingPress>,
}

fn training_press(row: &PressResult) -> Option<TrainingPress> {
    let (timing, truth) = (row.timing?, row.truth?);
    let us = |t: skinrig_model::HostTime| t.0 as f64 * 1e-3;
    Some(TrainingPress {
        press: row.press,
        at: [truth.x_mm, truth.y_mm],
        location: row.location.index(),
        columns: [0, 1].map(|k| row.views[k].and_then(|v| v.centroid_u)),
        contact_us: us(timing.contact),
        at_depth_us: us(timing.at_depth),
        release_us: us(timing.release),
        next_contact_us: None,
    })
}

impl Training {
    /// The valid calibration and sync presses of an analysis.
    ///
    /// # Errors
    /// [`TrainingError`] without a clock for both cameras, or with too few presses.
    pub fn of(analysis: &Analysis) -> Result<Self, TrainingError> {
        let clock = |camera: CameraId| {
            let fit = analysis.clocks[camera.index()];
            fit.ok_or(TrainingError::NoClock(camera))
        };
        let clocks = [clock(CameraId::One)?, clock(CameraId::Two)?];
        // Positions in the plan, so that no scored or failed press lies between two that follow each other.
        let mut rows: Vec<(usize, TrainingPress)> = Vec::new();
        for (row, press) in analysis.presses.iter().enumerate() {
            let usable = press.role != PressRole::Score && press.verdict == Verdict::Valid;
            rows.extend(training_press(press).filter(|_| usable).map(|p| (row, p)));
        }
        rows.sort_by(|a, b| a.1.contact_us.total_cmp(&b.1.contact_us));
        for i in 1..rows.len() {
            let (next, contact_us) = (rows[i].0, rows[i].1.contact_us);
            let (row, press) = &mut rows[i - 1];
            press.next_contact_us = (next == *row + 1).then_some(contact_us);
        }
        let presses: Vec<TrainingPress> = rows.into_iter().map(|(_, press)| press).collect();
        let found = presses.iter().filter(|p| p.gap_us().is_some()).count();
        if found < LEAST_PRESSES {
            let least = LEAST_PRESSES;
            return Err(TrainingError::FewPresses { found, least });
        }
        Ok(Self { clocks, presses })
    }

    /// Clock fit of each camera.
    #[must_use]
    pub const fn clocks(&self) -> &[ClockFit; 2] {
        &self.clocks
    }

    /// Time in the middle of the presses, host µs.
    pub(crate) fn middle_us(&self) -> f64 {
        let first = self.presses.first().map_or(0.0, |p| p.contact_us);
        0.5 * (first + self.end_us())
    }

    /// The longest window of a press, µs; `None` if windows lie about the middle of the presses.
    pub(crate) fn longest_window_us(&self, settings: &AnalysisSettings) -> Option<i64> {
        let each = self.presses.iter().map(|p| p.window_us(settings));
        let longest = each.max_by(f64::total_cmp)?;
        (settings.window_anchor == WindowAnchor::Touch).then_some(longest as i64)
    }

    /// End of the last press, host µs.
    #[must_use]
    pub fn end_us(&self) -> f64 {
        let ends = self.presses.iter().map(|p| p.release_us);
        ends.fold(f64::NEG_INFINITY, f64::max)
    }
}

/// Time around a press that belongs to it, µs.
pub(crate) const MARGIN_US: f64 = 20e3;

impl TrainingPress {
    /// Length of its window after the contact, µs: to the release, or as far as the settings let it reach.
    fn window_us(&self, settings: &AnalysisSettings) -> f64 {
        let after_contact = settings.window_after_contact_ms;
        let after_contact_us = after_contact.map_or(f64::INFINITY, |ms| ms * 1e3);
        let after_depth_us = settings.window_after_depth_ms * 1e3;
        (self.release_us - self.contact_us + settings.window_after_ms * 1e3)
            .min(self.at_depth_us - self.contact_us + after_depth_us)
            .min(after_contact_us)
    }

    /// Time between this press and the next, host µs; `None` if the next one is unknown.
    pub(crate) fn gap_us(&self) -> Option<(f64, f64)> {
        let gap = (
            self.release_us + MARGIN_US,
            self.next_contact_us? - MARGIN_US,
        );
        (gap.1 > gap.0).then_some(gap)
    }

    /// Its last 40 %, in which the release has faded most.
    pub(crate) fn idle_us(&self) -> Option<(f64, f64)> {
        let (from, to) = self.gap_us()?;
        Some((from + 0.6 * (to - from), to))
    }
}

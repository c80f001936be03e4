//! Separates calibration presses and scored presses by type.
//!
//! A [`CalibrationSet`] can only be built from presses with the calibration role, a [`ScoreSet`] only from presses with the
//! score role. Calibration takes the former and metrics the latter, so that no press can do both.

use skinrig_model::{Point2, PressId, PressOutcome, PressRole, PressVerdict, Verdict};

use crate::locator::Features;
use crate::result::PressResult;

/// Data of one press for the calibration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CalibrationPress {
    /// Press.
    pub press: PressId,
    /// Index of its location, for grouping.
    pub location: u32,
    /// Index of its repetition.
    pub repetition: u32,
    /// Centroid column in each camera, px.
    pub columns: [f64; 2],
    /// Standard deviations of the columns and rows of the clustered events in each camera, px.
    pub spreads: [Option<[f64; 2]>; 2],
    /// Measured position.
    pub truth: Point2,
    /// Number of clustered events in the weaker camera.
    pub cluster_events: u32,
}

/// Calibration presses: seen by both cameras, truth measured, not missed, invalid or excluded.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CalibrationSet(Vec<CalibrationPress>);

impl CalibrationSet {
    /// Selects the usable calibration presses of the table, independent of where the rays of an uncalibrated geometry meet.
    #[must_use]
    pub fn from_presses(presses: &[PressResult]) -> Self {
        let usable = presses
            .iter()
            .filter(|p| p.role == PressRole::Calibrate && is_valid(p));
        Self(
            usable
                .filter_map(|p| {
                    let features = Features::of_press(p)?;
                    Some(CalibrationPress {
                        press: p.press,
                        location: p.location.index(),
                        repetition: p.repetition.index(),
                        columns: features.columns,
                        spreads: features.spreads,
                        truth: p.truth?,
                        cluster_events: features.cluster_events,
                    })
                })
                .filter(|s| {
                    let numbers = [s.columns[0], s.columns[1], s.truth.x_mm, s.truth.y_mm];
                    numbers.iter().all(|n| n.is_finite())
                })
                .collect(),
        )
    }

    /// Presses, in plan order.
    #[must_use]
    pub fn sights(&self) -> &[CalibrationPress] {
        &self.0
    }

    /// The presses at these indices of [`Self::sights`].
    #[must_use]
    pub(crate) fn part(&self, rows: &[usize]) -> Self {
        Self(rows.iter().map(|i| self.0[*i]).collect())
    }
}

/// An attempted scored press.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScoredPress {
    /// Press.
    pub press: PressId,
    /// Index of its location, for grouping.
    pub location: u32,
    /// Planned depth, mm.
    pub depth_mm: f64,
    /// Measured position, or planned position if not measured.
    pub at: Point2,
    /// True if neither invalid nor excluded.
    pub valid: bool,
    /// Estimate and error vector (estimate - truth, mm), if both exist.
    pub found: Option<(Point2, [f64; 2])>,
}

/// Attempted scored presses, whatever their result, except those that the journal excludes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ScoreSet(Vec<ScoredPress>);

impl ScoreSet {
    /// True if any press has an estimate that does not count.
    #[must_use]
    pub(crate) fn excludes_estimates(&self) -> bool {
        self.0.iter().any(|p| !p.valid && p.found.is_some())
    }

    /// Selects the attempted scored presses of the table. `journal` holds the outcomes of the same presses: its exclusions
    /// were decided before the data were seen, and say nothing about the skin.
    #[must_use]
    pub fn from_presses(presses: &[PressResult], journal: &[Option<PressOutcome>]) -> Self {
        let left_out = |outcome: Option<&PressOutcome>| {
            outcome.is_some_and(|o| matches!(o.verdict, PressVerdict::Excluded(_)))
        };
        let attempted = presses
            .iter()
            .enumerate()
            .filter(|(i, _)| !left_out(journal.get(*i).and_then(Option::as_ref)))
            .map(|(_, p)| p)
            .filter(|p| p.role == PressRole::Score && p.verdict != Verdict::Missed);
        Self(
            attempted
                .map(|p| ScoredPress {
                    press: p.press,
                    location: p.location.index(),
                    depth_mm: p.depth_mm,
                    at: p.truth.unwrap_or(p.planned),
                    valid: is_valid(p),
                    found: p
                        .estimate()
                        .zip(p.error_mm())
                        .map(|(at, (dx, dy))| (at, [dx, dy])),
                })
                .collect(),
        )
    }

    /// Distinct planned depths, mm, shallowest first.
    #[must_use]
    pub fn depths_mm(&self) -> Vec<f64> {
        let mut depths: Vec<f64> = self.0.iter().map(|p| p.depth_mm).collect();
        depths.sort_by(f64::total_cmp);
        depths.dedup();
        depths
    }

    /// Presses planned at this depth.
    #[must_use]
    pub fn at_depth(&self, depth_mm: f64) -> Self {
        let same_depth = self.0.iter().filter(|p| p.depth_mm == depth_mm);
        Self(same_depth.copied().collect())
    }

    /// Presses, in plan order.
    #[must_use]
    pub fn presses(&self) -> &[ScoredPress] {
        &self.0
    }
}

fn is_valid(press: &PressResult) -> bool {
    press.verdict == Verdict::Valid
}

//! Presses that calibrate and presses that score, kept apart by type.
//!
//! A [`CalibrationSet`] can only be built from presses whose role is to calibrate, a [`ScoreSet`] only from
//! those whose role is to score. The calibration takes the one and the metrics the other, so that no press can
//! ever do both.

use skinrig_model::{Point2, PressId, PressOutcome, PressRole, PressVerdict};

use crate::result::PressResult;

/// What the calibration needs of one press.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sight {
    /// Which press.
    pub press: PressId,
    /// Index of its location: a label to group by.
    pub location: u32,
    /// Centroid column in each camera, px.
    pub columns: [f64; 2],
    /// The measured position.
    pub truth: Point2,
    /// Clustered events of the camera that has fewer.
    pub cluster_events: u32,
}

/// Presses that calibrate: seen by both cameras, truth measured, not missed, invalid or excluded.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CalibrationSet(Vec<Sight>);

impl CalibrationSet {
    /// Takes the usable calibrating presses out of the table; where the rays of an uncalibrated geometry meet
    /// plays no part.
    #[must_use]
    pub fn from_presses(presses: &[PressResult]) -> Self {
        let usable = presses
            .iter()
            .filter(|p| p.role == PressRole::Calibrate && is_valid(p));
        Self(
            usable
                .filter_map(|p| {
                    let [one, two] = p.views;
                    let (one, two) = (one?, two?);
                    Some(Sight {
                        press: p.press,
                        location: p.location.index(),
                        columns: [one.centroid_u?, two.centroid_u?],
                        truth: p.truth?,
                        cluster_events: one.cluster_events.min(two.cluster_events),
                    })
                })
                .filter(|s| {
                    let numbers = [s.columns[0], s.columns[1], s.truth.x_mm, s.truth.y_mm];
                    numbers.iter().all(|n| n.is_finite())
                })
                .collect(),
        )
    }

    /// The presses, in plan order.
    #[must_use]
    pub fn sights(&self) -> &[Sight] {
        &self.0
    }
}

/// One attempted press that scores.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scored {
    /// Which press.
    pub press: PressId,
    /// Index of its location: a label to group by.
    pub location: u32,
    /// Planned depth, mm.
    pub depth_mm: f64,
    /// The measured position, the planned one where none was measured.
    pub at: Point2,
    /// Neither invalid nor excluded.
    pub valid: bool,
    /// Estimate and error vector (estimate - truth, mm), when both exist.
    pub found: Option<(Point2, [f64; 2])>,
}

/// Presses that score and were attempted, whatever became of them, but for those that the journal leaves out.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ScoreSet(Vec<Scored>);

impl ScoreSet {
    /// Whether a press has an estimate that does not count.
    #[must_use]
    pub(crate) fn excludes_estimates(&self) -> bool {
        self.0.iter().any(|p| !p.valid && p.found.is_some())
    }

    /// Takes the attempted scored presses out of the table. `journal` holds the outcomes of the same presses: what
    /// it excludes was left out before anybody looked at the data, and says nothing about the skin.
    #[must_use]
    pub fn from_presses(presses: &[PressResult], journal: &[Option<PressOutcome>]) -> Self {
        let missed = PressVerdict::Missed(String::new());
        let left_out = |outcome: Option<&PressOutcome>| {
            outcome.is_some_and(|o| matches!(o.verdict, PressVerdict::Excluded(_)))
        };
        let attempted = presses
            .iter()
            .enumerate()
            .filter(|(i, _)| !left_out(journal.get(*i).and_then(Option::as_ref)))
            .map(|(_, p)| p)
            .filter(|p| p.role == PressRole::Score && p.verdict != missed.name());
        Self(
            attempted
                .map(|p| Scored {
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

    /// The planned depths, mm, shallowest first, each once.
    #[must_use]
    pub fn depths_mm(&self) -> Vec<f64> {
        let mut depths: Vec<f64> = self.0.iter().map(|p| p.depth_mm).collect();
        depths.sort_by(f64::total_cmp);
        depths.dedup();
        depths
    }

    /// The presses planned at this depth.
    #[must_use]
    pub fn at_depth(&self, depth_mm: f64) -> Self {
        let here = self.0.iter().filter(|p| p.depth_mm == depth_mm);
        Self(here.copied().collect())
    }

    /// The presses, in plan order.
    #[must_use]
    pub fn presses(&self) -> &[Scored] {
        &self.0
    }
}

fn is_valid(press: &PressResult) -> bool {
    press.verdict == PressVerdict::Valid.name()
}

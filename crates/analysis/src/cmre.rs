//! Contact map reconstruction error: difference between a map of the estimated contact and that of the true one.
//!
//! The definition is that of the public code (function `compute_CMRE`, which nothing there calls). The skin's
//! enclosing rectangle is cut into square cells; the estimate becomes a map `R = exp(-d² / 2 sigma²)`, d from each
//! cell's centre, scaled to a maximum of 1; the truth becomes a map `T` that is 1 in its own cell and 0 elsewhere. With
//! `C = tanh(3.5 (R - T)²)` and `D` the distance from the true cell in cells, the score is `C` of the true cell minus
//! the sum of `C / ((SR / 35)² + D²)` over all others. Cell, sigma and SR are not published.
//!
//! Interpret the score with care. At SR = cell = 5 mm and sigma = 1 mm it is 0 at the centre of the true cell, 0.02 one
//! whole cell away, 0.75 two cells away and 0.998 far off: beyond the first it counts cells rather than millimetres. It is
//! *negative* wherever the map is bright outside the true cell without being dark in it: -0.98 for an estimate on the edge
//! to the next cell, and below -1 when sigma is as large as a cell. Negative scores lower the mean, so a percentage of this
//! measure is not a share of anything; `Metrics::rmse_diagonal_percent` is.
//!
//! Two results of the public code are not reproduced: it moves a truth off the map into the nearest border cell, which has
//! no score here; and far off the map its R underflows to an empty map (score 0.99818), while here the maximum is always 1
//! (0.99202 in the same position).

use skinrig_model::{CmreSettings, Point2, PressRole, SkinOutline, Verdict};
use skinrig_settings::Settings;

use crate::error::AnalysisError;
use crate::metrics::mean_over_locations;
use crate::result::{Analysis, Cmre, Estimate};

/// Gain of the difference between the maps (public code).
const GAIN: f64 = 3.5;
/// Divisor of SR in the weights (public code).
const SR_DIVISOR: f64 = 35.0;
/// Cells along the longer side of a map, at most.
const MAX_CELLS: f64 = 200.0;
/// Where `ln R` is below this, `3.5 R²` is below 1e-34 and adds nothing.
const DARK: f64 = -40.0;

/// Contact map reconstruction error over the counting scored presses; `None` if the settings define no map.
#[must_use]
pub fn cmre(analysis: &Analysis) -> Option<Cmre> {
    let settings = &analysis.settings;
    let map = ContactMap::new(&analysis.rig.outline, &settings.cmre).ok()?;
    let counting = analysis
        .presses
        .iter()
        .filter(|p| p.role == PressRole::Score && p.verdict == Verdict::Valid);
    let pairs = counting.filter_map(|p| Some((p.location.index(), p.estimate()?, p.truth?)));
    let (mut scores, mut without_score) = (Vec::new(), 0);
    for (location, estimate, truth) in pairs {
        match map.score(estimate, truth) {
            Some(score) => scores.push((location, 100.0 * score)),
            None => without_score += 1,
        }
    }
    let percent: Estimate =
        mean_over_locations(&scores, settings.bootstrap_resamples, settings.seed);
    Some(Cmre {
        settings: settings.cmre,
        cells: map.cells,
        percent,
        without_score,
    })
}

/// Cells of a contact map, and their weights.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactMap {
    /// Corner with the smallest coordinates.
    corner: Point2,
    /// Extent of the rectangle, mm.
    extent_mm: (f64, f64),
    cell_mm: f64,
    sigma_mm: f64,
    sr_mm: f64,
    /// Cells along x and y; the last ones extend beyond a side that is not a multiple of the cell.
    cells: (u32, u32),
}

impl ContactMap {
    /// The map over the rectangle that encloses `outline`.
    ///
    /// # Errors
    /// When a parameter is not a positive number, or there are more than 200 cells along the longer side.
    pub fn new(outline: &SkinOutline, settings: &CmreSettings) -> Result<Self, AnalysisError> {
        let wrong = |key: &str, expected: &str, found: String| AnalysisError::Setting {
            name: format!("cmre.{key}"),
            expected: expected.to_owned(),
            found,
        };
        if let Some(out) = settings.out_of_range() {
            return Err(wrong(&out.key, &out.expected, out.found));
        }
        let CmreSettings {
            cell_mm,
            sigma_mm,
            sr_mm,
        } = *settings;
        let extent_mm = (outline.width_mm, outline.height_mm);
        let along = |side: f64| (side / cell_mm).ceil();
        let most = along(extent_mm.0).max(along(extent_mm.1));
        if !(1.0..=MAX_CELLS).contains(&most) {
            let expected = "a cell that fits at most 200 times along the skin";
            return Err(wrong("cell", expected, format!("{cell_mm} mm")));
        }
        Ok(Self {
            corner: Point2::new(
                outline.centre.x_mm - extent_mm.0 / 2.0,
                outline.centre.y_mm - extent_mm.1 / 2.0,
            ),
            extent_mm,
            cell_mm,
            sigma_mm,
            sr_mm,
            cells: (along(extent_mm.0) as u32, along(extent_mm.1) as u32),
        })
    }

    /// Score of an estimate, 0 for a perfect one (see the module's description for other values); `None` if the truth is off
    /// the map or the estimate is not a point.
    #[must_use]
    pub fn score(&self, estimate: Point2, truth: Point2) -> Option<f64> {
        if !(estimate.x_mm.is_finite() && estimate.y_mm.is_finite()) {
            return None;
        }
        let true_cell = (
            self.cell_of(truth.x_mm - self.corner.x_mm, self.extent_mm.0)?,
            self.cell_of(truth.y_mm - self.corner.y_mm, self.extent_mm.1)?,
        );
        let squares = |from: f64, to: f64, count: u32| -> Vec<f64> {
            let centre = |i| from + (f64::from(i) + 0.5) * self.cell_mm;
            (0..count).map(|i| (centre(i) - to).powi(2)).collect()
        };
        let dx = squares(self.corner.x_mm, estimate.x_mm, self.cells.0);
        let dy = squares(self.corner.y_mm, estimate.y_mm, self.cells.1);
        let least = |d: &[f64]| d.iter().copied().fold(f64::INFINITY, f64::min);
        let nearest = (least(&dx), least(&dy));
        let edge = (self.sr_mm / SR_DIVISOR).powi(2);
        let difference = |c: f64| libm::tanh(GAIN * c * c);
        let mut score = 0.0;
        for (i, x) in (0..).zip(&dx) {
            for (j, y) in (0..).zip(&dy) {
                let beyond = (x - nearest.0) + (y - nearest.1);
                let log = -beyond / (2.0 * self.sigma_mm * self.sigma_mm);
                let brightness = if log < DARK { 0.0 } else { libm::exp(log) };
                if (i, j) == true_cell {
                    score += difference(brightness - 1.0);
                } else if brightness > 0.0 {
                    let away = f64::from(true_cell.0.abs_diff(i)).powi(2)
                        + f64::from(true_cell.1.abs_diff(j)).powi(2);
                    score -= difference(brightness) / (edge + away);
                }
            }
        }
        Some(score)
    }

    /// The cell at `at` mm from the corner: an edge belongs to the next cell, the last edge to the last cell.
    fn cell_of(&self, at: f64, extent: f64) -> Option<u32> {
        let last = ((extent / self.cell_mm).ceil() as u32).saturating_sub(1);
        (0.0..=extent)
            .contains(&at)
            .then(|| ((at / self.cell_mm).floor() as u32).min(last))
    }
}

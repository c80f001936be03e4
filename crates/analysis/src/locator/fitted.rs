//! A fitted locator: from the features of a press to its position, region and flags.

use nalgebra::DMatrix;
use skinrig_model::{Locator, SkinOutline, StereoGeometry};

use super::base::{Base, Covariance};
use super::field::Field;
use super::samples::response;
use crate::result::{LocationOutcome, LocatorModel, Region};
use crate::triangulate::locate;

/// Level of the regions of the press table.
pub(super) const LEVEL: f64 = 0.95;

/// What the cameras say about a press. It holds no position: a locator cannot see where a press was made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Features {
    /// Centroid column in each camera, px.
    pub columns: [f64; 2],
    /// Clustered events in the weaker camera.
    pub cluster_events: u32,
}

/// A position with what is known about its error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Location {
    /// Position, mm.
    pub at: [f64; 2],
    /// 95 % region about it; `None` if too few calibration presses determine it.
    pub region: Option<Region>,
    /// True if the columns are beyond those of the calibration presses: the position is close to that of the base alone.
    pub extrapolated: bool,
}

/// Position and predicted covariance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Prediction {
    pub at: [f64; 2],
    pub covariance: Option<Covariance>,
    pub extrapolated: bool,
}

/// A locator that has learnt.
#[derive(Debug, Clone)]
pub struct Fitted {
    locator: Locator,
    geometry: StereoGeometry,
    model: LocatorModel,
    base: Base,
    field: Option<Field>,
}

impl Fitted {
    /// From its serialised form and the geometry of the analysis; `None` if the form contradicts itself.
    #[must_use]
    pub fn new(locator: Locator, geometry: StereoGeometry, model: LocatorModel) -> Option<Self> {
        let base = match (&model.affine, &model.geometry_covariance) {
            (Some(map), _) => Base::Affine(map.clone()),
            (None, None) => Base::rays(&geometry, None),
            (None, Some(rows)) => {
                let size = rows.len();
                if size != crate::calibrate::PARAMETERS || rows.iter().any(|r| r.len() != size) {
                    return None;
                }
                let covariance = DMatrix::from_fn(size, size, |i, j| rows[i][j]);
                Base::rays(&geometry, Some(covariance))
            }
        };
        let field = match &model.field {
            Some(field) => Some(Field::new(field)?),
            None => None,
        };
        Some(Self {
            locator,
            geometry,
            model,
            base,
            field,
        })
    }

    /// The locator.
    #[must_use]
    pub const fn locator(&self) -> Locator {
        self.locator
    }

    /// Everything it learnt.
    #[must_use]
    pub const fn model(&self) -> &LocatorModel {
        &self.model
    }

    pub(super) fn with_levels(mut self, levels: Vec<crate::result::RegionLevel>) -> Self {
        self.model.levels = levels;
        self
    }

    /// Locates a press; `None` if it has no position.
    #[must_use]
    pub fn locate(&self, features: &Features) -> Option<Location> {
        let prediction = self.predict(features)?;
        let factor = self.model.levels.iter().find(|l| l.level == LEVEL);
        let region = prediction
            .covariance
            .zip(factor)
            .and_then(|(covariance, level)| ellipse(covariance, level.factor));
        Some(Location {
            at: prediction.at,
            region,
            extrapolated: prediction.extrapolated,
        })
    }

    /// Where a press is, as the rays and this locator say. The rays decide whether a press has a position, whatever the
    /// locator, so that all locators are judged on the same presses; the position decides whether it is on the skin.
    #[must_use]
    pub fn outcome(
        &self,
        outline: &SkinOutline,
        columns: [Option<f64>; 2],
        cluster_events: u32,
    ) -> (LocationOutcome, Option<Location>) {
        let rays = locate(&self.geometry, outline, columns);
        let (LocationOutcome::Located { sine, .. } | LocationOutcome::Outside { sine, .. }) = rays
        else {
            return (rays, None);
        };
        let [Some(one), Some(two)] = columns else {
            return (rays, None);
        };
        let found = self.locate(&Features {
            columns: [one, two],
            cluster_events,
        });
        let Some(location) = found else {
            return (rays, None);
        };
        if self.locator == Locator::Geometry {
            return (rays, Some(location));
        }
        let at = skinrig_model::Point2::new(location.at[0], location.at[1]);
        let outcome = if outline.contains(at) {
            LocationOutcome::Located { at, sine }
        } else {
            LocationOutcome::Outside { at, sine }
        };
        (outcome, Some(location))
    }

    pub(super) fn predict(&self, features: &Features) -> Option<Prediction> {
        let anchor = self.base.anchor(features.columns)?;
        let correction = self.field.as_ref().map(|f| f.correction(features.columns));
        let by = correction.map_or([0.0; 2], |c| c.by);
        let at = [anchor.at[0] + by[0], anchor.at[1] + by[1]];
        let covariance = self.model.scatter.map(|scatter| {
            let relative = response(features.cluster_events, scatter.reference_events);
            let column_px2 = scatter.column_px * scatter.column_px * relative;
            let (own, open) = correction.map_or((0.0, 1.0), |c| (c.variance_mm2, c.open));
            // A field has already corrected errors of the parameters where it has seen presses.
            let fixed = scatter.fixed_mm * scatter.fixed_mm + own;
            let term = |i: usize| column_px2 * anchor.by_columns[i] + open * anchor.from_parameters[i];
            [fixed + term(0), term(1), fixed + term(2)]
        });
        let finite = at.iter().chain(covariance.iter().flatten()).all(|v| v.is_finite());
        finite.then_some(Prediction {
            at,
            covariance,
            extrapolated: correction.is_some_and(|c| c.extrapolated),
        })
    }
}

/// Squared Mahalanobis distance of an error; `None` for a degenerate covariance.
pub(super) fn distance(covariance: Covariance, error: [f64; 2]) -> Option<f64> {
    let [xx, xy, yy] = covariance;
    let determinant = xx * yy - xy * xy;
    let [dx, dy] = error;
    let square = (yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy) / determinant;
    (determinant > 0.0 && square.is_finite()).then_some(square.max(0.0))
}

/// The ellipse of this squared size.
fn ellipse([xx, xy, yy]: Covariance, factor: f64) -> Option<Region> {
    let (middle, off) = (0.5 * (xx + yy), libm::hypot(0.5 * (xx - yy), xy));
    let variances = [middle + off, middle - off];
    let region = Region {
        semi_axes_mm: variances.map(|v| (v * factor).sqrt()),
        angle_deg: 0.5 * libm::atan2(2.0 * xy, xx - yy).to_degrees(),
    };
    let usable = region.semi_axes_mm.iter().all(|a| a.is_finite() && *a > 0.0);
    usable.then_some(region)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_ellipse_holds_what_its_covariance_holds() {
        let covariance = [4.0, 1.2, 1.0];
        let region = ellipse(covariance, 5.0).unwrap();
        assert!(region.semi_axes_mm[0] > region.semi_axes_mm[1] && region.angle_deg > 0.0);
        for error in [[1.0, 0.0], [0.0, 1.0], [3.0, -2.0], [4.4, 1.3]] {
            let reach = distance(covariance, error).unwrap() / 5.0;
            assert!((region.reach(error) - reach).abs() < 1e-12, "{error:?}");
        }
        assert_eq!(distance([1.0, 1.0, 1.0], [1.0, 0.0]), None);
        assert_eq!(ellipse([0.0, 0.0, 0.0], 5.0), None);
    }
}

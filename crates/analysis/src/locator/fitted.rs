//! A fitted locator: from the features of a press to its position, region and flags.

use nalgebra::DMatrix;
use skinrig_model::{Locator, Point2, SkinOutline, StereoGeometry};

use super::features::{CameraFeatures, Features};
use super::fit_error::LocatorModelError;
use super::inverse::Inverse;
use super::learnt_area::LearntArea;
use super::prediction::{Prediction, Uncertainty, ellipse};
use super::rays::Rays;
use super::reading::Reading;
use super::regions::{LEVEL, Regions, size};
use super::robust::response;
use crate::calibrate::PARAMETERS;
use crate::result::{Analysis, LocationOutcome, LocatorModel, LocatorResult, Region};
use crate::triangulate::locate;

/// A position with what is known about its error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Location {
    /// Position, mm.
    pub at: [f64; 2],
    /// 95 % region about it; `None` if too few calibration presses determine it, or beyond them.
    pub region: Option<Region>,
    /// True beyond the calibration presses: of the position, or of the columns that a field has seen, where the position is close to that
    /// of the base alone.
    pub extrapolated: bool,
}

/// A locator that has learnt.
#[derive(Debug, Clone)]
pub struct FittedLocator {
    locator: Locator,
    geometry: StereoGeometry,
    model: LocatorModel,
    area: Option<LearntArea>,
    way: Solver,
}

/// From columns to a position.
#[derive(Debug, Clone)]
enum Solver {
    Rays(Box<Rays>),
    Inverse(Box<Inverse>),
}

/// The covariance with these rows, if there is one.
fn matrix(rows: Option<&[Vec<f64>]>) -> Result<Option<DMatrix<f64>>, LocatorModelError> {
    let Some(rows) = rows else { return Ok(None) };
    let size = PARAMETERS;
    let fits = rows.len() == size && rows.iter().all(|r| r.len() == size);
    fits.then(|| Some(DMatrix::from_fn(size, size, |i, j| rows[i][j])))
        .ok_or(LocatorModelError::CovarianceSize)
}

impl FittedLocator {
    /// From its serialised form and the geometry of the analysis.
    ///
    /// # Errors
    /// [`LocatorModelError`] if the form contradicts itself or is singular.
    pub fn new(
        locator: Locator,
        geometry: StereoGeometry,
        model: LocatorModel,
    ) -> Result<Self, LocatorModelError> {
        let covariance = matrix(model.geometry_covariance.as_deref())?;
        let remount = matrix(model.remount_covariance.as_deref())?;
        let way = match (&model.cameras, &model.prior) {
            (Some([one, two]), Some(prior)) => {
                let reading = match (one.polynomial, two.polynomial) {
                    (Some(one), Some(two)) => Reading::Column([one, two]),
                    (None, None) => Reading::Bearing {
                        geometry,
                        covariance,
                        remount,
                    },
                    _ => return Err(LocatorModelError::Incomplete),
                };
                let inverse = Inverse::new(reading, [one, two], prior, size(&model, LEVEL))
                    .ok_or(LocatorModelError::Singular)?;
                Solver::Inverse(Box::new(inverse))
            }
            (None, None) => Solver::Rays(Box::new(Rays::new(&geometry, covariance))),
            _ => return Err(LocatorModelError::Incomplete),
        };
        Ok(Self {
            locator,
            geometry,
            area: model.learnt.as_ref().map(LearntArea::new),
            model,
            way,
        })
    }

    /// The intersection of the rays of a geometry, without regions.
    #[must_use]
    pub fn rays(geometry: StereoGeometry) -> Self {
        Self {
            locator: Locator::Geometry,
            geometry,
            model: LocatorModel {
                reference_events: 1.0,
                scatter: None,
                geometry_covariance: None,
                remount_covariance: None,
                cameras: None,
                prior: None,
                inflation: 1.0,
                levels: Vec::new(),
                learnt: None,
            },
            area: None,
            way: Solver::Rays(Box::new(Rays::new(&geometry, None))),
        }
    }

    /// The locator of an analysis; the rays of its geometry if it has none.
    ///
    /// # Errors
    /// [`LocatorModelError`] if what the locator learnt was changed.
    pub fn of(analysis: &Analysis) -> Result<Self, LocatorModelError> {
        Self::restored(analysis.locator.as_ref(), analysis.geometry)
    }

    /// The locator of a result; the rays of this geometry without one.
    ///
    /// # Errors
    /// [`LocatorModelError`] if what the locator learnt was changed.
    pub fn restored(
        result: Option<&LocatorResult>,
        geometry: StereoGeometry,
    ) -> Result<Self, LocatorModelError> {
        match result {
            Some(l) => Self::new(l.locator, geometry, l.model.clone()),
            None => Ok(Self::rays(geometry)),
        }
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

    pub(super) fn with_regions(mut self, regions: Regions) -> Self {
        (self.model.inflation, self.model.levels) = (regions.inflation, regions.levels);
        self
    }

    /// Locates a press; `None` if it has no position.
    #[must_use]
    pub fn locate(&self, features: &Features) -> Option<Location> {
        let prediction = self.predict(features)?;
        let factor = self.model.levels.iter().find(|l| l.level == LEVEL);
        let region = prediction
            .uncertainty
            .and_then(|u| u.covariance(self.model.inflation))
            .zip(factor)
            .and_then(|(covariance, level)| ellipse(covariance, level.factor));
        let extrapolated = prediction.extrapolated || self.is_beyond(prediction.at, region);
        let region = region.filter(|_| !extrapolated);
        Some(Location {
            at: prediction.at,
            region,
            extrapolated,
        })
    }

    /// True if a position is beyond the calibration presses even if it is off by its region, or without one by half a step.
    fn is_beyond(&self, at: [f64; 2], region: Option<Region>) -> bool {
        let reach_mm = region.map(|r| r.semi_axes_mm[0]);
        self.area
            .as_ref()
            .is_some_and(|area| !area.is_near(at, reach_mm))
    }

    /// The region of another level in place of the 95 % one; `None` if the calibration presses do not determine it.
    #[must_use]
    pub fn at_level(&self, region: Region, level: f64) -> Option<Region> {
        let factor = |level: f64| {
            let found = self.model.levels.iter().find(|l| l.level == level);
            found.map(|l| l.factor)
        };
        let scale = libm::sqrt(factor(level)? / factor(LEVEL)?);
        Some(Region {
            semi_axes_mm: region.semi_axes_mm.map(|axis| axis * scale),
            ..region
        })
    }

    /// Where a press is, and what is known about the error. A field locates every press with two columns; the geometry only
    /// those whose rays meet in front of both cameras. Either way the outcome holds the sine between the rays.
    #[must_use]
    pub fn outcome(
        &self,
        outline: &SkinOutline,
        cameras: [CameraFeatures; 2],
    ) -> (LocationOutcome, Option<Location>) {
        let rays = locate(&self.geometry, outline, cameras.map(|c| c.column));
        let (Some(sine), Some(features)) = (rays.sine(), Features::new(cameras)) else {
            return (rays, None);
        };
        let Some(location) = self.locate(&features) else {
            return (rays, None);
        };
        if matches!(self.way, Solver::Rays(_)) {
            return (rays, rays.estimate().and(Some(location)));
        }
        let at = Point2::new(location.at[0], location.at[1]);
        let outcome = if outline.contains(at) {
            LocationOutcome::Located { at, sine }
        } else {
            LocationOutcome::Outside { at, sine }
        };
        (outcome, Some(location))
    }

    pub(super) fn predict(&self, features: &Features) -> Option<Prediction> {
        let relative = response(features.cluster_events, self.model.reference_events);
        let rays = match &self.way {
            Solver::Inverse(inverse) => return inverse.locate(features, relative),
            Solver::Rays(rays) => rays,
        };
        let crossing = rays.crossing(features.columns)?;
        let uncertainty = self.model.scatter.map(|scatter| {
            let fixed = scatter.fixed_mm * scatter.fixed_mm;
            let column_px2 = scatter.column_px * scatter.column_px * relative;
            let by_columns = crossing.by_columns.map(|v| column_px2 * v);
            Uncertainty::Crossing {
                scatter: [fixed + by_columns[0], by_columns[1], fixed + by_columns[2]],
                model: crossing.from_parameters,
            }
        });
        let finite = crossing.at.iter().all(|v| v.is_finite());
        finite.then_some(Prediction {
            at: crossing.at,
            uncertainty,
            extrapolated: false,
        })
    }
}

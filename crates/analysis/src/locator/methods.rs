//! The built-in methods, and what each needs.

use nalgebra::DMatrix;
use skinrig_model::{Locator, StereoGeometry};

use super::base::{Base, affine};
use super::field::{Logs, learn};
use super::fitted::Fitted;
use super::samples::{Sample, reference_events, samples, scatter};
use crate::result::{LocatorModel, Scatter};
use crate::sets::{CalibrationPress, CalibrationSet};

/// What a method sees of a press.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Feature {
    /// Centroid column of both cameras.
    Columns,
    /// Clustered events of the weaker camera.
    ClusterEvents,
}

/// What a method needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Needs {
    /// Features of each press.
    pub features: &'static [Feature],
    /// Minimum number of calibration locations.
    pub locations: u32,
}

/// Why a method could not be fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Unfit {
    /// Too few calibration locations.
    #[error("it needs {needed} calibration locations, found {found}")]
    Locations {
        /// Required number.
        needed: u32,
        /// Number of the set.
        found: u32,
    },
    /// The columns of the calibration presses lie on a line.
    #[error("the columns of the calibration presses lie on a line")]
    Line,
    /// The kernel is not positive definite, or the residuals are not finite.
    #[error("the residuals of the calibration presses determine no field")]
    Degenerate,
}

/// Where a fit begins.
#[derive(Debug, Clone)]
pub struct Start<'a> {
    /// Geometry fitted to the same presses (nominal without a calibration).
    pub geometry: StereoGeometry,
    /// Covariance of its ten parameters.
    pub(crate) covariance: Option<DMatrix<f64>>,
    /// Hyperparameters of a fit to almost the same presses.
    pub(crate) near: Option<&'a Hyperparameters>,
}

/// Opaque hyperparameters of a field.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hyperparameters(Logs);

/// A way to learn where presses are.
pub trait Method: Sync {
    /// Name in settings and results.
    fn locator(&self) -> Locator;
    /// Grows with every change of its numbers.
    fn version(&self) -> u32;
    /// What it needs.
    fn needs(&self) -> Needs;
    /// Learns from calibration presses.
    ///
    /// # Errors
    /// [`Unfit`] if they do not suffice.
    fn fit(
        &self,
        presses: &CalibrationSet,
        start: &Start<'_>,
    ) -> Result<(Fitted, Option<Hyperparameters>), Unfit>;
}

/// All methods, simplest first.
pub const METHODS: [&dyn Method; 3] = [&Geometry, &ResidualField, &DirectField];

/// The method of a locator; for `Auto` the geometry.
#[must_use]
pub fn method(locator: Locator) -> &'static dyn Method {
    let named = METHODS.into_iter().find(|m| m.locator() == locator);
    named.unwrap_or(&Geometry)
}

struct Geometry;
struct ResidualField;
struct DirectField;

const FEATURES: &[Feature] = &[Feature::Columns, Feature::ClusterEvents];

impl Method for Geometry {
    fn locator(&self) -> Locator {
        Locator::Geometry
    }

    fn version(&self) -> u32 {
        1
    }

    fn needs(&self) -> Needs {
        Needs {
            features: &[Feature::Columns],
            locations: 0,
        }
    }

    fn fit(
        &self,
        presses: &CalibrationSet,
        start: &Start<'_>,
    ) -> Result<(Fitted, Option<Hyperparameters>), Unfit> {
        let base = Base::rays(&start.geometry, start.covariance.clone());
        let presses = presses.sights();
        let seen = samples(&base, presses);
        let model = LocatorModel {
            affine: None,
            field: None,
            scatter: scatter(&seen, reference_events(presses)),
            geometry_covariance: rows(start),
            levels: Vec::new(),
        };
        let fitted = Fitted::new(Locator::Geometry, start.geometry, model);
        fitted.map(|f| (f, None)).ok_or(Unfit::Degenerate)
    }
}

impl Method for ResidualField {
    fn locator(&self) -> Locator {
        Locator::Field
    }

    fn version(&self) -> u32 {
        1
    }

    fn needs(&self) -> Needs {
        Needs {
            features: FEATURES,
            locations: 12,
        }
    }

    fn fit(
        &self,
        presses: &CalibrationSet,
        start: &Start<'_>,
    ) -> Result<(Fitted, Option<Hyperparameters>), Unfit> {
        enough(self.needs(), presses.sights())?;
        let base = Base::rays(&start.geometry, start.covariance.clone());
        let model = LocatorModel {
            affine: None,
            field: None,
            scatter: None,
            geometry_covariance: rows(start),
            levels: Vec::new(),
        };
        with_field(Locator::Field, presses.sights(), &base, start, model)
    }
}

impl Method for DirectField {
    fn locator(&self) -> Locator {
        Locator::Direct
    }

    fn version(&self) -> u32 {
        1
    }

    fn needs(&self) -> Needs {
        Needs {
            features: FEATURES,
            locations: 16,
        }
    }

    fn fit(
        &self,
        presses: &CalibrationSet,
        start: &Start<'_>,
    ) -> Result<(Fitted, Option<Hyperparameters>), Unfit> {
        enough(self.needs(), presses.sights())?;
        let map = affine(presses.sights()).ok_or(Unfit::Line)?;
        let base = Base::Affine(map.clone());
        let model = LocatorModel {
            affine: Some(map),
            field: None,
            scatter: None,
            geometry_covariance: None,
            levels: Vec::new(),
        };
        with_field(Locator::Direct, presses.sights(), &base, start, model)
    }
}

/// Adds the field on the residuals of `base`.
fn with_field(
    locator: Locator,
    presses: &[CalibrationPress],
    base: &Base,
    start: &Start<'_>,
    model: LocatorModel,
) -> Result<(Fitted, Option<Hyperparameters>), Unfit> {
    let seen: Vec<Sample> = samples(base, presses);
    let learnt = learn(&seen, start.near.map(|h| &h.0)).ok_or(Unfit::Degenerate)?;
    let [fixed_mm, column_px] = learnt.scatter;
    let model = LocatorModel {
        field: Some(learnt.model),
        scatter: Some(Scatter {
            fixed_mm,
            column_px,
            reference_events: reference_events(presses),
        }),
        ..model
    };
    let fitted = Fitted::new(locator, start.geometry, model).ok_or(Unfit::Degenerate)?;
    Ok((fitted, Some(Hyperparameters(learnt.logs))))
}

fn rows(start: &Start<'_>) -> Option<Vec<Vec<f64>>> {
    let covariance = start.covariance.as_ref()?;
    let row = |r: usize| covariance.row(r).iter().copied().collect();
    Some((0..covariance.nrows()).map(row).collect())
}

fn enough(needs: Needs, presses: &[CalibrationPress]) -> Result<(), Unfit> {
    let mut locations: Vec<u32> = presses.iter().map(|p| p.location).collect();
    locations.sort_unstable();
    locations.dedup();
    let (needed, found) = (needs.locations, locations.len() as u32);
    if found < needed {
        return Err(Unfit::Locations { needed, found });
    }
    Ok(())
}

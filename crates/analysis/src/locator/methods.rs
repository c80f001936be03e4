//! The built-in methods, and what each needs.

use nalgebra::DMatrix;
use skinrig_model::{Locator, StereoGeometry};

use super::field::learn;
use super::fit_error::FitError;
use super::fitted::FittedLocator;
use super::likelihood::Logs;
use super::rays::Rays;
use super::reading::{Reading, polynomials};
use super::robust::reference_events;
use super::samples::samples;
use super::spread::SpreadFits;
use crate::distinct::distinct;
use crate::result::{CameraField, LearntPlaces, LocatorModel, PositionPrior};
use crate::sets::{CalibrationPress, CalibrationSet};

/// Input of a method.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Feature {
    /// Centroid column of both cameras.
    Columns,
    /// Clustered events of the weaker camera.
    ClusterEvents,
    /// Standard deviations of the columns and rows of the clustered events of both cameras.
    Spreads,
}

/// Requirements of a method.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Requirements {
    /// Features of each press.
    pub features: &'static [Feature],
    /// Minimum number of calibration locations.
    pub locations: u32,
}

/// Where a fit begins.
#[derive(Debug, Clone)]
pub struct FitStart<'a> {
    /// Geometry fitted to the same presses (nominal without a calibration).
    pub geometry: StereoGeometry,
    /// Covariance of its ten parameters.
    pub(crate) covariance: Option<DMatrix<f64>>,
    /// Hyperparameters of a fit to almost the same presses.
    pub(crate) near: Option<&'a Hyperparameters>,
    /// Fields of the spreads of the same presses. They are the same for all methods.
    pub(super) spreads: Option<&'a SpreadFits>,
}

/// Opaque hyperparameters of the fields of the columns of both cameras.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hyperparameters([Logs; 2]);

/// A way to learn where presses are.
pub trait Method: Sync {
    /// Name in settings and results.
    fn locator(&self) -> Locator;
    /// Grows with every change of its numbers.
    fn version(&self) -> u32;
    /// Its requirements.
    fn needs(&self) -> Requirements;
    /// Learns from calibration presses.
    ///
    /// # Errors
    /// [`FitError`] if they do not suffice.
    fn fit(
        &self,
        presses: &CalibrationSet,
        start: &FitStart<'_>,
    ) -> Result<(FittedLocator, Option<Hyperparameters>), FitError>;
}

/// All methods, simplest first.
pub(crate) const METHODS: [&dyn Method; 3] = [&Geometry, &GeometryField, &DirectField];

/// The method of a locator; for `Auto` the geometry.
#[must_use]
pub fn method(locator: Locator) -> &'static dyn Method {
    let named = METHODS.into_iter().find(|m| m.locator() == locator);
    named.unwrap_or(&Geometry)
}

struct Geometry;
struct GeometryField;
struct DirectField;

/// Smallest standard deviation of the prior along any direction, mm.
const NARROWEST_MM: f64 = 1.0;

const FEATURES: &[Feature] = &[Feature::Columns, Feature::ClusterEvents, Feature::Spreads];

impl Method for Geometry {
    fn locator(&self) -> Locator {
        Locator::Geometry
    }

    fn version(&self) -> u32 {
        2
    }

    fn needs(&self) -> Requirements {
        Requirements {
            features: &[Feature::Columns],
            locations: 0,
        }
    }

    fn fit(
        &self,
        presses: &CalibrationSet,
        start: &FitStart<'_>,
    ) -> Result<(FittedLocator, Option<Hyperparameters>), FitError> {
        let rays = Rays::new(&start.geometry, start.covariance.clone());
        let presses = presses.sights();
        let model = LocatorModel {
            reference_events: reference_events(presses),
            scatter: rays.scatter(presses),
            geometry_covariance: rows(start),
            remount_covariance: None,
            cameras: None,
            prior: None,
            inflation: 1.0,
            levels: Vec::new(),
            learnt: LearntPlaces::of(presses),
        };
        let fitted = FittedLocator::new(Locator::Geometry, start.geometry, model);
        fitted.map(|f| (f, None)).map_err(|_| FitError::Degenerate)
    }
}

impl Method for GeometryField {
    fn locator(&self) -> Locator {
        Locator::Field
    }

    fn version(&self) -> u32 {
        3
    }

    fn needs(&self) -> Requirements {
        Requirements {
            features: FEATURES,
            locations: 12,
        }
    }

    fn fit(
        &self,
        presses: &CalibrationSet,
        start: &FitStart<'_>,
    ) -> Result<(FittedLocator, Option<Hyperparameters>), FitError> {
        enough(self.needs(), presses.sights())?;
        let reading = Reading::Bearing {
            geometry: start.geometry,
            covariance: start.covariance.clone(),
            remount: None,
        };
        with_fields(Locator::Field, presses.sights(), &reading, start)
    }
}

impl Method for DirectField {
    fn locator(&self) -> Locator {
        Locator::Direct
    }

    fn version(&self) -> u32 {
        3
    }

    fn needs(&self) -> Requirements {
        Requirements {
            features: FEATURES,
            locations: 16,
        }
    }

    fn fit(
        &self,
        presses: &CalibrationSet,
        start: &FitStart<'_>,
    ) -> Result<(FittedLocator, Option<Hyperparameters>), FitError> {
        enough(self.needs(), presses.sights())?;
        let reading = Reading::Column(polynomials(presses.sights()).ok_or(FitError::Line)?);
        with_fields(Locator::Direct, presses.sights(), &reading, start)
    }
}

/// Learns the fields of both cameras about `reading`.
fn with_fields(
    locator: Locator,
    presses: &[CalibrationPress],
    reading: &Reading,
    start: &FitStart<'_>,
) -> Result<(FittedLocator, Option<Hyperparameters>), FitError> {
    let bearings = matches!(reading, Reading::Bearing { .. });
    let camera = |k: usize| {
        let columns = samples(presses, |p| Some(reading.residual(k, p)));
        let near = start.near.map(|h| &h.0[k]);
        let (field, logs) = learn(&columns, near).ok_or(FitError::Degenerate)?;
        let field = CameraField {
            polynomial: match reading {
                Reading::Column(polynomials) => Some(polynomials[k]),
                Reading::Bearing { .. } => None,
            },
            field,
            spreads: start.spreads.and_then(|spreads| spreads.fields(k)),
        };
        Ok((field, logs))
    };
    let (one, two) = rayon::join(|| camera(0), || camera(1));
    let ((one, logs_one), (two, logs_two)) = (one?, two?);
    let model = LocatorModel {
        reference_events: reference_events(presses),
        scatter: None,
        geometry_covariance: rows(start).filter(|_| bearings),
        remount_covariance: None,
        cameras: Some([one, two]),
        prior: Some(prior(presses)),
        inflation: 1.0,
        levels: Vec::new(),
        learnt: LearntPlaces::of(presses),
    };
    let fitted =
        FittedLocator::new(locator, start.geometry, model).map_err(|_| FitError::Degenerate)?;
    Ok((fitted, Some(Hyperparameters([logs_one, logs_two]))))
}

/// Where presses are expected: mean and covariance of the calibration positions.
fn prior(presses: &[CalibrationPress]) -> PositionPrior {
    let n = presses.len().max(1) as f64;
    let mean = |of: &dyn Fn(&CalibrationPress) -> f64| presses.iter().map(of).sum::<f64>() / n;
    let (x, y) = (mean(&|p| p.truth.x_mm), mean(&|p| p.truth.y_mm));
    let least = NARROWEST_MM * NARROWEST_MM;
    PositionPrior {
        centre_mm: [x, y],
        covariance_mm2: [
            least + mean(&|p| (p.truth.x_mm - x).powi(2)),
            mean(&|p| (p.truth.x_mm - x) * (p.truth.y_mm - y)),
            least + mean(&|p| (p.truth.y_mm - y).powi(2)),
        ],
    }
}

fn rows(start: &FitStart<'_>) -> Option<Vec<Vec<f64>>> {
    let covariance = start.covariance.as_ref()?;
    let row = |r: usize| covariance.row(r).iter().copied().collect();
    Some((0..covariance.nrows()).map(row).collect())
}

fn enough(needs: Requirements, presses: &[CalibrationPress]) -> Result<(), FitError> {
    let locations = distinct(presses.iter().map(|p| p.location));
    let (needed, found) = (needs.locations, locations.len() as u32);
    if found < needed {
        return Err(FitError::Locations { needed, found });
    }
    Ok(())
}

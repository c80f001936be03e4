//! Owns the result of learning to locate: the locator in use, its serialised form, its competitors, its regions.

use serde::{Deserialize, Serialize};
use skinrig_model::{Locator, Point2};

use super::{Estimate, PairedTest};
use crate::locator::FitError;
use crate::with_text::with_text;

/// The locator of an analysis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LocatorResult {
    /// The locator in use, never `Auto`.
    pub locator: Locator,
    /// Version of its method.
    pub version: u32,
    /// Why another locator than the one in the settings is in use.
    #[serde(default)]
    pub fallback: Option<LocatorFallback>,
    /// Locators compared at held-out locations; empty if there were too few locations.
    pub compared: Vec<LocatorComparison>,
    /// Bound on errors in the comparison, mm, as in [`super::CalibrationResult::bound_mm`].
    #[serde(default)]
    pub bound_mm: Option<f64>,
    /// What it learnt.
    pub model: LocatorModel,
    /// Share of scored presses within the regions of several levels.
    pub reliability: Vec<ReliabilityRow>,
}

/// Why the geometry is in use: the locator in the settings cannot learn, or the automatic choice ends there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
#[serde(remote = "Self", tag = "kind", rename_all = "snake_case")]
pub enum LocatorFallback {
    /// The settings ask for another locator, which cannot learn.
    #[error("the locator `{}` cannot learn: {why}; using `geometry`", .wanted.name())]
    CannotLearn {
        /// In the settings.
        wanted: Locator,
        /// Why not.
        why: FitError,
    },
    /// There is no calibration to learn with.
    #[error("the nominal geometry is used as it is (`calibration: none`)")]
    NominalGeometry,
    /// Too few locations for a comparison.
    #[error(
        "{locations} calibration locations are too few to compare locators by cross-validation"
    )]
    FewLocations {
        /// Calibration locations.
        locations: usize,
    },
    /// No other locator could be compared.
    #[error("no field could be compared: {}", .why.map_or_else(
        || "a fit without some of the locations failed".to_owned(), |why| why.to_string()
    ))]
    NoneCompared {
        /// Why the first of them cannot learn; `None` if all can, but not without some of the locations.
        why: Option<FitError>,
    },
    /// No other locator is better.
    #[error("no field is better at held-out locations by more than noise explains")]
    NoneBetter,
}

with_text!(LocatorFallback);

/// A locator of the comparison.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LocatorComparison {
    /// The locator.
    pub locator: Locator,
    /// RMSE of the calibration presses at locations left out of its fit, mm; the value is `None` if it could not be
    /// fitted.
    pub rmse_mm: Estimate,
    /// The same with every error bounded at [`LocatorResult::bound_mm`], mm: the criterion of the comparison.
    pub bounded_rmse_mm: Option<f64>,
    /// RMSE in repetitions left out of its fit, mm; `None` for a single repetition.
    pub over_repetitions_mm: Option<f64>,
    /// Comparison with the current locator at its turn; `None` for the first.
    pub test: Option<PairedTest<Locator>>,
    /// Why it could not be fitted.
    pub unfit: Option<FitError>,
    /// True for the locator in use.
    pub chosen: bool,
}

/// Everything that a fitted locator needs besides the geometry.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LocatorModel {
    /// Median cluster events of the calibration presses, weaker camera.
    pub reference_events: f64,
    /// Scatter of the crossings of the rays; `None` with fields, or if too few presses determine it: no regions.
    pub scatter: Option<Scatter>,
    /// Covariance of the ten parameters of the geometry, row by row, as in [`super::CalibrationResult::names`]; `None` if
    /// unknown or not used.
    pub geometry_covariance: Option<Vec<Vec<f64>>>,
    /// Of a field after a remount: covariance that the correction leaves in the same parameters, everywhere on the skin.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub remount_covariance: Option<Vec<Vec<f64>>>,
    /// What each camera sees; `None` for the geometry alone.
    pub cameras: Option<[CameraField; 2]>,
    /// Where presses are expected; `None` for the geometry alone.
    pub prior: Option<PositionPrior>,
    /// Factor on the variance that the fields, or the parameters of the geometry alone, state about themselves, from
    /// held-out calibration presses.
    pub inflation: f64,
    /// Squared size of a region of each level, in units of the predicted covariance, from held-out calibration presses;
    /// empty if there are too few.
    pub levels: Vec<RegionLevel>,
    /// Where the calibration presses are; `None` without any.
    pub learnt: Option<LearntPlaces>,
}

/// Where a locator learnt. Estimates outside the convex hull, by more than the margin and their own region, are extrapolated and have no
/// region.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LearntPlaces {
    /// Measured position of a calibration press of each location, mm.
    pub places: Vec<Point2>,
    /// Margin, mm: half of the largest distance of a place from its nearest other one. Our choice.
    pub margin_mm: f64,
}

/// The column at which a camera sees a press at a position.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CameraField {
    /// The expected column, px: coefficients of 1, x, y, x², xy, y² (mm). `None`: the geometry says what is expected.
    pub polynomial: Option<[f64; 6]>,
    /// Correction of the expected column.
    pub field: FieldModel,
    /// Spread of the columns and rows of the events; `None` if too few presses have one.
    pub spreads: Option<[SpreadField; 2]>,
}

/// How far the events of a press spread, by its position.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SpreadField {
    /// Median of the calibration presses, px.
    pub typical_px: f64,
    /// `typical_px` times the logarithm of the spread divided by `typical_px`.
    pub field: FieldModel,
}

/// A Gaussian process over positions.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FieldModel {
    /// Standard deviation of the field before data, px.
    pub amplitude_px: f64,
    /// Length scale, mm.
    pub length_mm: f64,
    /// Standard deviation from press to press that does not depend on the events, px.
    pub fixed_px: f64,
    /// Standard deviation from press to press with [`LocatorModel::reference_events`], px. Its variance is inversely
    /// proportional to the cluster events.
    pub column_px: f64,
    /// Observations.
    pub points: Vec<FieldPoint>,
}

/// An observation of a field.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FieldPoint {
    /// Measured position, mm.
    pub at_mm: [f64; 2],
    /// Reading minus the one expected there, px; of a geometry: the miss of the ray as an angle, divided by degrees per column.
    pub residual_px: f64,
    /// Its variance, px²; large for weak presses and outliers.
    pub variance_px2: f64,
}

/// Where presses are expected: mean and covariance of the calibration positions.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PositionPrior {
    /// Mean, mm.
    pub centre_mm: [f64; 2],
    /// xx, xy, yy, mm².
    pub covariance_mm2: [f64; 3],
}

/// Scatter of the crossing of two rays: a part of its own, and one from the columns that grows as cluster events become fewer.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Scatter {
    /// Standard deviation of either coordinate, mm.
    pub fixed_mm: f64,
    /// Standard deviation of a column with [`LocatorModel::reference_events`], px. Its variance is inversely proportional to the
    /// cluster events.
    pub column_px: f64,
}

/// Size of the regions of one level.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RegionLevel {
    /// Probability, 0..1.
    pub level: f64,
    /// Squared Mahalanobis distance.
    pub factor: f64,
}

/// Regions of one level on the scored presses.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ReliabilityRow {
    /// Probability that the regions state, 0..1.
    pub level: f64,
    /// Share of the valid scored presses inside, with its interval over locations.
    pub inside: Estimate,
}

/// 95 % region of a position: an ellipse about the estimate.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Region {
    /// Semi-axes, mm, the longer first.
    pub semi_axes_mm: [f64; 2],
    /// Direction of the longer one, degrees from the x axis, counter-clockwise, in -90..=90.
    pub angle_deg: f64,
}

impl Region {
    /// Squared distance of an error vector from the centre, mm, in units of the ellipse: at most 1 inside.
    #[must_use]
    pub fn reach(&self, error_mm: [f64; 2]) -> f64 {
        let (sin, cos) = libm::sincos(self.angle_deg.to_radians());
        let along = (error_mm[0] * cos + error_mm[1] * sin) / self.semi_axes_mm[0];
        let across = (error_mm[1] * cos - error_mm[0] * sin) / self.semi_axes_mm[1];
        along * along + across * across
    }

    /// Area, mm².
    #[must_use]
    pub fn area_mm2(&self) -> f64 {
        std::f64::consts::PI * self.semi_axes_mm[0] * self.semi_axes_mm[1]
    }
}

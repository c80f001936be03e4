//! Corrects an earlier calibration by a few presses after the skin has been mounted again.
//!
//! Skin and cameras move together (shift and turn), and each camera may move a little on the skin. The earlier geometry, and the
//! field on it if one was in use, move along. Scales of these moves are settings, and the most likely move is the result.
//! Decision and measurements: `docs/adr/0046-*`.

mod fit;
mod motion;

use nalgebra::DMatrix;
use skinrig_model::{AnalysisSettings, CalibrationModel, CameraId, Locator, StereoGeometry};

use self::fit::{Expectation, Outcome};
use self::motion::{NUMBERS, RigidMotion, Spread, WHOLE, covariance_after, parameters_after};
use super::choose::{LocatorChoice, choose_locator};
use super::field::Field;
use super::fitted::FittedLocator;
use super::regions::{LEVEL, size};
use crate::calibrate::{PARAMETERS, covariance, rmse_mm, standard_fit, with_parameters};
use crate::error::RecalibrationError;
use crate::result::{
    Analysis, CalibrationResult, CameraMove, EarlierSession, LocatorModel, LocatorResult, Move,
    Recalibration, RemountPart, ThresholdChoice, Warning, WarningCause,
};
use crate::sets::{CalibrationPress, CalibrationSet};
use skinrig_statistics::distributions::poisson_cdf;

/// Fewest presses of a correction: of the three numbers that describe how the whole moved, each press reads two.
const FEWEST: usize = 3;
/// Presses with less weight, about 4.5 standard deviations off, are outliers.
const OUTLIER: f64 = 0.25;
/// A smaller chance is a warning.
const UNUSUAL: f64 = 0.05;

/// The calibration of an earlier session.
#[derive(Debug, Clone, PartialEq)]
pub struct EarlierCalibration {
    session: EarlierSession,
    geometry: StereoGeometry,
    calibration: CalibrationResult,
    locator: LocatorResult,
    threshold: Option<ThresholdChoice>,
}

/// A corrected calibration.
#[derive(Debug, Clone)]
pub struct Recalibrated {
    /// The geometry.
    pub geometry: StereoGeometry,
    /// Its parameters; `start` is the earlier geometry.
    pub calibration: CalibrationResult,
    /// The earlier locator about this geometry.
    pub locator: LocatorChoice,
    /// Origin and size of the correction.
    pub about: Recalibration,
}

impl EarlierCalibration {
    /// The calibration of an analysed session. A direct field knows no geometry that could move: one about the geometry,
    /// learnt from the same presses, takes its place.
    ///
    /// # Errors
    /// [`RecalibrationError`] if the session is INVALID or has no calibration.
    pub fn new(session: EarlierSession, analysis: &Analysis) -> Result<Self, RecalibrationError> {
        if !analysis.may_calibrate() {
            return Err(RecalibrationError::EarlierInvalid {
                because: analysis.invalid_because(),
            });
        }
        let set = CalibrationSet::from_presses(&analysis.presses);
        let stored = (analysis.geometry, analysis.calibration.clone());
        Self::from_parts(
            session,
            &set,
            stored,
            (analysis.locator.clone(), analysis.threshold.clone()),
            &analysis.settings,
        )
    }

    /// The same from the presses that calibrated, and what they gave.
    ///
    /// # Errors
    /// [`RecalibrationError::EarlierUncalibrated`] without a calibration.
    pub fn from_parts(
        session: EarlierSession,
        set: &CalibrationSet,
        (geometry, calibration): (StereoGeometry, Option<CalibrationResult>),
        (locator, threshold): (Option<LocatorResult>, Option<ThresholdChoice>),
        settings: &AnalysisSettings,
    ) -> Result<Self, RecalibrationError> {
        let (Some(calibration), Some(locator)) = (calibration, locator) else {
            return Err(RecalibrationError::EarlierUncalibrated);
        };
        let locator = match locator.locator {
            Locator::Direct => {
                let about_geometry = AnalysisSettings {
                    locator: Locator::Field,
                    ..settings.clone()
                };
                choose_locator(set, &geometry, Some(&calibration), &about_geometry)
                    .ok_or(RecalibrationError::EarlierUncalibrated)?
                    .result
            }
            _ => locator,
        };
        Ok(Self {
            session,
            geometry,
            calibration,
            locator,
            threshold,
        })
    }

    /// Threshold on cluster events that the earlier session chose.
    pub(crate) const fn threshold(&self) -> Option<&ThresholdChoice> {
        self.threshold.as_ref()
    }

    /// Corrects the calibration by the calibration presses of a later session. `centre_mm`: about which the skin turns.
    ///
    /// # Errors
    /// [`RecalibrationError`] if the presses are too few, or the earlier calibration does not fit them.
    pub fn correct(
        &self,
        set: &CalibrationSet,
        centre_mm: [f64; 2],
        settings: &AnalysisSettings,
    ) -> Result<Recalibrated, RecalibrationError> {
        let presses = set.sights();
        if presses.len() < FEWEST {
            return Err(RecalibrationError::FewPresses {
                needed: FEWEST,
                found: presses.len(),
            });
        }
        let model = &self.locator.model;
        let fields = match &model.cameras {
            None => None,
            Some([one, two]) => Some(
                Field::new(&one.field)
                    .zip(Field::new(&two.field))
                    .map(|(one, two)| [one, two])
                    .ok_or(RecalibrationError::Degenerate)?,
            ),
        };
        let scatter = match (&fields, model.scatter) {
            (None, None) => return Err(RecalibrationError::EarlierUncalibrated),
            (_, scatter) => scatter.unwrap_or_default(),
        };
        // A field already corrects what the earlier presses left open about the geometry. What no geometry explains, the
        // inflation, is no prior of the move: it stays where it is.
        let size = size(model, 0.5);
        let open = covariance(&self.calibration);
        let unexplained = open.as_ref().filter(|_| fields.is_none());
        let unexplained = unexplained.map(|c| c * size);
        let prior = motion::prior(&self.geometry, unexplained.as_ref(), &settings.remount);
        let expectation = Expectation {
            geometry: &self.geometry,
            centre: centre_mm,
            model,
            fields,
            scatter,
            root: motion::root(&prior),
            presses,
            size,
            open,
        };
        let outcome = expectation.fit().ok_or(RecalibrationError::Degenerate)?;
        let about = self.about(&outcome, &prior, presses, settings)?;
        let parameters = parameters_after(&self.geometry, centre_mm, &outcome.numbers);
        let geometry = with_parameters(&self.geometry, &parameters);
        let left = covariance_after(
            &self.geometry,
            centre_mm,
            &outcome.numbers,
            &outcome.covariance,
        );
        let locator = self.moved(geometry, &outcome, centre_mm, &left)?;
        let calibration =
            self.calibration_after(geometry, &parameters.into(), left, &outcome, presses);
        Ok(Recalibrated {
            geometry,
            calibration,
            locator,
            about,
        })
    }

    /// Origin and size, with checks.
    fn about(
        &self,
        outcome: &Outcome,
        prior: &Spread,
        presses: &[CalibrationPress],
        settings: &AnalysisSettings,
    ) -> Result<Recalibration, RecalibrationError> {
        let part = |i: usize| Move {
            value: outcome.numbers[i],
            standard_error: outcome.covariance[(i, i)].max(0.0).sqrt(),
            expected: prior[(i, i)].sqrt(),
        };
        let camera = |k: usize| CameraMove {
            shift_mm: [part(WHOLE + 2 * k), part(WHOLE + 2 * k + 1)],
            turn_deg: part(WHOLE + 4 + k),
        };
        let outliers = presses.iter().zip(&outcome.weights);
        let remaining = presses.len() as u64 - 1;
        let about = Recalibration {
            from: self.session.clone(),
            presses: presses.len() as u32,
            outliers: outliers
                .filter(|(_, weight)| **weight < OUTLIER)
                .map(|(p, _)| p.press)
                .collect(),
            shift_mm: [part(0), part(1)],
            turn_deg: part(2),
            cameras: [camera(0), camera(1)],
            // Chi-squared with an even number of degrees of freedom has Poisson's tail.
            chance: poisson_cdf(remaining - 1, 0.5 * outcome.square),
        };
        let largest = about
            .parts()
            .into_iter()
            .max_by(|a, b| a.1.sigmas().total_cmp(&b.1.sigmas()));
        let limit = settings.remount.max_sigmas;
        match largest {
            Some((part, moved)) if moved.sigmas() > limit => Err(RecalibrationError::TooLarge {
                part,
                value: moved.value,
                sigmas: moved.sigmas(),
                limit,
            }),
            _ if about.chance < settings.remount.min_chance => {
                Err(RecalibrationError::DoesNotFit {
                    chance: about.chance,
                    limit: settings.remount.min_chance,
                    presses: presses.len(),
                })
            }
            _ => Ok(about),
        }
    }

    /// The earlier locator about the new geometry, its field moved with the skin.
    fn moved(
        &self,
        geometry: StereoGeometry,
        outcome: &Outcome,
        centre_mm: [f64; 2],
        left: &DMatrix<f64>,
    ) -> Result<LocatorChoice, RecalibrationError> {
        let motion = RigidMotion::new(centre_mm, &outcome.numbers);
        let mut model: LocatorModel = self.locator.model.clone();
        // Regions of the geometry multiply its covariance by their size and by the inflation.
        let divisor = match &model.cameras {
            None => size(&model, LEVEL) * model.inflation,
            Some(_) => 1.0,
        };
        // The earlier geometry was off by so much before, place by place, and a few presses cannot tell where.
        let earlier = model.geometry_covariance.take();
        let before = |i: usize, j: usize| earlier.as_ref().map_or(0.0, |rows| rows[i][j]);
        let row = |i: usize| {
            let each = 0..PARAMETERS;
            each.map(|j| before(i, j) + left[(i, j)] / divisor)
                .collect()
        };
        let rows: Vec<Vec<f64>> = (0..PARAMETERS).map(row).collect();
        match &mut model.cameras {
            None => model.geometry_covariance = Some(rows),
            Some(cameras) => {
                model.remount_covariance = Some(rows);
                for camera in cameras {
                    let spreads = camera.spreads.iter_mut().flatten().map(|s| &mut s.field);
                    for field in spreads.chain([&mut camera.field]) {
                        for point in &mut field.points {
                            point.at_mm = motion.forth(point.at_mm);
                        }
                    }
                }
            }
        }
        let fitted = FittedLocator::new(self.locator.locator, geometry, model.clone())
            .map_err(|_| RecalibrationError::Degenerate)?;
        Ok(LocatorChoice {
            fitted,
            result: LocatorResult {
                compared: Vec::new(),
                bound_mm: None,
                model,
                reliability: Vec::new(),
                ..self.locator.clone()
            },
            warnings: Vec::new(),
        })
    }

    /// The calibration as a fit that begins at the earlier geometry.
    fn calibration_after(
        &self,
        geometry: StereoGeometry,
        values: &[f64; PARAMETERS],
        left: DMatrix<f64>,
        outcome: &Outcome,
        presses: &[CalibrationPress],
    ) -> CalibrationResult {
        let fields = self.locator.model.cameras.is_some();
        // What a field corrects is still unknown about the parameters.
        let all = match covariance(&self.calibration).filter(|_| fields) {
            Some(earlier) => left + earlier,
            None => left,
        };
        let model = match self.calibration.model {
            CalibrationModel::None | CalibrationModel::Positions => {
                CalibrationModel::PositionsSkews
            }
            model => model,
        };
        let outliers = outcome.weights.iter().filter(|w| **w < OUTLIER).count();
        CalibrationResult {
            rmse_before_mm: rmse_mm(presses, &self.geometry),
            rmse_after_mm: rmse_mm(presses, &geometry),
            n: presses.len() as u32,
            outliers: outliers as u32,
            termination: outcome.termination,
            starts: outcome.starts[0],
            starts_agreeing: outcome.starts[1],
            ..standard_fit(&self.geometry, model, values, &all)
        }
    }
}

impl Recalibrated {
    /// Warnings about the correction.
    #[must_use]
    pub fn warnings(&self) -> Vec<Warning> {
        let about = &self.about;
        let unusual = (about.chance < UNUSUAL).then_some(WarningCause::RemountUnusual {
            chance: about.chance,
        });
        let outliers = (!about.outliers.is_empty()).then(|| WarningCause::RemountOutliers {
            presses: about.outliers.clone(),
            of: about.presses,
        });
        let both = unusual.into_iter().chain(outliers);
        both.map(Warning::from).collect()
    }
}

const _: () = assert!(NUMBERS == WHOLE + PARAMETERS);

impl Recalibration {
    /// All parts of the move, by name.
    fn parts(&self) -> Vec<(RemountPart, Move)> {
        let mut parts = vec![
            (RemountPart::ShiftX, self.shift_mm[0]),
            (RemountPart::ShiftY, self.shift_mm[1]),
            (RemountPart::Turn, self.turn_deg),
        ];
        for (camera, moved) in CameraId::ALL.into_iter().zip(&self.cameras) {
            parts.push((RemountPart::CameraShiftX { camera }, moved.shift_mm[0]));
            parts.push((RemountPart::CameraShiftY { camera }, moved.shift_mm[1]));
            parts.push((RemountPart::CameraTurn { camera }, moved.turn_deg));
        }
        parts
    }
}

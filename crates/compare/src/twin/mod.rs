//! The twin of a session: the optical scene whose skins look like it, and what they predict.
//!
//! Skins are drawn from the range of each constant ([`TwinConstant`]) and simulated by the session's own protocol. What the calibration
//! presses of a session show ([`CalibrationFigures`]) predicts its constants, and the errors of its other presses, through a regression
//! over these skins; the skins' own residuals are the uncertainty (`regression`). So the figures of held-out presses, also those of
//! a changed protocol, come with intervals that hold for sessions like the skins. A session unlike all of them has no twin (`likeness`).
//! `tests/tests/system/twins.rs` measures the coverage.

mod constants;
mod figures;
mod likeness;
mod places;
mod rank;
mod regression;
#[cfg(test)]
mod tests;

use serde::{Deserialize, Serialize};

use self::regression::Design;
use crate::scene::{SessionFigure, SessionFigures};

pub use self::constants::TwinConstant;
pub use self::figures::{
    CalibrationFigure, CalibrationFigures, Observed, PlaceErrors, SkinDraw, calibration_only,
    outcomes, place_errors,
};

/// Fewest skins from which a twin is fitted.
const LEAST_SKINS: usize = 40;
/// A figure of the session is used if at least this share of the skins has it.
const LEAST_SHARE: f64 = 0.9;
/// A figure is named as unlike beyond this many standard deviations of what the other figures make of it.
const UNLIKE: f64 = 3.0;

/// Figures of the held-out presses that a twin predicts.
pub const OUTCOMES: [SessionFigure; 4] = [
    SessionFigure::Rmse,
    SessionFigure::RepeatStd,
    SessionFigure::Located,
    SessionFigure::PressRate,
];

/// A value with the 95 % interval of one session.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    /// Median.
    pub middle: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// A twin.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Twin {
    /// Skins behind it.
    pub skins: u32,
    /// Skins that lack a figure of the session.
    pub left_out: u32,
    /// Skins that lie at least as far from the other ones as the session lies from all.
    pub farther: u32,
    /// The figures that it was fitted to.
    pub figures: Vec<FigureFit>,
    /// The constants; empty if the session is unlike the skins.
    pub constants: Vec<ConstantFit>,
    /// Predictions for the scored presses; empty if the session is unlike the skins.
    pub outcomes: Vec<OutcomePrediction>,
    /// Errors by place; `None` if too few places have calibration presses.
    pub places: Option<PlacePrediction>,
}

/// A figure of the session, and what its other figures make of it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FigureFit {
    /// The figure.
    pub figure: CalibrationFigure,
    /// Of the session, in its unit.
    pub session: f64,
    /// 95 % of skins whose other figures are like the session's.
    pub expected: Interval,
    /// Distance from it, standard deviations.
    pub deviations: f64,
}

impl FigureFit {
    /// True if no skin with the session's other figures has this one.
    #[must_use]
    pub fn is_unlike(&self) -> bool {
        self.deviations.abs() > UNLIKE
    }
}

/// A constant of the twin.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ConstantFit {
    /// The constant.
    pub constant: TwinConstant,
    /// In its unit.
    pub value: Interval,
    /// Share of the variance between skins that the figures explain: 0 for a constant that the session does not show.
    pub explained: f64,
    /// Draws as shares of the range's probability; those of one place in all constants belong together.
    pub draws: Vec<f64>,
}

/// A figure of the held-out presses.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct OutcomePrediction {
    /// The figure.
    pub figure: SessionFigure,
    /// Prediction; `None` if the skins do not vary in it, or too few have it.
    pub predicted: Option<Interval>,
    /// What the session shows.
    pub recorded: Option<f64>,
    /// Prediction for the changed protocol; `None` without one.
    pub changed: Option<Interval>,
}

/// Errors by place.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlacePrediction {
    /// The session's places.
    pub places: Vec<PlaceErrors>,
    /// Predicted error of the scored presses of each, mm.
    pub predicted_mm: Vec<Option<f64>>,
    /// Rank correlation of the predictions with the recorded errors.
    pub correlation: Option<f64>,
    /// What is usual among skins left out of the fit; `None` from too few.
    pub usual: Option<Interval>,
}

/// Why there is no twin.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum NoTwin {
    /// Too few skins were simulated and analysed.
    #[error(
        "expected at least {LEAST_SKINS} simulated skins with the figures of the session, found {0}"
    )]
    TooFew(usize),
    /// The calibration presses of the session show nothing.
    #[error("expected calibration presses with events, found none that have figures")]
    NoFigures,
}

/// Fits the twin of a session over simulated skins.
///
/// # Errors
/// [`NoTwin`]. A session unlike the skins is no error, but nothing is predicted of it: [`Twin::is_like`].
pub fn twin(session: &Observed, skins: &[SkinDraw]) -> Result<Twin, NoTwin> {
    let used = used_figures(&session.figures, skins);
    if used.is_empty() {
        return Err(NoTwin::NoFigures);
    }
    let row = |figures: &CalibrationFigures| -> Option<Vec<f64>> {
        let of = |k: &usize| Some(CalibrationFigure::ALL[*k].scale().of(figures.values[*k]?));
        used.iter().map(of).collect()
    };
    let own = row(&session.figures).ok_or(NoTwin::NoFigures)?;
    let (rows, kept): (Vec<Vec<f64>>, Vec<&SkinDraw>) = skins
        .iter()
        .filter_map(|skin| Some((row(&skin.figures)?, skin)))
        .unzip();
    if kept.len() < LEAST_SKINS {
        return Err(NoTwin::TooFew(kept.len()));
    }
    let likeness = likeness::likeness(&rows, &own).ok_or(NoTwin::NoFigures)?;
    let figures = used.iter().zip(&likeness.figures);
    let unlike = Twin {
        skins: kept.len() as u32,
        left_out: (skins.len() - kept.len()) as u32,
        farther: likeness.farther,
        figures: figures.map(|(k, f)| figure_fit(*k, f)).collect(),
        constants: Vec::new(),
        outcomes: Vec::new(),
        places: None,
    };
    if !unlike.is_like() {
        return Ok(unlike);
    }
    let outcome = |figure: SessionFigure| {
        // An end just below all presses would leave out a session that locates all.
        let attainable = |found: Interval| Interval {
            low: session.outcomes.attainable(figure, found.low),
            high: session.outcomes.attainable(figure, found.high),
            ..found
        };
        let own_skins = predicted(figure, &rows, &own, &kept, |skin| Some(&skin.outcomes));
        let changed = predicted(figure, &rows, &own, &kept, |skin| skin.changed.as_ref());
        OutcomePrediction {
            figure,
            predicted: own_skins.map(attainable),
            recorded: session.outcomes.get(figure),
            changed: changed.map(attainable),
        }
    };
    Ok(Twin {
        constants: constants(&Design::new(&rows, &own), &kept),
        outcomes: OUTCOMES.map(outcome).to_vec(),
        places: place_prediction(&session.places, &kept),
        ..unlike
    })
}

fn constants(design: &Design, skins: &[&SkinDraw]) -> Vec<ConstantFit> {
    let fit = |(k, constant): (usize, &TwinConstant)| {
        let values: Vec<f64> = skins.iter().map(|skin| logit(skin.shares[k])).collect();
        let found = design.predict(&values)?;
        let draws: Vec<f64> = found.draws.iter().map(|x| logistic(*x)).collect();
        let share = interval(&draws)?;
        Some(ConstantFit {
            constant: *constant,
            value: Interval {
                middle: constant.at(share.middle),
                low: constant.at(share.low),
                high: constant.at(share.high),
            },
            explained: found.explained,
            draws,
        })
    };
    TwinConstant::ALL
        .iter()
        .enumerate()
        .filter_map(fit)
        .collect()
}

impl Twin {
    /// False if the session is farther from the skins than each of them from the other ones, by either distance, which at most
    /// two of `skins + 1` right sessions are: the scene has no skin that looks like it.
    #[must_use]
    pub const fn is_like(&self) -> bool {
        self.farther > 0
    }

    /// Settings of a protocol for this twin, as `key=value`: the median of each constant.
    #[must_use]
    pub fn settings(&self) -> Vec<String> {
        let median = |fit: &ConstantFit| Some(fit.constant.setting(interval(&fit.draws)?.middle));
        self.constants.iter().filter_map(median).collect()
    }
}

/// Positions in [`CalibrationFigure::ALL`] of the figures that the session has, and nearly all skins.
fn used_figures(session: &CalibrationFigures, skins: &[SkinDraw]) -> Vec<usize> {
    let least = LEAST_SHARE * skins.len() as f64;
    let is_used = |k: &usize| {
        let n = skins
            .iter()
            .filter(|skin| skin.figures.values[*k].is_some())
            .count();
        session.values[*k].is_some() && n as f64 >= least
    };
    (0..CalibrationFigure::ALL.len()).filter(is_used).collect()
}

/// Prediction of an outcome over the skins that have it.
fn predicted<'a>(
    figure: SessionFigure,
    rows: &[Vec<f64>],
    own: &[f64],
    skins: &[&'a SkinDraw],
    outcomes: impl Fn(&'a SkinDraw) -> Option<&'a SessionFigures>,
) -> Option<Interval> {
    let scale = figure.scale();
    let of = |skin: &&'a SkinDraw| outcomes(skin)?.get(figure).map(|x| scale.of(x));
    let pairs = rows
        .iter()
        .zip(skins)
        .filter_map(|(row, skin)| Some((row.clone(), of(skin)?)));
    let (rows, values): (Vec<Vec<f64>>, Vec<f64>) = pairs.unzip();
    if rows.len() < LEAST_SKINS {
        return None;
    }
    let found = interval(&Design::new(&rows, own).predict(&values)?.draws)?;
    Some(Interval {
        middle: scale.back(found.middle),
        low: scale.back(found.low),
        high: scale.back(found.high),
    })
}

fn figure_fit(k: usize, found: &likeness::Expected) -> FigureFit {
    let figure = CalibrationFigure::ALL[k];
    let scale = figure.scale();
    let at = |deviations: f64| scale.back(found.middle + deviations * found.deviation);
    FigureFit {
        figure,
        session: scale.back(found.session),
        expected: Interval {
            middle: at(0.0),
            low: at(-1.96),
            high: at(1.96),
        },
        deviations: (found.session - found.middle) / found.deviation,
    }
}

fn place_prediction(session: &[PlaceErrors], skins: &[&SkinDraw]) -> Option<PlacePrediction> {
    let (predicted_mm, usual) = places::predict(session, skins)?;
    let pairs = session.iter().zip(&predicted_mm);
    let (found, expected): (Vec<f64>, Vec<f64>) = pairs
        .filter_map(|(place, predicted)| Some((place.scored_mm?, (*predicted)?)))
        .unzip();
    Some(PlacePrediction {
        places: session.to_vec(),
        correlation: rank::rank_correlation(&expected, &found),
        usual: interval(&usual),
        predicted_mm,
    })
}

/// Median and 95 % interval of draws, from their order statistics; `None` from fewer than 39, which have no such interval.
fn interval(draws: &[f64]) -> Option<Interval> {
    let mut sorted = draws.to_vec();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len();
    let rank = (0.025 * (n + 1) as f64) as usize;
    if rank == 0 {
        return None;
    }
    Some(Interval {
        middle: 0.5 * (sorted[(n - 1) / 2] + sorted[n / 2]),
        low: sorted[rank - 1],
        high: sorted[n - rank],
    })
}

fn logit(share: f64) -> f64 {
    libm::log(share / (1.0 - share))
}

fn logistic(x: f64) -> f64 {
    1.0 / (1.0 + libm::exp(-x))
}

//! Whether a session is like the scene that is to explain it: figures of the session against those of simulated sessions of the
//! same protocol.
//!
//! The simulated sessions, the replicates, are draws of what the scene predicts: the session is one more draw if the scene is
//! right. Each figure is compared with the prediction interval of its replicates (Student's t on a scale on which the figure is
//! near normal: logarithm, arcsine of the root of a share); p values are corrected for the number of figures (Holm 1979).
//! `tests/tests/system/scene_prediction.rs` measures how often a right scene is rejected.

mod figure;

use serde::{Deserialize, Serialize};
use skinrig_statistics::distributions::{student_cdf, student_quantile};
use skinrig_statistics::holm;

pub(crate) use figure::Scale;
pub use figure::{SessionFigure, SessionFigures};

/// Fewest replicates from which a figure is predicted.
pub const LEAST_REPLICATES: usize = 8;
/// A figure differs if its corrected p value is below this.
const ALPHA: f64 = 0.05;

/// A figure of a session and its prediction.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FigurePrediction {
    /// The figure.
    pub figure: SessionFigure,
    /// Value of the session, in the figure's unit; `None` if the session has none.
    pub session: Option<f64>,
    /// Replicates that have one.
    pub replicates: u32,
    /// What they predict; `None` from fewer than [`LEAST_REPLICATES`], or if they do not vary.
    pub predicted: Option<Predicted>,
}

/// The prediction of a figure.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Predicted {
    /// Middle of the replicates, in the figure's unit.
    pub middle: f64,
    /// Lower end of the 95 % prediction interval of one session.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// p value of the session under the scene, two-sided, corrected for the number of figures; `None` without a value.
    pub p: Option<f64>,
    /// Distance of the session from the middle in standard deviations of a new session; `None` without a value.
    pub deviations: Option<f64>,
}

impl FigurePrediction {
    /// True if the session's value is not what the scene predicts.
    #[must_use]
    pub fn differs(&self) -> bool {
        let p = self.predicted.and_then(|predicted| predicted.p);
        p.is_some_and(|p| p < ALPHA)
    }

    /// True if the session's value lies above the prediction.
    #[must_use]
    pub fn is_higher(&self) -> bool {
        let deviations = self.predicted.and_then(|p| p.deviations);
        deviations.is_some_and(|d| d > 0.0)
    }
}

/// Compares the figures of a session with those of its replicates. One row per figure, in the order of [`SessionFigure::ALL`].
#[must_use]
pub fn predict(session: &SessionFigures, replicates: &[SessionFigures]) -> Vec<FigurePrediction> {
    let rows = SessionFigure::ALL.map(|figure| row(figure, session, replicates));
    let p: Vec<Option<f64>> = rows.iter().map(|(_, p)| *p).collect();
    let rows = rows.into_iter().zip(holm(&p));
    rows.map(|((mut row, _), p)| {
        if let Some(predicted) = &mut row.predicted {
            predicted.p = p;
        }
        row
    })
    .collect()
}

/// The prediction of one figure, and its p value alone.
fn row(
    figure: SessionFigure,
    session: &SessionFigures,
    replicates: &[SessionFigures],
) -> (FigurePrediction, Option<f64>) {
    let scale = figure.scale();
    let drawn: Vec<f64> = replicates
        .iter()
        .filter_map(|figures| Some(scale.of(figures.get(figure)?)))
        .filter(|x| x.is_finite())
        .collect();
    let mut row = FigurePrediction {
        figure,
        session: session.get(figure),
        replicates: drawn.len() as u32,
        predicted: None,
    };
    let Some((middle, deviation)) = spread(&drawn, figure.least_deviation(session)) else {
        return (row, None);
    };
    let freedom = drawn.len() as f64 - 1.0;
    let reach = student_quantile(0.975, freedom) * deviation;
    let deviations = row.session.map(|x| (scale.of(x) - middle) / deviation);
    row.predicted = Some(Predicted {
        middle: scale.back(middle),
        low: scale.back(middle - reach),
        high: scale.back(middle + reach),
        p: None,
        deviations,
    });
    let p = deviations.map(|d| 2.0 * student_cdf(-d.abs(), freedom));
    (row, p)
}

/// Mean, and standard deviation of a new draw around it. `None` from too few draws, or if they do not vary.
fn spread(drawn: &[f64], least: f64) -> Option<(f64, f64)> {
    if drawn.len() < LEAST_REPLICATES {
        return None;
    }
    let n = drawn.len() as f64;
    let mean = drawn.iter().sum::<f64>() / n;
    let squares: f64 = drawn.iter().map(|x| (x - mean) * (x - mean)).sum();
    let is_fixed = drawn.iter().all(|x| *x == drawn[0]);
    let own = if is_fixed {
        0.0
    } else {
        (squares / (n - 1.0)).sqrt()
    };
    let deviation = own.max(least);
    (deviation > 0.0).then(|| (mean, deviation * (1.0 + 1.0 / n).sqrt()))
}

#[cfg(test)]
mod tests;

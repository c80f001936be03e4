//! A value of a skin, predicted from its figures: ridge regression over simulated skins, with the spread of what each skin's own value
//! is from the prediction of the other ones.
//!
//! If the session is one more draw of what the skins are drawn from, the value minus the prediction by all skins but one is one more
//! residual of the kind that the skins themselves have: quantiles of the prediction plus the left-out residuals hold the value with the
//! stated probability (jackknife+, Barber et al. 2021), whether or not the regression is right. Residuals are scaled to the size that is
//! usual at the predicted value. The constant of the ridge is that with the least left-out error.

use nalgebra::{DMatrix, DVector};

/// Constants of the ridge, in units of the figures' variance.
const RIDGES: [f64; 6] = [0.01, 0.1, 1.0, 10.0, 100.0, 1_000.0];
/// A residual counts as at least this share of the largest one where its size is learnt: zeros have no logarithm.
const LEAST_RESIDUAL: f64 = 1e-3;

/// Figures of the skins and of the session, each column with mean 0 and variance 1 over the skins.
#[derive(Debug, Clone)]
pub(super) struct Design {
    /// One row per skin; the first column is 1.
    rows: DMatrix<f64>,
    session: DVector<f64>,
}

/// Draws of a value of the session.
#[derive(Debug, Clone)]
pub(super) struct Prediction {
    /// One per skin, in their order: the prediction without it, plus its own residual.
    pub(super) draws: Vec<f64>,
    /// Share of the variance between skins that the figures explain, in skins left out of the fit; at least 0.
    pub(super) explained: f64,
}

impl Design {
    /// `figures`: one row per skin, all of the session's length and finite. Columns that do not vary say nothing and are left out.
    pub(super) fn new(figures: &[Vec<f64>], session: &[f64]) -> Self {
        let n = figures.len();
        let mut columns = vec![(DVector::from_element(n, 1.0), 1.0)];
        for (k, own) in session.iter().enumerate() {
            let column = DVector::from_iterator(n, figures.iter().map(|row| row[k]));
            let (mean, deviation) = moments(column.as_slice());
            if deviation > 0.0 {
                columns.push((
                    column.map(|x| (x - mean) / deviation),
                    (own - mean) / deviation,
                ));
            }
        }
        let session = DVector::from_iterator(columns.len(), columns.iter().map(|(_, own)| *own));
        let columns: Vec<DVector<f64>> = columns.into_iter().map(|(column, _)| column).collect();
        Self {
            rows: DMatrix::from_columns(&columns),
            session,
        }
    }

    /// Predicts the session's value from those of the skins; `None` if they do not vary.
    pub(super) fn predict(&self, values: &[f64]) -> Option<Prediction> {
        let (mean, deviation) = moments(values);
        if deviation <= 0.0 {
            return None;
        }
        let y = DVector::from_iterator(values.len(), values.iter().map(|v| (v - mean) / deviation));
        let fits = RIDGES.iter().filter_map(|ridge| self.fit(&y, *ridge));
        let best = fits.min_by(|a, b| a.error.total_cmp(&b.error))?;
        let scale = Scale::of(&best);
        let own = scale.at(best.session);
        let draws = best.left_out.iter().map(|skin| {
            let residual = skin.residual * own / scale.at(skin.prediction);
            mean + deviation * (skin.session + residual)
        });
        Some(Prediction {
            draws: draws.collect(),
            explained: (1.0 - best.error / (values.len() - 1) as f64).max(0.0),
        })
    }

    fn fit(&self, y: &DVector<f64>, ridge: f64) -> Option<Fit> {
        let mut normal = self.rows.transpose() * &self.rows;
        for k in 1..normal.nrows() {
            normal[(k, k)] += ridge;
        }
        let inverse = normal.cholesky()?.inverse();
        let weights = &inverse * self.rows.transpose() * y;
        let session = self.session.dot(&weights);
        let towards = &inverse * &self.session;
        let left_out: Vec<LeftOut> = (0..y.len())
            .map(|i| {
                let row = self.rows.row(i).transpose();
                let lever = row.dot(&(&inverse * &row));
                let residual = (y[i] - row.dot(&weights)) / (1.0 - lever);
                LeftOut {
                    residual,
                    prediction: y[i] - residual,
                    session: session - row.dot(&towards) * residual,
                }
            })
            .collect();
        let error: f64 = left_out
            .iter()
            .map(|skin| skin.residual * skin.residual)
            .sum();
        error.is_finite().then_some(Fit {
            session,
            left_out,
            error,
        })
    }
}

struct Fit {
    session: f64,
    left_out: Vec<LeftOut>,
    /// Sum of the squared residuals.
    error: f64,
}

/// Without one skin: its residual, its prediction, and that of the session.
struct LeftOut {
    residual: f64,
    prediction: f64,
    session: f64,
}

/// Usual size of a residual by the predicted value: its logarithm is linear, up to the ends of the skins' predictions.
struct Scale {
    slope: f64,
    range: (f64, f64),
}

impl Scale {
    fn of(fit: &Fit) -> Self {
        let largest = fit
            .left_out
            .iter()
            .map(|skin| skin.residual.abs())
            .fold(0.0, f64::max);
        let least = (LEAST_RESIDUAL * largest).max(f64::MIN_POSITIVE);
        let sizes: Vec<f64> = fit
            .left_out
            .iter()
            .map(|skin| libm::log(skin.residual.abs().max(least)))
            .collect();
        let at: Vec<f64> = fit.left_out.iter().map(|skin| skin.prediction).collect();
        let ((mean, deviation), (mean_size, _)) = (moments(&at), moments(&sizes));
        let together: f64 = at
            .iter()
            .zip(&sizes)
            .map(|(x, s)| (x - mean) * (s - mean_size))
            .sum();
        let squares = deviation * deviation * (at.len() - 1) as f64;
        let slope = if squares > 0.0 {
            together / squares
        } else {
            0.0
        };
        Self {
            slope,
            range: (
                at.iter().copied().fold(f64::INFINITY, f64::min),
                at.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            ),
        }
    }

    fn at(&self, prediction: f64) -> f64 {
        libm::exp(self.slope * prediction.clamp(self.range.0, self.range.1))
    }
}

/// Mean and standard deviation; exactly 0 for equal values.
pub(super) fn moments(values: &[f64]) -> (f64, f64) {
    if values.windows(2).all(|pair| pair[0] == pair[1]) {
        return (values.first().copied().unwrap_or(0.0), 0.0);
    }
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|x| (x - mean) * (x - mean)).sum();
    (mean, (squares / (n - 1.0)).sqrt())
}

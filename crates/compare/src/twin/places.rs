//! Errors by place: where a skin errs, learnt from the calibration presses of simulated skins and their scored ones.

use nalgebra::{SMatrix, SVector};

use super::figures::{PlaceErrors, SkinDraw};
use super::rank::rank_correlation;

/// Added to an error before its logarithm, mm: a tenth of the smallest errors that matter.
const FLOOR_MM: f64 = 0.02;
/// Fewest places, of all skins together, from which weights are learnt.
const LEAST_PLACES: u32 = 50;
/// Against features that depend on each other, in units of squared logarithms.
const RIDGE: f64 = 1e-3;
/// Nearest other locations whose errors count.
const NEIGHBOURS: usize = 4;

/// Features, and 1.
const TERMS: usize = 6;
type Features = SVector<f64, TERMS>;

/// Features of the places of one skin, and the logarithm of their scored error; `None` without all features.
type Rows = Vec<Option<(Features, Option<f64>)>>;

fn log_error(mm: f64) -> f64 {
    libm::log(mm + FLOOR_MM)
}

/// Features of each place: error of its own calibration presses, of its neighbours', its response and regions, and the mean
/// error there on other skins (`usual`).
fn features(places: &[PlaceErrors], usual: &[Option<f64>]) -> Rows {
    let mut responses: Vec<f64> = places.iter().filter_map(|p| p.response_per_s).collect();
    let median = skinrig_analysis::metrics::quantile(&mut responses, 0.5);
    places
        .iter()
        .zip(usual)
        .map(|(place, usual)| {
            let own = log_error(place.calibration_mm?);
            let near = neighbours(place, places)?;
            let response = (place.response_per_s?.max(0.0) + 1.0) / (median?.max(0.0) + 1.0);
            let region = libm::log(place.region_mm?);
            let row = Features::from([1.0, own, near, libm::log(response), (*usual)?, region]);
            Some((row, place.scored_mm.map(log_error)))
        })
        .collect()
}

/// Mean logarithm of the calibration errors of the nearest other places.
fn neighbours(place: &PlaceErrors, places: &[PlaceErrors]) -> Option<f64> {
    let distance = |p: &PlaceErrors| {
        let (x, y) = (p.at.x_mm - place.at.x_mm, p.at.y_mm - place.at.y_mm);
        x * x + y * y
    };
    let mut others: Vec<(f64, f64)> = places
        .iter()
        .filter(|p| p.location != place.location)
        .filter_map(|p| Some((distance(p), log_error(p.calibration_mm?))))
        .collect();
    others.sort_by(|a, b| a.0.total_cmp(&b.0));
    others.truncate(NEIGHBOURS);
    let n = others.len() as f64;
    (n > 0.0).then(|| others.iter().map(|(_, e)| e).sum::<f64>() / n)
}

/// Mean logarithm of the scored error at each place of the skins without `except`.
fn usual(skins: &[&SkinDraw], except: Option<usize>, n: usize) -> Vec<Option<f64>> {
    (0..n)
        .map(|place| {
            let others = skins.iter().enumerate().filter(|(k, _)| Some(*k) != except);
            let errors: Vec<f64> = others
                .filter_map(|(_, skin)| skin.places.get(place)?.scored_mm.map(log_error))
                .collect();
            (!errors.is_empty()).then(|| errors.iter().sum::<f64>() / errors.len() as f64)
        })
        .collect()
}

/// Predicted error at each place of the session, mm, and the rank correlations of predictions and errors of skins left out of the fit,
/// ascending. `None` if too few places have all features.
pub(super) fn predict(
    session: &[PlaceErrors],
    skins: &[&SkinDraw],
) -> Option<(Vec<Option<f64>>, Vec<f64>)> {
    let n = session.len();
    let skins: Vec<&SkinDraw> = skins
        .iter()
        .copied()
        .filter(|skin| skin.places.len() == n)
        .collect();
    let rows: Vec<Rows> = skins
        .iter()
        .enumerate()
        .map(|(k, skin)| features(&skin.places, &usual(&skins, Some(k), n)))
        .collect();
    let of_session = features(session, &usual(&skins, None, n));
    let all = Sums::of(rows.iter().flatten());
    let mut correlations: Vec<f64> = rows
        .iter()
        .filter_map(|skin| {
            let weights = all.without(skin).weights()?;
            let pairs = skin
                .iter()
                .flatten()
                .filter_map(|(row, error)| Some((weights.dot(row), (*error)?)));
            let (predicted, found): (Vec<f64>, Vec<f64>) = pairs.unzip();
            rank_correlation(&predicted, &found)
        })
        .collect();
    correlations.sort_by(f64::total_cmp);
    let weights = all.weights()?;
    let predicted = of_session.iter().map(|row| {
        let (row, _) = row.as_ref()?;
        Some((libm::exp(weights.dot(row)) - FLOOR_MM).max(0.0))
    });
    Some((predicted.collect(), correlations))
}

/// Sums of the least squares.
#[derive(Clone, Copy)]
struct Sums {
    normal: SMatrix<f64, TERMS, TERMS>,
    right: Features,
    n: u32,
}

impl Sums {
    fn of<'a>(rows: impl Iterator<Item = &'a Option<(Features, Option<f64>)>>) -> Self {
        let mut sums = Self {
            normal: SMatrix::zeros(),
            right: Features::zeros(),
            n: 0,
        };
        for (row, error) in rows.flatten() {
            let Some(error) = error else { continue };
            sums.normal += row * row.transpose();
            sums.right += row * *error;
            sums.n += 1;
        }
        sums
    }

    fn without(&self, skin: &Rows) -> Self {
        let own = Self::of(skin.iter());
        Self {
            normal: self.normal - own.normal,
            right: self.right - own.right,
            n: self.n - own.n,
        }
    }

    /// Weights of the features; `None` from too few places.
    fn weights(&self) -> Option<Features> {
        if self.n < LEAST_PLACES {
            return None;
        }
        let ridge = SMatrix::identity() * RIDGE;
        Some((self.normal + ridge).cholesky()?.solve(&self.right))
    }
}

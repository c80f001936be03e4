//! Whether a session looks like any of the simulated skins: figures that lie outside what the scene can show, alone or together.

use nalgebra::{DMatrix, DVector};

use super::regression::moments;

/// Share of a column's variance that is added to it: figures may depend on each other exactly.
const RIDGE: f64 = 1e-3;

/// A session among the skins.
#[derive(Debug, Clone)]
pub(super) struct Likeness {
    /// Skins that lie at least as far from the other ones as the session from all: the lesser count of two distances.
    pub(super) farther: u32,
    /// Per figure: what the other figures of the session make of it, and its distance from that, in standard deviations.
    pub(super) figures: Vec<Expected>,
}

/// A figure as the other ones predict it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Expected {
    pub(super) middle: f64,
    pub(super) deviation: f64,
    pub(super) session: f64,
}

/// How far figures lie from those of others.
struct Distances {
    /// Of Mahalanobis: all figures together.
    together: f64,
    /// The farthest figure from what the other ones make of it, standard deviations.
    alone: f64,
}

impl Distances {
    fn of(off: &DVector<f64>, precision: &DMatrix<f64>) -> Self {
        let pulled = precision * off;
        let alone = |k: usize| (pulled[k] / precision[(k, k)].sqrt()).abs();
        Self {
            together: off.dot(&pulled),
            alone: (0..off.len()).map(alone).fold(0.0, f64::max),
        }
    }
}

/// `figures`: one row per skin; at least two rows.
pub(super) fn likeness(figures: &[Vec<f64>], session: &[f64]) -> Option<Likeness> {
    let n = figures.len();
    let columns = session.len();
    let column = |k: usize| figures.iter().map(|row| row[k]).collect::<Vec<f64>>();
    let spread: Vec<(f64, f64)> = (0..columns).map(|k| moments(&column(k))).collect();
    // A column that does not vary is compared as it is.
    let unit = |k: usize| if spread[k].1 > 0.0 { spread[k].1 } else { 1.0 };
    let standard = |row: &[f64]| {
        DVector::from_iterator(
            columns,
            row.iter()
                .enumerate()
                .map(|(k, x)| (x - spread[k].0) / unit(k)),
        )
    };
    let rows: Vec<DVector<f64>> = figures.iter().map(|row| standard(row)).collect();
    let own = standard(session);
    let total = rows
        .iter()
        .fold(DMatrix::zeros(columns, columns), |sum, z| {
            sum + z * z.transpose()
        });
    let precision = |squares: &DMatrix<f64>, n: f64| {
        let mut covariance = squares / (n - 1.0);
        for k in 0..columns {
            covariance[(k, k)] += RIDGE;
        }
        Some(covariance.cholesky()?.inverse())
    };
    // Rows have mean 0. Without one: its share of the mean and of the squares is taken away.
    let without = |z: &DVector<f64>| {
        let rest = (n - 1) as f64;
        let mean = -z / rest;
        let squares = &total - z * z.transpose() - &mean * mean.transpose() * rest;
        Some((mean, precision(&squares, rest)?))
    };
    let inverse = precision(&total, n as f64)?;
    let far = Distances::of(&own, &inverse);
    let mut farther = [0, 0];
    for z in &rows {
        let (mean, inverse) = without(z)?;
        let skin = Distances::of(&(z - mean), &inverse);
        farther[0] += u32::from(skin.together >= far.together);
        farther[1] += u32::from(skin.alone >= far.alone);
    }
    let pulled = &inverse * &own;
    let figures = (0..columns).map(|k| {
        let (own_mean, scale) = (spread[k].0, unit(k));
        let off = pulled[k] / inverse[(k, k)];
        Expected {
            middle: own_mean + scale * (own[k] - off),
            deviation: scale / inverse[(k, k)].sqrt(),
            session: session[k],
        }
    });
    Some(Likeness {
        farther: farther[0].min(farther[1]),
        figures: figures.collect(),
    })
}

//! Profile of a single touch in one camera: shape and widths over columns, learnt from the calibration presses.

use nalgebra::{DMatrix, DVector};

use super::sight::{BIN_PX, BINS, TouchSight, column};

/// Range and step of the shape, in standard deviations.
const REACH: f64 = 4.0;
const STEP: f64 = 0.1;
const CELLS: usize = 81;
/// Least shape, relative to its integral.
const LEAST_SHAPE: f64 = 1e-5;
/// Rounds in which shape and sensitivity are learnt in turn.
const ROUNDS: usize = 4;
/// Events below which a column keeps its prior sensitivity of 1, and limits of the sensitivity.
const PRIOR_EVENTS: f64 = 200.0;
const GAINS: [f64; 2] = [0.1, 5.0];
/// Terms of the polynomial of widths over positions.
const TERMS: usize = 6;
/// Ridge that keeps the polynomial finite with few presses, and least scatter of the logarithm of a width.
const RIDGE: f64 = 1e-3;
const LEAST_SCATTER: f64 = 0.03;

/// Count, mean and standard deviation over columns, px.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Moments {
    pub(super) events: f64,
    pub(super) mean: f64,
    pub(super) width: f64,
}

/// Moments of a histogram over bins of columns.
pub(super) fn moments(counts: &[f64]) -> Option<Moments> {
    let n: f64 = counts.iter().sum();
    let mean = counts
        .iter()
        .enumerate()
        .map(|(k, n)| n * column(k))
        .sum::<f64>()
        / n;
    let square = |(k, n): (usize, &f64)| n * (column(k) - mean).powi(2);
    let variance = counts.iter().enumerate().map(square).sum::<f64>() / n;
    (n > 0.0).then(|| Moments {
        events: n,
        mean,
        width: variance.max((BIN_PX * BIN_PX) as f64 / 4.0).sqrt(),
    })
}

/// Moments about the main cluster: columns beyond 3.5 widths do not count.
fn main_cluster(counts: &[f64]) -> Option<Moments> {
    let half: f64 = 0.5 * counts.iter().sum::<f64>();
    let mut sum = 0.0;
    let median = counts.iter().position(|n| {
        sum += n;
        sum >= half
    })?;
    let (mut centre, mut reach) = (column(median), 150.0);
    let mut found = None;
    for _ in 0..12 {
        let inside = |k: usize| (column(k) - centre).abs() < reach;
        let cut: Vec<f64> = counts
            .iter()
            .enumerate()
            .map(|(k, n)| if inside(k) { *n } else { 0.0 })
            .collect();
        let moments = moments(&cut)?;
        (centre, reach) = (moments.mean, (3.5 * moments.width).max(20.0));
        found = Some(moments);
    }
    found
}

/// A single touch at a known place.
pub(super) struct Example<'a> {
    pub(super) at: [f64; 2],
    pub(super) sight: &'a TouchSight,
}

/// Profile of touches in one camera.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Profile {
    /// Density over standard deviations.
    shape: Vec<f64>,
    /// Relative sensitivity of each bin of columns.
    gain: Vec<f64>,
    /// Logarithm of the width by position, and its scatter.
    widths: [f64; TERMS],
    pub(super) scatter: f64,
    /// Median width, px.
    pub(super) typical: f64,
}

impl Profile {
    /// `None` with fewer examples than the widths have terms.
    pub(super) fn learn(examples: &[Example<'_>]) -> Option<Self> {
        let nets: Vec<Vec<f64>> = examples.iter().map(|e| e.sight.net_columns()).collect();
        let seen: Vec<(usize, Moments)> = nets
            .iter()
            .enumerate()
            .filter_map(|(k, net)| Some((k, main_cluster(net)?)))
            .collect();
        if seen.len() < TERMS {
            return None;
        }
        let mut profile = Self {
            shape: vec![1.0 / CELLS as f64; CELLS],
            gain: vec![1.0; BINS],
            widths: [0.0; TERMS],
            scatter: LEAST_SCATTER,
            typical: median(seen.iter().map(|(_, m)| m.width).collect()),
        };
        for _ in 0..ROUNDS {
            profile.learn_shape(&nets, &seen);
            profile.learn_gain(&nets, &seen);
        }
        profile.learn_widths(examples, &seen)?;
        Some(profile)
    }

    fn learn_shape(&mut self, nets: &[Vec<f64>], seen: &[(usize, Moments)]) {
        let mut shape = vec![LEAST_SHAPE; CELLS];
        for (k, m) in seen {
            for (bin, n) in nets[*k].iter().enumerate() {
                let cell = cell((column(bin) - m.mean) / m.width);
                if let Some(cell) = cell {
                    shape[cell] += n / m.events / self.gain[bin] * m.width / BIN_PX as f64;
                }
            }
        }
        let mut weights = vec![0.0; CELLS];
        for (_, m) in seen {
            for bin in 0..BINS {
                if let Some(cell) = cell((column(bin) - m.mean) / m.width) {
                    weights[cell] += 1.0;
                }
            }
        }
        let smooth = |k: usize| {
            let range = k.saturating_sub(2)..(k + 3).min(CELLS);
            let weight: f64 = weights[range.clone()].iter().sum();
            shape[range].iter().sum::<f64>() / weight.max(1.0)
        };
        let shape: Vec<f64> = (0..CELLS).map(smooth).collect();
        let sum = shape.iter().sum::<f64>() * STEP;
        self.shape = shape.iter().map(|s| (s / sum).max(LEAST_SHAPE)).collect();
    }

    fn learn_gain(&mut self, nets: &[Vec<f64>], seen: &[(usize, Moments)]) {
        let (mut found, mut expected) = (vec![PRIOR_EVENTS; BINS], vec![PRIOR_EVENTS; BINS]);
        for (k, m) in seen {
            let flat = self.flat(m.mean, m.width);
            for bin in 0..BINS {
                // Beyond its own reach the events of a press are noise.
                if (column(bin) - m.mean).abs() < 3.0 * m.width {
                    found[bin] += nets[*k][bin];
                    expected[bin] += m.events * flat[bin];
                }
            }
        }
        let ratio = found.iter().zip(&expected);
        self.gain = ratio
            .map(|(f, e)| (f / e).clamp(GAINS[0], GAINS[1]))
            .collect();
    }

    fn learn_widths(&mut self, examples: &[Example<'_>], seen: &[(usize, Moments)]) -> Option<()> {
        let rows: Vec<[f64; TERMS]> = seen.iter().map(|(k, _)| terms(examples[*k].at)).collect();
        let values: Vec<f64> = seen.iter().map(|(_, m)| libm::log(m.width)).collect();
        let mut normal = DMatrix::identity(TERMS, TERMS) * RIDGE;
        let mut right = DVector::zeros(TERMS);
        for (row, value) in rows.iter().zip(&values) {
            let row = DVector::from_row_slice(row);
            normal += &row * row.transpose();
            right += row * (*value);
        }
        let solved = normal.cholesky()?.solve(&right);
        self.widths.copy_from_slice(solved.as_slice());
        let residuals = rows.iter().zip(&values).map(|(row, value)| {
            let fit: f64 = row.iter().zip(&self.widths).map(|(a, b)| a * b).sum();
            (value - fit).abs()
        });
        self.scatter = (1.4826 * median(residuals.collect())).max(LEAST_SCATTER);
        Some(())
    }

    /// Expected width of a touch at a position, px.
    pub(super) fn width_at(&self, at: [f64; 2]) -> f64 {
        let log: f64 = terms(at).iter().zip(&self.widths).map(|(a, b)| a * b).sum();
        libm::exp(log).clamp(0.3 * self.typical, 3.0 * self.typical)
    }

    /// Share of a touch's events in each bin, without sensitivities.
    fn flat(&self, mean: f64, width: f64) -> Vec<f64> {
        let per_bin = BIN_PX as f64 / width;
        (0..BINS)
            .map(|bin| per_bin * self.density((column(bin) - mean) / width))
            .collect()
    }

    fn density(&self, z: f64) -> f64 {
        let at = (z + REACH) / STEP;
        if !(0.0..(CELLS - 1) as f64).contains(&at) {
            return LEAST_SHAPE;
        }
        let (low, part) = (at as usize, at.fract());
        self.shape[low] + part * (self.shape[low + 1] - self.shape[low])
    }

    /// Share of a touch's events in each bin; sums to 1.
    pub(super) fn template(&self, mean: f64, width: f64) -> Vec<f64> {
        let mut shares = self.flat(mean, width);
        for (share, gain) in shares.iter_mut().zip(&self.gain) {
            *share *= gain;
        }
        let sum: f64 = shares.iter().sum();
        shares.iter_mut().for_each(|s| *s /= sum);
        shares
    }
}

fn cell(z: f64) -> Option<usize> {
    let at = (z + REACH) / STEP + 0.5;
    (0.0..CELLS as f64).contains(&at).then_some(at as usize)
}

fn terms([x, y]: [f64; 2]) -> [f64; TERMS] {
    let (x, y) = (x / 30.0, y / 30.0);
    [1.0, x, y, x * x, x * y, y * y]
}

pub(super) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

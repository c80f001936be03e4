//! The position that both cameras see at their columns: least squares over the expected columns and the fields on them, with
//! the positions of the calibration presses as prior.

use super::field::Field;
use super::prediction::{ColumnUncertainty, Covariance, Prediction, Uncertainty, inverted};
use super::reading::Reading;
use crate::result::{FieldModel, PositionPrior};

/// Rounds of variances, and Gauss-Newton steps within a round.
const ROUNDS: usize = 3;
const STEPS: usize = 30;
/// Halvings of a step.
const HALVINGS: usize = 20;
/// A step shorter than this ends a round, mm.
const SHORTEST_MM: f64 = 1e-10;

/// Fields of both cameras, ready to locate.
#[derive(Debug, Clone)]
pub(super) struct Inverse {
    reading: Reading,
    fields: [Field; 2],
    /// Fixed variance and variance by events, px², per camera.
    scatter: [[f64; 2]; 2],
    centre: [f64; 2],
    /// Inverse of the prior's covariance: xx, xy, yy, 1/mm².
    precision: Covariance,
    starts: Vec<Begin>,
}

/// A position to begin from, with what each camera is expected to read and the value of its field there.
#[derive(Debug, Clone, Copy)]
struct Begin {
    at: [f64; 2],
    expected: [(f64, f64); 2],
}

/// What both cameras read.
struct Readings {
    columns: [f64; 2],
    values: [f64; 2],
    /// Change of a reading per column.
    slopes: [f64; 2],
    /// Variances of the scatter, px².
    noise: [f64; 2],
}

impl Readings {
    /// Column minus the expected one, px.
    fn off(&self, k: usize, expected: f64, field: f64) -> f64 {
        (self.values[k] - expected) / self.slopes[k] - field
    }
}

/// The sum to minimise at a position, with its Gauss-Newton matrix and right side.
struct Normal {
    value: f64,
    matrix: Covariance,
    side: [f64; 2],
}

impl Inverse {
    /// `None` if a field or the prior contradicts itself.
    pub(super) fn new(
        reading: Reading,
        fields: [&FieldModel; 2],
        prior: &PositionPrior,
    ) -> Option<Self> {
        let scatter = fields.map(|f| [f.fixed_px * f.fixed_px, f.column_px * f.column_px]);
        let [xx, xy, yy] = prior.covariance_mm2;
        let determinant = xx * yy - xy * xy;
        let precision = [yy / determinant, -xy / determinant, xx / determinant];
        if determinant <= 0.0 || precision.iter().any(|v| !v.is_finite()) {
            return None;
        }
        let mut inverse = Self {
            reading,
            scatter,
            centre: prior.centre_mm,
            precision,
            starts: Vec::new(),
            fields: [Field::new(fields[0])?, Field::new(fields[1])?],
        };
        let positions = fields[0]
            .points
            .iter()
            .map(|p| p.at_mm)
            .chain([prior.centre_mm]);
        inverse.starts = positions
            .map(|at| Begin {
                at,
                expected: [0, 1].map(|k| {
                    let (expected, _) = inverse.reading.expected(k, at);
                    (expected, inverse.fields[k].value(at).0)
                }),
            })
            .collect();
        Some(inverse)
    }

    /// Variance of the expected column, px²: that of the field, and that of the geometry where the field knows nothing.
    fn model_variance(&self, read: &Readings, at: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|k| {
            let open = self.fields[k].open(at);
            let slope = read.slopes[k];
            let geometry =
                self.reading.parameter_variance(k, at, read.columns[k]) / (slope * slope);
            self.fields[k].variance(open) + open * geometry
        })
    }

    /// Change of what a camera is expected to read, in columns per mm.
    fn slope(&self, read: &Readings, k: usize, at: [f64; 2]) -> [f64; 2] {
        let (_, by) = self.reading.expected(k, at);
        let (_, field_by) = self.fields[k].value(at);
        [0, 1].map(|axis| by[axis] / read.slopes[k] + field_by[axis])
    }

    /// Half the squared distance from the prior's centre, and its slope.
    fn prior(&self, at: [f64; 2]) -> (f64, [f64; 2]) {
        let [xx, xy, yy] = self.precision;
        let (dx, dy) = (at[0] - self.centre[0], at[1] - self.centre[1]);
        let slope = [xx * dx + xy * dy, xy * dx + yy * dy];
        (0.5 * (slope[0] * dx + slope[1] * dy), slope)
    }

    fn normal(&self, read: &Readings, variance: [f64; 2], at: [f64; 2]) -> Normal {
        let (value, slope) = self.prior(at);
        let mut normal = Normal {
            value,
            matrix: self.precision,
            side: slope.map(|s| -s),
        };
        for (k, variance) in variance.into_iter().enumerate() {
            let (expected, by) = self.reading.expected(k, at);
            let (field, field_by) = self.fields[k].value(at);
            let off = read.off(k, expected, field);
            let [x, y] = [0, 1].map(|axis| by[axis] / read.slopes[k] + field_by[axis]);
            normal.value += 0.5 * off * off / variance;
            normal.matrix[0] += x * x / variance;
            normal.matrix[1] += x * y / variance;
            normal.matrix[2] += y * y / variance;
            normal.side[0] += x * off / variance;
            normal.side[1] += y * off / variance;
        }
        normal
    }

    /// The most likely position; `None` if no number is finite. `response`: as in [`super::robust::response`].
    pub(super) fn locate(&self, columns: [f64; 2], response: f64) -> Option<Prediction> {
        let read = [0, 1].map(|k| self.reading.of_column(k, columns[k]));
        let read = Readings {
            columns,
            values: read.map(|(value, _)| value),
            slopes: read.map(|(_, slope)| slope),
            noise: self
                .scatter
                .map(|[fixed, column]| fixed + column * response),
        };
        let mut at = self.start(&read)?;
        let mut model = [0.0; 2];
        for _ in 0..ROUNDS {
            model = self.model_variance(&read, at);
            let variance = [0, 1].map(|k| read.noise[k] + model[k]);
            at = self.descend(&read, variance, at);
        }
        let open = [0, 1].map(|k| self.fields[k].open(at));
        let columns = [0, 1].map(|k| ColumnUncertainty {
            slope: self.slope(&read, k, at),
            scatter: read.noise[k],
            model: model[k],
        });
        let prior = self.precision;
        let finite = at.iter().all(|v| v.is_finite());
        finite.then_some(Prediction {
            at,
            uncertainty: Some(Uncertainty::Columns { prior, columns }),
            extrapolated: [0, 1].iter().any(|k| self.fields[*k].is_beyond(open[*k])),
        })
    }

    /// The best of the starts.
    fn start(&self, read: &Readings) -> Option<[f64; 2]> {
        let cost = |begin: &Begin| {
            let square = |k: usize| {
                let (expected, field) = begin.expected[k];
                read.off(k, expected, field).powi(2) / read.noise[k]
            };
            self.prior(begin.at).0 + 0.5 * (square(0) + square(1))
        };
        let all = self.starts.iter().map(|s| (cost(s), s.at));
        let best = all.filter(|(cost, _)| cost.is_finite());
        best.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, at)| at)
    }

    /// Gauss-Newton steps, halved until they lead down.
    fn descend(&self, read: &Readings, variance: [f64; 2], from: [f64; 2]) -> [f64; 2] {
        let (mut at, mut normal) = (from, self.normal(read, variance, from));
        for _ in 0..STEPS {
            let Some([xx, xy, yy]) = inverted(normal.matrix) else {
                break;
            };
            let [a, b] = normal.side;
            let mut step = [xx * a + xy * b, xy * a + yy * b];
            if libm::hypot(step[0], step[1]) < SHORTEST_MM {
                break;
            }
            let mut lower = None;
            for _ in 0..HALVINGS {
                let there = [at[0] + step[0], at[1] + step[1]];
                let found = self.normal(read, variance, there);
                if found.value < normal.value {
                    lower = Some((there, found));
                    break;
                }
                step = step.map(|s| 0.5 * s);
            }
            let Some(found) = lower else { break };
            (at, normal) = found;
        }
        at
    }
}

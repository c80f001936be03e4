//! The position where all readings of both cameras are as expected: least squares over the columns with the fields on them
//! and over the spreads of the events, with the positions of the calibration presses as prior.

use super::Features;
use super::field::Field;
use super::prediction::{
    Covariance, Prediction, READINGS, ReadingUncertainty, Uncertainty, inverted,
};
use super::reading::Reading;
use super::robust::{log_density, student_weight};
use super::spread::Spread;
use crate::result::{CameraField, PositionPrior};

/// Rounds of variances, and Gauss-Newton steps within a round.
const ROUNDS: usize = 3;
const STEPS: usize = 30;
/// Halvings of a step.
const HALVINGS: usize = 20;
/// A step shorter than this is the last of a round, mm.
const SHORTEST_MM: f64 = 1e-6;
/// A round that moves the position less than this is the last, mm: variances change over the length scales of the fields.
const LAST_MM: f64 = 1e-3;

/// Fields of both cameras, ready to locate.
#[derive(Debug, Clone)]
pub(super) struct Inverse {
    reading: Reading,
    fields: [Field; 2],
    /// Fixed variance and variance by events, px², per camera.
    scatter: [[f64; 2]; 2],
    /// Columns and rows of camera 1, then of camera 2.
    spreads: [Option<Spread>; 4],
    centre: [f64; 2],
    /// Inverse of the prior's covariance: xx, xy, yy, 1/mm².
    precision: Covariance,
    starts: Vec<StartPoint>,
    /// Factor of the regions on all variances; the variance of a remount has its own size.
    size: f64,
}

/// A position, with what each camera is expected to read and the fields there: values, px, and changes per mm.
#[derive(Debug, Clone, Copy)]
struct Place {
    at: [f64; 2],
    expected: [(f64, [f64; 2]); 2],
    fields: [(f64, [f64; 2]); READINGS],
}

/// A place to begin from, with the shares of the fields' variances that the observations leave open there.
#[derive(Debug, Clone, Copy)]
struct StartPoint {
    place: Place,
    open: [f64; READINGS],
}

/// Readings of both cameras.
struct Readings {
    columns: [f64; 2],
    values: [f64; 2],
    /// Change of a reading per column.
    slopes: [f64; 2],
    /// Readings of the spreads, px; `None` if missing.
    spreads: [Option<f64>; 4],
    /// Variances of the scatter, px².
    noise: [f64; READINGS],
}

impl Readings {
    /// Column minus the expected one, px.
    fn off(&self, k: usize, expected: f64, field: f64) -> f64 {
        (self.values[k] - expected) / self.slopes[k] - field
    }
}

/// A reading minus the expected one, px, and the change of the expected one per mm.
struct Residual {
    off: f64,
    slope: [f64; 2],
}

/// Half the loss of a miss, and its weight. Of the spreads, outliers lose weight: a second cluster widens them.
fn loss(i: usize, off: f64, variance: f64) -> (f64, f64) {
    let square = off * off / variance;
    if i < 2 {
        (0.5 * square, 1.0)
    } else {
        (-log_density(square, 1.0), student_weight(square, 1.0))
    }
}

/// The sum to minimise at a position, with its Gauss-Newton matrix and right side.
struct NormalEquations {
    value: f64,
    matrix: Covariance,
    side: [f64; 2],
}

impl Inverse {
    /// `None` if a field or the prior contradicts itself.
    pub(super) fn new(
        reading: Reading,
        cameras: [&CameraField; 2],
        prior: &PositionPrior,
        size: f64,
    ) -> Option<Self> {
        let fields = cameras.map(|c| &c.field);
        let scatter = fields.map(|f| [f.fixed_px, f.column_px].map(|s| s * s));
        let precision = inverted(prior.covariance_mm2)?;
        let mut spreads = [None, None, None, None];
        for (k, camera) in cameras.iter().enumerate() {
            for (axis, model) in camera.spreads.iter().flatten().enumerate() {
                spreads[2 * k + axis] = Some(Spread::new(model)?);
            }
        }
        let mut inverse = Self {
            reading,
            scatter,
            spreads,
            centre: prior.centre_mm,
            precision,
            starts: Vec::new(),
            size,
            fields: [Field::new(fields[0])?, Field::new(fields[1])?],
        };
        let positions = fields[0].points.iter().map(|p| p.at_mm);
        let positions = positions.chain([prior.centre_mm]).enumerate();
        inverse.starts = positions
            .map(|(i, at)| StartPoint {
                place: inverse.place(at),
                open: inverse.open_of(|field| field.open_at_observation(i, at)),
            })
            .collect();
        Some(inverse)
    }

    fn place(&self, at: [f64; 2]) -> Place {
        Place {
            at,
            expected: [0, 1].map(|k| self.reading.expected(k, at)),
            fields: std::array::from_fn(|i| self.field(i).map_or((0.0, [0.0; 2]), |f| f.value(at))),
        }
    }

    /// Shares of the fields' variances that the observations leave open at a position; 0 without a field.
    fn open(&self, at: [f64; 2]) -> [f64; READINGS] {
        self.open_of(|field| field.open(at))
    }

    fn open_of(&self, open: impl Fn(&Field) -> f64) -> [f64; READINGS] {
        std::array::from_fn(|i| self.field(i).map_or(0.0, &open))
    }

    /// The field of a reading.
    fn field(&self, i: usize) -> Option<&Field> {
        match i.checked_sub(2) {
            None => Some(&self.fields[i]),
            Some(spread) => self.spreads[spread].as_ref().map(|s| &s.field),
        }
    }

    fn readings(&self, features: &Features, response: f64) -> Readings {
        let read = [0, 1].map(|k| self.reading.of_column(k, features.columns[k]));
        let spread = |i: usize| {
            let own = features.spreads[i / 2]?;
            Some(self.spreads[i].as_ref()?.reading(own[i % 2]))
        };
        let noise = |i: usize| {
            let [fixed, column] = match i.checked_sub(2) {
                None => self.scatter[i],
                Some(spread) => self.spreads[spread]
                    .as_ref()
                    .map_or([0.0; 2], |s| s.scatter),
            };
            fixed + column * response
        };
        Readings {
            columns: features.columns,
            values: read.map(|(value, _)| value),
            slopes: read.map(|(_, slope)| slope),
            spreads: std::array::from_fn(spread),
            noise: std::array::from_fn(noise),
        }
    }

    /// `None` for a missing reading.
    fn miss(&self, read: &Readings, i: usize, place: &Place) -> Option<Residual> {
        let (field, field_by) = place.fields[i];
        let Some(spread) = i.checked_sub(2) else {
            let (expected, by) = place.expected[i];
            return Some(Residual {
                off: read.off(i, expected, field),
                slope: [0, 1].map(|axis| by[axis] / read.slopes[i] + field_by[axis]),
            });
        };
        self.spreads[spread].as_ref()?;
        Some(Residual {
            off: read.spreads[spread]? - field,
            slope: field_by,
        })
    }

    /// Variance of the expected reading, px²: that of the field, and that of the geometry where the field has no data.
    fn model_variance(&self, read: &Readings, i: usize, at: [f64; 2], open: f64) -> f64 {
        let Some(field) = self.field(i) else {
            return 0.0;
        };
        field.variance(open) + open * self.parameter_variances(read, i, at)[0]
    }

    /// Variances of the expected reading from the parameters of the geometry: those that the field corrects, and those of a
    /// remount, px².
    fn parameter_variances(&self, read: &Readings, i: usize, at: [f64; 2]) -> [f64; 2] {
        if i > 1 {
            return [0.0; 2];
        }
        let slope = read.slopes[i];
        let both = self.reading.parameter_variances(i, at, read.columns[i]);
        both.map(|v| v / (slope * slope))
    }

    /// Half the squared distance from the prior's centre, and its slope.
    fn prior(&self, at: [f64; 2]) -> (f64, [f64; 2]) {
        let [xx, xy, yy] = self.precision;
        let (dx, dy) = (at[0] - self.centre[0], at[1] - self.centre[1]);
        let slope = [xx * dx + xy * dy, xy * dx + yy * dy];
        (0.5 * (slope[0] * dx + slope[1] * dy), slope)
    }

    fn normal(
        &self,
        read: &Readings,
        variance: &[f64; READINGS],
        place: &Place,
    ) -> NormalEquations {
        let (value, slope) = self.prior(place.at);
        let mut normal = NormalEquations {
            value,
            matrix: self.precision,
            side: slope.map(|s| -s),
        };
        for (i, variance) in variance.iter().enumerate() {
            let Some(miss) = self.miss(read, i, place) else {
                continue;
            };
            let (value, weight) = loss(i, miss.off, *variance);
            let ([x, y], known) = (miss.slope, weight / variance);
            normal.value += value;
            normal.matrix[0] += known * x * x;
            normal.matrix[1] += known * x * y;
            normal.matrix[2] += known * y * y;
            normal.side[0] += known * x * miss.off;
            normal.side[1] += known * y * miss.off;
        }
        normal
    }

    /// The most likely position; `None` if no number is finite. `response`: as in [`super::robust::response`].
    pub(super) fn locate(&self, features: &Features, response: f64) -> Option<Prediction> {
        let read = self.readings(features, response);
        let StartPoint {
            mut place,
            mut open,
        } = *self.start(&read)?;
        let (mut model, mut noise) = ([0.0; READINGS], read.noise);
        for round in 0..ROUNDS {
            let from = place.at;
            if round > 0 {
                open = self.open(from);
            }
            model = std::array::from_fn(|i| self.model_variance(&read, i, from, open[i]));
            noise = std::array::from_fn(|i| {
                read.noise[i] + self.parameter_variances(&read, i, from)[1]
            });
            let variance = std::array::from_fn(|i| noise[i] + model[i]);
            place = self.descend(&read, &variance, place);
            let at = place.at;
            if libm::hypot(at[0] - from[0], at[1] - from[1]) < LAST_MM {
                break;
            }
        }
        let readings: [ReadingUncertainty; READINGS] = std::array::from_fn(|i| {
            self.miss(&read, i, &place)
                .map_or_else(ReadingUncertainty::default, |miss| ReadingUncertainty {
                    slope: miss.slope,
                    weight: loss(i, miss.off, noise[i] + model[i]).1.min(1.0),
                    scatter: read.noise[i] + (noise[i] - read.noise[i]) / self.size,
                    model: model[i],
                })
        });
        let at = place.at;
        let prior = self.precision;
        let finite = at.iter().all(|v| v.is_finite());
        finite.then_some(Prediction {
            at,
            uncertainty: Some(Uncertainty::Readings {
                prior,
                readings: Box::new(readings),
            }),
            extrapolated: self
                .fields
                .iter()
                .zip(open)
                .any(|(f, open)| f.is_beyond(open)),
        })
    }

    /// The best of the starts.
    fn start(&self, read: &Readings) -> Option<&StartPoint> {
        let cost = |place: &Place| {
            let each = (0..READINGS).filter_map(|i| {
                let (field, _) = place.fields[i];
                let off = match i.checked_sub(2) {
                    None => read.off(i, place.expected[i].0, field),
                    Some(spread) => read.spreads[spread]? - field,
                };
                Some(loss(i, off, read.noise[i]).0)
            });
            self.prior(place.at).0 + each.sum::<f64>()
        };
        let all = self.starts.iter().map(|s| (cost(&s.place), s));
        let best = all.filter(|(cost, _)| cost.is_finite());
        best.min_by(|a, b| a.0.total_cmp(&b.0))
            .map(|(_, start)| start)
    }

    /// Gauss-Newton steps, halved until they lead down.
    fn descend(&self, read: &Readings, variance: &[f64; READINGS], from: Place) -> Place {
        let (mut place, mut normal) = (from, self.normal(read, variance, &from));
        for _ in 0..STEPS {
            let Some([xx, xy, yy]) = inverted(normal.matrix) else {
                break;
            };
            let [a, b] = normal.side;
            let mut step = [xx * a + xy * b, xy * a + yy * b];
            if libm::hypot(step[0], step[1]) < SHORTEST_MM {
                // The sum is too coarse to judge so short a step, which ends nearer to the minimum.
                place = self.place([place.at[0] + step[0], place.at[1] + step[1]]);
                break;
            }
            let mut lower = None;
            for _ in 0..HALVINGS {
                let there = self.place([place.at[0] + step[0], place.at[1] + step[1]]);
                let found = self.normal(read, variance, &there);
                if found.value < normal.value {
                    lower = Some((there, found));
                    break;
                }
                step = step.map(|s| 0.5 * s);
            }
            let Some(found) = lower else { break };
            (place, normal) = found;
        }
        place
    }
}

//! Derives the interval and the one-sided p values of an estimate; each is the inverse of the other.

use super::bootstrap;
use super::comparison::Interval;
use super::influence::{BOOTSTRAP_FROM, InferenceData, Measure, Ratio, correlation, error};
use super::mover::{Limits, mover_limits};
use super::question::{Pairing, Settings};
use super::sessions::SessionSpread;
use crate::distributions::{student_cdf, student_quantile};

/// Smallest p value that is found from limits, and halvings of its logarithm.
const LEAST_P: f64 = 1e-15;
const HALVINGS: u32 = 60;

/// An estimate with its error model.
pub(super) struct Inference {
    value: f64,
    method: IntervalMethod,
    /// Widens the interval, if sessions can be told apart.
    sessions: Option<SessionSpread>,
}

enum IntervalMethod {
    /// Student's t times the standard error.
    Student {
        error: f64,
        df: f64,
        scale: StudentScale,
    },
    /// Bootstrap-t interval, never narrower than Student's t.
    BootstrapT {
        error: f64,
        df: f64,
        draws: Vec<f64>,
    },
    /// Limits of the components, combined, at quantiles of Student's t.
    Limits { of: Box<LimitSource>, df: f64 },
}

/// Scale on which an error is taken to follow Student's t.
#[derive(Clone, Copy)]
enum StudentScale {
    Value,
    /// Logarithm of a value above 0, whose errors are skewed.
    Logarithm,
}

impl StudentScale {
    /// Ends of the interval of `half` standard errors on either side.
    fn limits(self, value: f64, error: f64, half: f64) -> (f64, f64) {
        match self {
            Self::Value => (value - half * error, value + half * error),
            Self::Logarithm => {
                let factor = libm::exp(half * error / value);
                (value / factor, value * factor)
            }
        }
    }

    /// Distance of the value above `border` in standard errors.
    fn above(self, value: f64, error: f64, border: f64) -> f64 {
        match self {
            Self::Value => (value - border) / error,
            Self::Logarithm if border > 0.0 => libm::log(value / border) * value / error,
            Self::Logarithm => f64::INFINITY,
        }
    }
}

enum LimitSource {
    Single(Limits),
    /// Second minus first: both values with limits, their correlation, and the standard error of the difference that sets
    /// the minimum width (0: no minimum).
    Difference([(f64, Limits); 2], f64, f64),
}

impl Inference {
    /// Inference for one sample.
    pub(super) fn alone(of: &Measure, settings: &Settings) -> Self {
        let totals = of.totals();
        let (error, df) = (error(&totals), totals.len() as f64 - 1.0);
        let method = match of.shape.ratio() {
            Some(ratio) if totals.len() < BOOTSTRAP_FROM => IntervalMethod::Student {
                error,
                df,
                scale: if ratio.scale.is_positive() && of.value > 0.0 {
                    StudentScale::Logarithm
                } else {
                    StudentScale::Value
                },
            },
            Some(ratio) => IntervalMethod::BootstrapT {
                error,
                df,
                draws: bootstrap::paired(None, ratio, settings.resamples, settings.seed),
            },
            None => IntervalMethod::Limits {
                of: Box::new(LimitSource::Single(Limits::of(of, None))),
                df,
            },
        };
        Self {
            value: of.value,
            method,
            sessions: None,
        }
    }

    /// Inference for `b - sign * a`; `sign` is 1 or, for ratios only, -1.
    pub(super) fn difference(
        [a, b]: [&Measure; 2],
        sign: f64,
        sessions: Option<SessionSpread>,
        settings: &Settings,
    ) -> Self {
        let totals = [a.totals(), b.totals()];
        let value = b.value - sign * a.value;
        let (error, df) = spread(&totals, sign, settings.pairing);
        let method = match (a.shape.ratio(), b.shape.ratio()) {
            (Some(a), Some(b)) => {
                if totals[0].len().min(totals[1].len()) < BOOTSTRAP_FROM {
                    let scale = StudentScale::Value;
                    IntervalMethod::Student { error, df, scale }
                } else {
                    let draws = draws(a, b, sign, settings);
                    IntervalMethod::BootstrapT { error, df, draws }
                }
            }
            _ => {
                let together = match settings.pairing {
                    Pairing::SharedLocations => correlation(&totals[0], &totals[1]),
                    Pairing::Independent => 0.0,
                };
                let parts = [
                    (a.value, Limits::of(a, Some(b))),
                    (b.value, Limits::of(b, Some(a))),
                ];
                let least = match a.shape {
                    InferenceData::Share(_) | InferenceData::Counts(..) => error,
                    _ => 0.0,
                };
                IntervalMethod::Limits {
                    of: Box::new(LimitSource::Difference(parts, together, least)),
                    df,
                }
            }
        };
        Self {
            value,
            method,
            sessions,
        }
    }

    /// Two-sided interval with coverage 1 - `alpha`.
    pub(super) fn interval(&self, alpha: f64) -> Interval {
        let (low, high) = self.limits(alpha);
        let finite = |v: f64| v.is_finite().then_some(v);
        Interval {
            value: self.value,
            low: finite(low),
            high: finite(high),
        }
    }

    /// Its ends: distances from the value by locations and by sessions add up as independent errors (MOVER, Zou and Donner 2008).
    fn limits(&self, alpha: f64) -> (f64, f64) {
        let (low, high) = self.limits_over_locations(alpha);
        let Some(sessions) = &self.sessions else {
            return (low, high);
        };
        let (value, half) = (self.value, sessions.half_width(alpha));
        (
            value - libm::hypot(half, value - low),
            value + libm::hypot(half, high - value),
        )
    }

    fn limits_over_locations(&self, alpha: f64) -> (f64, f64) {
        match &self.method {
            IntervalMethod::Student { error, df, scale } => {
                let half = student_quantile(1.0 - 0.5 * alpha, *df);
                scale.limits(self.value, *error, half)
            }
            IntervalMethod::BootstrapT { error, df, draws } => {
                let t = student_quantile(1.0 - 0.5 * alpha, *df);
                let outside = 0.5 * alpha * (draws.len() as f64 + 1.0);
                // 0.05 has no exact binary form; the offset keeps whole numbers whole.
                let outside = ((outside + 1e-9).floor() as usize).clamp(1, draws.len());
                let (least, most) = (
                    draws[outside - 1].min(-t),
                    draws[draws.len() - outside].max(t),
                );
                (self.value - most * error, self.value - least * error)
            }
            IntervalMethod::Limits { of, df } => {
                of.limits(self.value, student_quantile(1.0 - 0.5 * alpha, *df))
            }
        }
    }

    /// One-sided p value against a truth at `border` or beyond, as seen from the value: the level at which a limit is there, by
    /// bisection. Above 1/2 if the value itself is beyond.
    fn p_of_limits(&self, border: f64, is_above: bool) -> f64 {
        let beyond = if is_above {
            self.value <= border
        } else {
            self.value >= border
        };
        if beyond {
            return if self.value == border {
                0.5
            } else {
                1.0 - self.p_of_limits(border, !is_above)
            };
        }
        let excludes = |p: f64| {
            let (low, high) = self.limits(2.0 * p);
            if is_above {
                low > border
            } else {
                high < border
            }
        };
        let (mut near, mut far) = (libm::log(LEAST_P), libm::log(0.5));
        for _ in 0..HALVINGS {
            let middle = 0.5 * (near + far);
            if excludes(libm::exp(middle)) {
                far = middle;
            } else {
                near = middle;
            }
        }
        libm::exp(far)
    }

    /// One-sided p value against `truth <= border`: a lower tail, which keeps its digits however small it is.
    pub(crate) fn p_above(&self, border: f64) -> f64 {
        if self.sessions.is_some() {
            return self.p_of_limits(border, true);
        }
        match &self.method {
            IntervalMethod::Student { error, df, scale } => {
                student_cdf(-scale.above(self.value, *error, border), *df)
            }
            IntervalMethod::BootstrapT { error, df, draws } => {
                let t = (self.value - border) / error;
                let as_far = draws.len() - draws.partition_point(|d| *d < t);
                let drawn = (as_far as f64 + 1.0) / (draws.len() as f64 + 1.0);
                drawn.max(student_cdf(-t, *df))
            }
            IntervalMethod::Limits { of, df } => student_cdf(-of.above(self.value, border), *df),
        }
    }

    /// One-sided p value against `truth >= border`.
    pub(crate) fn p_below(&self, border: f64) -> f64 {
        if self.sessions.is_some() {
            return self.p_of_limits(border, false);
        }
        match &self.method {
            IntervalMethod::Student { error, df, scale } => {
                student_cdf(scale.above(self.value, *error, border), *df)
            }
            IntervalMethod::BootstrapT { error, df, draws } => {
                let t = (self.value - border) / error;
                let as_far = draws.partition_point(|d| *d <= t);
                let drawn = (as_far as f64 + 1.0) / (draws.len() as f64 + 1.0);
                drawn.max(student_cdf(t, *df))
            }
            IntervalMethod::Limits { of, df } => student_cdf(of.above(self.value, border), *df),
        }
    }
}

impl LimitSource {
    /// Limits at `c` standard errors about `value`.
    fn limits(&self, value: f64, c: f64) -> (f64, f64) {
        match self {
            Self::Single(limits) => limits.at(c),
            Self::Difference([a, b], together, least) => {
                let (low, high) = mover_limits((a.0, a.1.at(c)), (b.0, b.1.at(c)), *together);
                let half = c * least;
                (low.min(value - half), high.max(value + half))
            }
        }
    }

    /// Signed distance of `value` above `border`, in standard errors, by bisection on the limits.
    fn above(&self, value: f64, border: f64) -> f64 {
        let above = border <= value;
        let passed = |c: f64| {
            let (low, high) = self.limits(value, c);
            if above { low <= border } else { high >= border }
        };
        let (mut near, mut far) = (0.0, 1.0);
        while !passed(far) && far < 1e6 {
            far *= 2.0;
        }
        for _ in 0..60 {
            let middle = 0.5 * (near + far);
            if passed(middle) {
                far = middle;
            } else {
                near = middle;
            }
        }
        if above { near } else { -near }
    }
}

/// Standard error of `b - sign * a` and its degrees of freedom (Welch 1947 for independent samples).
fn spread(totals: &[Vec<f64>; 2], sign: f64, pairing: Pairing) -> (f64, f64) {
    let free = |i: usize| totals[i].len() as f64 - 1.0;
    match pairing {
        Pairing::SharedLocations => {
            let pairs = totals[0].iter().zip(&totals[1]);
            let both: Vec<f64> = pairs.map(|(a, b)| b - sign * a).collect();
            (error(&both), free(0))
        }
        Pairing::Independent => {
            let [a, b] = [0, 1].map(|i| error(&totals[i]).powi(2));
            let both = a + b;
            let df = if both > 0.0 {
                both * both / (a * a / free(0) + b * b / free(1))
            } else {
                free(0).min(free(1))
            };
            (both.sqrt(), df)
        }
    }
}

fn draws(a: &Ratio, b: &Ratio, sign: f64, settings: &Settings) -> Vec<f64> {
    let (resamples, seed) = (settings.resamples, settings.seed);
    if settings.pairing == Pairing::SharedLocations {
        return bootstrap::paired(Some((a, sign)), b, resamples, seed);
    }
    // The smaller ratio draws first, so that swapping the samples mirrors the draws.
    if a.ratio <= b.ratio {
        return bootstrap::independent((a, sign), b, resamples, seed);
    }
    let mut draws = bootstrap::independent((b, sign), a, resamples, seed);
    if sign > 0.0 {
        draws.iter_mut().for_each(|d| *d = -*d);
        draws.reverse();
    }
    draws
}

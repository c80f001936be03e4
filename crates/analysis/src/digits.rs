//! True digits of the results: how far they move when measured inputs move by one unit in the last place.
//!
//! Positions, depths, forces and the drawn geometry are measured to a few digits; their last binary digits are arbitrary. The
//! digits of a result that depend on them are rounding errors. Repetitions with inputs moved at random show these digits
//! without a model of the arithmetic (Parker 1997, Monte Carlo Arithmetic). Times, counts and events are whole numbers and
//! stay as they are; sums are compensated ([`crate::sums`]).

use std::collections::BTreeMap;

use serde::Serialize;
use serde_json::Value;
use skinrig_model::Point2;
use skinrig_statistics::seeded;

use crate::error::AnalysisError;
use crate::input::{EventSource, SessionInput};
use crate::result::Analysis;

/// Digits of a number that holds no more: those of a 64-bit number.
pub const MOST: f64 = 15.95;

/// Digits of one result.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FigureDigits {
    /// Path in the results, such as `scored.rmse_mm.value`.
    pub path: String,
    /// Value with the inputs as measured.
    pub value: f64,
    /// Significant decimal digits that all repetitions share, 0 to [`MOST`].
    pub digits: f64,
}

/// Digits of all results.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Digits {
    /// Repetitions with moved inputs.
    pub repetitions: u32,
    /// Every number, in the order of its path.
    pub figures: Vec<FigureDigits>,
    /// Paths of words, counts and missing values that some repetition changed: decisions on the edge.
    pub changed: Vec<String>,
}

impl Digits {
    /// Digits of the figure at `path`.
    #[must_use]
    pub fn of(&self, path: &str) -> Option<&FigureDigits> {
        let at = self.figures.binary_search_by(|f| f.path.as_str().cmp(path));
        at.ok().map(|i| &self.figures[i])
    }
}

/// Analyses the session `repetitions` times with moved inputs; calls `each` with the number of finished ones.
///
/// # Errors
/// [`AnalysisError`] of any repetition.
pub fn digits(
    input: &SessionInput,
    source: &dyn EventSource,
    repetitions: u32,
    each: &dyn Fn(u32),
) -> Result<Digits, AnalysisError> {
    let measured = leaves(&crate::analyze(input, source)?);
    let mut furthest: BTreeMap<&str, f64> = BTreeMap::new();
    let mut changed: Vec<&str> = Vec::new();
    for repetition in 0..repetitions {
        let found = leaves(&crate::analyze(&moved(input, repetition), source)?);
        for (path, leaf) in &measured {
            match (leaf, found.get(path)) {
                (Leaf::Number(a), Some(Leaf::Number(b))) => {
                    let most = furthest.entry(path).or_insert(0.0);
                    *most = most.max((a - b).abs());
                }
                (a, b) if b != Some(a) => changed.push(path),
                _ => {}
            }
        }
        each(repetition + 1);
    }
    changed.sort_unstable();
    changed.dedup();
    let figures = measured.iter().filter_map(|(path, leaf)| match leaf {
        Leaf::Number(value) => Some(FigureDigits {
            path: path.clone(),
            value: *value,
            digits: shared_digits(*value, furthest.get(path.as_str()).copied().unwrap_or(0.0)),
        }),
        Leaf::Other(_) => None,
    });
    Ok(Digits {
        repetitions,
        figures: figures.collect(),
        changed: changed.into_iter().map(str::to_owned).collect(),
    })
}

/// Decimal digits that `value` shares with a number this far away.
fn shared_digits(value: f64, distance: f64) -> f64 {
    // One unit in the last place of 0 is less than any normal number.
    if distance < f64::MIN_POSITIVE {
        return MOST;
    }
    libm::log10(value.abs() / distance).clamp(0.0, MOST)
}

/// A number or anything else in the results.
#[derive(Debug, Clone, PartialEq)]
enum Leaf {
    Number(f64),
    /// Word, count, truth value, missing value, or length of a list.
    Other(Value),
}

/// All leaves of an analysis by path. The input's own copy is left out.
fn leaves(analysis: &Analysis) -> BTreeMap<String, Leaf> {
    let mut out = BTreeMap::new();
    // An analysis has no maps with keys other than text, the only thing that JSON refuses.
    let value = serde_json::to_value(analysis).unwrap_or_default();
    for (key, value) in value.as_object().into_iter().flatten() {
        if key != "settings" && key != "rig" {
            flatten(key, value, &mut out);
        }
    }
    out
}

fn flatten(path: &str, value: &Value, out: &mut BTreeMap<String, Leaf>) {
    match value {
        Value::Object(fields) => {
            for (key, value) in fields {
                flatten(&format!("{path}.{key}"), value, out);
            }
        }
        Value::Array(items) => {
            let length = Leaf::Other(items.len().into());
            out.insert(format!("{path}.length"), length);
            for (i, value) in items.iter().enumerate() {
                flatten(&format!("{path}[{i}]"), value, out);
            }
        }
        Value::Number(n) if n.is_f64() => {
            out.insert(
                path.to_owned(),
                Leaf::Number(n.as_f64().unwrap_or(f64::NAN)),
            );
        }
        other => {
            out.insert(path.to_owned(), Leaf::Other(other.clone()));
        }
    }
}

/// The input with each measured number one unit in the last place higher, lower, or as it is, drawn from `stream`.
fn moved(input: &SessionInput, stream: u32) -> SessionInput {
    let mut rng = seeded::generator(input.settings.seed, u64::from(stream));
    let mut step = |value: f64| match seeded::index(&mut rng, 3) {
        0 => value.next_down(),
        1 => value.next_up(),
        _ => value,
    };
    let mut input = input.clone();
    for outcome in input.outcomes.iter_mut().flatten() {
        outcome.measured_at = outcome.measured_at.map(|at| Point2 {
            x_mm: step(at.x_mm),
            y_mm: step(at.y_mm),
        });
        let numbers = [
            &mut outcome.measured_depth_mm,
            &mut outcome.touched_mm,
            &mut outcome.peak_force_n,
        ];
        for number in numbers {
            *number = number.map(&mut step);
        }
    }
    for number in &mut input.hold_forces_n {
        *number = number.map(&mut step);
    }
    input.pose_interval_us = input.pose_interval_us.map(&mut step);
    input.crossing_se_us = input.crossing_se_us.map(&mut step);
    for camera in &mut input.rig.nominal.cameras {
        let numbers = [
            &mut camera.position.x_mm,
            &mut camera.position.y_mm,
            &mut camera.aim.x_mm,
            &mut camera.aim.y_mm,
            &mut camera.skew_deg,
        ];
        for number in numbers {
            *number = step(*number);
        }
        let (half_fov_deg, w) = camera.lens.coefficients();
        camera.lens = camera.lens.with(step(half_fov_deg), step(w));
    }
    input
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_are_those_that_both_numbers_share() {
        assert_eq!(shared_digits(1.25, 0.0), MOST);
        assert!((shared_digits(1.25, 1.25e-9) - 9.0).abs() < 1e-9);
        assert_eq!(shared_digits(0.0, 1e-18), 0.0);
        assert_eq!(shared_digits(0.0, 0.0_f64.next_up()), MOST);
        assert_eq!(shared_digits(1.0, 3.0), 0.0);
    }
}

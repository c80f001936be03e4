//! Predictions of whole choices from the curves of their options, with intervals from random draws.
//!
//! The interval is split-conformal (Vovk, Gammerman and Shafer 2005): random choices are measured, and the smallest and the
//! largest factor by which they miss their predictions bound that of a further one. It holds whatever the rule is worth.

use serde::{Deserialize, Serialize};

use super::rule::{Point, Rule};

/// A predicted value with its 95 % interval.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Predicted {
    /// The prediction of the rule.
    pub value: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl Predicted {
    /// True if a measured value lies inside.
    #[must_use]
    pub fn contains(&self, measured: f64) -> bool {
        (self.low..=self.high).contains(&measured)
    }
}

/// Predictions of a row that neither the curves nor the intervals were made of.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Prediction {
    /// Index of the row.
    pub row: usize,
    /// True if the row was drawn at random, to check the intervals; false if it was selected for its prediction.
    pub is_check: bool,
    /// RMSE, mm.
    pub rmse_mm: Predicted,
    /// Events per press.
    pub events_per_press: Predicted,
    /// CPU time per press, µs; `None` without measured times.
    pub cpu_us: Option<Predicted>,
}

/// How the rows were measured, and what was predicted of them.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Predictions {
    /// Number of choices in all combinations.
    pub combinations: usize,
    /// The first rows, of which the curves consist.
    pub curve_rows: usize,
    /// The rows after them that make the intervals.
    pub draw_rows: usize,
    /// The rows after them that were drawn to check the intervals.
    pub check_rows: usize,
    /// Predictions of all rows after the draws that compete; empty if too few draws compete.
    pub of: Vec<Prediction>,
}

impl Predictions {
    /// The prediction of a row.
    #[must_use]
    pub fn get(&self, row: usize) -> Option<&Prediction> {
        self.of.iter().find(|p| p.row == row)
    }
}

/// Smallest and largest factor from prediction to measurement.
fn factors(pairs: impl Iterator<Item = (f64, f64)>) -> (f64, f64) {
    pairs
        .map(|(predicted, measured)| measured / predicted)
        .fold((f64::INFINITY, 0.0), |(low, high), f| {
            (f.min(low), f.max(high))
        })
}

/// Predicts the `tested` points: (row, drawn to check), from `curves`, with the errors of `draws`.
pub(super) fn predict(
    rule: &Rule<'_>,
    draws: &[Point],
    tested: impl Iterator<Item = (usize, bool, Point)>,
    least_draws: usize,
) -> Vec<Prediction> {
    let competing: Vec<&Point> = draws.iter().filter(|p| p.rmse_mm.is_some()).collect();
    if competing.len() < least_draws {
        return Vec::new();
    }
    let range = |of: &dyn Fn(&Point) -> Option<(f64, f64)>| {
        let all: Option<Vec<(f64, f64)>> = competing.iter().map(|p| of(p)).collect();
        all.map(|all| factors(all.into_iter()))
    };
    let interval = |range: (f64, f64), value: f64| Predicted {
        value,
        low: value * range.0,
        high: value * range.1,
    };
    let errors = range(&|p| Some((rule.rmse_mm(p.choice)?, p.rmse_mm?)));
    let events = range(&|p| Some((rule.events(p.choice)?, p.events)));
    let times = range(&|p| Some((rule.cpu_us(p.choice)?, p.cpu_us)).filter(|t| t.1 > 0.0));
    let (Some(errors), Some(events)) = (errors, events) else {
        return Vec::new();
    };
    let one = |(row, is_check, point): (usize, bool, Point)| {
        point.rmse_mm?;
        let time = times.and_then(|t| Some(interval(t, rule.cpu_us(point.choice)?)));
        Some(Prediction {
            row,
            is_check,
            rmse_mm: interval(errors, rule.rmse_mm(point.choice)?),
            events_per_press: interval(events, rule.events(point.choice)?),
            cpu_us: time,
        })
    };
    tested.filter_map(one).collect()
}

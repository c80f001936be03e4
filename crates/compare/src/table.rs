//! Owns the table of a comparison: per metric the value of each skin, and each skin against the first.

use serde::Serialize;

use crate::metrics::{Metric, Shown};
use crate::places::Places;
use crate::statistics::{
    Adjusted, Against, Comparison, Interval, Question, Sample, Settings, Verdict, compare_all,
    estimate,
};
use crate::subject::Subject;

/// A metric's margin, in the unit of its values.
pub type Margins = Vec<(Metric, f64)>;

/// A value, or why there is none.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Value {
    /// With its interval, over all locations of the skin.
    pub value: Option<Interval>,
    /// Why there is none.
    pub missing: Option<String>,
}

/// A skin against the first.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Against1 {
    /// Which skin, by its index.
    pub subject: usize,
    /// Both over the locations that they share, and their difference; `None` when they cannot be compared.
    pub comparison: Option<Comparison>,
    /// The same among several skins: corrected for their number.
    pub adjusted: Option<Adjusted>,
    /// What to go by: corrected for the number of skins.
    pub verdict: Option<Verdict>,
    /// Why they cannot be compared.
    pub refused: Option<String>,
}

/// One metric.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// Which.
    pub metric: Metric,
    /// For people.
    pub name: String,
    /// Of the values here.
    pub unit: &'static str,
    /// How to write them.
    #[serde(skip)]
    pub shown: Shown,
    /// The largest difference that is none, in the unit of the values.
    pub margin: Option<f64>,
    /// Of each skin.
    pub values: Vec<Value>,
    /// Each skin but the first, against it.
    pub against_first: Vec<Against1>,
}

/// Compares all metrics.
pub(crate) fn table(
    subjects: &[Subject],
    places: &Places,
    within_mm: f64,
    margins: &Margins,
    settings: &Settings,
) -> Vec<Row> {
    let area_mm2 = area_mm2(subjects);
    let row = |metric: Metric| {
        let margin = margins.iter().find(|(m, _)| *m == metric).map(|m| m.1);
        let samples: Vec<_> = subjects
            .iter()
            .map(|s| metric.sample(s, places, within_mm, area_mm2))
            .collect();
        let values = samples.iter().map(|sample| {
            let value = sample.as_ref().map_err(ToString::to_string);
            let value = value.and_then(|s| estimate(s, settings).map_err(|e| e.to_string()));
            Value {
                missing: value.as_ref().err().cloned(),
                value: value.ok(),
            }
        });
        Row {
            metric,
            name: metric.name(within_mm),
            unit: metric.unit(),
            shown: metric.shown(),
            margin,
            values: values.collect(),
            against_first: against(samples, metric, margin, settings),
        }
    };
    Metric::ALL.into_iter().map(row).collect()
}

fn against<F: ToString>(
    samples: Vec<Result<Sample, F>>,
    metric: Metric,
    margin: Option<f64>,
    settings: &Settings,
) -> Vec<Against1> {
    let count = samples.len();
    let refused = |subject: usize, why: String| Against1 {
        subject,
        comparison: None,
        adjusted: None,
        verdict: None,
        refused: Some(why),
    };
    let question = Question {
        better: metric.better(),
        margin,
    };
    let samples: Result<Vec<Sample>, F> = samples.into_iter().collect();
    let pairs = match samples {
        Err(fault) => Err(fault.to_string()),
        Ok(samples) => compare_all(&samples, Against::Reference(0), &question, settings)
            .map_err(|e| e.to_string()),
    };
    match pairs {
        Err(why) => (1..count).map(|i| refused(i, why.clone())).collect(),
        Ok(pairs) => pairs
            .into_iter()
            .map(|pair| match pair.alone {
                Err(why) => refused(pair.b, why.to_string()),
                Ok(comparison) => Against1 {
                    subject: pair.b,
                    verdict: Some(pair.adjusted.map_or(comparison.verdict, |a| a.verdict)),
                    comparison: Some(comparison),
                    adjusted: pair.adjusted,
                    refused: None,
                },
            })
            .collect(),
    }
}

/// The area that taxels fill: what the first skin's locations stand for, else its outline.
fn area_mm2(subjects: &[Subject]) -> f64 {
    let first = subjects.first();
    let probed = first
        .and_then(|s| s.sessions.first())
        .and_then(|s| s.analysis.coverage.as_ref())
        .and_then(|c| c.probed_mm2);
    let outline = first.and_then(Subject::outline).map(|o| o.area_mm2());
    probed.or(outline).unwrap_or(0.0)
}

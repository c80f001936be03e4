//! Owns the metrics table: value of each skin per metric, and each skin against the first.

use serde::Serialize;

use crate::locations::Locations;
use crate::metrics::{DisplayFormat, Metric};
use crate::no_result::NoResult;
use crate::subject::{Subject, sample};
use skinrig_statistics::{
    AdjustedComparison, Comparison, ComparisonTarget, Interval, PairSelection, Sample, SampleFault,
    Settings, Verdict, compare_all, estimate,
};

/// Equivalence margins per metric, in the unit of its values.
pub type Margins = Vec<(Metric, f64)>;

/// Value of one skin, or the reason for its absence.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Value {
    /// Value over all locations of the skin, with its interval.
    pub value: Option<Interval>,
    /// Why there is no value.
    pub missing: Option<NoResult>,
}

/// Comparison of one skin with the first.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BaselineComparison {
    /// Index of the skin.
    pub subject: usize,
    /// Both over their shared locations, and their difference; `None` if they cannot be compared.
    pub comparison: Option<Comparison>,
    /// Corrected for the number of skins.
    pub adjusted: Option<AdjustedComparison>,
    /// Final verdict, corrected for the number of skins.
    pub verdict: Option<Verdict>,
    /// Why they cannot be compared.
    #[serde(rename = "refused")]
    pub error: Option<NoResult>,
}

impl BaselineComparison {
    /// The difference, with an interval that holds for all comparisons with the first skin together.
    #[must_use]
    pub fn difference(&self) -> Option<Interval> {
        let alone = self.comparison.as_ref().map(|c| c.difference);
        self.adjusted.map(|a| a.simultaneous).or(alone)
    }
}

/// Results for one metric.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// The metric.
    pub metric: Metric,
    /// Display name.
    pub name: String,
    /// Unit of the values.
    pub unit: &'static str,
    /// Display format of the values.
    #[serde(skip)]
    pub format: DisplayFormat,
    /// Equivalence margin, in the unit of the values.
    pub margin: Option<f64>,
    /// Value of each skin.
    pub values: Vec<Value>,
    /// Comparison of each skin but the first with the first.
    pub against_first: Vec<BaselineComparison>,
}

/// Builds one row per metric.
pub(crate) fn table(
    subjects: &[Subject],
    locations: &Locations,
    within_mm: f64,
    margins: &Margins,
    settings: &Settings,
) -> Vec<Row> {
    let area_mm2 = area_mm2(subjects);
    let by_session: Vec<Vec<Subject>> = subjects.iter().map(Subject::by_session).collect();
    let row = |metric: Metric| {
        let margin = margins.iter().find(|(m, _)| *m == metric).map(|m| m.1);
        let samples: Vec<_> = subjects
            .iter()
            .zip(&by_session)
            .map(|(subject, sessions)| {
                sample(subject, sessions, |s| {
                    metric.sample(s, locations, within_mm, area_mm2)
                })
            })
            .collect();
        let values = samples.iter().map(|sample| {
            let value = match sample {
                Ok(sample) => estimate(sample, settings).map_err(NoResult::from),
                Err(fault) => Err(NoResult::from(*fault)),
            };
            Value {
                missing: value.as_ref().err().cloned(),
                value: value.ok(),
            }
        });
        Row {
            metric,
            name: metric.name(within_mm),
            unit: metric.unit(),
            format: metric.display_format(),
            margin,
            values: values.collect(),
            against_first: against(samples, metric, margin, settings),
        }
    };
    Metric::ALL.into_iter().map(row).collect()
}

fn against(
    samples: Vec<Result<Sample, SampleFault>>,
    metric: Metric,
    margin: Option<f64>,
    settings: &Settings,
) -> Vec<BaselineComparison> {
    let count = samples.len();
    let failed = |subject: usize, reason: NoResult| BaselineComparison {
        subject,
        comparison: None,
        adjusted: None,
        verdict: None,
        error: Some(reason),
    };
    let question = ComparisonTarget {
        better: metric.better(),
        margin,
    };
    let samples: Result<Vec<Sample>, SampleFault> = samples.into_iter().collect();
    let pairs = samples.map_err(NoResult::from).and_then(|samples| {
        let pairs = compare_all(&samples, PairSelection::Reference(0), &question, settings)?;
        Ok(pairs)
    });
    match pairs {
        Err(why) => (1..count).map(|i| failed(i, why.clone())).collect(),
        Ok(pairs) => pairs
            .into_iter()
            .map(|pair| match pair.alone {
                Err(why) => failed(pair.b, why.into()),
                Ok(comparison) => BaselineComparison {
                    subject: pair.b,
                    verdict: Some(pair.adjusted.map_or(comparison.verdict, |a| a.verdict)),
                    comparison: Some(comparison),
                    adjusted: pair.adjusted,
                    error: None,
                },
            })
            .collect(),
    }
}

/// Area that the taxels cover: the area probed on the first skin, or its outline.
fn area_mm2(subjects: &[Subject]) -> f64 {
    let first = subjects.first();
    let probed = first
        .and_then(|s| s.sessions.first())
        .and_then(|s| s.analysis.coverage.as_ref())
        .and_then(|c| c.probed_mm2);
    let outline = first.and_then(Subject::outline).map(|o| o.area_mm2());
    probed.or(outline).unwrap_or(0.0)
}

//! Headline numbers of published sessions: taken from an analysis, stored in a crate, compared bit by bit when derived again.

use serde::{Deserialize, Serialize};
use skinrig_analysis::Analysis;
use skinrig_analysis::result::Estimate;
use skinrig_export::metric_rows;

/// File of the numbers in a crate.
pub(super) const FILE: &str = "headline.json";
/// Values of `format` and `format_version`.
pub(super) const FORMAT: (&str, u32) = ("skinrig-headline", 1);

/// The numbers of a crate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Headline {
    pub format: String,
    pub format_version: u32,
    /// Version of skinrig.
    pub software: String,
    /// The selection, if the numbers are from one.
    pub selection: Option<SelectionEntry>,
    pub sessions: Vec<SessionNumbers>,
}

/// The selection of a crate.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct SelectionEntry {
    /// File name in the crate.
    pub file: String,
    pub name: String,
    pub sha256: String,
}

/// The numbers of one session.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct SessionNumbers {
    /// Folder of its bundle in the crate.
    pub bundle: String,
    pub session_id: String,
    pub prototype: String,
    /// Hash of the seal.
    pub content_sha256: String,
    pub numbers: Vec<Number>,
}

/// A number with its interval.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Number {
    pub set: String,
    pub metric: String,
    /// Of one depth only.
    pub depth_mm: Option<f64>,
    pub unit: String,
    pub value: Option<f64>,
    pub low: Option<f64>,
    pub high: Option<f64>,
    pub n: u32,
}

impl Number {
    /// The numbers of an analysis, and the RMSE without its selection.
    pub(super) fn all(analysis: &Analysis, without_selection: Option<&Estimate>) -> Vec<Self> {
        let number =
            |set: &str, metric: &str, unit: &str, depth_mm: Option<f64>, e: &Estimate| Self {
                set: set.to_owned(),
                metric: metric.to_owned(),
                depth_mm,
                unit: unit.to_owned(),
                value: e.value,
                low: e.low,
                high: e.high,
                n: e.n,
            };
        let rows = metric_rows(analysis).into_iter();
        let rows = rows.map(|r| number(r.set, r.metric, r.unit, r.depth_mm, &r.estimate));
        let without = without_selection.map(|e| number("without_selection", "rmse", "mm", None, e));
        rows.chain(without).collect()
    }

    /// Its name, for example `scored rmse at 2 mm depth`.
    pub(super) fn name(&self) -> String {
        let depth = self
            .depth_mm
            .map_or_else(String::new, |mm| format!(" at {mm} mm depth"));
        format!("{} {}{depth}", self.set, self.metric)
    }

    /// Value, interval and count with all their digits.
    pub(super) fn text(&self) -> String {
        let text = |value: Option<f64>| value.map_or_else(|| "none".to_owned(), |v| v.to_string());
        let unit = if self.unit == "1" { "" } else { &self.unit };
        format!(
            "{} {unit} [{}, {}], n {}",
            text(self.value),
            text(self.low),
            text(self.high),
            self.n
        )
    }

    /// True for the same number to the last bit.
    pub(super) fn is(&self, other: &Self) -> bool {
        let bits = |n: &Self| [n.depth_mm, n.value, n.low, n.high].map(|v| v.map(f64::to_bits));
        let words = |n: &Self| (n.set.clone(), n.metric.clone(), n.unit.clone(), n.n);
        bits(self) == bits(other) && words(self) == words(other)
    }

    fn key(&self) -> (&str, &str, Option<u64>) {
        (&self.set, &self.metric, self.depth_mm.map(f64::to_bits))
    }

    /// The number of the same name among `others`.
    pub(super) fn among<'a>(&self, others: &'a [Self]) -> Option<&'a Self> {
        others.iter().find(|other| other.key() == self.key())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_bit_is_another_number() {
        let number = |value: f64| Number {
            set: "scored".to_owned(),
            metric: "rmse".to_owned(),
            depth_mm: None,
            unit: "mm".to_owned(),
            value: Some(value),
            low: None,
            high: None,
            n: 8,
        };
        let one = number(0.1);
        assert!(one.is(&number(0.1)));
        assert!(!one.is(&number(f64::from_bits(0.1f64.to_bits() + 1))));
        assert!(one.among(&[number(0.2)]).is_some());
        let text = serde_json::to_string(&number(0.1 + 0.2)).unwrap();
        assert!(
            number(0.1 + 0.2).is(&serde_json::from_str(&text).unwrap()),
            "{text}"
        );
    }
}

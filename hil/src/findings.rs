//! Findings of a check: measured values by device and metric, and evidence.

use skinrig_nightly::{Evidence, EvidenceKind, GoldenSession};

/// A measured value, or a metric that could not be measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Value {
    /// Device: `robot`, `camera1`, `camera2`, `trigger box`, `computer` or `skin`.
    pub subject: String,
    /// Metric name as in the suite.
    pub metric: &'static str,
    /// In the metric's unit. `None`: not measured.
    pub value: Option<f64>,
    /// 95 % interval.
    pub interval: Option<[f64; 2]>,
    /// Number of samples behind the value.
    pub n: Option<u64>,
    /// Minimum number of samples; with fewer the value is inconclusive.
    pub needs: u64,
    /// Remark for the reader.
    pub note: Option<String>,
}

/// Findings of one attempt to run a check.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Findings {
    /// In the order of measurement.
    pub values: Vec<Value>,
    /// In the order of observation.
    pub evidence: Vec<Evidence>,
    /// Why the check cannot run on this bench. The check is then SKIPPED.
    pub not_applicable: Option<String>,
    /// Session of the golden campaign, if the check ran one.
    pub golden: Option<GoldenRecord>,
}

/// Data of a golden campaign that the night keeps besides the metrics.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GoldenRecord {
    /// The session and its report, relative to the night's folder.
    pub files: GoldenSession,
    /// Name of the skin, from the protocol.
    pub skin: Option<String>,
    /// Version of the analysis.
    pub analysis_version: u32,
}

impl Findings {
    /// Adds a value of `metric` on `subject`.
    pub fn value(&mut self, subject: &str, metric: &'static str, value: f64) -> &mut Value {
        self.push(subject, metric, Some(value))
    }

    /// Records that `metric` of `subject` could not be measured.
    pub fn unmeasured(&mut self, subject: &str, metric: &'static str) -> &mut Value {
        self.push(subject, metric, None)
    }

    /// Adds `evidence` and marks `metrics` of `subject` as unmeasured.
    pub fn failed(&mut self, evidence: Evidence, subject: &str, metrics: &[&'static str]) {
        self.evidence.push(evidence);
        for metric in metrics {
            self.unmeasured(subject, metric);
        }
    }

    /// Adds evidence.
    pub fn add_evidence(&mut self, kind: EvidenceKind, subject: &str, what: impl Into<String>) {
        self.evidence.push(Evidence::new(kind, subject, what));
    }

    fn push(&mut self, subject: &str, metric: &'static str, value: Option<f64>) -> &mut Value {
        self.values.push(Value {
            subject: subject.to_owned(),
            metric,
            value,
            interval: None,
            n: None,
            needs: 0,
            note: None,
        });
        let last = self.values.len() - 1;
        &mut self.values[last]
    }
}

impl Value {
    /// Sets the number of samples, and how many are needed.
    pub fn with_samples(&mut self, n: usize, needs: u64) -> &mut Self {
        self.n = Some(n as u64);
        self.needs = needs;
        self
    }

    /// Attaches a remark.
    pub fn with_note(&mut self, note: impl Into<String>) -> &mut Self {
        self.note = Some(note.into());
        self
    }
}

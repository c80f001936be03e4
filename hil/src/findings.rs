//! What a check found: values by device and metric, and evidence.

use skinrig_nightly::{Evidence, EvidenceKind, Golden};

/// A value that was measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Value {
    /// Of which device: `robot`, `camera1`, `camera2`, `trigger box`, `computer`, `skin`.
    pub subject: String,
    /// As in the suite.
    pub metric: &'static str,
    /// In the metric's unit. `None`: it could not be measured.
    pub value: Option<f64>,
    /// 95 % interval.
    pub interval: Option<[f64; 2]>,
    /// Samples behind it.
    pub n: Option<u64>,
    /// How many it needs; with fewer it is inconclusive.
    pub needs: u64,
    /// Anything to add.
    pub note: Option<String>,
}

/// What a check found.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Findings {
    /// In the order in which they were found.
    pub values: Vec<Value>,
    /// Likewise.
    pub evidence: Vec<Evidence>,
    /// The check cannot be made on this bench, and why: it is SKIPPED.
    pub not_here: Option<String>,
    /// What a golden campaign leaves in the night besides its numbers.
    pub golden: Option<GoldenKept>,
}

/// What a golden campaign leaves in the night besides its numbers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GoldenKept {
    /// The session and its report, relative to the night's folder.
    pub files: Golden,
    /// Name of the skin, from the protocol.
    pub skin: Option<String>,
    /// Version of the analysis.
    pub analysis_version: u32,
}

impl Findings {
    /// A value of `metric` on `subject`.
    pub fn value(&mut self, subject: &str, metric: &'static str, value: f64) -> &mut Value {
        self.push(subject, metric, Some(value))
    }

    /// `metric` could not be measured on `subject`.
    pub fn unmeasured(&mut self, subject: &str, metric: &'static str) -> &mut Value {
        self.push(subject, metric, None)
    }

    /// A trouble, with the metrics that it kept from being measured on `subject`.
    pub fn trouble(&mut self, trouble: Evidence, subject: &str, metrics: &[&'static str]) {
        self.evidence.push(trouble);
        for metric in metrics {
            self.unmeasured(subject, metric);
        }
    }

    /// Something that was seen.
    pub fn saw(&mut self, kind: EvidenceKind, subject: &str, what: impl Into<String>) {
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
    /// From so many samples, of which `needs` are enough.
    pub fn of(&mut self, n: usize, needs: u64) -> &mut Self {
        self.n = Some(n as u64);
        self.needs = needs;
        self
    }

    /// With a remark.
    pub fn noting(&mut self, note: impl Into<String>) -> &mut Self {
        self.note = Some(note.into());
        self
    }
}

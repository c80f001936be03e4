//! Input of the trends: nights in order, and the values of each metric over them.

use serde::{Deserialize, Serialize};
use skinrig_model::Limit;

use crate::judge::part_verdicts;
use crate::night::{Night, Versions};
use crate::verdict::Verdict;

/// Nights of one suite on one bench with their measurements.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct History {
    /// Oldest first.
    pub nights: Vec<NightSummary>,
    /// One series per metric and unit, sorted by both.
    pub series: Vec<Series>,
    /// Accepted changes.
    pub accepted: Vec<Acceptance>,
}

/// Metadata of a night.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct NightSummary {
    /// As in [`Night::id`].
    pub id: String,
    /// Start time, RFC 3339, UTC.
    pub started: String,
    /// Name of the suite.
    pub suite: String,
    /// As in [`Night::suite_sha256`].
    pub suite_sha256: String,
    /// Name of the bench.
    pub rig: String,
    /// `bench` or `emulated`.
    pub rig_kind: String,
    /// SHA-256 of the rig file's text.
    pub rig_sha256: String,
    /// Versions in use.
    pub versions: Versions,
    /// Verdict of the night.
    pub verdict: Verdict,
    /// Folder of the night.
    pub folder: String,
    /// The golden session, relative to the folder.
    pub golden: Option<String>,
}

/// Values of one metric of one device over the nights.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Series {
    /// `check/subject/metric`.
    pub name: String,
    /// Unit of the values; empty for counts.
    pub unit: String,
    /// Oldest first. Nights that did not request the metric have no point.
    pub points: Vec<Point>,
}

/// Value of a metric in one night, from the last attempt.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// Index into [`History::nights`].
    pub night: usize,
    /// `None`: not measured.
    pub value: Option<f64>,
    /// 95 % interval, if known.
    pub interval: Option<[f64; 2]>,
    /// Number of samples behind the value.
    pub n: Option<u64>,
    /// Limit stated in advance.
    pub limit: Option<Limit>,
    /// Verdict on the measurement.
    pub verdict: Verdict,
    /// Verdict on the device's part of the check: INVALID when the device was faulty.
    pub part: Verdict,
    /// Number of attempts at the check.
    pub attempts: u32,
}

/// A change that an operator accepted as known.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Acceptance {
    /// The series; `None`: all series.
    pub series: Option<String>,
    /// ID of the night at which the reference restarts.
    pub night: String,
    /// Why.
    pub reason: String,
    /// Name of the operator.
    pub by: String,
    /// Time of the acceptance, RFC 3339.
    pub at: String,
}

impl NightSummary {
    /// Metadata of `night`, whose files are in `folder`.
    #[must_use]
    pub fn of(night: &Night, folder: impl Into<String>) -> Self {
        Self {
            id: night.id.clone(),
            started: night.started.clone(),
            suite: night.suite.clone(),
            suite_sha256: night.suite_sha256.clone(),
            rig: night.rig.clone(),
            rig_kind: night.rig_kind.clone(),
            rig_sha256: night.rig_sha256.clone(),
            versions: night.versions.clone(),
            verdict: night.verdict,
            folder: folder.into(),
            golden: night.golden.as_ref().map(|g| g.session.clone()),
        }
    }
}

impl Point {
    /// The value, if it describes its subject: measured, from enough samples, with a rig that
    /// worked. It may be beyond its limit.
    #[must_use]
    pub fn usable(&self) -> Option<f64> {
        let describes_subject = |verdict| {
            !matches!(
                verdict,
                Verdict::Invalid | Verdict::Inconclusive | Verdict::Skipped
            )
        };
        self.value.filter(|v| {
            v.is_finite() && describes_subject(self.verdict) && describes_subject(self.part)
        })
    }
}

impl History {
    /// Appends a night.
    pub fn push(&mut self, night: &Night, folder: impl Into<String>) {
        let at = self.nights.len();
        self.nights.push(NightSummary::of(night, folder));
        let checks = night.checks.iter();
        let last = checks.flat_map(|c| Some((c, c.attempts.last()?)));
        for (check, attempt) in last {
            for (part, verdict) in attempt.parts.iter().zip(part_verdicts(check, attempt)) {
                for m in &part.measurements {
                    let name = format!("{}/{}/{}", check.name, part.subject, m.metric);
                    let point = Point {
                        night: at,
                        value: m.value,
                        interval: m.interval,
                        n: m.n,
                        limit: m.limit,
                        verdict: m.verdict,
                        part: verdict,
                        attempts: u32::try_from(check.attempts.len()).unwrap_or(u32::MAX),
                    };
                    self.add(&name, &m.unit, point);
                }
            }
        }
    }

    /// Appends a point to the series with this name and unit, creating the series if needed. Values in another unit are another series:
    /// they cannot be compared.
    pub fn add(&mut self, name: &str, unit: &str, point: Point) {
        let at = self
            .series
            .binary_search_by(|s| (s.name.as_str(), s.unit.as_str()).cmp(&(name, unit)));
        let at = at.unwrap_or_else(|at| {
            let new = Series {
                name: name.to_owned(),
                unit: unit.to_owned(),
                points: Vec::new(),
            };
            self.series.insert(at, new);
            at
        });
        self.series[at].points.push(point);
    }
}

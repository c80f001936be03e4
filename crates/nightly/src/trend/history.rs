//! What the trends are read from: nights in their order, and the values of each metric over them.

use serde::{Deserialize, Serialize};
use skinrig_model::Limit;

use crate::night::{Night, Versions};
use crate::verdict::Verdict;

/// The nights of one suite on one bench, oldest first, and what was measured in them.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct History {
    /// Oldest first.
    pub nights: Vec<NightHead>,
    /// One per metric, by name.
    pub series: Vec<Series>,
    /// Changes that somebody knows of.
    pub accepted: Vec<Acceptance>,
}

/// A night without its measurements.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct NightHead {
    /// As in [`Night::id`].
    pub id: String,
    /// When it began, RFC 3339, UTC.
    pub started: String,
    /// Name of the suite.
    pub suite: String,
    /// SHA-256 of the suite's text.
    pub suite_sha256: String,
    /// Name of the bench.
    pub rig: String,
    /// `bench` or `emulated`.
    pub rig_kind: String,
    /// SHA-256 of the rig file's text.
    pub rig_sha256: String,
    /// What ran.
    pub versions: Versions,
    /// The night's.
    pub verdict: Verdict,
    /// Its folder.
    pub folder: String,
    /// The golden session, relative to the folder.
    pub golden: Option<String>,
}

/// One metric of one device over the nights.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Series {
    /// `check/subject/metric`.
    pub name: String,
    /// Unit of the values; empty for counts.
    pub unit: String,
    /// Oldest first; nights in which it was not asked for have none.
    pub points: Vec<Point>,
}

/// A night's value of a metric: that of the last attempt.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// Which of [`History::nights`].
    pub night: usize,
    /// `None`: not measured.
    pub value: Option<f64>,
    /// 95 % interval, when there is one.
    pub interval: Option<[f64; 2]>,
    /// Samples behind it.
    pub n: Option<u64>,
    /// What was stated before.
    pub limit: Option<Limit>,
    /// Of the measurement.
    pub verdict: Verdict,
    /// Of the device's part of the check: INVALID when the device was at fault.
    pub part: Verdict,
    /// How often the check was made.
    pub attempts: u32,
}

/// A change that somebody knows of and takes as it is.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Acceptance {
    /// The series; `None`: all.
    pub series: Option<String>,
    /// From this night on things are learnt anew.
    pub night: String,
    /// Why.
    pub reason: String,
    /// Who said so.
    pub by: String,
    /// When, RFC 3339.
    pub at: String,
}

impl NightHead {
    /// The head of a night whose files are in `folder`.
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
    /// The value, when it speaks of what it is a metric of: measured, from enough samples, and with a rig that was not at fault.
    /// A value beyond its limit does.
    #[must_use]
    pub fn usable(&self) -> Option<f64> {
        let speaks = |verdict| {
            !matches!(
                verdict,
                Verdict::Invalid | Verdict::Inconclusive | Verdict::Skipped
            )
        };
        self.value
            .filter(|v| v.is_finite() && speaks(self.verdict) && speaks(self.part))
    }
}

impl History {
    /// Puts a night at the end.
    pub fn push(&mut self, night: &Night, folder: impl Into<String>) {
        let at = self.nights.len();
        self.nights.push(NightHead::of(night, folder));
        let checks = night.checks.iter();
        let last = checks.flat_map(|c| Some((c, c.attempts.last()?)));
        for (check, attempt) in last {
            for part in &attempt.parts {
                for m in &part.measurements {
                    let name = format!("{}/{}/{}", check.name, part.subject, m.metric);
                    let point = Point {
                        night: at,
                        value: m.value,
                        interval: m.interval,
                        n: m.n,
                        limit: m.limit,
                        verdict: m.verdict,
                        part: part.verdict,
                        attempts: u32::try_from(check.attempts.len()).unwrap_or(u32::MAX),
                    };
                    self.add(&name, &m.unit, point);
                }
            }
        }
    }

    /// Adds a point to the series of this name, which begins with it when there is none.
    pub fn add(&mut self, name: &str, unit: &str, point: Point) {
        let at = self.series.binary_search_by(|s| s.name.as_str().cmp(name));
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

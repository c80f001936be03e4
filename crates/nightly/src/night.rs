//! What a night of checks found: a tree from the suite down to single measurements, as it is stored and shown.

use serde::{Deserialize, Serialize};
use skinrig_model::Limit;

use crate::cause::Cause;
use crate::evidence::Evidence;
use crate::verdict::{NightExit, Verdict};

/// Version of the JSON form.
pub const NIGHT_VERSION: u32 = 1;

/// A night: one pass of a suite over a bench.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Night {
    /// [`NIGHT_VERSION`].
    pub version: u32,
    /// Names this night everywhere: start and suite, for example `2026-11-20T02-00-00Z-nightly`.
    pub id: String,
    /// Name of the suite.
    pub suite: String,
    /// SHA-256 of its text.
    pub suite_sha256: String,
    /// Name of the bench; says `emulated` when it is.
    pub rig: String,
    /// `bench` or `emulated`.
    pub rig_kind: String,
    /// SHA-256 of the rig file's text.
    pub rig_sha256: String,
    /// What ran.
    pub versions: Versions,
    /// When it began, RFC 3339, UTC.
    pub started: String,
    /// How long it took, s.
    pub took_s: f64,
    /// How long it was planned to take without repeats, s.
    pub planned_s: f64,
    /// How long it might take, s.
    pub budget_s: f64,
    /// Whether it came to its end. A night that is under way, or whose program died, is not: what stands in it holds.
    pub finished: bool,
    /// Why it ended before its last check, when it did.
    pub ended_early: Option<String>,
    /// How the lease of the bench was got, when there is something to say: a takeover.
    pub lease_note: Option<String>,
    /// The checks in the order in which they were made.
    pub checks: Vec<CheckResult>,
    /// The golden session, when there is one.
    pub golden: Option<Golden>,
    /// The worst of the checks'.
    pub verdict: Verdict,
    /// How the program ends.
    pub exit: NightExit,
}

/// The versions that a change of a metric may come from.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Versions {
    /// This program: version, commit, a digest of what the sources differ by; `commit unknown` when built outside a repository.
    pub software: String,
    /// Of the analysis: results of two versions do not compare.
    pub analysis: u32,
    /// `robot`, `camera1`, ... and its firmware.
    pub firmware: Vec<(String, String)>,
    /// Name of the golden skin, from its protocol.
    pub skin: Option<String>,
}

/// The session of the golden skin.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Golden {
    /// The session file, relative to the night's folder.
    pub session: String,
    /// Its report, likewise.
    pub report: Option<String>,
    /// Digest of its results.
    pub results_sha256: Option<String>,
}

/// One check.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CheckResult {
    /// As in the suite: `trigger_loopback`.
    pub name: String,
    /// For people.
    pub title: String,
    /// How long one attempt was planned to take, s.
    pub planned_s: f64,
    /// Every attempt, in order; none when it was skipped.
    pub attempts: Vec<Attempt>,
    /// Why it was not made.
    pub skipped: Option<String>,
    /// After the rules of repeats.
    pub verdict: Verdict,
    /// In words, how the verdict came from the attempts, when there was more than one.
    pub repeats: Option<String>,
    /// Where to look, when it is not good.
    pub cause: Option<Cause>,
    /// The rule that told the cause.
    pub rule: Option<String>,
    /// Other checks of the night that the rule relies on.
    pub witnesses: Vec<String>,
}

/// One attempt at a check.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Attempt {
    /// When it began, s after the night's start.
    pub began_s: f64,
    /// s.
    pub took_s: f64,
    /// One per device.
    pub parts: Vec<Part>,
    /// What else was seen.
    pub evidence: Vec<Evidence>,
    /// The worst of the parts', after the rules over the evidence.
    pub verdict: Verdict,
    /// Where to look, when it is not good.
    pub cause: Option<Cause>,
    /// The rule that told the cause; `None`: a limit was broken, and nothing was seen that explains it.
    pub rule: Option<String>,
}

/// What an attempt says of one device.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Part {
    /// `robot`, `camera1`, `camera2`, `trigger box`, `computer`, `skin`.
    pub subject: String,
    /// In the order of the suite's metrics.
    pub measurements: Vec<Measurement>,
    /// The worst of the measurements', before the rules over the evidence.
    pub verdict: Verdict,
}

/// One measured value and its limit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Measurement {
    /// As in the suite: `jitter`.
    pub metric: String,
    /// `None`: not measured.
    pub value: Option<f64>,
    /// Unit of the value; empty for counts.
    pub unit: String,
    /// 95 % interval, when there is one.
    pub interval: Option<[f64; 2]>,
    /// Samples behind the value.
    pub n: Option<u64>,
    /// How many samples it needs.
    pub needs: u64,
    /// Stated before. `None`: for the record.
    pub limit: Option<Limit>,
    /// What it means.
    pub verdict: Verdict,
    /// Anything to add.
    pub note: Option<String>,
}

impl Part {
    /// Whether something was measured beyond its limit, other than not measured at all.
    #[must_use]
    pub(crate) fn is_broken(&self) -> bool {
        let measured = |m: &Measurement| m.verdict == Verdict::Fail && m.value.is_some();
        self.measurements.iter().any(measured)
    }
}

impl Night {
    /// Tells verdict and exit from the checks.
    pub fn conclude(&mut self) {
        self.verdict = Verdict::worst(self.checks.iter().map(|c| c.verdict));
        self.exit = NightExit::of(self.checks.iter().map(|c| (c.verdict, c.cause)));
    }

    /// The last attempt's measurements, each with the name of its series: `check/subject/metric`.
    pub fn series(&self) -> impl Iterator<Item = (String, &Measurement)> {
        self.checks.iter().flat_map(|check| {
            let last = check.attempts.last();
            let parts = last.map(|a| a.parts.as_slice()).unwrap_or_default();
            parts.iter().flat_map(move |part| {
                part.measurements.iter().map(move |m| {
                    let name = format!("{}/{}/{}", check.name, part.subject, m.metric);
                    (name, m)
                })
            })
        })
    }
}

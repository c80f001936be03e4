//! Results of a night: a tree from the suite down to single measurements, as stored and displayed.

use serde::{Deserialize, Serialize};
use skinrig_model::{Limit, Notification};

use crate::cause::Cause;
use crate::evidence::Evidence;
use crate::verdict::{NightExit, Verdict};

/// Version of the JSON format.
pub const NIGHT_VERSION: u32 = 1;

/// A night: one pass of a suite over a bench.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Night {
    /// [`NIGHT_VERSION`].
    pub version: u32,
    /// Unique ID: start time and suite, for example `2026-11-20T02-00-00Z-nightly`.
    pub id: String,
    /// Name of the suite.
    pub suite: String,
    /// SHA-256 of the suite's text, and of the protocols of its campaigns if it has any.
    pub suite_sha256: String,
    /// Name of the bench; contains `emulated` for an emulated one.
    pub rig: String,
    /// `bench` or `emulated`.
    pub rig_kind: String,
    /// SHA-256 of the rig file's text.
    pub rig_sha256: String,
    /// Versions in use.
    pub versions: Versions,
    /// Start time, RFC 3339, UTC.
    pub started: String,
    /// Duration, s.
    pub took_s: f64,
    /// Estimated duration without repeats, s.
    pub planned_s: f64,
    /// Time limit, s.
    pub budget_s: f64,
    /// Whether the night ended normally. The results of an interrupted night are still valid.
    pub finished: bool,
    /// Why it ended before its last check, if it did.
    pub ended_early: Option<String>,
    /// How the lease was taken over, if it was.
    pub lease_note: Option<String>,
    /// Checks in order of execution.
    pub checks: Vec<CheckResult>,
    /// The golden session, if there is one.
    pub golden: Option<GoldenSession>,
    /// The worst verdict of the checks.
    pub verdict: Verdict,
    /// Exit code of the program.
    pub exit: NightExit,
    /// Messages about the night; not part of its digest in a history.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub notifications: Vec<Notification>,
}

/// Versions whose change may explain a change of a metric.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Versions {
    /// skinrig: version, commit, and a digest of uncommitted changes; `commit unknown` when built outside a repository.
    pub software: String,
    /// Analysis version. Results of different versions are not comparable.
    pub analysis: u32,
    /// Firmware by device.
    pub firmware: Vec<(String, String)>,
    /// Name of the golden skin, from its protocol.
    pub skin: Option<String>,
}

/// The session of the golden skin.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct GoldenSession {
    /// The session file, relative to the night's folder.
    pub session: String,
    /// Its report, relative to the night's folder.
    pub report: Option<String>,
    /// Hash of the analysis results, as in the results file: values and rules, no messages.
    pub results_sha256: Option<String>,
}

/// Result of one check.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CheckResult {
    /// Name as in the suite: `trigger_loopback`.
    pub name: String,
    /// Display name.
    pub title: String,
    /// Estimated duration of one attempt, s.
    pub planned_s: f64,
    /// Attempts in order; empty if the check was skipped.
    pub attempts: Vec<Attempt>,
    /// Why the check was skipped.
    pub skipped: Option<String>,
    /// Verdict under the repeat rule.
    pub verdict: Verdict,
    /// How the verdict follows from the attempts, if there was more than one.
    pub repeats: Option<String>,
    /// Where to look; `None` when the verdict is good.
    pub cause: Option<Cause>,
    /// Name of the rule behind the cause.
    pub rule: Option<String>,
    /// Names of other checks that the rule relies on.
    pub witnesses: Vec<String>,
}

/// One attempt to run a check.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Attempt {
    /// Start, s after the start of the night.
    pub began_s: f64,
    /// Duration, s.
    pub took_s: f64,
    /// One part per device.
    pub parts: Vec<Part>,
    /// Other observations.
    pub evidence: Vec<Evidence>,
    /// The worst verdict of the parts, after the rules.
    pub verdict: Verdict,
    /// Where to look; `None` when the verdict is good.
    pub cause: Option<Cause>,
    /// Name of the rule behind the cause; `None`: a limit was broken without evidence that explains
    /// it.
    pub rule: Option<String>,
}

/// Measurements of one device in an attempt.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Part {
    /// `robot`, `camera1`, `camera2`, `trigger box`, `computer`, `skin`.
    pub subject: String,
    /// In the order of the suite's metrics.
    pub measurements: Vec<Measurement>,
    /// The worst verdict of the measurements, before the rules.
    pub verdict: Verdict,
}

/// A measured value with its limit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Measurement {
    /// Metric name as in the suite: `jitter`.
    pub metric: String,
    /// `None`: not measured.
    pub value: Option<f64>,
    /// Unit of the value; empty for counts.
    pub unit: String,
    /// 95 % interval, if known.
    pub interval: Option<[f64; 2]>,
    /// Number of samples behind the value.
    pub n: Option<u64>,
    /// Minimum number of samples.
    pub needs: u64,
    /// Limit stated in advance. `None`: recorded only.
    pub limit: Option<Limit>,
    /// Verdict on this value alone.
    pub verdict: Verdict,
    /// Remark for the reader.
    pub note: Option<String>,
}

impl Part {
    /// Whether a measured value is beyond its limit. Missing values do not count.
    #[must_use]
    pub(crate) fn exceeds_limit(&self) -> bool {
        let measured = |m: &Measurement| m.verdict == Verdict::Fail && m.value.is_some();
        self.measurements.iter().any(measured)
    }
}

impl Night {
    /// Recomputes verdict and exit code from the checks.
    pub fn update_verdict(&mut self) {
        self.verdict = Verdict::worst(self.checks.iter().map(|c| c.verdict));
        self.exit = NightExit::of(self.checks.iter().map(|c| (c.verdict, c.cause)));
    }

    /// Marks a night whose files could not be written: it shows nothing to those who read them later, whatever it measured.
    pub fn lose(&mut self, why: &str) {
        self.finished = false;
        self.ended_early = Some(format!("its files could not be written: {why}"));
        self.verdict = self.verdict.max(Verdict::Fail);
        self.exit = NightExit::Infrastructure;
    }

    /// Measurements of the last attempts, each with its series name: `check/subject/metric`.
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

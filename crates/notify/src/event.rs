//! Events that messages report, and their text.

use std::path::Path;

use serde_json::{Value, json};
use skinrig_model::{Occasion, RunEnd};
use skinrig_nightly::{Night, Verdict};

/// Something that happened on a rig.
#[derive(Debug, Clone)]
pub struct Event<'a> {
    /// Name of the rig; contains its kind.
    pub rig: &'a str,
    /// What happened.
    pub subject: Subject<'a>,
}

/// What happened.
#[derive(Debug, Clone)]
pub enum Subject<'a> {
    /// A run ended.
    Run(RunEnded<'a>),
    /// A night ended.
    Night {
        /// The night.
        night: &'a Night,
        /// Its page.
        page: &'a Path,
        /// Its golden session: the smallest that shows the state of the bench.
        golden: Option<&'a Path>,
    },
    /// A night raised trend alarms.
    Alarms(RaisedAlarms<'a>),
    /// A test of the channels.
    Test,
}

/// The end of a run.
#[derive(Debug, Clone)]
pub struct RunEnded<'a> {
    /// Its end.
    pub end: &'a RunEnd,
    /// File name of the protocol.
    pub protocol: &'a str,
    /// Name of the prototype.
    pub prototype: &'a str,
    /// Name of the operator.
    pub operator: &'a str,
    /// The session file.
    pub session: &'a Path,
    /// Presses: planned, valid, invalid, missed.
    pub presses: [usize; 4],
}

/// Trend alarms raised by one night.
#[derive(Debug, Clone)]
pub struct RaisedAlarms<'a> {
    /// The night.
    pub night: &'a Night,
    /// What moved, since when, and the probable cause, in one sentence.
    pub headline: &'a str,
    /// Number of alarms that this night raised.
    pub raised: usize,
    /// Page of the trends.
    pub page: &'a Path,
    /// The golden session that the alarm keeps.
    pub session: Option<&'a Path>,
}

impl Event<'_> {
    /// Its occasion; `None` for a test.
    #[must_use]
    pub fn occasion(&self) -> Option<Occasion> {
        match &self.subject {
            Subject::Run(run) => Some(Occasion::of_end(run.end)),
            Subject::Night { night, .. } => Some(match night.verdict {
                Verdict::Skipped => Occasion::NightSkipped,
                Verdict::Pass => Occasion::NightPass,
                Verdict::Marginal => Occasion::NightMarginal,
                Verdict::Inconclusive => Occasion::NightInconclusive,
                Verdict::Fail => Occasion::NightFail,
                Verdict::Invalid => Occasion::NightInvalid,
            }),
            Subject::Alarms(_) => Some(Occasion::TrendAlarm),
            Subject::Test => None,
        }
    }

    pub(crate) fn subject(&self) -> String {
        let rig = self.rig;
        match &self.subject {
            Subject::Run(run) => {
                let (ended, protocol) = (run.end.name(), run.protocol);
                match run.end.reason() {
                    None => format!("{protocol} {ended} on {rig}"),
                    Some(reason) => format!("{protocol} {ended} on {rig}: {reason}"),
                }
            }
            Subject::Night { night, .. } => {
                format!("night {} of {} on {rig}", night.verdict.name(), night.suite)
            }
            Subject::Alarms(alarms) => format!("trend alarm on {rig}: {}", alarms.headline),
            Subject::Test => format!("test message for {rig}"),
        }
    }

    pub(crate) fn text(&self) -> String {
        let path = |path: &Path| path.display().to_string();
        let mut rows: Vec<(&str, String)> = Vec::new();
        let head =
            match &self.subject {
                Subject::Run(run) => {
                    let [planned, valid, invalid, missed] = run.presses;
                    if let Some(reason) = run.end.reason() {
                        rows.push(("cause", reason));
                    }
                    rows.push((
                        "presses",
                        format!("{valid} of {planned} valid, {invalid} invalid, {missed} missed"),
                    ));
                    rows.push(("prototype", run.prototype.to_owned()));
                    rows.push(("operator", run.operator.to_owned()));
                    rows.push(("session", path(run.session)));
                    rows.push((
                        "replay",
                        format!("skinrig run --replay {}", path(run.session)),
                    ));
                    format!("The run of {} {}.", run.protocol, run.end.name())
                }
                Subject::Night {
                    night,
                    page,
                    golden,
                } => {
                    let is_bad = |verdict: Verdict| verdict > Verdict::Pass;
                    for check in night.checks.iter().filter(|check| is_bad(check.verdict)) {
                        rows.push(("check", format!("{} {}", check.verdict.name(), check.name)));
                    }
                    if let Some(why) = &night.ended_early {
                        rows.push(("ended", why.clone()));
                    }
                    rows.push(("page", path(page)));
                    rows.extend(golden.map(|golden| ("session", path(golden))));
                    rows.extend(golden.map(|golden| {
                        ("replay", format!("skinrig run --replay {}", path(golden)))
                    }));
                    format!("The night {} is {}.", night.id, night.verdict.name())
                }
                Subject::Alarms(alarms) => {
                    rows.push(("night", alarms.night.id.clone()));
                    rows.push(("page", path(alarms.page)));
                    rows.extend(alarms.session.map(|session| ("session", path(session))));
                    rows.extend(alarms.session.map(|session| {
                        ("replay", format!("skinrig run --replay {}", path(session)))
                    }));
                    format!("Trend alarm: {}", alarms.headline)
                }
                Subject::Test => "This is a test of `notify`. Nothing happened.".to_owned(),
            };
        rows.push(("rig", self.rig.to_owned()));
        let rows: Vec<String> = rows
            .iter()
            .map(|(name, value)| format!("{name:<10}{value}"))
            .collect();
        format!("{head}\n\n{}", rows.join("\n"))
    }

    /// The key of the JSON for this kind of event, and its value.
    pub(crate) fn details(&self) -> (Option<&'static str>, Value) {
        match &self.subject {
            Subject::Run(run) => {
                let [planned, valid, invalid, missed] = run.presses;
                let details = json!({
                    "protocol": run.protocol,
                    "prototype": run.prototype,
                    "operator": run.operator,
                    "session": run.session,
                    "end": run.end.name(),
                    "cause": run.end.cause(),
                    "reason": run.end.reason(),
                    "planned": planned,
                    "valid": valid,
                    "invalid": invalid,
                    "missed": missed,
                });
                (Some("run"), details)
            }
            Subject::Night {
                night,
                page,
                golden,
            } => {
                let checks = night.checks.iter();
                let checks =
                    checks.map(|check| json!({ "name": check.name, "verdict": check.verdict }));
                let details = json!({
                    "id": night.id,
                    "suite": night.suite,
                    "verdict": night.verdict,
                    "finished": night.finished,
                    "page": page,
                    "session": golden,
                    "checks": checks.collect::<Vec<_>>(),
                });
                (Some("night"), details)
            }
            Subject::Alarms(alarms) => {
                let details = json!({
                    "night": alarms.night.id,
                    "suite": alarms.night.suite,
                    "headline": alarms.headline,
                    "raised": alarms.raised,
                    "page": alarms.page,
                    "session": alarms.session,
                });
                (Some("alarms"), details)
            }
            Subject::Test => (None, Value::Null),
        }
    }
}

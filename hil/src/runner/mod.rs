//! The runner: runs a suite's checks in order, repeats failed ones, enforces the time budget and builds the night's result.

mod parts;
pub mod plan;

use std::panic::{AssertUnwindSafe, catch_unwind};

use skinrig_device::Clock;
use skinrig_model::{HostDuration, HostTime};
use skinrig_nightly::judge::{self, CombinedVerdict, RepeatRule};
use skinrig_nightly::{Attempt, CheckResult, Evidence, EvidenceKind, Night, Verdict, rules};
use skinrig_protocol::suite::{Check, Suite};

use crate::bench::Bench;
use crate::checks;
use crate::findings::Findings;
use plan::PlanInputs;

/// One pass of a suite over a bench.
pub struct SuiteRunner<'a> {
    /// The suite.
    pub suite: &'a Suite,
    /// Names of the checks to run; the others are SKIPPED. `None` runs all checks.
    pub only: Option<&'a [String]>,
    /// Inputs of the time estimates that are not part of the suite.
    pub inputs: PlanInputs,
    /// Clock for the budget.
    pub clock: &'a dyn Clock,
    /// Runs one attempt of a check; [`checks::run`] by default.
    pub make: &'a dyn Fn(&Check, &mut dyn Bench) -> Findings,
}

/// Receives the progress of a night.
pub trait NightObserver {
    /// Attempt number `attempt` (from 1) at `check` starts.
    fn attempt_started(&mut self, night: &Night, check: &Check, attempt: usize);

    /// A check has its verdict. `night` holds all results so far and can be saved.
    fn check_finished(&mut self, night: &Night);
}

impl<'a> SuiteRunner<'a> {
    /// All checks of `suite`, timed by `clock`.
    #[must_use]
    pub fn new(suite: &'a Suite, clock: &'a dyn Clock) -> Self {
        Self {
            suite,
            only: None,
            inputs: PlanInputs::default(),
            clock,
            make: &checks::run,
        }
    }

    /// Why `check` is skipped; `None` if it runs.
    fn skipped(&self, check: &Check) -> Option<String> {
        let left_out = |only: &[String]| !only.iter().any(|o| o == check.name);
        if self.only.is_some_and(left_out) {
            return Some("left out with --only".to_owned());
        }
        check.skip.clone()
    }

    /// Estimated duration of one attempt at `check`; zero if it is skipped.
    #[must_use]
    pub fn planned(&self, check: &Check) -> HostDuration {
        match self.skipped(check) {
            Some(_) => HostDuration::ZERO,
            None => plan::estimated_duration(check, &self.inputs),
        }
    }

    /// Estimated duration of all checks from index `from` on, without repeats.
    #[must_use]
    pub fn planned_from(&self, from: usize) -> HostDuration {
        let checks = self.suite.checks.iter().skip(from);
        HostDuration(checks.map(|c| self.planned(c).0).sum())
    }

    /// Runs the suite. `night` comes with its identity and start time filled in; all devices are closed at the end.
    pub fn run(
        &self,
        night: Night,
        bench: &mut dyn Bench,
        observer: &mut dyn NightObserver,
    ) -> Night {
        let mut run = NightRun {
            runner: self,
            bench,
            observer,
            night,
            began: self.clock.now(),
        };
        run.night.planned_s = self.planned_from(0).as_secs_f64();
        run.night.budget_s = self.suite.budget.as_secs_f64();
        for (at, check) in self.suite.checks.iter().enumerate() {
            let result = run.check(at, check);
            run.night.checks.push(result);
            run.publish();
        }
        run.bench.close();
        run.night.finished = true;
        run.publish();
        run.night
    }
}

/// A night in progress.
struct NightRun<'a, 'b> {
    runner: &'a SuiteRunner<'a>,
    bench: &'b mut dyn Bench,
    observer: &'b mut dyn NightObserver,
    night: Night,
    began: HostTime,
}

impl NightRun<'_, '_> {
    /// Updates the night's totals and passes it to the observer.
    fn publish(&mut self) {
        rules::apply_cross_check_rules(&mut self.night.checks);
        self.night.took_s = self.elapsed().as_secs_f64();
        for (device, version) in self.bench.firmware() {
            let known = &mut self.night.versions.firmware;
            if !known.iter().any(|(d, _)| *d == device) {
                known.push((device, version));
            }
        }
        self.night.update_verdict();
        self.observer.check_finished(&self.night);
    }

    fn elapsed(&self) -> HostDuration {
        self.runner.clock.now() - self.began
    }

    /// Time left in the budget; negative once it is exceeded.
    fn left(&self) -> HostDuration {
        HostDuration(self.runner.suite.budget.0 - self.elapsed().0)
    }

    fn check(&mut self, at: usize, check: &Check) -> CheckResult {
        let planned = self.runner.planned(check);
        let result = CheckResult {
            name: check.name.to_owned(),
            title: check.title.to_owned(),
            planned_s: planned.as_secs_f64(),
            attempts: Vec::new(),
            skipped: self.runner.skipped(check),
            verdict: Verdict::Skipped,
            repeats: None,
            cause: None,
            rule: None,
            witnesses: Vec::new(),
        };
        if result.skipped.is_some() {
            return result;
        }
        if let Some((evidence, witnesses)) = self.blocked_by(check, planned) {
            let findings = Findings {
                evidence,
                ..Findings::default()
            };
            let now_s = self.elapsed().as_secs_f64();
            let attempt = self.judge(check, findings, now_s);
            return CheckResult {
                witnesses,
                ..with_attempts(result, RepeatRule::NEVER, vec![attempt])
            };
        }
        let rule = plan::repeat_rule(self.runner.suite, &check.measure);
        let mut attempts: Vec<Attempt> = Vec::new();
        let mut ended = None;
        loop {
            self.observer
                .attempt_started(&self.night, check, attempts.len() + 1);
            let began_s = self.elapsed().as_secs_f64();
            let findings = self.make(check);
            if let Some(reason) = findings.not_applicable {
                if attempts.is_empty() {
                    return CheckResult {
                        skipped: Some(reason),
                        ..result
                    };
                }
                // The findings of an earlier attempt stand.
                ended = Some(format!("a repeat did not apply: {reason}"));
                break;
            }
            attempts.push(self.judge(check, findings, began_s));
            if !rule.should_repeat(&attempts) {
                break;
            }
            if self.bench.stop_requested() {
                ended = Some("not repeated: the suite was stopped".to_owned());
                break;
            }
            // A repeat must leave time for all remaining checks.
            if self.left().0 < planned.0 + self.runner.planned_from(at + 1).0 {
                let why = "not repeated: the remaining budget is needed for the remaining checks";
                ended = Some(why.to_owned());
                break;
            }
            // Reopening may find a missing device or recover one that hangs.
            self.bench.close();
        }
        let mut result = with_attempts(result, rule, attempts);
        if let Some(reason) = ended {
            let before = result.repeats.take().map_or(String::new(), |r| r + "; ");
            result.repeats = Some(before + &reason);
        }
        result
    }

    /// Runs one attempt. A panic becomes evidence, and the night continues.
    fn make(&mut self, check: &Check) -> Findings {
        let (make, bench) = (self.runner.make, &mut *self.bench);
        let outcome = catch_unwind(AssertUnwindSafe(|| make(check, bench)));
        let mut findings = outcome.unwrap_or_else(|panic| {
            let message = panic
                .downcast_ref::<&str>()
                .map(|s| (*s).to_owned())
                .or_else(|| panic.downcast_ref::<String>().cloned())
                .unwrap_or_else(|| "no message".to_owned());
            let mut findings = Findings::default();
            findings.evidence.push(
                Evidence::new(
                    EvidenceKind::Software,
                    "computer",
                    format!("{} panicked: {message}", check.name),
                )
                .next("report this as a bug in skinrig, with the night's folder"),
            );
            // The check's devices are in an unknown state.
            let closed = catch_unwind(AssertUnwindSafe(|| self.bench.close()));
            if closed.is_err() {
                findings.add_evidence(
                    EvidenceKind::Software,
                    "computer",
                    "the devices could not be closed",
                );
            }
            findings
        });
        if let Some(record) = findings.golden.take() {
            self.night.golden = Some(record.files);
            self.night.versions.skin = record.skin;
            self.night.versions.analysis = record.analysis_version;
        }
        findings
    }

    /// Turns the findings of an attempt into its verdict.
    fn judge(&mut self, check: &Check, mut findings: Findings, began_s: f64) -> Attempt {
        if self.bench.stop_requested() {
            let (kind, what) = if self.bench.lease_is_lost() {
                (EvidenceKind::Lease, "another program took the bench")
            } else {
                (EvidenceKind::Stopped, "the suite was stopped")
            };
            findings.add_evidence(
                kind,
                "computer",
                format!("{what} during this check or before it"),
            );
            let reason = || format!("{what}, at {}", check.name);
            self.night.ended_early.get_or_insert_with(reason);
        }
        let has_box = self.bench.rig().trigger_box.is_some();
        let parts = parts::group_by_device(check, &mut findings, has_box);
        let took_s = self.elapsed().as_secs_f64() - began_s;
        let default_cause = checks::default_cause(&check.measure);
        judge::judge_attempt((began_s, took_s), parts, findings.evidence, default_cause)
    }

    /// Evidence against running `check`, and the names of the checks that provide it; `None` if it can run.
    fn blocked_by(
        &self,
        check: &Check,
        planned: HostDuration,
    ) -> Option<(Vec<Evidence>, Vec<String>)> {
        if self.bench.stop_requested() {
            // `judge` adds the evidence.
            return Some((Vec::new(), Vec::new()));
        }
        let left = self.left();
        if left.0 < planned.0 {
            let what = format!(
                "not started: it needs about {:.0} s, and {:.0} s of the budget are left",
                planned.as_secs_f64(),
                left.as_secs_f64().max(0.0)
            );
            let next = "raise the suite's `budget`, or find out which check took too long";
            let late = Evidence::new(EvidenceKind::TimeOut, "computer", what).next(next);
            return Some((vec![late], Vec::new()));
        }
        let prerequisites = plan::prerequisites(&check.measure);
        let bad = self
            .night
            .checks
            .iter()
            .find(|c| prerequisites.contains(&c.name.as_str()) && !c.verdict.is_good())?;
        let what = format!(
            "not started: {} was {}, and the arm must not move until that check is good",
            bad.name,
            bad.verdict.name()
        );
        // Copy the evidence of the failed check. If it has none, report the arm's state.
        let mut evidence: Vec<Evidence> = bad
            .attempts
            .iter()
            .max_by_key(|a| a.verdict)
            .map(|a| a.evidence.clone())
            .unwrap_or_default();
        if evidence.is_empty() {
            evidence.push(Evidence::new(EvidenceKind::State, "robot", what));
        } else {
            for e in &mut evidence {
                e.what = format!("{what}: {}", e.what);
            }
        }
        Some((evidence, vec![bad.name.clone()]))
    }
}

/// `result` with its attempts and their combined verdict.
fn with_attempts(result: CheckResult, rule: RepeatRule, attempts: Vec<Attempt>) -> CheckResult {
    let CombinedVerdict {
        verdict,
        cause,
        rule,
        explanation,
    } = rule.combine(&attempts);
    CheckResult {
        attempts,
        verdict,
        cause,
        rule,
        repeats: explanation,
        ..result
    }
}

//! The runner: makes the checks of a suite in their order, repeats what failed, holds the budget, and keeps the night.

mod parts;
pub mod plan;

use std::panic::{AssertUnwindSafe, catch_unwind};

use skinrig_device::Clock;
use skinrig_model::{HostDuration, HostTime};
use skinrig_nightly::judge::{self, RepeatRule, Together};
use skinrig_nightly::{Attempt, CheckResult, Evidence, EvidenceKind, Night, Verdict, rules};
use skinrig_protocol::suite::{Check, Suite};

use crate::bench::Bench;
use crate::checks;
use crate::findings::Findings;
use plan::Known;

/// What is made tonight.
pub struct Tonight<'a> {
    /// The suite.
    pub suite: &'a Suite,
    /// Only these checks; the others are SKIPPED.
    pub only: Option<&'a [String]>,
    /// What the plan of the night relies on.
    pub known: Known,
    /// Measures the budget.
    pub clock: &'a dyn Clock,
    /// Makes one check once: [`checks::make`].
    pub make: &'a dyn Fn(&Check, &mut dyn Bench) -> Findings,
}

/// Sees the night grow.
pub trait Onlooker {
    /// Attempt number `attempt` (from 1) of a check begins.
    fn begins(&mut self, night: &Night, check: &Check, attempt: usize);

    /// A check has its verdict; `night` holds everything so far and may be kept.
    fn made(&mut self, night: &Night);
}

impl<'a> Tonight<'a> {
    /// All checks of `suite`, on this clock.
    #[must_use]
    pub fn new(suite: &'a Suite, clock: &'a dyn Clock) -> Self {
        Self {
            suite,
            only: None,
            known: Known::default(),
            clock,
            make: &checks::make,
        }
    }

    /// Why a check is not made.
    fn skipped(&self, check: &Check) -> Option<String> {
        let left_out = |only: &[String]| !only.iter().any(|o| o == check.name);
        if self.only.is_some_and(left_out) {
            return Some("left out with --only".to_owned());
        }
        check.skip.clone()
    }

    /// How long an attempt at `check` should take; nothing when it is skipped.
    #[must_use]
    pub fn planned(&self, check: &Check) -> HostDuration {
        match self.skipped(check) {
            Some(_) => HostDuration::ZERO,
            None => plan::planned(check, &self.known),
        }
    }

    /// How long the checks from number `from` on should take without repeats.
    #[must_use]
    pub fn planned_from(&self, from: usize) -> HostDuration {
        let checks = self.suite.checks.iter().skip(from);
        HostDuration(checks.map(|c| self.planned(c).0).sum())
    }

    /// Makes the night; `night` holds who and when. Devices are closed in the end.
    pub fn run(&self, night: Night, bench: &mut dyn Bench, onlooker: &mut dyn Onlooker) -> Night {
        let mut run = Run {
            tonight: self,
            bench,
            onlooker,
            night,
            began: self.clock.now(),
        };
        run.night.planned_s = self.planned_from(0).as_secs_f64();
        run.night.budget_s = self.suite.budget.as_secs_f64();
        for (at, check) in self.suite.checks.iter().enumerate() {
            let result = run.check(at, check);
            run.night.checks.push(result);
            run.keep();
        }
        run.bench.close();
        run.night.finished = true;
        run.keep();
        run.night
    }
}

/// A night under way.
struct Run<'a, 'b> {
    tonight: &'a Tonight<'a>,
    bench: &'b mut dyn Bench,
    onlooker: &'b mut dyn Onlooker,
    night: Night,
    began: HostTime,
}

impl Run<'_, '_> {
    /// Brings the night up to date and shows it.
    fn keep(&mut self) {
        rules::across(&mut self.night.checks);
        self.night.took_s = self.elapsed().as_secs_f64();
        for (device, version) in self.bench.firmware() {
            let known = &mut self.night.versions.firmware;
            if !known.iter().any(|(d, _)| *d == device) {
                known.push((device, version));
            }
        }
        self.night.conclude();
        self.onlooker.made(&self.night);
    }

    fn elapsed(&self) -> HostDuration {
        self.tonight.clock.now() - self.began
    }

    /// What is left of the budget.
    fn left(&self) -> HostDuration {
        HostDuration(self.tonight.suite.budget.0 - self.elapsed().0)
    }

    fn check(&mut self, at: usize, check: &Check) -> CheckResult {
        let planned = self.tonight.planned(check);
        let result = CheckResult {
            name: check.name.to_owned(),
            title: check.title.to_owned(),
            planned_s: planned.as_secs_f64(),
            attempts: Vec::new(),
            skipped: self.tonight.skipped(check),
            verdict: Verdict::Skipped,
            repeats: None,
            cause: None,
            rule: None,
            witnesses: Vec::new(),
        };
        if result.skipped.is_some() {
            return result;
        }
        if let Some((evidence, witnesses)) = self.withheld(check, planned) {
            let found = Findings {
                evidence,
                ..Findings::default()
            };
            let now_s = self.elapsed().as_secs_f64();
            let attempt = self.judge(check, found, now_s);
            return CheckResult {
                witnesses,
                ..concluded(result, RepeatRule::NEVER, vec![attempt])
            };
        }
        let rule = plan::repeats(self.tonight.suite, &check.measure);
        let mut attempts: Vec<Attempt> = Vec::new();
        let mut ended = None;
        loop {
            self.onlooker.begins(&self.night, check, attempts.len() + 1);
            let began_s = self.elapsed().as_secs_f64();
            let found = self.make(check);
            if let Some(reason) = found.not_here {
                return CheckResult {
                    skipped: Some(reason),
                    ..result
                };
            }
            attempts.push(self.judge(check, found, began_s));
            if !rule.goes_on(&attempts) {
                break;
            }
            if self.bench.stop_asked() {
                ended = Some("not repeated: the suite was ended");
                break;
            }
            // A repeat must leave room for everything that is still to come.
            if self.left().0 < planned.0 + self.tonight.planned_from(at + 1).0 {
                ended = Some("not repeated: the budget holds only what is still to come");
                break;
            }
            // What was not there may be there now, and what is stuck may come free.
            self.bench.close();
        }
        let mut result = concluded(result, rule, attempts);
        if let Some(words) = ended {
            let before = result.repeats.take().map_or(String::new(), |r| r + "; ");
            result.repeats = Some(before + words);
        }
        result
    }

    /// Makes the check behind a wall: its panic is evidence, and the night goes on.
    fn make(&mut self, check: &Check) -> Findings {
        let (make, bench) = (self.tonight.make, &mut *self.bench);
        let made = catch_unwind(AssertUnwindSafe(|| make(check, bench)));
        let mut found = made.unwrap_or_else(|panic| {
            let words = panic
                .downcast_ref::<&str>()
                .map(|s| (*s).to_owned())
                .or_else(|| panic.downcast_ref::<String>().cloned())
                .unwrap_or_else(|| "no message".to_owned());
            let mut found = Findings::default();
            found.evidence.push(
                Evidence::new(
                    EvidenceKind::Software,
                    "computer",
                    format!("{} broke off: {words}", check.name),
                )
                .next("report this as a defect of skinrig, with the night's folder"),
            );
            // Whatever it held is in an unknown state.
            let closed = catch_unwind(AssertUnwindSafe(|| self.bench.close()));
            if closed.is_err() {
                found.saw(
                    EvidenceKind::Software,
                    "computer",
                    "the devices could not be closed",
                );
            }
            found
        });
        if let Some(kept) = found.golden.take() {
            self.night.golden = Some(kept.files);
            self.night.versions.skin = kept.skin;
            self.night.versions.analysis = kept.analysis_version;
        }
        found
    }

    /// An attempt, from what was found.
    fn judge(&mut self, check: &Check, mut found: Findings, began_s: f64) -> Attempt {
        if self.bench.stop_asked() {
            let (kind, what) = if self.bench.lease_is_lost() {
                (EvidenceKind::Lease, "somebody else took the bench")
            } else {
                (EvidenceKind::Stopped, "the suite was ended")
            };
            found.saw(
                kind,
                "computer",
                format!("{what} during this check, or before it"),
            );
            let whole = || format!("{what}, at {}", check.name);
            self.night.ended_early.get_or_insert_with(whole);
        }
        let has_box = self.bench.rig().trigger_box.is_some();
        let parts = parts::parts(check, &mut found, has_box);
        let took_s = self.elapsed().as_secs_f64() - began_s;
        let about = checks::about(&check.measure);
        judge::attempt((began_s, took_s), parts, found.evidence, about)
    }

    /// Why a check may not begin: what stands for it in the night, and the checks that say so.
    fn withheld(
        &self,
        check: &Check,
        planned: HostDuration,
    ) -> Option<(Vec<Evidence>, Vec<String>)> {
        if self.bench.stop_asked() {
            // Told by `judge`.
            return Some((Vec::new(), Vec::new()));
        }
        let left = self.left();
        if left.0 < planned.0 {
            let what = format!(
                "not begun: it should take {:.0} s, and {:.0} s of the budget are left",
                planned.as_secs_f64(),
                left.as_secs_f64().max(0.0)
            );
            let next = "raise the suite's `budget`, or see what took so long";
            let late = Evidence::new(EvidenceKind::TimeOut, "computer", what).next(next);
            return Some((vec![late], Vec::new()));
        }
        let relied = plan::relies_on(&check.measure);
        let bad = self
            .night
            .checks
            .iter()
            .find(|c| relied.contains(&c.name.as_str()) && !c.verdict.is_good())?;
        let what = format!(
            "not begun: {} was {}, and the arm is not moved before that is well",
            bad.name,
            bad.verdict.name()
        );
        // What explains that check explains this one; without anything, the arm's state does.
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

/// A result with its attempts and what they say together.
fn concluded(result: CheckResult, rule: RepeatRule, attempts: Vec<Attempt>) -> CheckResult {
    let Together {
        verdict,
        cause,
        rule,
        words,
    } = rule.together(&attempts);
    CheckResult {
        attempts,
        verdict,
        cause,
        rule,
        repeats: words,
        ..result
    }
}

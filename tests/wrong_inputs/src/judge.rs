//! Owns the verdict on a case: compares the result with what was executed.

use std::fmt;

use skinrig_analysis::result::Fault;
use skinrig_analysis::{Analysis, SessionInput, analyze};
use skinrig_model::{PressRole, Verdict};

use crate::bench::Bench;
use crate::cases::Case;

/// A result is right if it differs from the true value by less than its own interval plus this share of the true value plus
/// this length, mm.
const SHARE: f64 = 0.3;
const SLACK_MM: f64 = 0.4;
/// Maximum share of counting presses whose two views show different presses.
const MIXED: f64 = 0.1;

/// An allowed outcome of a case.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Allowed {
    /// Valid with the right result, with or without remarks.
    Right,
    /// A finding with this fault; valid only with the right result.
    Named(Fault),
    /// Not read, not aligned, or without a result, with a reason.
    Refused,
    /// The data cannot reveal the wrong result, for this reason.
    Unknowable(&'static str),
}

/// Observed outcome.
#[derive(Debug, Clone, PartialEq)]
pub enum Observed {
    /// Valid with the right result.
    Right,
    /// An allowed fault was reported; the flag states whether the session is valid.
    Named(Fault, bool),
    /// No result, with the reason.
    Refused(String),
    /// INVALID due to a fault that the case does not allow.
    Misnamed(Vec<Fault>),
    /// Valid with a wrong result.
    Wrong(Numbers),
}

/// The result, and its true value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Numbers {
    /// Reported RMSE, mm.
    pub reported: f64,
    /// Half the width of its interval, mm.
    pub half_width: f64,
    /// RMS distance of the estimates from the true tip positions, mm.
    pub done: Option<f64>,
    /// RMSE of the same recording with correct documents, mm.
    pub faultless: Option<f64>,
    /// Share of presses whose views show different presses.
    pub mixed: f64,
}

impl Numbers {
    fn of(bench: &Bench, analysis: &Analysis, faultless: Option<f64>) -> Option<Self> {
        let rmse = analysis.scored.rmse_mm;
        let (mut squares, mut n, mut mixed, mut counted) = (0.0, 0u32, 0u32, 0u32);
        for press in analysis
            .presses
            .iter()
            .filter(|p| p.role == PressRole::Score && p.verdict == Verdict::Valid)
        {
            let (Some(estimate), Some(timing)) = (press.estimate(), press.timing) else {
                continue;
            };
            counted += 1;
            let truly = [0, 1].map(|k| {
                let clock = analysis.clocks[k]?;
                let camera_us = clock.camera_us_of_host(timing.contact);
                bench.pressed_at(bench.host_s(bench.feeds[k], camera_us))
            });
            match truly {
                [Some(a), Some(b)] if a.distance_mm(b) < 1.0 => {
                    squares += estimate.distance_mm(a).powi(2);
                    n += 1;
                }
                _ => mixed += 1,
            }
        }
        Some(Self {
            reported: rmse.value?,
            half_width: rmse.low.zip(rmse.high).map_or(0.0, |(a, b)| 0.5 * (b - a)),
            done: (n > 0).then(|| (squares / f64::from(n)).sqrt()),
            faultless,
            mixed: f64::from(mixed) / f64::from(counted.max(1)),
        })
    }

    /// True if every known value agrees with the reported one.
    #[must_use]
    pub(crate) fn are_right(&self) -> bool {
        let near = |other: Option<f64>| {
            other.is_none_or(|other| {
                (self.reported - other).abs() <= self.half_width + SHARE * other + SLACK_MM
            })
        };
        self.mixed <= MIXED && near(self.done) && near(self.faultless)
    }
}

/// Verdict on a case.
#[derive(Debug, Clone)]
pub struct CaseVerdict {
    /// Observed outcome.
    pub observed: Observed,
    /// True if the case allows it.
    pub holds: bool,
    /// The result, if there is one.
    pub numbers: Option<Numbers>,
    /// Findings of the audit.
    pub findings: Vec<String>,
}

impl fmt::Display for CaseVerdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:?}\n    {:?}", self.observed, self.numbers)?;
        self.findings
            .iter()
            .try_for_each(|finding| write!(f, "\n    {finding}"))
    }
}

/// Analyses a case, changed in this way, and evaluates the outcome.
#[must_use]
pub fn judge(case: &Case, seed: u64, change: impl Fn(&mut SessionInput)) -> CaseVerdict {
    let bench = (case.bench)(seed);
    let analysed = |bench: &Bench| {
        let mut input = bench.input()?;
        change(&mut input);
        analyze(&input, &bench.events()).map_err(|e| e.to_string())
    };
    let analysis = analysed(&bench);
    let analysis = match analysis {
        Ok(analysis) => analysis,
        Err(why) => return refused(case, why),
    };
    let faultless = case.papers.and_then(|right| {
        let mut bench = bench.clone();
        right(&mut bench);
        analysed(&bench).ok()?.scored.rmse_mm.value
    });
    let numbers = Numbers::of(&bench, &analysis, faultless);
    let named = case.allowed.iter().find_map(|allowed| match allowed {
        Allowed::Named(fault) if analysis.findings.iter().any(|f| f.fault == *fault) => {
            Some(*fault)
        }
        _ => None,
    });
    let right = numbers.is_some_and(|n| n.are_right());
    let valid = analysis.is_valid();
    let observed = match (valid, named, numbers) {
        (true, Some(fault), Some(_)) if right => Observed::Named(fault, true),
        (true, None, Some(_)) if right => Observed::Right,
        (true, _, Some(numbers)) => Observed::Wrong(numbers),
        (_, Some(fault), _) => Observed::Named(fault, valid),
        (true, None, None) => Observed::Refused("no number".to_owned()),
        (false, None, _) if !analysis.alignment.is_usable() => {
            Observed::Refused(texts(&analysis.alignment.violations).join("; "))
        }
        (false, None, None) if analysis.may_calibrate() => {
            Observed::Refused(analysis.invalid_because().join("; "))
        }
        (false, None, _) => {
            let faults: Vec<Fault> = analysis.findings.iter().map(|f| f.fault).collect();
            if faults == [Fault::Unknown] {
                Observed::Refused(analysis.invalid_because().join("; "))
            } else {
                Observed::Misnamed(faults)
            }
        }
    };
    let holds = case
        .allowed
        .iter()
        .any(|allowed| match (allowed, &observed) {
            (Allowed::Right, Observed::Right)
            | (Allowed::Refused, Observed::Refused(_))
            | (Allowed::Unknowable(_), Observed::Wrong(_) | Observed::Right) => true,
            (Allowed::Named(a), Observed::Named(b, _)) => a == b,
            _ => false,
        });
    let findings = analysis
        .findings
        .iter()
        .map(|f| {
            format!(
                "{} {:?} invalidates {}: {}",
                f.fault.name(),
                f.camera,
                f.invalidates,
                f.evidence
            )
        })
        .chain(texts(&analysis.alignment.violations));
    CaseVerdict {
        observed,
        holds,
        numbers,
        findings: findings.collect(),
    }
}

fn refused(case: &Case, why: String) -> CaseVerdict {
    CaseVerdict {
        observed: Observed::Refused(why),
        holds: case.allowed.contains(&Allowed::Refused),
        numbers: None,
        findings: Vec::new(),
    }
}

fn texts<T: fmt::Display>(causes: &[T]) -> Vec<String> {
    causes.iter().map(T::to_string).collect()
}

//! Verdicts on measurements, checks and nights, and the exit code of a night.

use serde::{Deserialize, Serialize};
use skinrig_model::{Limit, Side};

use crate::cause::Cause;

/// Verdict, ordered by severity: a parent takes the worst verdict of its children.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
pub enum Verdict {
    /// Not run, for a stated reason. Any other verdict outweighs it.
    Skipped,
    /// Within its limit.
    Pass,
    /// Within its limit but close to it, or passed only when repeated.
    Marginal,
    /// Too little data for a verdict.
    Inconclusive,
    /// Beyond its limit, or not measured.
    Fail,
    /// The rig was faulty: the measurement does not describe its subject.
    Invalid,
}

impl Verdict {
    /// Display name: `PASS`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Skipped => "SKIPPED",
            Self::Pass => "PASS",
            Self::Marginal => "MARGINAL",
            Self::Inconclusive => "INCONCLUSIVE",
            Self::Fail => "FAIL",
            Self::Invalid => "INVALID",
        }
    }

    /// All verdicts by severity.
    pub const ALL: [Self; 6] = [
        Self::Skipped,
        Self::Pass,
        Self::Marginal,
        Self::Inconclusive,
        Self::Fail,
        Self::Invalid,
    ];

    /// Whether no action is needed: passed, marginal or skipped.
    #[must_use]
    pub const fn is_good(self) -> bool {
        matches!(self, Self::Skipped | Self::Pass | Self::Marginal)
    }

    /// The worst of `children`. Without children the verdict is FAIL: nothing was measured.
    #[must_use]
    pub fn worst(children: impl IntoIterator<Item = Self>) -> Self {
        children.into_iter().max().unwrap_or(Self::Fail)
    }

    /// Verdict on `value` (`None`: not measured) from `n` samples, of which `needed` are required,
    /// under `limit` (`None`: recorded only, always PASS).
    #[must_use]
    pub fn of_measurement(
        value: Option<f64>,
        n: Option<u64>,
        needed: u64,
        limit: Option<&Limit>,
    ) -> Self {
        let Some(limit) = limit else {
            return Self::Pass;
        };
        match value {
            _ if n.is_some_and(|n| n < needed) => Self::Inconclusive,
            Some(value) if value.is_finite() => match limit.side(value) {
                Side::Within => Self::Pass,
                Side::Near => Self::Marginal,
                Side::Beyond => Self::Fail,
            },
            // A missing or non-finite value cannot show that the limit holds.
            _ => Self::Fail,
        }
    }
}

/// Exit code of a night. The numbers are a stable interface; 2 is reserved for bad input before a night starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[repr(u8)]
pub enum NightExit {
    /// All checks passed, were marginal, or were skipped for a stated reason; at least one ran.
    Pass = 0,
    /// A limit was broken, too little was measured, or no check ran.
    Fail = 1,
    /// Only the computer, its disk, cables or permissions are at fault.
    Infrastructure = 3,
    /// A device of the rig was faulty: the night says nothing about the skin.
    Invalid = 4,
}

impl NightExit {
    /// Exit code from the verdict and cause of each check.
    #[must_use]
    pub fn of(checks: impl IntoIterator<Item = (Verdict, Option<Cause>)>) -> Self {
        let run = checks.into_iter().filter(|(v, _)| *v != Verdict::Skipped);
        let run: Vec<_> = run.collect();
        let bad: Vec<_> = run.iter().filter(|(v, _)| !v.is_good()).collect();
        if run.is_empty() {
            // The exit code must not report success for a night in which nothing was checked.
            Self::Fail
        } else if bad.is_empty() {
            Self::Pass
        } else if bad.iter().any(|(v, _)| *v == Verdict::Invalid) {
            Self::Invalid
        } else if bad.iter().all(|(_, c)| *c == Some(Cause::Infrastructure)) {
            Self::Infrastructure
        } else {
            Self::Fail
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_worst_child_decides_and_no_measurement_is_a_failure() {
        use Verdict::*;
        assert_eq!(Verdict::worst([]), Fail);
        assert_eq!(Verdict::worst([Skipped]), Skipped);
        assert_eq!(Verdict::worst([Pass, Skipped]), Pass);
        assert_eq!(Verdict::worst([Marginal, Pass, Inconclusive]), Inconclusive);
        assert_eq!(Verdict::worst([Fail, Invalid, Pass]), Invalid);
        let limit = Limit::at_most(1.0).with_margin(0.25);
        for (value, n, verdict) in [
            (Some(0.5), None, Pass),
            (Some(0.8), None, Marginal),
            (Some(1.1), None, Fail),
            (Some(f64::NAN), None, Fail),
            (Some(f64::NEG_INFINITY), None, Fail),
            (None, None, Fail),
            (Some(0.5), Some(2), Inconclusive),
            (Some(0.5), Some(3), Pass),
        ] {
            assert_eq!(
                Verdict::of_measurement(value, n, 3, Some(&limit)),
                verdict,
                "{value:?}"
            );
        }
        assert_eq!(Verdict::of_measurement(None, None, 3, None), Pass);
    }

    #[test]
    fn a_broken_limit_is_not_hidden_behind_the_infrastructure_nor_behind_a_pass() {
        use Verdict::*;
        let infra = Some(Cause::Infrastructure);
        let skin = Some(Cause::Skin);
        assert_eq!(
            NightExit::of([(Pass, None), (Skipped, None)]),
            NightExit::Pass
        );
        assert_eq!(NightExit::of([(Skipped, None)]), NightExit::Fail);
        assert_eq!(NightExit::of([]), NightExit::Fail);
        assert_eq!(NightExit::of([(Pass, None), (Fail, skin)]), NightExit::Fail);
        assert_eq!(
            NightExit::of([(Fail, infra), (Fail, skin)]),
            NightExit::Fail
        );
        assert_eq!(
            NightExit::of([(Fail, infra), (Pass, None)]),
            NightExit::Infrastructure
        );
        assert_eq!(NightExit::of([(Inconclusive, None)]), NightExit::Fail);
        assert_eq!(
            NightExit::of([(Fail, skin), (Invalid, Some(Cause::Rig))]),
            NightExit::Invalid
        );
    }
}

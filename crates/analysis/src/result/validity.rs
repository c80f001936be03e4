//! Decides whether the numbers of an analysis may be used.

use skinrig_model::{PressRole, Verdict};

use super::{Analysis, Warning, WarningCause};

impl Analysis {
    /// False if the numbers of the session must not be used: its clocks are not known well enough, the audit found that
    /// positions, cameras or rows are not what they claim to be, or no press counts.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        self.may_calibrate() && self.nothing_counts().is_none()
    }

    /// Like [`Self::is_valid`], for what the calibration presses alone give: no scored press need count yet.
    #[must_use]
    pub fn may_calibrate(&self) -> bool {
        self.alignment.is_usable() && !self.findings.iter().any(|f| f.invalidates)
    }

    /// Number of scored presses that the plan still owes: those never made. A campaign that ended because its question was decided owes
    /// none.
    #[must_use]
    pub fn scored_owed(&self) -> usize {
        if self.campaign.as_ref().is_some_and(|c| c.decided.is_some()) {
            return 0;
        }
        let scored = self.presses.iter().filter(|p| p.role == PressRole::Score);
        scored.filter(|p| p.verdict == Verdict::Missed).count()
    }

    /// Share of the scored presses with a counting estimate, of those attempted and those owed; `None` without any.
    #[must_use]
    pub fn located_of_scored(&self) -> Option<f64> {
        let attempted = self.scored.located_rate;
        let (share, n) = (attempted.value.unwrap_or(0.0), attempted.n as f64);
        let all = n + self.scored_owed() as f64;
        (all > 0.0).then(|| share * n / all)
    }

    /// The warning that no press gives a number.
    #[must_use]
    pub fn nothing_counts(&self) -> Option<&WarningCause> {
        let mut causes = self.warnings.iter().map(|w| &w.cause);
        causes.find(|c| matches!(c, WarningCause::NothingCounts { .. }))
    }

    /// The warnings beside an answer: all but the one that makes the session invalid, which is a reason of
    /// [`Self::invalid_because`].
    pub fn remarks(&self) -> impl Iterator<Item = &Warning> {
        let all = self.alignment.warnings.iter().chain(&self.warnings);
        all.filter(|w| !matches!(w.cause, WarningCause::NothingCounts { .. }))
    }

    /// Why the numbers must not be used, one text per reason; empty for a valid session.
    #[must_use]
    pub fn invalid_because(&self) -> Vec<String> {
        let clocks = if self.alignment.is_usable() {
            &[][..]
        } else {
            &self.alignment.violations[..]
        };
        let clocks = clocks.iter().map(ToString::to_string);
        let found = self.findings.iter().filter(|f| f.invalidates);
        let found = found.map(|f| match f.camera {
            Some(camera) => format!("{} ({camera}): {}", f.fault.name(), f.evidence),
            None => format!("{}: {}", f.fault.name(), f.evidence),
        });
        let nothing = self.nothing_counts().map(ToString::to_string);
        clocks.chain(found).chain(nothing).collect()
    }
}

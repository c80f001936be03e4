//! Decides whether the numbers of an analysis may be used.

use super::Analysis;

impl Analysis {
    /// False if the numbers of the session must not be used: its clocks are not known well enough, or the audit found that
    /// positions, cameras or rows are not what they claim to be.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        self.alignment.is_usable() && !self.findings.iter().any(|f| f.invalidates)
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
        clocks.chain(found).collect()
    }
}

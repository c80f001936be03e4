//! Touches that a run has felt so far, counted from its records, for display.

use skinrig_model::{AttemptId, PressRole, TouchEstimate, TouchKind};

/// Touches since the run began to feel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TouchProgress {
    /// The newest estimate or reaction.
    pub latest: TouchEstimate,
    /// True during a touch.
    pub touching: bool,
    /// Attempts at scored presses since then.
    pub presses: usize,
    /// How many of them were felt, including during approach and retraction.
    pub felt: usize,
    /// Touches felt between presses.
    pub between: usize,
    /// How often bytes were skipped because the estimator could not keep up.
    pub skipped: usize,
    /// True during an attempt at a scored press.
    is_scored: bool,
    /// Attempt that the last touch was counted for; `None`: between presses.
    counted: Option<AttemptId>,
}

impl TouchProgress {
    const fn new(started: TouchEstimate) -> Self {
        Self {
            latest: started,
            touching: false,
            presses: 0,
            felt: 0,
            between: 0,
            skipped: 0,
            is_scored: false,
            counted: None,
        }
    }

    /// Adds an estimate to `progress`, which begins with the first one.
    pub(crate) fn add(progress: &mut Option<Self>, estimate: TouchEstimate) {
        let progress = progress.get_or_insert(Self::new(estimate));
        progress.latest = estimate;
        match estimate.kind {
            TouchKind::Onset => progress.begins(estimate.attempt),
            TouchKind::Withdrawn => progress.was_none(),
            TouchKind::Release => progress.touching = false,
            TouchKind::Skipped => {
                progress.touching = false;
                progress.skipped += 1;
            }
            TouchKind::Started | TouchKind::Position | TouchKind::Stopped | TouchKind::Lifted => {}
        }
    }

    /// An attempt begins.
    pub(crate) fn attempt(&mut self, role: PressRole) {
        self.is_scored = role == PressRole::Score;
        self.presses += usize::from(self.is_scored);
    }

    fn begins(&mut self, attempt: Option<AttemptId>) {
        self.touching = true;
        let again = attempt.is_some() && attempt == self.counted;
        self.counted = attempt;
        match attempt {
            None => self.between += 1,
            Some(_) => self.felt += usize::from(self.is_scored && !again),
        }
    }

    fn was_none(&mut self) {
        self.touching = false;
        match self.counted.take() {
            None => self.between = self.between.saturating_sub(1),
            Some(_) if self.is_scored => self.felt = self.felt.saturating_sub(1),
            Some(_) => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use skinrig_model::{HostTime, PressId};

    use super::*;

    fn estimate(kind: TouchKind, press: Option<u32>) -> TouchEstimate {
        TouchEstimate {
            t: HostTime::ZERO,
            until: HostTime::ZERO,
            until_sd_ns: 0,
            kind,
            attempt: press.map(|n| AttemptId {
                press: PressId::from_index(n),
                number: 1,
            }),
            at_mm: None,
            region: None,
            depth: None,
            llr: None,
        }
    }

    #[test]
    fn felt_presses_touches_between_them_and_withdrawn_ones_are_counted() {
        let mut all = None;
        TouchProgress::add(&mut all, estimate(TouchKind::Started, None));
        assert!(all.is_some_and(|start| !start.touching));
        let mut add = |role: Option<PressRole>, kind, press| {
            if let Some(role) = role {
                all.as_mut().unwrap().attempt(role);
            }
            TouchProgress::add(&mut all, estimate(kind, press));
            let p = all.unwrap();
            (p.touching, [p.presses, p.felt, p.between, p.skipped])
        };
        use PressRole::{Calibrate, Score};
        use TouchKind::{Onset, Position, Release, Skipped, Withdrawn};
        assert_eq!(add(Some(Score), Onset, Some(4)), (true, [1, 1, 0, 0]));
        assert_eq!(add(None, Position, Some(4)), (true, [1, 1, 0, 0]));
        assert_eq!(add(None, Release, Some(4)), (false, [1, 1, 0, 0]));
        // Felt twice in one attempt: one press.
        assert_eq!(add(None, Onset, Some(4)), (true, [1, 1, 0, 0]));
        assert_eq!(add(None, Release, None), (false, [1, 1, 0, 0]));
        assert_eq!(add(None, Onset, None), (true, [1, 1, 1, 0]));
        assert_eq!(add(None, Withdrawn, None), (false, [1, 1, 0, 0]));
        assert_eq!(add(Some(Score), Onset, Some(5)), (true, [2, 2, 0, 0]));
        assert_eq!(add(None, Withdrawn, Some(5)), (false, [2, 1, 0, 0]));
        assert_eq!(add(None, Onset, Some(5)), (true, [2, 2, 0, 0]));
        assert_eq!(add(None, Skipped, Some(5)), (false, [2, 2, 0, 1]));
        assert_eq!(add(Some(Calibrate), Onset, Some(6)), (true, [2, 2, 0, 1]));
    }
}

//! Invalid presses in a row: past a limit something is wrong that more presses do not mend.

use crate::suspend::SUSPENDED;
use skinrig_model::PressVerdict;

use crate::error::ControllerError;

/// Why a press is invalid that the operator's `pause_now` broke off. It says nothing of the rig and is not counted.
pub(crate) const PAUSED: &str = "paused by the operator";

/// The present row of invalid presses.
#[derive(Debug)]
pub(crate) struct InvalidRun {
    limit: u32,
    reasons: Vec<String>,
    last: Option<PressVerdict>,
}

impl InvalidRun {
    /// `limit` in a row are too many; 0: any number is borne.
    pub(crate) const fn new(limit: u32) -> Self {
        Self {
            limit,
            reasons: Vec::new(),
            last: None,
        }
    }

    /// An attempt ended. The last one of a press counts.
    pub(crate) fn attempt(&mut self, verdict: &PressVerdict) {
        self.last = Some(verdict.clone());
    }

    /// A press ended, with all its attempts.
    ///
    /// # Errors
    /// [`ControllerError::InvalidInARow`] at the limit.
    pub(crate) fn press_ended(&mut self) -> Result<(), ControllerError> {
        match self.last.take() {
            Some(PressVerdict::Invalid(reason))
                if reason.starts_with(PAUSED) || reason.starts_with(SUSPENDED) => {}
            Some(PressVerdict::Invalid(reason)) => self.reasons.push(reason),
            _ => self.reasons.clear(),
        }
        if self.limit == 0 {
            self.reasons.clear();
        }
        if self.limit == 0 || self.reasons.len() < self.limit as usize {
            return Ok(());
        }
        let mut reasons: Vec<String> = Vec::new();
        for reason in &self.reasons {
            if !reasons.contains(reason) {
                reasons.push(reason.clone());
            }
        }
        Err(ControllerError::InvalidInARow {
            limit: self.limit,
            reasons,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_ends_the_run_and_a_valid_press_ends_the_row() {
        let bad = |why: &str| PressVerdict::Invalid(why.to_owned());
        let mut run = InvalidRun::new(3);
        let mut press = |attempts: &[PressVerdict]| {
            attempts.iter().for_each(|v| run.attempt(v));
            run.press_ended()
        };
        assert_eq!(press(&[bad("late"), bad("late"), bad("late")]), Ok(()));
        assert_eq!(press(&[bad("late")]), Ok(()));
        assert_eq!(press(&[bad("late"), PressVerdict::Valid]), Ok(()));
        assert_eq!(press(&[bad("late")]), Ok(()));
        assert_eq!(press(&[bad("lost")]), Ok(()));
        // The operator's own doing neither counts nor ends the row.
        assert_eq!(press(&[bad(PAUSED)]), Ok(()));
        let told = press(&[bad("late")]).unwrap_err().to_string();
        assert!(
            told.contains("fewer than 3") && told.contains("late; lost"),
            "{told}"
        );

        let mut unlimited = InvalidRun::new(0);
        for _ in 0..100 {
            unlimited.attempt(&bad("late"));
            assert_eq!(unlimited.press_ended(), Ok(()));
        }
    }
}

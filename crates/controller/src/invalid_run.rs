//! Counts consecutive invalid presses: beyond a limit, more presses would not help.

use skinrig_model::{Causes, NoCause, PressFault, RunFault};

/// The current row of invalid presses.
#[derive(Debug)]
pub(crate) struct InvalidRun {
    limit: u32,
    /// Faults of each press in the row.
    faults: Vec<Vec<PressFault>>,
    last: Option<Vec<PressFault>>,
}

impl InvalidRun {
    /// Allows fewer than `limit` in a row; 0 allows any number.
    pub(crate) const fn new(limit: u32) -> Self {
        Self {
            limit,
            faults: Vec::new(),
            last: None,
        }
    }

    /// Adds the faults of an attempt. Only the last attempt at a press counts.
    pub(crate) fn attempt(&mut self, faults: &[PressFault]) {
        self.last = Some(faults.to_vec());
    }

    /// Ends a press after its last attempt. A press that was interrupted on purpose is not counted.
    ///
    /// # Errors
    /// [`RunFault::InvalidInARow`] at the limit.
    pub(crate) fn press_ended(&mut self) -> Result<(), RunFault> {
        match self.last.take() {
            Some(faults) if faults.first().is_some_and(PressFault::is_pause) => {}
            Some(faults) if !faults.is_empty() => self.faults.push(faults),
            _ => self.faults.clear(),
        }
        if self.limit == 0 {
            self.faults.clear();
        }
        if self.limit == 0 || self.faults.len() < self.limit as usize {
            return Ok(());
        }
        let mut faults: Vec<PressFault> = Vec::new();
        for fault in self.faults.iter().flatten() {
            if !faults.contains(fault) {
                faults.push(fault.clone());
            }
        }
        match Causes::try_from(faults) {
            Ok(faults) => Err(RunFault::InvalidInARow {
                limit: self.limit,
                faults,
            }),
            // Only presses with faults are in the row.
            Err(NoCause) => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use skinrig_model::CameraId;

    use super::*;

    #[test]
    fn a_row_ends_the_run_and_a_valid_press_ends_the_row() {
        let bad = |camera| vec![PressFault::NoData { camera }];
        let (one, two) = (bad(CameraId::One), bad(CameraId::Two));
        let valid = Vec::new();
        let mut run = InvalidRun::new(3);
        let mut press = |attempts: &[&Vec<PressFault>]| {
            attempts.iter().for_each(|faults| run.attempt(faults));
            run.press_ended()
        };
        assert_eq!(press(&[&one, &one, &one]), Ok(()));
        assert_eq!(press(&[&one]), Ok(()));
        assert_eq!(press(&[&one, &valid]), Ok(()));
        assert_eq!(press(&[&one]), Ok(()));
        assert_eq!(press(&[&two]), Ok(()));
        // Interruptions by the operator neither count nor end the row.
        assert_eq!(press(&[&vec![PressFault::Paused]]), Ok(()));
        let ended = press(&[&one]).unwrap_err();
        let text = ended.to_string();
        assert!(
            text.contains("fewer than 3")
                && text.contains("camera 1 sent no bytes; camera 2 sent no bytes"),
            "{text}"
        );

        let mut unlimited = InvalidRun::new(0);
        for _ in 0..100 {
            unlimited.attempt(&one);
            assert_eq!(unlimited.press_ended(), Ok(()));
        }
    }
}

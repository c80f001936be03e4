//! Invalid presses in a row: past a limit something is wrong that more presses do not mend.

use crate::error::ControllerError;
use crate::press_fault::PressFault;

/// The present row of invalid presses.
#[derive(Debug)]
pub(crate) struct InvalidRun {
    limit: u32,
    /// Of each press of the row.
    faults: Vec<Vec<PressFault>>,
    last: Option<Vec<PressFault>>,
}

impl InvalidRun {
    /// `limit` in a row are too many; 0: any number is borne.
    pub(crate) const fn new(limit: u32) -> Self {
        Self {
            limit,
            faults: Vec::new(),
            last: None,
        }
    }

    /// An attempt ended, with these faults. The last one of a press counts.
    pub(crate) fn attempt(&mut self, faults: &[PressFault]) {
        self.last = Some(faults.to_vec());
    }

    /// A press ended, with all its attempts. One that was broken off on purpose says nothing of the rig and is not counted.
    ///
    /// # Errors
    /// [`ControllerError::InvalidInARow`] at the limit.
    pub(crate) fn press_ended(&mut self) -> Result<(), ControllerError> {
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
        Err(ControllerError::InvalidInARow {
            limit: self.limit,
            faults,
        })
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
        // The operator's own doing neither counts nor ends the row.
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

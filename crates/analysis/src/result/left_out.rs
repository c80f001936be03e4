//! The RMSE where no press calibrated.

use std::collections::BTreeSet;

use skinrig_model::{LocationId, PressRole, Verdict};

use super::{Analysis, Estimate};

impl Analysis {
    /// RMSE at locations that did not calibrate, mm: the headline where most of its presses are at such locations, else that of the
    /// calibrating locations left out one by one, with the chosen locator or model. `None` without a comparison of them, and where the
    /// calibration is that of an earlier session.
    #[must_use]
    pub fn left_out_rmse(&self) -> Option<&Estimate> {
        if self.recalibration.is_some() {
            return None;
        }
        if !self.scores_calibrating_places()? {
            return Some(&self.scored.rmse_mm);
        }
        let by_locator = self.locator.as_ref().map(|l| &l.compared);
        let by_locator = by_locator.and_then(|all| all.iter().find(|c| c.chosen));
        let by_model = self.calibration.as_ref().map(|c| &c.compared);
        let by_model = by_model.and_then(|all| all.iter().find(|c| c.chosen));
        let rmse = by_locator
            .map(|c| &c.rmse_mm)
            .or(by_model.map(|c| &c.rmse_mm))?;
        rmse.value.map(|_| rmse)
    }

    /// True if the headline presses are mostly at locations that calibrated: its RMSE is measured where the calibration was fitted.
    /// `None` without such presses.
    #[must_use]
    pub fn scores_calibrating_places(&self) -> Option<bool> {
        let calibrating = self.presses.iter();
        let calibrating = calibrating.filter(|p| p.role == PressRole::Calibrate);
        let taught: BTreeSet<LocationId> = calibrating.map(|p| p.location).collect();
        let counted = self.presses.iter().filter(|p| {
            p.role == PressRole::Score && p.verdict == Verdict::Valid && p.error_mm().is_some()
        });
        let (mut there, mut all) = (0, 0);
        for press in counted {
            there += usize::from(taught.contains(&press.location));
            all += 1;
        }
        (all > 0).then_some(2 * there >= all)
    }
}

//! The RMSE where no press calibrated.

use std::collections::BTreeSet;

use skinrig_model::{LocationId, PressRole};

use super::{Analysis, Estimate, PressResult};
use crate::over_locations::rms_over_locations;

/// Fewest locations whose scored presses give the RMSE where no press calibrated.
const LEAST_LOCATIONS: usize = 3;

impl Analysis {
    /// RMSE at locations that did not calibrate, mm: of the scored presses that count there, if they have at least three locations;
    /// else of the calibrating locations left out one by one, with the chosen locator or model. `None` without either, and where
    /// the calibration is that of an earlier session.
    #[must_use]
    pub fn left_out_rmse(&self) -> Option<Estimate> {
        if self.recalibration.is_some() {
            return None;
        }
        let taught = self.calibrating_places();
        let (there, elsewhere): (Vec<_>, Vec<_>) =
            self.counted().partition(|p| taught.contains(&p.location));
        if there.is_empty() {
            return (!elsewhere.is_empty()).then_some(self.scored.rmse_mm);
        }
        let errors: Vec<(u32, f64)> = elsewhere
            .iter()
            .filter_map(|p| {
                let (x, y) = p.error_mm()?;
                Some((p.location.index(), libm::hypot(x, y)))
            })
            .collect();
        let places: BTreeSet<u32> = errors.iter().map(|(location, _)| *location).collect();
        if places.len() >= LEAST_LOCATIONS {
            let settings = &self.settings;
            let resamples = settings.bootstrap_resamples;
            return Some(rms_over_locations(&errors, resamples, settings.seed));
        }
        self.left_out_one_by_one()
    }

    /// RMSE at the calibrating locations, left out one by one, with the chosen locator or model, mm.
    pub(crate) fn left_out_one_by_one(&self) -> Option<Estimate> {
        let by_locator = self.locator.as_ref().map(|l| &l.compared);
        let by_locator = by_locator.and_then(|all| all.iter().find(|c| c.chosen));
        let by_model = self.calibration.as_ref().map(|c| &c.compared);
        let by_model = by_model.and_then(|all| all.iter().find(|c| c.chosen));
        let rmse = by_locator
            .map(|c| c.rmse_mm)
            .or(by_model.map(|c| c.rmse_mm))?;
        rmse.value.map(|_| rmse)
    }

    /// True if a press of the headline is at a location that calibrated, where the calibration was fitted. `None` without such
    /// presses.
    #[must_use]
    pub fn scores_calibrating_places(&self) -> Option<bool> {
        let taught = self.calibrating_places();
        let mut counted = self.counted().peekable();
        counted.peek()?;
        Some(counted.any(|p| taught.contains(&p.location)))
    }

    fn calibrating_places(&self) -> BTreeSet<LocationId> {
        let presses = self.presses.iter();
        let calibrating = presses.filter(|p| p.role == PressRole::Calibrate);
        calibrating.map(|p| p.location).collect()
    }

    fn counted(&self) -> impl Iterator<Item = &PressResult> {
        self.presses.iter().filter(|p| p.is_in_headline())
    }
}

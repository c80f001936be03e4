//! Owns the parts of a cross-validation: what all methods share when they learn from the same presses.

use rayon::prelude::*;
use skinrig_model::StereoGeometry;

use super::spread::SpreadFits;
use crate::calibrate::Folds;
use crate::sets::CalibrationSet;

/// The presses outside one fold, with everything learnt from them that does not depend on the method.
pub(super) struct Part {
    pub presses: CalibrationSet,
    /// `None` if these presses do not determine it.
    pub geometry: Option<StereoGeometry>,
    /// `None` if no method reads spreads.
    pub spreads: Option<SpreadFits>,
}

/// Folds, and the part outside each.
pub(super) struct Parts {
    folds: Folds,
    parts: Vec<Part>,
}

impl Parts {
    /// `spreads`: those of all presses, if a method reads them.
    pub(super) fn new(
        folds: Folds,
        all: &CalibrationSet,
        geometry: impl Fn(&CalibrationSet) -> Option<StereoGeometry> + Sync,
        spreads: Option<&SpreadFits>,
    ) -> Self {
        let part = |fold: usize| {
            let (_, kept) = folds.split(fold);
            let presses = all.part(&kept);
            Part {
                geometry: geometry(&presses),
                spreads: spreads.map(|near| SpreadFits::learn(presses.sights(), Some(near))),
                presses,
            }
        };
        let parts = (0..folds.count()).into_par_iter().map(part).collect();
        Self { folds, parts }
    }

    /// Calls `held_out(part, held)` for every fold, which returns one value per held-out press, and returns the values in
    /// the order of the presses; `None` if a fold has none.
    pub(super) fn each<T: Send>(
        &self,
        held_out: impl Fn(&Part, &[usize]) -> Option<Vec<T>> + Sync,
    ) -> Option<Vec<T>> {
        self.folds
            .each(|fold, _, held| held_out(&self.parts[fold], held))
    }
}

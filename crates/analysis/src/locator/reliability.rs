//! Owns the check of the regions on the scored presses.

use skinrig_model::{AnalysisSettings, PressRole, Verdict};

use super::prediction::distance;
use super::{Features, FittedLocator};
use crate::metrics::share_over_locations;
use crate::result::{PressResult, RegionLevel, ReliabilityRow};

/// Shares of the valid scored presses inside the regions of each level.
pub(crate) fn reliability(
    fitted: &FittedLocator,
    presses: &[PressResult],
    settings: &AnalysisSettings,
) -> Vec<ReliabilityRow> {
    let scored = presses
        .iter()
        .filter(|p| p.role == PressRole::Score && p.verdict == Verdict::Valid);
    let reached: Vec<(u32, f64)> = scored
        .filter_map(|p| {
            let (features, (dx, dy)) = (Features::of_press(p)?, p.error_mm()?);
            let uncertainty = fitted.predict(&features)?.uncertainty?;
            let covariance = uncertainty.covariance(fitted.model().inflation)?;
            Some((p.location.index(), distance(covariance, [dx, dy])?))
        })
        .collect();
    if reached.is_empty() {
        return Vec::new();
    }
    let row = |level: &RegionLevel| {
        let inside = |(location, d): &(u32, f64)| (*location, *d <= level.factor);
        let inside: Vec<(u32, bool)> = reached.iter().map(inside).collect();
        ReliabilityRow {
            level: level.level,
            inside: share_over_locations(&inside, settings.bootstrap_resamples, settings.seed),
        }
    };
    fitted.model().levels.iter().map(row).collect()
}

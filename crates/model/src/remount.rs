//! Settings of a recalibration: how far a skin is expected to move when it is mounted again.

use serde::{Deserialize, Serialize};
use skinrig_settings::Settings;

/// Scales of a remount, as standard deviations, for `skinrig analyze --calibration-from`. They are assumed, not measured: a skin
/// put back into its holder by hand, with its cameras bolted to it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, Settings)]
#[serde(default)]
#[settings(name = "remount")]
pub struct RemountSettings {
    /// Shift of skin and cameras together, along either axis.
    #[setting(default = "2 mm", above = 0.0, max = 50.0)]
    pub shift_mm: f64,
    /// Turn of skin and cameras together.
    #[setting(default = "2 deg", above = 0.0, max = 45.0)]
    pub turn_deg: f64,
    /// Shift of each camera on the skin, along either axis.
    #[setting(default = "0.2 mm", above = 0.0, max = 50.0)]
    pub camera_shift_mm: f64,
    /// Turn of each camera on the skin.
    #[setting(default = "0.2 deg", above = 0.0, max = 45.0)]
    pub camera_turn_deg: f64,
    /// A correction with a part of more standard deviations is rejected.
    #[setting(default = "4", above = 0.0, max = 1000.0)]
    pub max_sigmas: f64,
    /// A recalibration is rejected if presses of a skin that fits would disagree as much with a smaller probability than this.
    /// The worst press is left out of the test.
    #[setting(default = "0.001", min = 0.0, max = 1.0)]
    pub min_chance: f64,
}

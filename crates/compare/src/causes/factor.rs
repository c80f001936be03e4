//! Possible causes of a difference between two skins, and measurements that support them.

use serde::{Deserialize, Serialize};

use crate::subject::Subject;
use skinrig_statistics::Interval;

/// Possible cause of a change in mean square error.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Factor {
    /// Analysis settings.
    Settings,
    /// Calibrated camera geometry.
    Calibration,
    /// Ground truth: measured robot position.
    Robot,
    /// Events added by a press.
    Signal,
    /// Background events.
    Noise,
    /// Width of a press in the image.
    Spread,
    /// Bias that varies over the skin, and everything that the other factors leave unexplained.
    Skin,
}

impl Factor {
    /// Short name for reports.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Settings => "settings of the analysis",
            Self::Calibration => "camera geometry",
            Self::Robot => "repetition accuracy of the robot",
            Self::Signal => "events per press",
            Self::Noise => "noise",
            Self::Spread => "width of a press",
            Self::Skin => "bias over the skin, and the rest",
        }
    }
}

/// Contribution of one factor to the change.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Contribution {
    /// The factor.
    pub factor: Factor,
    /// Contribution to the change of the mean square error, mm², with a 95 % bootstrap interval over locations.
    pub mm2: Interval,
}

/// A quantity measured in both skins, shown as evidence beside the contributions.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FactorMeasurement {
    /// Name for reports.
    pub what: &'static str,
    /// Unit of the values.
    pub unit: &'static str,
    /// Value of the first and of the other skin.
    pub values: [Option<f64>; 2],
}

/// Both skins reanalysed, each with the settings of the other.
#[derive(Debug, Clone, Copy)]
pub struct Reanalysis<'a> {
    /// First skin with the settings of the second.
    pub first: &'a Subject,
    /// Second skin with the settings of the first.
    pub second: &'a Subject,
}

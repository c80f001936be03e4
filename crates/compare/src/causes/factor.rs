//! What may carry a change between two skins, and what was measured of it.

use serde::{Deserialize, Serialize};

use crate::statistics::Interval;
use crate::subject::Subject;

/// What may carry a change.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Factor {
    /// Settings of the analysis.
    Settings,
    /// Where the cameras are thought to be.
    Calibration,
    /// Where the robot says it pressed.
    Robot,
    /// Events that a press adds.
    Signal,
    /// Events without a press.
    Noise,
    /// Width of a touch in the picture.
    Spread,
    /// Bias that depends on the place on the skin, and what nothing above explains.
    Skin,
}

impl Factor {
    /// In a few words.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Settings => "settings of the analysis",
            Self::Calibration => "camera geometry",
            Self::Robot => "repetition accuracy of the robot",
            Self::Signal => "events per press",
            Self::Noise => "noise",
            Self::Spread => "width of a touch",
            Self::Skin => "bias over the skin, and the rest",
        }
    }
}

/// What one factor carries.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Contribution {
    /// Which.
    pub factor: Factor,
    /// Of the change of the mean square error, mm², with its 95 % interval over places.
    pub mm2: Interval,
}

/// Something measured directly in both skins.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Measured {
    /// What.
    pub what: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// Of the first and of the other skin.
    pub values: [Option<f64>; 2],
}

/// A skin analysed again with the settings of the other one.
#[derive(Debug, Clone, Copy)]
pub struct Again<'a> {
    /// The first skin with the settings of the second.
    pub first: &'a Subject,
    /// The second with those of the first.
    pub second: &'a Subject,
}

//! Requirements for a simulated scene, and the cheapest simulation level that meets them.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::text::UnknownName;

/// Levels of simulation, from cheap to expensive; each level contains the ones before it.
#[derive(
    Debug,
    Clone,
    Copy,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    Hash,
    Serialize,
    Deserialize,
    skinrig_settings::Choice,
)]
#[serde(rename_all = "snake_case")]
pub enum SimLevel {
    /// Robot and trigger box; cameras deliver time base and triggers but no pixel events.
    Kinematic,
    /// Events around the projected column of the contact, from rates fitted per press phase.
    Geometric,
    /// A light-path model of the waveguide; events follow from log-intensity changes per pixel.
    Optical,
}

impl SimLevel {
    /// All levels, cheapest first.
    pub const ALL: [Self; 3] = [Self::Kinematic, Self::Geometric, Self::Optical];

    /// The name used in protocols and sessions.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Kinematic => "kinematic",
            Self::Geometric => "geometric",
            Self::Optical => "optical",
        }
    }
}

impl fmt::Display for SimLevel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for SimLevel {
    type Err = UnknownName;
    fn from_str(s: &str) -> Result<Self, UnknownName> {
        Self::ALL
            .into_iter()
            .find(|l| l.name() == s)
            .ok_or_else(|| UnknownName {
                expected: "kinematic, geometric or optical",
                found: s.to_owned(),
            })
    }
}

/// Physics that the optical level adds when a scene lists it.
#[derive(
    Debug,
    Clone,
    Copy,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    Hash,
    Serialize,
    Deserialize,
    skinrig_settings::Choice,
)]
#[serde(rename_all = "snake_case")]
pub enum ScenePart {
    /// The dent lies beside the tip and is deeper or shallower, otherwise in each press.
    PressScatter,
    /// Some presses dent the skin little.
    WeakPresses,
    /// The skin keeps a part of the last dents for seconds.
    SlowRecovery,
    /// Rays bend where they leave the skin for the lens.
    PodRefraction,
    /// Emitters differ in power, and the skin is cloudier in places.
    UnevenLight,
    /// Pixels differ in threshold and refractory time.
    UnevenPixels,
    /// Noise comes from few pixels.
    UnevenNoise,
    /// Dark pixels respond later.
    DarkLatency,
    /// Events wait until the sensor reads their row.
    Readout,
}

impl ScenePart {
    /// All parts.
    pub const ALL: [Self; 9] = [
        Self::PressScatter,
        Self::WeakPresses,
        Self::SlowRecovery,
        Self::PodRefraction,
        Self::UnevenLight,
        Self::UnevenPixels,
        Self::UnevenNoise,
        Self::DarkLatency,
        Self::Readout,
    ];

    /// The name used in protocols and sessions.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::PressScatter => "press_scatter",
            Self::WeakPresses => "weak_presses",
            Self::SlowRecovery => "slow_recovery",
            Self::PodRefraction => "pod_refraction",
            Self::UnevenLight => "uneven_light",
            Self::UnevenPixels => "uneven_pixels",
            Self::UnevenNoise => "uneven_noise",
            Self::DarkLatency => "dark_latency",
            Self::Readout => "readout",
        }
    }
}

/// A property of the simulated session that its user relies on.
#[derive(
    Debug,
    Clone,
    Copy,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    Hash,
    Serialize,
    Deserialize,
    skinrig_settings::Choice,
)]
#[serde(rename_all = "snake_case")]
pub enum SceneNeed {
    /// Trajectories, settling, timing of the presses.
    Motion,
    /// Trigger edges and clock fits.
    Triggers,
    /// Data volume and event rates of realistic size and time course.
    EventRates,
    /// Polarity of press and release bursts.
    Polarity,
    /// Localisation end to end; errors come from a stated sampling noise of the centroid.
    Localisation,
    /// Localisation errors that emerge from optics: bias over the skin, dependence on depth and distance.
    OpticalError,
    /// Detection latency that emerges from light and pixel thresholds.
    Latency,
}

impl SceneNeed {
    /// All needs.
    pub const ALL: [Self; 7] = [
        Self::Motion,
        Self::Triggers,
        Self::EventRates,
        Self::Polarity,
        Self::Localisation,
        Self::OpticalError,
        Self::Latency,
    ];

    /// The name used in protocols.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Motion => "motion",
            Self::Triggers => "triggers",
            Self::EventRates => "event_rates",
            Self::Polarity => "polarity",
            Self::Localisation => "localisation",
            Self::OpticalError => "optical_error",
            Self::Latency => "latency",
        }
    }

    /// The cheapest level that has this property.
    #[must_use]
    pub const fn level(self) -> SimLevel {
        match self {
            Self::Motion | Self::Triggers => SimLevel::Kinematic,
            Self::EventRates | Self::Polarity | Self::Localisation => SimLevel::Geometric,
            Self::OpticalError | Self::Latency => SimLevel::Optical,
        }
    }
}

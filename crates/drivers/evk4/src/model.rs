//! Cameras with EVT3 words that neuromorphic-drivers supports over USB, and the features it offers for each.

use std::ops::RangeInclusive;

use skinrig_formats::Geometry;

/// A camera model. Features are those of neuromorphic-drivers 0.18, not those of the camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Model {
    /// Prophesee EVK4 (IMX636): biases, trigger input, shared time base.
    Evk4,
    /// Prophesee EVK3 HD (Gen4.1): biases; neither a trigger input nor a shared time base.
    Evk3Hd,
    /// CenturyArks SilkyEvCam VGA (Gen3.1): none of these.
    SilkyVga,
}

impl Model {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Evk4, Self::Evk3Hd, Self::SilkyVga];

    /// Its name in a rig file.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Evk4 => "evk4",
            Self::Evk3Hd => "evk3_hd",
            Self::SilkyVga => "silky_vga",
        }
    }

    /// The model with this [name in a rig file](Self::word).
    #[must_use]
    pub fn of_word(word: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|m| m.word() == word)
    }

    /// Manufacturer and name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Evk4 => "Prophesee EVK4",
            Self::Evk3Hd => "Prophesee EVK3 HD",
            Self::SilkyVga => "CenturyArks SilkyEvCam VGA",
        }
    }

    /// Size of its sensor.
    #[must_use]
    pub const fn geometry(self) -> Geometry {
        let (width, height) = match self {
            Self::Evk4 | Self::Evk3Hd => (1280, 720),
            Self::SilkyVga => (640, 480),
        };
        Geometry { width, height }
    }

    /// Bias names. Two more of an EVK4 have no name; those of a SilkyEvCam VGA are not offered, because neither their unit nor the sensor's
    /// limits are documented.
    #[must_use]
    pub const fn biases(self) -> &'static [&'static str] {
        match self {
            Self::Evk4 => &[
                "diff",
                "diff_off",
                "diff_on",
                "fo",
                "hpf",
                "inv",
                "pr",
                "refr",
                "reqpux",
                "reqpuy",
                "sendreqpdy",
            ],
            Self::Evk3Hd => &[
                "blk", "diff", "diff_off", "diff_on", "fo_n", "fo_p", "hpf", "pr", "refr", "reqpuy",
            ],
            Self::SilkyVga => &[],
        }
    }

    /// Bias range: for an EVK4 an offset from the value in the sensor's memory (an 8-bit register holds the sum), for an EVK3 HD the register
    /// value.
    #[must_use]
    pub(crate) const fn bias_range(self) -> RangeInclusive<i16> {
        match self {
            Self::Evk4 => -255..=255,
            Self::Evk3Hd | Self::SilkyVga => 0..=255,
        }
    }

    /// Available trigger inputs (metavision_driver, `config/trigger_pins.yaml`, lists the main input of every model as channel 0).
    #[must_use]
    pub const fn trigger_channels(self) -> &'static [u8] {
        match self {
            Self::Evk4 => &[0],
            Self::Evk3Hd | Self::SilkyVga => &[],
        }
    }

    /// Whether it can share its time base with another camera.
    #[must_use]
    pub(crate) const fn shares_time_base(self) -> bool {
        matches!(self, Self::Evk4)
    }
}

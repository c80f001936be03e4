//! The cameras that neuromorphic-drivers opens over USB and that send EVT3 words, and what it offers of each.

use std::ops::RangeInclusive;

use skinrig_formats::Geometry;

/// A camera model. What is said of each is what neuromorphic-drivers 0.18 offers, not what the camera could do.
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

    /// The word that stands for it in a rig file.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Evk4 => "evk4",
            Self::Evk3Hd => "evk3_hd",
            Self::SilkyVga => "silky_vga",
        }
    }

    /// The model of this [word](Self::word).
    #[must_use]
    pub fn of_word(word: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|m| m.word() == word)
    }

    /// Maker and name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Evk4 => "Prophesee EVK4",
            Self::Evk3Hd => "Prophesee EVK3 HD",
            Self::SilkyVga => "CenturyArks SilkyEvCam VGA",
        }
    }

    /// Columns and rows of its sensor.
    #[must_use]
    pub const fn geometry(self) -> Geometry {
        let (width, height) = match self {
            Self::Evk4 | Self::Evk3Hd => (1280, 720),
            Self::SilkyVga => (640, 480),
        };
        Geometry { width, height }
    }

    /// Biases by name. Two more of an EVK4 have no name; those of a SilkyEvCam VGA are left alone, because neither their unit
    /// nor what the sensor bears is stated anywhere.
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

    /// What a bias may be: for an EVK4 an offset from the value in the sensor's memory (a register of eight bits holds both
    /// together), for an EVK3 HD the register's value.
    #[must_use]
    pub(crate) const fn bias_range(self) -> RangeInclusive<i16> {
        match self {
            Self::Evk4 => -255..=255,
            Self::Evk3Hd | Self::SilkyVga => 0..=255,
        }
    }

    /// The trigger inputs that can be switched on (metavision_driver, `config/trigger_pins.yaml`, gives the main input of
    /// every model as channel 0).
    #[must_use]
    pub const fn trigger_channels(self) -> &'static [u8] {
        match self {
            Self::Evk4 => &[0],
            Self::Evk3Hd | Self::SilkyVga => &[],
        }
    }

    /// Whether it can give its time base to another camera, or take another's.
    #[must_use]
    pub(crate) const fn shares_time_base(self) -> bool {
        matches!(self, Self::Evk4)
    }
}

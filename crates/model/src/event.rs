//! Events of an event camera: changes of a pixel, and edges on its trigger input.

use serde::{Deserialize, Serialize};

/// The sign of a brightness change.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Polarity {
    /// Darker.
    Off,
    /// Brighter.
    On,
}

impl Polarity {
    /// `On` for 1, `Off` for 0.
    #[must_use]
    pub const fn from_bit(bit: bool) -> Self {
        if bit { Self::On } else { Self::Off }
    }

    /// 1 for `On`, 0 for `Off`.
    #[must_use]
    pub const fn bit(self) -> u8 {
        match self {
            Self::Off => 0,
            Self::On => 1,
        }
    }
}

/// A change-detection (CD) event.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct CdEvent {
    /// Time on the camera's clock, µs, unwrapped (the 34-bit counter of EVT2 continues past its wrap).
    pub t_us: u64,
    /// Column, 0 at the left; `u` of the paper.
    pub x: u16,
    /// Row, 0 at the top; `v` of the paper.
    pub y: u16,
    /// Sign of the change.
    pub polarity: Polarity,
}

/// An edge on a camera's trigger input.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct TriggerEdge {
    /// Time on the camera's clock, µs, unwrapped.
    pub t_us: u64,
    /// Input channel: 0 main, 6 loop-back of trigger out, 7 auxiliary (EVK1).
    pub channel: u8,
    /// True for a rising edge.
    pub rising: bool,
}

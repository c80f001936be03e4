//! How presses find the surface of the skin.

use serde::{Deserialize, Serialize};
use skinrig_model::HostDuration;

use crate::keys::{count, default};
use crate::shape::{Field, Key, Keys, Range, Shape, Table, Word};
use skinrig_settings::Dimension::{Force, Length, Speed, Time};

/// Where a press takes the surface to be.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(tag = "surface", rename_all = "snake_case")]
pub enum Surface {
    /// At z = 0 of the skin's frame.
    #[default]
    Known,
    /// Where the force rises.
    Touch(TouchSearch),
}

impl Surface {
    /// True for [`Surface::Known`].
    #[must_use]
    pub const fn is_known(&self) -> bool {
        matches!(self, Self::Known)
    }
}

/// How the surface is searched: from clearance height to `band_mm` above the frame's surface at the approach's speed,
/// then down at `speed_mm_s` until the force is `threshold_n` above the one in free air.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TouchSearch {
    /// N above the tare.
    pub threshold_n: f64,
    /// So many samples in a row.
    pub samples: u32,
    /// mm/s.
    pub speed_mm_s: f64,
    /// A touch farther than this from z = 0 is not believed; the search ends there, mm.
    pub band_mm: f64,
    /// How long the force in free air is averaged.
    pub tare: HostDuration,
}

/// The defaults of the keys of `press`.
impl Default for TouchSearch {
    fn default() -> Self {
        Self {
            threshold_n: 0.2,
            samples: 5,
            speed_mm_s: 2.0,
            band_mm: 1.0,
            tare: HostDuration::from_millis(300),
        }
    }
}

/// How the surface is found: keys of protocols and of rig files.
pub(crate) static PRESS: Table = Table {
    name: "press",
    doc: "How a press finds the surface.",
    keys: KEYS,
    exactly_one: &[],
};

const KEYS: &[Key] = &[
    default(
        "surface",
        Shape::Choice(SURFACES),
        "known",
        "Where the surface is.",
    ),
    default(
        "threshold",
        Shape::Quantity(&[Force], Range::above_zero(12.0)),
        "0.2 N",
        "With `touch`: a force this far above the one in free air is a contact. Friction hides less than about 0.1 N.",
    ),
    default(
        "samples",
        count(1, 1000),
        "5",
        "With `touch`: so many samples in a row must be above the threshold.",
    ),
    default(
        "speed",
        Shape::Quantity(&[Speed], Range::above_zero(10.0)),
        "2 mm/s",
        "With `touch`: speed of the search.",
    ),
    default(
        "band",
        Shape::Quantity(&[Length], Range::above_zero(10.0)),
        "1 mm",
        "With `touch`: how far above or below the frame's surface a touch is believed; the search starts and ends there.",
    ),
    default(
        "tare",
        Shape::Quantity(&[Time], Range::above_zero(10.0)),
        "300 ms",
        "With `touch`: how long the force in free air is averaged at clearance height.",
    ),
];

const SURFACES: &[Word] = &[
    ("known", "at z = 0 of the frame"),
    (
        "touch",
        "where the force rises; depths count from there, the floor limit stays where it is",
    ),
];

/// Reads a mapping of the table `press`.
pub(crate) fn surface(f: &Field) -> Option<Surface> {
    if f.word("surface")? == "known" {
        return Some(Surface::Known);
    }
    Some(Surface::Touch(TouchSearch {
        threshold_n: f.quantity("threshold")?,
        samples: f.count("samples")?,
        speed_mm_s: f.quantity("speed")?,
        band_mm: f.quantity("band")?,
        tare: HostDuration::from_secs_f64(f.quantity("tare")?),
    }))
}

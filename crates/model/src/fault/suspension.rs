//! Conditions that suspend a run.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::id::CameraId;

/// Quantity that a condition watches.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum WatchedQuantity {
    /// Events per second: too many.
    Storm,
    /// Events per second: too few.
    Dark,
    /// Bytes lost per second.
    Loss,
    /// Temperature of a camera, °C.
    Temperature,
    /// Free space at the session file, bytes.
    Disk,
}

impl WatchedQuantity {
    /// Name and unit.
    const fn words(self) -> (&'static str, &'static str) {
        match self {
            Self::Storm => ("event rate", "ev/s"),
            Self::Dark => ("dark scene: event rate", "ev/s"),
            Self::Loss => ("lost data", "B/s"),
            Self::Temperature => ("temperature", "°C"),
            Self::Disk => ("free space", "B"),
        }
    }
}

/// A suspension of a run: the condition that tripped.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Suspension {
    /// Camera of the condition; `None` for the disk.
    pub camera: Option<CameraId>,
    /// What was watched.
    pub quantity: WatchedQuantity,
    /// Trip level, in the unit of the quantity.
    pub trip: f64,
    /// Value beyond it.
    #[serde(with = "crate::number")]
    pub found: f64,
}

impl fmt::Display for Suspension {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (what, unit) = self.quantity.words();
        let (trip, found) = (self.trip, self.found);
        let side = if found > trip { "at most" } else { "at least" };
        f.write_str("suspended: ")?;
        if let Some(camera) = self.camera {
            write!(f, "{camera}: ")?;
        }
        write!(
            f,
            "{what}: expected {side} {trip} {unit}, found {found:.0} {unit}"
        )
    }
}

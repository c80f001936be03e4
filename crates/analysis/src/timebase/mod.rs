//! Common time base of host, trigger box, both cameras and the robot, with its certificate.
//!
//! `host` bounds the host's clock by the exchanges with the box, `edges` finds the sent trains in the edges that each camera
//! saw, `smooth` fits both. Camera time over host time combines the two. `docs/explanation/time-base.md` has the formulae
//! and the limits.

mod base;
mod certificate;
mod drifting;
mod edges;
mod epoch_maps;
mod epochs;
mod error;
mod held_out;
mod host;
mod limits;
mod line;
mod reading;
mod residuals;
mod smooth;
mod wire;

pub use self::base::{TimeBase, TimeBaseInput};
pub(crate) use self::edges::distance_us;
pub use self::error::CameraClockError;
pub use self::reading::{Drift, Reading};
pub(crate) use self::smooth::{Point, STEP_US, SmoothMap};
pub use self::wire::{Wire, WireTrain, wire};

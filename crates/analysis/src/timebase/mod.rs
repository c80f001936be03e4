//! One time base: host, trigger box, both cameras and the robot on one another, and the certificate of it.
//!
//! `host` bounds the host's clock by the exchanges with the box, `edges` finds the trains that the box sent among what
//! each camera saw, `smooth` fits both. Camera time over host time is the two together. `docs/explanation/time-base.md` has the
//! formulae and the limits.

mod base;
mod certificate;
mod drifting;
mod edges;
mod epochs;
mod held_out;
mod host;
mod limits;
mod line;
mod piece;
mod reading;
mod residuals;
mod smooth;
mod wire;

pub use self::base::{Tie, Ties, TimeBase};
pub(crate) use self::edges::distance_us;
pub use self::reading::{Drift, Reading};
pub(crate) use self::smooth::{Point, STEP_US, Smooth};
pub use self::wire::{Wire, WireTrain, wire};

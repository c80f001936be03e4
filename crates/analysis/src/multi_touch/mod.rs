//! Two touches at once: divides what both cameras see of a press into touches, and pairs the touches of one camera with those
//! of the other.
//!
//! `profile` learns from the calibration presses what a single touch looks like over the columns of a camera; `mixture`
//! divides the events of a camera among two touches, each with its own course over time; `timing` finds when each ends. Rays
//! of two touches cross at four points. Which two are real follows from the times, unless only one pairing lies on
//! the skin. Where neither decides, the result is ambiguous. Decision and measurements: `docs/adr/0047-*`.

mod mixture;
mod profile;
mod separate;
mod sight;
mod timing;

pub use separate::{Ambiguity, Separation, Separator, SingleTouch, Touch};
pub use sight::{TouchEvent, TouchSight, TouchTimes};

//! The contract suite: what every implementation of a device trait must do, simulated, replayed or real.
//!
//! Each function drives fresh devices through one trait's promises and panics with a clear message at the first
//! broken one. Call them from tests. They work on any clock and touch nothing but the devices they are given.
//!
//! Positions are in the robot frame; whoever runs [`indenter`] on a real robot clears the space between the
//! targets first.

use skinrig_model::{HostDuration, HostTime};

use crate::{Clock, DeviceError};

/// Asserts that `answer` is an error of the kind named by `pattern`.
macro_rules! expect_error {
    ($answer:expr, $pattern:pat, $what:expr) => {
        match $answer {
            Err($pattern) => {}
            other => panic!("{}: found {:?}", $what, other.map(|_| "success")),
        }
    };
}

/// A step of waiting; short against everything that a robot does.
const TICK: HostDuration = HostDuration::from_millis(5);

/// Lets `span` pass on `clock`, looking in between.
fn pass(clock: &mut dyn Clock, span: HostDuration, mut look: impl FnMut()) {
    let end = clock.now() + span;
    while clock.now() < end {
        let next = clock.now() + TICK;
        clock.wait_until(if next < end { next } else { end });
        look();
    }
}

/// Asks until the device has answered.
fn answered<T>(
    clock: &mut dyn Clock,
    mut ask: impl FnMut() -> Result<T, DeviceError>,
) -> Result<T, DeviceError> {
    loop {
        match ask() {
            Err(DeviceError::Pending { .. }) => pass(clock, TICK, || {}),
            answer => return answer,
        }
    }
}

mod camera;
mod indenter;
mod trigger;

pub use camera::event_camera;
pub use indenter::{IndenterContract, indenter};
pub use trigger::trigger_box;

/// The promises of [`Clock`]: never back, and a wait reaches its end.
pub fn clock(clock: &mut dyn Clock) {
    let start = clock.now();
    clock.wait_until(HostTime(start.0 - 1_000_000));
    assert!(
        clock.now() >= start,
        "clock: went back after a wait for the past"
    );
    let end = start + HostDuration::from_millis(20);
    let mut last = start;
    // A replayed clock may end a wait early; waiting again goes on.
    for _ in 0..1_000_000 {
        clock.wait_until(end);
        let now = clock.now();
        assert!(now >= last, "clock: went back from {last} to {now}");
        last = now;
        if now >= end {
            return;
        }
    }
    panic!(
        "clock: waited again and again for {end}, still at {}",
        clock.now()
    );
}

//! Contract tests that every implementation of a device trait must pass: simulated, replayed or real.
//!
//! Each function tests new devices against one trait and panics with a clear message at the first violation. They work with any clock
//! and touch only the given devices.
//!
//! Positions are in the robot frame. Before running [`indenter`] on a real robot, clear the space between the targets.

use skinrig_model::{HostDuration, HostTime};

use crate::{Clock, DeviceError};

/// Asserts that `answer` is an error of the kind `pattern`.
macro_rules! expect_error {
    ($answer:expr, $pattern:pat, $what:expr) => {
        match $answer {
            Err($pattern) => {}
            other => panic!("{}: found {:?}", $what, other.map(|_| "success")),
        }
    };
}

/// Polling interval; short compared with any robot motion.
const TICK: HostDuration = HostDuration::from_millis(5);

/// Waits for `span` on `clock` and polls meanwhile.
fn pass(clock: &mut dyn Clock, span: HostDuration, mut look: impl FnMut()) {
    let end = clock.now() + span;
    while clock.now() < end {
        let next = clock.now() + TICK;
        clock.wait_until(if next < end { next } else { end });
        look();
    }
}

/// Repeats a call until it is no longer pending.
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

/// Verifies the contract of [`Clock`]: monotonic, and waits reach their end.
pub fn clock(clock: &mut dyn Clock) {
    let start = clock.now();
    clock.wait_until(HostTime(start.0 - 1_000_000));
    assert!(
        clock.now() >= start,
        "clock: went back after a wait for the past"
    );
    let end = start + HostDuration::from_millis(20);
    let mut last = start;
    // A replayed clock may return early; waiting again continues.
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

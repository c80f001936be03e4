//! The clock of a rig: real, simulated or replayed.

use std::time::{Duration, Instant};

use skinrig_model::HostTime;

/// Source of host time. All waits go through it, so that tests and simulations control time.
pub trait Clock: Send {
    /// Current time. Monotonic.
    fn now(&self) -> HostTime;

    /// Waits until `t`, or returns at once if it is past. A simulated clock jumps to `t`. A replayed clock may return early at the time of a
    /// recorded command: wait again to continue.
    fn wait_until(&mut self, t: HostTime);
}

/// Allows passing a clock on by mutable reference.
impl<T: Clock + ?Sized> Clock for &mut T {
    fn now(&self) -> HostTime {
        (**self).now()
    }

    fn wait_until(&mut self, t: HostTime) {
        (**self).wait_until(t);
    }
}

/// Clock of a real bench: the operating system's monotonic clock, with its zero at the start of the session.
///
/// Copies share the zero, so that each driver thread can stamp data on arrival.
#[derive(Debug, Clone, Copy)]
pub struct RealClock {
    start: Instant,
}

impl RealClock {
    /// A clock with its zero at the current time.
    #[must_use]
    pub fn start() -> Self {
        Self {
            start: Instant::now(),
        }
    }

    /// Current time; saturates after 292 years.
    #[must_use]
    pub fn now(&self) -> HostTime {
        let ns = i64::try_from(self.start.elapsed().as_nanos());
        HostTime(ns.unwrap_or(i64::MAX))
    }
}

impl Clock for RealClock {
    fn now(&self) -> HostTime {
        Self::now(self)
    }

    fn wait_until(&mut self, t: HostTime) {
        let left = t - Self::now(self);
        if let Ok(ns) = u64::try_from(left.0) {
            std::thread::sleep(Duration::from_nanos(ns));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_real_clock_keeps_the_contract() {
        let mut clock = RealClock::start();
        crate::contract::clock(&mut clock);
    }
}

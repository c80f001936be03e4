//! The clock of a rig: real, simulated or replayed.

use std::time::{Duration, Instant};

use skinrig_model::HostTime;

/// Host time, injected. Everything that waits, waits here.
pub trait Clock: Send {
    /// The present. Never goes back.
    fn now(&self) -> HostTime;

    /// Waits until `t` (at once when it is past). A simulated clock jumps there. A replayed clock may end a
    /// wait early, at an instant at which its recording holds a command: wait again to go on.
    fn wait_until(&mut self, t: HostTime);
}

/// Whoever holds one for a while may lend it on.
impl<T: Clock + ?Sized> Clock for &mut T {
    fn now(&self) -> HostTime {
        (**self).now()
    }

    fn wait_until(&mut self, t: HostTime) {
        (**self).wait_until(t);
    }
}

/// The clock of a bench: the operating system's monotonic clock since the session began.
///
/// Copies tell the same time, so every driver thread carries one and stamps what it receives the moment it
/// arrives.
#[derive(Debug, Clone, Copy)]
pub struct RealClock {
    start: Instant,
}

impl RealClock {
    /// A clock that reads zero now.
    #[must_use]
    pub fn start() -> Self {
        Self {
            start: Instant::now(),
        }
    }

    /// The present; saturates after 292 years.
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

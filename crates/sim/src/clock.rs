//! The simulated clock, and a wrapper that runs in real time.

use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};
use std::time::{Duration, Instant};

use skinrig_device::Clock;
use skinrig_model::HostTime;

/// Simulated host time: a wait jumps to its end. Clones share the time.
#[derive(Debug, Clone, Default)]
pub struct SimClock {
    now_ns: Arc<AtomicI64>,
}

impl SimClock {
    /// A clock at time zero.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }
}

impl Clock for SimClock {
    fn now(&self) -> HostTime {
        HostTime(self.now_ns.load(Ordering::Acquire))
    }

    fn wait_until(&mut self, t: HostTime) {
        self.now_ns.fetch_max(t.0, Ordering::AcqRel);
    }
}

/// Slows another clock down to real time, for `--real-time`.
pub struct PacedClock<C> {
    inner: C,
    began: Instant,
    from: HostTime,
}

impl<C: Clock> PacedClock<C> {
    /// Wraps `inner`, whose current time corresponds to the real current time.
    pub fn new(inner: C) -> Self {
        Self {
            began: Instant::now(),
            from: inner.now(),
            inner,
        }
    }
}

impl<C: Clock> Clock for PacedClock<C> {
    fn now(&self) -> HostTime {
        self.inner.now()
    }

    fn wait_until(&mut self, t: HostTime) {
        let due = Duration::from_nanos(u64::try_from((t - self.from).0).unwrap_or(0));
        std::thread::sleep(due.saturating_sub(self.began.elapsed()));
        self.inner.wait_until(t);
    }
}

/// Makes a boxed clock a clock, so that the clock of a finished rig can be wrapped.
pub(crate) struct BoxedClock(pub Box<dyn Clock>);

impl Clock for BoxedClock {
    fn now(&self) -> HostTime {
        self.0.now()
    }

    fn wait_until(&mut self, t: HostTime) {
        self.0.wait_until(t);
    }
}

//! The simulated clock, and the one that keeps pace with real time.

use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};
use std::time::{Duration, Instant};

use skinrig_device::Clock;
use skinrig_model::HostTime;

/// Simulated host time: waiting jumps there. Clones share one time.
#[derive(Debug, Clone, Default)]
pub struct SimClock {
    now_ns: Arc<AtomicI64>,
}

impl SimClock {
    /// A clock at time 0.
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

/// Lets another clock jump only as fast as real time passes (`--real-time`): for watching.
pub struct Paced<C> {
    inner: C,
    began: Instant,
    from: HostTime,
}

impl<C: Clock> Paced<C> {
    /// Paces `inner`, whose present corresponds to the real present.
    pub fn new(inner: C) -> Self {
        Self {
            began: Instant::now(),
            from: inner.now(),
            inner,
        }
    }
}

impl<C: Clock> Clock for Paced<C> {
    fn now(&self) -> HostTime {
        self.inner.now()
    }

    fn wait_until(&mut self, t: HostTime) {
        let due = Duration::from_nanos(u64::try_from((t - self.from).0).unwrap_or(0));
        std::thread::sleep(due.saturating_sub(self.began.elapsed()));
        self.inner.wait_until(t);
    }
}

/// A boxed clock is a clock, so that the clock of a finished rig can be paced too.
pub(crate) struct Boxed(pub Box<dyn Clock>);

impl Clock for Boxed {
    fn now(&self) -> HostTime {
        self.0.now()
    }

    fn wait_until(&mut self, t: HostTime) {
        self.0.wait_until(t);
    }
}

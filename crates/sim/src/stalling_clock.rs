//! A clock that simulates a stalled program: the wait during which the fault occurs ends late.

use skinrig_device::Clock;
use skinrig_model::{HostDuration, HostTime, RigFault};

use crate::config::SimConfig;
use crate::faults::{self, FaultTrigger};
use crate::world::Shared;

/// Clock of a rig whose host stalls.
pub(crate) struct StallingClock {
    shared: Shared,
    stalls: Vec<FaultTrigger>,
    stall: HostDuration,
}

impl StallingClock {
    /// Clock of `shared` with the stalls of `config`; `None` without any.
    pub(crate) fn new(shared: Shared, config: &SimConfig) -> Option<Self> {
        let stalls: Vec<_> = faults::times(&config.faults, RigFault::RecorderSlow).collect();
        let stall = HostDuration::from_millis(i64::from(config.fault_sizes.recorder_ms));
        (!stalls.is_empty()).then_some(Self {
            shared,
            stalls,
            stall,
        })
    }
}

impl Clock for StallingClock {
    fn now(&self) -> HostTime {
        self.shared.clock.now()
    }

    fn wait_until(&mut self, t: HostTime) {
        self.shared.clock.wait_until(t);
        let before = self.stalls.len();
        if before == 0 {
            return;
        }
        {
            let world = self.shared.world();
            self.stalls.retain(|&when| !world.has_occurred(when));
        }
        for _ in self.stalls.len()..before {
            let until = self.shared.clock.now() + self.stall;
            self.shared.clock.wait_until(until);
        }
    }
}

//! A clock that simulates a stalled program: the wait during which the fault occurs ends late.

use skinrig_device::Clock;
use skinrig_model::{HostDuration, HostTime};

use crate::faults::{Fault, FaultTrigger};
use crate::world::Shared;

/// Clock of a rig whose host stalls.
pub(crate) struct StallingClock {
    shared: Shared,
    faults: Vec<(FaultTrigger, u32)>,
}

impl StallingClock {
    /// Clock of `shared` with the stall faults among `faults`; `None` without any.
    pub(crate) fn new(shared: Shared, faults: &[Fault]) -> Option<Self> {
        let faults: Vec<_> = faults
            .iter()
            .filter_map(|fault| match *fault {
                Fault::HostHeldUp { when, for_ms } => Some((when, for_ms)),
                _ => None,
            })
            .collect();
        (!faults.is_empty()).then_some(Self { shared, faults })
    }
}

impl Clock for StallingClock {
    fn now(&self) -> HostTime {
        self.shared.clock.now()
    }

    fn wait_until(&mut self, t: HostTime) {
        self.shared.clock.wait_until(t);
        if self.faults.is_empty() {
            return;
        }
        let mut held_ms = 0;
        {
            let world = self.shared.world();
            self.faults.retain(|&(when, for_ms)| {
                let struck = world.has_occurred(when);
                held_ms += if struck { i64::from(for_ms) } else { 0 };
                !struck
            });
        }
        if held_ms > 0 {
            let until = self.shared.clock.now() + HostDuration::from_millis(held_ms);
            self.shared.clock.wait_until(until);
        }
    }
}

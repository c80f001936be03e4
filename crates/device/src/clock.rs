//! The clock of a rig: real, simulated or replayed.

use skinrig_model::HostTime;

/// Host time, injected. Everything that waits, waits here.
pub trait Clock: Send {
    /// The present. Never goes back.
    fn now(&self) -> HostTime;

    /// Waits until `t` (at once when it is past). A simulated clock jumps there. A replayed clock may end a
    /// wait early, at an instant at which its recording holds a command: wait again to go on.
    fn wait_until(&mut self, t: HostTime);
}

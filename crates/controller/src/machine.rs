//! The state machine of a run, and the operator's requests to it.

use std::collections::VecDeque;

use skinrig_device::Clock;
use skinrig_model::HostTime;

use crate::control::{ControlHandle, Request};
use crate::states::{Action, Event, State, transition};

/// Current state of a run.
#[derive(Debug)]
pub(crate) struct Machine {
    state: State,
    /// Carries the requests, and shows the current state to other threads.
    control: ControlHandle,
    /// True while a motion is in progress that `pause_now` may interrupt.
    is_interruptible: bool,
    /// Time at which the operator's halt was received.
    halted_at: Option<HostTime>,
}

impl Machine {
    pub(crate) fn new(control: ControlHandle) -> Self {
        let state = State::Planned;
        control.publish_state(state);
        Self {
            state,
            control,
            is_interruptible: false,
            halted_at: None,
        }
    }

    pub(crate) const fn state(&self) -> State {
        self.state
    }

    /// Enters the next state and returns the action to take.
    pub(crate) fn fire(&mut self, event: Event) -> Action {
        let (next, action) = transition(self.state, event);
        self.state = next;
        self.control.publish_state(next);
        action
    }

    /// Number of requests made; to be acknowledged once they are handled.
    pub(crate) fn requests_made(&self) -> u64 {
        self.control.requests_made()
    }

    /// Takes all pending requests, most urgent first.
    pub(crate) fn take_requests(&self) -> impl Iterator<Item = Request> + use<> {
        self.control.take()
    }

    /// Acknowledges the first `requests` requests.
    pub(crate) fn acknowledge(&self, requests: u64) {
        self.control.acknowledge(requests);
    }

    /// Takes the operator's notes.
    pub(crate) fn take_notes(&self) -> VecDeque<String> {
        self.control.take_notes()
    }

    /// Counts a recorded note.
    pub(crate) fn count_note(&self) {
        self.control.count_note();
    }

    /// Sets whether `pause_now` may interrupt the current motion.
    pub(crate) const fn set_interruptible(&mut self, is_interruptible: bool) {
        self.is_interruptible = is_interruptible;
    }

    /// True, once, if a `pause_now` interrupts the current motion.
    pub(crate) fn take_interruption(&mut self) -> bool {
        let interrupts = self.is_interruptible && self.state == State::PausingNow;
        if interrupts {
            self.is_interruptible = false;
        }
        interrupts
    }

    /// During the end of a run: true once the operator has requested a halt. Other requests have no effect then.
    pub(crate) fn check_halt(&mut self, clock: &dyn Clock) -> bool {
        let count = self.control.requests_made();
        if self.control.is_halted() && self.halted_at.is_none() {
            self.halted_at = Some(clock.now());
            self.fire(Event::Halt);
        }
        self.control.acknowledge(count);
        self.halted_at.is_some()
    }

    /// Time at which the operator's halt was received.
    pub(crate) const fn halted_at(&self) -> Option<HostTime> {
        self.halted_at
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(state: State) -> Machine {
        Machine {
            state,
            ..Machine::new(ControlHandle::new())
        }
    }

    #[test]
    fn abort_and_fault_lead_to_disarmed_from_everywhere() {
        for state in State::ALL {
            for event in [Event::Abort, Event::Fault] {
                let mut machine = at(state);
                let action = machine.fire(event);
                if state == State::Finished {
                    assert_eq!(machine.state(), State::Finished);
                    continue;
                }
                if machine.state() == State::Halting {
                    assert_eq!(action, Action::Ignore, "a halt cannot be weakened");
                    assert_eq!(machine.fire(Event::Disarmed), Action::Close);
                    continue;
                }
                assert!(matches!(action, Action::Retract | Action::Ignore));
                assert_eq!(machine.fire(Event::Cleared), Action::Disarm, "{state:?}");
                assert_eq!(machine.fire(Event::Disarmed), Action::Close, "{state:?}");
                assert_eq!(machine.state(), State::Finished);
            }
        }
    }

    #[test]
    fn a_halt_disarms_at_once_from_everywhere() {
        for state in State::ALL {
            let mut machine = at(state);
            let action = machine.fire(Event::Halt);
            if matches!(state, State::Halting | State::Finished) {
                assert_eq!((machine.state(), action), (state, Action::Ignore));
                continue;
            }
            assert_eq!(action, Action::Disarm, "{state:?}");
            assert_eq!(machine.fire(Event::Disarmed), Action::Close, "{state:?}");
        }
    }
}

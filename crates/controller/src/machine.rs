//! The state machine of a run.

use crate::control::ControlHandle;
use crate::states::{Action, Event, State, transition};

/// Current state of a run.
#[derive(Debug)]
pub(crate) struct Machine {
    state: State,
    /// Shows the current state to other threads.
    shown: ControlHandle,
}

impl Machine {
    pub(crate) fn new(shown: ControlHandle) -> Self {
        let state = State::Planned;
        shown.publish_state(state);
        Self { state, shown }
    }

    pub(crate) const fn state(&self) -> State {
        self.state
    }

    /// Enters the next state and returns the action to take.
    pub(crate) fn fire(&mut self, event: Event) -> Action {
        let (next, action) = transition(self.state, event);
        self.state = next;
        self.shown.publish_state(next);
        action
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(state: State) -> Machine {
        Machine {
            state,
            shown: ControlHandle::new(),
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
                assert!(!machine.state().may_be_armed());
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

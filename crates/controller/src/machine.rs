//! The state of a run as it goes.

use crate::control::ControlHandle;
use crate::states::{Action, Event, State, transition};

/// A run's present state.
#[derive(Debug)]
pub(crate) struct Machine {
    state: State,
    /// Where the present state can be seen from other threads.
    shown: ControlHandle,
}

impl Machine {
    pub(crate) fn new(shown: ControlHandle) -> Self {
        let state = State::Planned;
        shown.show(state);
        Self { state, shown }
    }

    pub(crate) const fn state(&self) -> State {
        self.state
    }

    /// Goes to the next state and says what to do.
    pub(crate) fn fire(&mut self, event: Event) -> Action {
        let (next, action) = transition(self.state, event);
        self.state = next;
        self.shown.show(next);
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
                    assert_eq!(action, Action::Ignore, "a halt is not softened");
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

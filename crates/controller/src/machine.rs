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

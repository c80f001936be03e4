//! The transition table of a run: state and event determine the next state and the action.
//!
//! `docs/reference/runs.md` contains the same table; a test compares the two.

/// State of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum State {
    /// No device is open.
    Planned,
    /// Devices are configured and read back, cameras stream, the robot holds its position.
    Armed,
    /// Steps are executed.
    Running,
    /// Like running; waits at the next safe point.
    Pausing,
    /// Interrupts the current press or motion and leaves the skin; waits at the next safe point.
    PausingNow,
    /// Waits at clearance height, everything streaming.
    Paused,
    /// Like running; ends at the next safe point.
    Stopping,
    /// The operator's abort: the robot leaves the skin now.
    Aborting,
    /// The orderly end: the robot is at, or returns to, clearance height.
    Retracting,
    /// Something failed: the robot leaves the skin if it still answers.
    Faulted,
    /// The operator's halt: motors off, wherever the tip is.
    Halting,
    /// Disarmed; all records are written.
    Finished,
}

/// Event in a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) enum Event {
    /// All devices are armed.
    ArmingDone,
    /// The plan starts.
    Begin,
    /// The operator requests a pause.
    Pause,
    /// The operator requests an immediate pause off the skin.
    PauseNow,
    /// The operator requests to continue.
    Resume,
    /// The operator requests an end after the current press.
    Stop,
    /// The operator requests an immediate end.
    Abort,
    /// The operator requests motors off immediately.
    Halt,
    /// A device, a limit, the recorder or the controller failed.
    Fault,
    /// No press is in progress and the tip is at clearance height.
    SafePoint,
    /// The last step is done.
    PlanDone,
    /// The tip is at clearance height, or cannot be brought there.
    Cleared,
    /// The motors are off, or the robot does not answer the command.
    Disarmed,
}

/// Action of the controller on a transition.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) enum Action {
    /// No action.
    None,
    /// Execute the next step.
    Continue,
    /// Wait at clearance height.
    Wait,
    /// Hold, rise straight to clearance height, hold.
    Retract,
    /// Motors off, cameras flushed and stopped.
    Disarm,
    /// Write the last records.
    Close,
    /// The request has no effect here.
    Ignore,
    /// Internal error of the controller: treat it as [`Event::Fault`].
    Reject,
}

impl State {
    /// All states.
    pub const ALL: [Self; 12] = [
        Self::Planned,
        Self::Armed,
        Self::Running,
        Self::Pausing,
        Self::PausingNow,
        Self::Paused,
        Self::Stopping,
        Self::Aborting,
        Self::Retracting,
        Self::Faulted,
        Self::Halting,
        Self::Finished,
    ];

    /// Name for programs: `running`, `pausing_now`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Planned => "planned",
            Self::Armed => "armed",
            Self::Running => "running",
            Self::Pausing => "pausing",
            Self::PausingNow => "pausing_now",
            Self::Paused => "paused",
            Self::Stopping => "stopping",
            Self::Aborting => "aborting",
            Self::Retracting => "retracting",
            Self::Faulted => "faulted",
            Self::Halting => "halting",
            Self::Finished => "finished",
        }
    }
}

/// The transition table. Total: the compiler checks that every pair is covered.
#[must_use]
pub(crate) const fn transition(state: State, event: Event) -> (State, Action) {
    use Action as A;
    use Event as E;
    use State as S;
    match (state, event) {
        // The normal course.
        (S::Planned, E::ArmingDone) => (S::Armed, A::None),
        (S::Armed, E::Begin) => (S::Running, A::Continue),
        (S::Running, E::SafePoint) => (S::Running, A::Continue),
        (S::Pausing | S::PausingNow, E::SafePoint) => (S::Paused, A::Wait),
        (S::Stopping, E::SafePoint) => (S::Retracting, A::Retract),
        (S::Running | S::Pausing | S::PausingNow | S::Stopping, E::PlanDone) => {
            (S::Retracting, A::Retract)
        }

        // The operator's requests.
        (S::Running, E::Pause) => (S::Pausing, A::None),
        (S::Running | S::Pausing, E::PauseNow) => (S::PausingNow, A::Retract),
        (S::Pausing | S::PausingNow, E::Resume) => (S::Running, A::None),
        (S::Paused, E::Resume) => (S::Running, A::Continue),
        (S::Running | S::Pausing | S::PausingNow, E::Stop) => (S::Stopping, A::None),
        (S::Planned | S::Armed | S::Paused, E::Stop) => (S::Retracting, A::Retract),
        (
            S::Planned
            | S::Armed
            | S::Running
            | S::Pausing
            | S::PausingNow
            | S::Paused
            | S::Stopping,
            E::Abort,
        ) => (S::Aborting, A::Retract),

        // A halt takes precedence over every other way out, even one in progress.
        (
            S::Planned
            | S::Armed
            | S::Running
            | S::Pausing
            | S::PausingNow
            | S::Paused
            | S::Stopping
            | S::Aborting
            | S::Retracting
            | S::Faulted,
            E::Halt,
        ) => (S::Halting, A::Disarm),

        // The way out. Only a disarmed robot reaches `Finished`.
        (S::Retracting | S::Aborting | S::Faulted, E::Cleared) => (state, A::Disarm),
        (S::Retracting | S::Aborting | S::Faulted | S::Halting, E::Disarmed) => {
            (S::Finished, A::Close)
        }
        (
            S::Planned
            | S::Armed
            | S::Running
            | S::Pausing
            | S::PausingNow
            | S::Paused
            | S::Stopping
            | S::Aborting
            | S::Retracting,
            E::Fault,
        ) => (S::Faulted, A::Retract),
        (S::Faulted | S::Halting | S::Finished, E::Fault) => (state, A::Ignore),

        // Requests without effect.
        (
            S::Retracting | S::Aborting | S::Faulted | S::Halting | S::Finished,
            E::Stop | E::Abort,
        )
        | (S::Halting | S::Finished, E::Halt)
        | (S::Stopping, E::Stop) => (state, A::Ignore),
        (
            S::Planned
            | S::Armed
            | S::PausingNow
            | S::Paused
            | S::Stopping
            | S::Aborting
            | S::Retracting
            | S::Faulted
            | S::Halting
            | S::Finished,
            E::Pause | E::PauseNow,
        )
        | (S::Pausing, E::Pause) => (state, A::Ignore),
        (
            S::Planned
            | S::Armed
            | S::Running
            | S::Stopping
            | S::Aborting
            | S::Retracting
            | S::Faulted
            | S::Halting
            | S::Finished,
            E::Resume,
        ) => (state, A::Ignore),

        // Internal events in impossible states.
        (
            S::Armed
            | S::Running
            | S::Pausing
            | S::PausingNow
            | S::Paused
            | S::Stopping
            | S::Aborting
            | S::Retracting
            | S::Faulted
            | S::Halting
            | S::Finished,
            E::ArmingDone,
        )
        | (
            S::Planned
            | S::Running
            | S::Pausing
            | S::PausingNow
            | S::Paused
            | S::Stopping
            | S::Aborting
            | S::Retracting
            | S::Faulted
            | S::Halting
            | S::Finished,
            E::Begin,
        )
        | (
            S::Planned
            | S::Armed
            | S::Paused
            | S::Aborting
            | S::Retracting
            | S::Faulted
            | S::Halting
            | S::Finished,
            E::SafePoint | E::PlanDone,
        )
        | (
            S::Planned
            | S::Armed
            | S::Running
            | S::Pausing
            | S::PausingNow
            | S::Paused
            | S::Stopping
            | S::Finished,
            E::Cleared | E::Disarmed,
        )
        | (S::Halting, E::Cleared) => (state, A::Reject),
    }
}

#[cfg(test)]
mod tests {
    use std::collections::{BTreeMap, BTreeSet};

    use super::*;

    const EVENTS: [Event; 13] = [
        Event::ArmingDone,
        Event::Begin,
        Event::Pause,
        Event::PauseNow,
        Event::Resume,
        Event::Stop,
        Event::Abort,
        Event::Halt,
        Event::Fault,
        Event::SafePoint,
        Event::PlanDone,
        Event::Cleared,
        Event::Disarmed,
    ];

    /// The table as Markdown, one row per event: `states → next state: action`, and what the event does in all other states.
    fn markdown() -> String {
        let mut out = String::from("| event | effect | in other states |\n|---|---|---|\n");
        for event in EVENTS {
            let mut effects: Vec<(String, String)> = Vec::new();
            let mut elsewhere = BTreeSet::new();
            for state in State::ALL {
                let result = match transition(state, event) {
                    (_, Action::Ignore) => {
                        elsewhere.insert("ignored");
                        continue;
                    }
                    (_, Action::Reject) => {
                        elsewhere.insert("fault");
                        continue;
                    }
                    (next, Action::None) => format!("{next:?}"),
                    (next, action) if next == state => format!("{action:?}"),
                    (next, action) => format!("{next:?}: {action:?}"),
                };
                match effects.iter_mut().find(|(_, same)| *same == result) {
                    Some((states, _)) => states.push_str(&format!(", {state:?}")),
                    None => effects.push((format!("{state:?}"), result)),
                }
            }
            let effects: Vec<String> = effects
                .iter()
                .map(|(states, result)| format!("{states} → {result}"))
                .collect();
            let elsewhere: Vec<&str> = elsewhere.into_iter().collect();
            out.push_str(&format!(
                "| {event:?} | {} | {} |\n",
                effects.join("; "),
                elsewhere.join(", ")
            ));
        }
        out
    }

    /// Every reachable state with a shortest path to it.
    fn reachable() -> BTreeMap<State, Vec<Event>> {
        let mut ways = BTreeMap::from([(State::Planned, vec![])]);
        let mut todo = vec![State::Planned];
        while let Some(state) = todo.pop() {
            for event in EVENTS {
                let (next, action) = transition(state, event);
                if action != Action::Reject && !ways.contains_key(&next) {
                    let mut way = ways[&state].clone();
                    way.push(event);
                    ways.insert(next, way);
                    todo.push(next);
                }
            }
        }
        ways
    }

    #[test]
    fn every_state_is_reachable() {
        let found: BTreeSet<_> = reachable().into_keys().collect();
        assert_eq!(found, BTreeSet::from(State::ALL));
    }

    /// From every reachable state, all sequences of four events: nothing leaves the way out, a pause always
    /// ends in a resume, a stop or worse, and steps are executed only while running.
    #[test]
    fn a_paused_run_continues_only_on_request() {
        fn explore(state: State, left: u32) {
            for event in EVENTS.into_iter().take(if left == 0 { 0 } else { 13 }) {
                let (next, action) = transition(state, event);
                if action == Action::Continue {
                    assert_eq!(next, State::Running, "{state:?} {event:?}");
                }
                if state == State::Paused && next == State::Running {
                    assert_eq!(event, Event::Resume);
                }
                if next == State::Paused && state != State::Paused {
                    assert_eq!(event, Event::SafePoint, "from {state:?}");
                }
                explore(next, left - 1);
            }
        }
        for state in reachable().into_keys() {
            explore(state, 4);
        }
    }

    #[test]
    fn only_disarming_finishes_and_the_end_is_final() {
        for state in State::ALL {
            for event in EVENTS {
                let (next, action) = transition(state, event);
                if next == State::Finished && state != State::Finished {
                    assert_eq!(event, Event::Disarmed, "from {state:?}");
                }
                if state == State::Finished {
                    assert_eq!(next, State::Finished);
                }
                if matches!(action, Action::Ignore | Action::Reject) {
                    assert_eq!(next, state, "{state:?} {event:?} changes nothing");
                }
                // Once on the way out, a run never executes steps again.
                let out = |s| {
                    matches!(
                        s,
                        State::Aborting
                            | State::Retracting
                            | State::Faulted
                            | State::Halting
                            | State::Finished
                    )
                };
                assert!(!out(state) || out(next), "{state:?} {event:?}");
            }
        }
    }

    #[test]
    fn the_documented_table_is_this_one() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/reference/runs.md");
        let text = std::fs::read_to_string(path).unwrap_or_default();
        let table = markdown();
        assert!(
            text.contains(&table),
            "docs/reference/runs.md does not hold this table:\n{table}"
        );
    }
}

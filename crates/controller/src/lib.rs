//! Executes plans through the device traits, owns safety and emits records. Depends on no driver, SQL or terminal.
//!
//! [`Run`] is the entry point: it takes a plan, a rig, a [`ControlHandle`] for the operator and a
//! [`RecordSink`], and [`Run::execute`] returns a [`RunReport`] once the robot is disarmed, whatever happened in
//! between. `docs/reference/runs.md` has the transition table of a run.
//!
//! [`Run::resumed`] continues an interrupted session as a further leg with the rest of its plan.
//!
//! # Decisions and replay
//!
//! Every decision depends only on data from the devices and on the injected clock, and no motion target depends on
//! time. A [`Record::Command`](skinrig_model::Record::Command) carries the clock's time *after* the indenter
//! accepted the command, and these times separate the phases of a press. So a replayed rig that sets its clock
//! to the recorded time at each command reproduces the same commands, phase times and verdicts.

mod camera_streams;
pub mod checks;
mod continuity;
pub mod control;
pub mod error;
mod executor;
mod feeling;
pub mod guard;
mod invalid_run;
pub mod jog;
mod journal;
pub mod looks;
mod machine;
mod open_press;
mod overrun;
mod pose_trackers;
mod preflight;
mod preflight_run;
mod press_series;
mod press_tracker;
pub mod progress;
pub mod run;
pub mod settings;
pub mod sink;
mod states;
mod stream_probe;
pub mod suspend;
mod touch;
mod touch_progress;
mod touch_sense;
mod trigger_line;
mod verdict;
pub mod watchdog;

pub use checks::{
    ExpectedDevice, Loopback, Preflight, contains_version, differing, identity_checks,
};
pub use control::{ControlHandle, NoteQueueFull};
pub use error::Problem;
pub use guard::{Floor, GuardedIndenter};
pub use jog::{Jog, JogSetup, MoveOutcome, TouchOutcome};
pub use looks::{LookFault, LookOutcome, Looks};
pub use progress::{Progress, ProgressTracker};
pub use run::{Resume, Run, RunReport};
pub use settings::ControllerSettings;
pub use sink::RecordSink;
pub use states::State;
pub use touch_progress::TouchProgress;
pub use touch_sense::{SenseAnswer, SenseFault, SensedTouch, TouchSense};
pub use watchdog::{WatchLimits, Watchdog};

pub use skinrig_model::fault::{
    GuardError, NotArrived, NotAtRest, PressFault, RunFault, SinkFault, TimingFault, TouchFault,
    WatchdogTrip,
};

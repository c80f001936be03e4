//! Executes plans through the device traits, owns safety and emits records. Depends on no driver, SQL or terminal.
//!
//! [`execute`] is the entry point: it takes a plan, a rig, a [`ControlHandle`] for the operator and a
//! [`RecordSink`], and returns a [`RunReport`] once the robot is disarmed, whatever happened in between.
//! Internally a [`Run`] passes through `Planned -> Armed -> Running -> Finished`, and calls that do not fit the
//! current state do not compile:
//!
//! ```compile_fail
//! # use skinrig_controller::{Run, Planned, Running};
//! fn press_before_arming(run: Run<'_, Planned>) -> Run<'_, Running> {
//!     run.begin() // only an armed run can begin
//! }
//! ```
//!
//! ```
//! # use skinrig_controller::{Run, Planned, Finished, RunReport};
//! fn in_order(run: Run<'_, Planned>) -> Result<Run<'_, Finished>, Box<RunReport>> {
//!     Ok(run.arm()?.begin().run())
//! }
//! ```
//!
//! [`Run::resumed`] continues an interrupted session as a further leg with the rest of its plan.
//!
//! # Decisions and replay
//!
//! Every decision depends only on data from the devices and on the injected clock, and no motion target depends on
//! time. A [`Record::Command`](skinrig_model::Record::Command) carries the clock's time *after* the indenter
//! accepted the command, and these times separate the phases of a press. So a replayed rig that sets its clock
//! to the recorded time at each command reproduces the same commands, phase times and verdicts.

mod arming;
pub mod checks;
mod continuity;
pub mod control;
mod ending;
pub mod error;
mod executor;
pub mod guard;
mod invalid_run;
pub mod jog;
mod journal;
mod machine;
mod not_arrived;
mod preflight;
mod press;
pub mod press_fault;
pub mod press_tracker;
pub mod progress;
pub mod run;
pub mod settings;
pub mod sink;
pub mod states;
mod steps;
mod surface;
pub mod suspend;
mod touch;
mod verdict;
pub mod watchdog;

pub use checks::{
    ExpectedDevice, Loopback, Preflight, contains_version, differing, identity_checks,
};
pub use control::{ControlHandle, NotesFull};
pub use error::{ControllerError, GuardError, NotAtRest, Problem};
pub use guard::{Floor, GuardedIndenter};
pub use jog::{Jog, MoveOutcome, TouchOutcome};
pub use not_arrived::NotArrived;
pub use press_fault::{PressFault, TimingFault, TouchFault};
pub use progress::{Progress, ProgressTracker};
pub use run::{
    Armed, Finished, Planned, Resume, Run, RunReport, Running, execute, execute_checked,
};
pub use settings::ControllerSettings;
pub use sink::{RecordSink, SinkFault};
pub use states::State;
pub use watchdog::{WatchLimits, Watchdog, WatchdogTrip};

//! Executes plans over device traits, owns safety, emits records. Knows no driver, no SQL, no terminal.
//!
//! [`execute`] is the whole of it: it takes a plan, a rig, a [`ControlHandle`] for the operator and a
//! [`RecordSink`], and returns a [`RunReport`] once the robot is disarmed again, whatever happened in
//! between. Underneath, [`Run`] goes through `Planned -> Armed -> Running -> Finished`, and what does not
//! fit the present state does not compile:
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
//! A session that was cut off goes on as a further leg of it: [`Run::resumed`] with what is left of the plan.
//!
//! # Decisions and replay
//!
//! Every decision depends on what devices delivered and on the injected clock alone, and no motion target
//! depends on time. A [`Record::Command`](skinrig_model::Record::Command) carries the clock's present as read
//! *after* the indenter took the command, and the phases of a press are told apart by these instants.
//! A replayed rig that sets its clock to the recorded instant on each command therefore brings about the
//! same commands, moments and verdicts.

mod arming;
pub mod checks;
mod continuity;
pub mod control;
mod core;
mod ending;
pub mod error;
pub mod guard;
mod invalid_run;
pub mod jog;
mod journal;
mod machine;
pub mod moments;
mod not_arrived;
mod preflight;
mod press;
pub mod press_fault;
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

pub use checks::{ExpectedDevice, Loopback, Preflight, differing, identity_checks, says_version};
pub use control::{ControlHandle, NotesFull};
pub use error::{ControllerError, GuardError, NotAtRest, Problem};
pub use guard::{Floor, GuardedIndenter};
pub use jog::{Jog, Moved, Touched};
pub use not_arrived::NotArrived;
pub use press_fault::{MomentFault, PressFault, TouchFault};
pub use progress::{Progress, ProgressTracker};
pub use run::{
    Armed, Finished, Planned, Resume, Run, RunReport, Running, execute, execute_checked,
};
pub use settings::ControllerSettings;
pub use sink::{RecordSink, SinkFault};
pub use states::State;
pub use watchdog::{Trip, WatchLimits, Watchdog};

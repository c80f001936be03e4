//! Compiles YAML text to a checked protocol and then to a flat plan of steps. Pure: no devices or clocks, and files only through an injected loader.
//!
//! 1. [`Protocol::parse`] reads a protocol and reports all errors at once, each with file, line, column, key path,
//!    expected, found and the source line ([`Diagnostics`]).
//! 2. [`Protocol::compile`] turns it into a [`Plan`]: seeds resolved, orders shuffled, positions absolute.
//! 3. [`check()`] checks every segment of the plan against workspace, skin outline, keep-outs and limits.
//! 4. [`Plan::summary`] and [`path_svg`] display it.
//!
//! [`Schedule`] describes a recording made without skinrig, for imports; [`RigFile`] a bench; [`Limits`] the margins
//! of a comparison; [`Selection`] the sessions and presses of a result; [`Publication`] what published data
//! state; [`NewSettings`] other settings of analyses; [`Suite`] the checks of a bench. The settings structs declare the keys of each
//! language and yield its JSON Schema ([`schema_json`], [`schedule_schema_json`], [`rig_schema_json`], [`limits_schema_json`],
//! [`selection_schema_json`], [`publication_schema_json`], [`new_settings_schema_json`], [`suite_schema_json`]).

pub mod area;
mod assemble;
pub mod check;
mod compile;
mod design;
pub mod faults;
mod file;
mod findings;
mod keys;
pub mod limits;
mod new_settings;
pub mod notify;
pub mod online;
mod path;
mod phases;
pub mod plan;
pub mod protocol;
pub mod publication;
mod reference_code;
mod remaining;
mod retakes;
pub mod rig;
pub mod schedule;
mod schema;
pub mod selection;
pub mod stop;
pub mod suite;
pub mod summary;
pub mod surface;
mod surface_check;
mod suspend;
mod svg;
pub mod timing;

pub use area::{Area, KeepOut, Surroundings};
pub use assemble::protocol_with;
pub use check::{PlanRule, Segment, Violation, check};
pub use design::best_locations;
pub use faults::{FaultPhase, FaultTime, InvalidFault, PlantedFault};
pub use limits::Limits;
pub use new_settings::NewSettings;
pub use notify::Notify;
pub use online::{Online, React};
pub use phases::PressPhases;
pub use plan::{Plan, PressStep, RunLimits, Step, TripReaction};
pub use protocol::{CameraRequest, Motion, Pace, Protocol, Prototype, Scene, SimulatedSkin, Sync};
pub use publication::Publication;
pub use reference_code::REFERENCE_CODE;
pub use remaining::Route;
pub use retakes::Retakes;
pub use rig::{RigFile, RigKind};
pub use schedule::Schedule;
pub use schema::{
    limits_schema_json, new_settings_schema_json, publication_schema_json, rig_schema_json,
    schedule_schema_json, schema_json, selection_schema_json, setting_doc, suite_schema_json,
};
pub use selection::Selection;
pub use skinrig_settings::{Diagnostic, Diagnostics, Location};
pub use stop::{DeclaredStop, Stop};
pub use suite::Suite;
pub use summary::PlanSummary;
pub use surface::{Surface, TouchSearch};
pub use surface_check::SurfaceCheck;
pub use suspend::{PressHandling, Suspend, Threshold};
pub use svg::path_svg;

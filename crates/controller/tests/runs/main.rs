//! The controller on a scripted rig.

mod course;
mod edges;
mod guard;
mod mock;
mod progress;
mod rig_faults;
mod simulated;

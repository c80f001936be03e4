//! The controller on a scripted rig.

mod blocking;
mod broken_off;
mod course;
mod data_faults;
mod edges;
mod escape;
mod felt;
mod guard;
mod jog;
mod looks;
mod mock;
mod preflight;
mod progress;
mod recovery;
mod requests;
mod resumed;
mod rig_faults;
mod simulated;
mod steady;
mod suspend;
mod touch;
mod vanished;
mod watchdog;

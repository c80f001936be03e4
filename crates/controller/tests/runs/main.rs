//! The controller on a scripted rig.

mod blocking;
mod broken_off;
mod course;
mod edges;
mod escape;
mod guard;
mod heard;
mod jog;
mod mock;
mod preflight;
mod progress;
mod recovery;
mod resumed;
mod rig_faults;
mod simulated;
mod spoilt;
mod steady;
mod suspend;
mod touch;
mod vanished;
mod watchdog;

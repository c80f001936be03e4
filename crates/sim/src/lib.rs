//! Simulated and replayed rigs: a seeded skin world, simulated devices, fault injection, and replay of recordings.
//!
//! [`simulated_rig`] returns the devices of a simulated bench: a robot, two event cameras and a trigger box with a common world and clock.
//! [`SimConfig`] determines everything: equal configurations and equal commands at equal times give equal bytes on every machine,
//! however often the devices are polled. [`replay`] serves a recording through the same traits.

mod byte_encoder;
pub mod camera;
mod camera_stream;
pub mod clock;
pub mod columns;
pub mod config;
pub mod contacts;
pub mod drifting;
pub mod faults;
pub mod geometric;
pub mod indenter;
pub mod line;
pub mod motion;
pub mod optical;
mod pattern;
mod phase_tracker;
pub mod random;
pub mod replay;
pub mod rig;
pub mod scene;
mod stalling_clock;
pub mod trigger;
pub mod world;

pub use clock::{PacedClock, SimClock};
pub use config::SimConfig;
pub use faults::{Fault, FaultSizes, FaultTrigger, LineNoise, MotionPhase};
pub use rig::{FaultWatch, in_real_time, simulated_rig, watched_rig};

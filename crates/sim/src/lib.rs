//! A seeded skin world, simulated devices, replayed devices, fault injection.
//!
//! [`simulated_rig`] gives the devices of a bench that exists only in numbers: a robot, two event cameras and a
//! trigger box which share one world and one clock. Everything follows from [`SimConfig`]: equal configurations
//! and equal commands at equal times give equal bytes on every machine, however often the devices are
//! polled. [`replay`] serves a recording through the same traits.

pub mod camera;
mod camera_stream;
pub mod clock;
pub mod columns;
pub mod config;
pub mod contacts;
pub mod drifting;
pub mod faults;
pub mod geometric;
mod held_up;
pub mod indenter;
pub mod line;
pub mod moments;
pub mod motion;
pub mod optical;
mod pattern;
pub mod random;
pub mod replay;
pub mod rig;
pub mod scene;
pub mod trigger;
pub mod world;

pub use clock::{Paced, SimClock};
pub use config::SimConfig;
pub use faults::{Fault, MarkFate, Moment, When};
pub use rig::{in_real_time, simulated_rig};

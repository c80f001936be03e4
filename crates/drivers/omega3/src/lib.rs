//! Driver of the Force Dimension omega.3 as an indenter. It loads libdrd at run time and calls it from one thread.
//!
//! [`Omega::open`] loads the vendor's library, finds and checks the robot, and leaves it braked; after that it is an
//! [`Indenter`](skinrig_device::Indenter). One thread (`owner`) makes all calls. Each cycle (`engine`) reads the pose, checks the
//! limits, moves the set point along a straight line and sends it to the vendor's regulation.
//!
//! libdrd has no force limit of its own, so the driver limits force on several levels: a cap on the motor ratio, no integral gain, a
//! bounded lead of the set point, a soft limit that stops the motion and a hard limit that brakes. All of them use the *commanded*
//! motor force: an omega.3 has no force sensor. None of them replaces the force button on the base.
//!
//! `force_n` of a sample is the force of the environment on the tip along robot z, positive upward: the negative commanded motor
//! force minus its mean at rest after arming (tare). It is NaN while the tare is measured.

pub mod axes;
pub mod brake;
pub mod config;
mod correction;
mod engine;
pub mod enumerate;
pub mod error;
mod indenter;
pub mod library;
pub mod load;
pub mod monitor;
pub mod open;
mod owner;
pub mod profile;
mod regulation;
mod remark;
pub mod sdk;
mod span;
mod stream;
pub mod supervisor;
mod tare;
pub mod trajectory;

pub use config::OmegaConfig;
pub use error::OmegaError;
pub use indenter::Omega;
pub use remark::Remark;

#[cfg(test)]
mod tests;

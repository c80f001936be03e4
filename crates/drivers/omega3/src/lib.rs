//! The Force Dimension omega.3 as an indenter: libdrd loaded at run time, owned by one thread.
//!
//! [`Omega::open`] loads the vendor's library, finds the robot, checks it and leaves it braked; from then on it is an
//! [`Indenter`](skinrig_device::Indenter). One thread (`owner`) makes every call; its cycle (`engine`) reads the pose,
//! checks the limits, moves the set point along a straight line and hands it to the vendor's regulation.
//!
//! Force is limited on several levels, because the library has no force limit of its own: a cap on the motor ratio,
//! integral gain off, a bounded lead of the set point, a soft limit that stops and a hard limit that brakes, all on
//! *commanded* motor force: an omega.3 has no force sensor. None of it replaces the force button on the base.
//!
//! `force_n` of a sample is the force with which the world pushes the tip along robot z, positive upwards: minus the
//! motors' commanded force, minus its mean while the arm hung still after arming; NaN while that is taken.

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
pub mod trajectory;
mod weighing;

pub use config::OmegaConfig;
pub use error::OmegaError;
pub use indenter::Omega;
pub use remark::Remark;

#[cfg(test)]
mod tests;

//! Rig files: the devices of a bench, the position of the skin and the bench's limits.

mod camera;
mod date;
mod file;
mod fit;
mod frame;
mod hil;
mod limits;
mod robot;
mod tip;
mod trigger_box;
mod variables;

pub use camera::{CameraKind, CameraSetup, SyncRole};
pub use date::Date;
pub use file::{RigFile, RigKind};
pub use frame::{Frame, TouchOff, TouchedPoint};
pub use hil::{Drill, HilSetup, Lamps};
pub use limits::{BenchLimits, PreflightLimits, Workspace};
pub use robot::{DeviceAxis, MotorForce, RobotKind, RobotSetup};
pub use tip::{Tip, TipShape};
pub use trigger_box::{BoxInput, BoxOutput, BoxSetup, Wiring};
pub use variables::Environment;

//! Device interfaces: small traits, capabilities as data, and a clock.
//!
//! All calls return immediately: a real driver owns its device on a separate thread and exchanges messages with it ([`detached`]); a simulated
//! device computes everything up to the clock's current time. The controller polls. Positions are in the *robot* frame; only the
//! controller uses the skin frame.

pub mod camera;
pub mod clock;
pub mod contract;
pub mod detached;
pub mod indenter;
pub mod limits;
pub mod rig;
pub mod trigger;

pub use camera::{
    CameraCapabilities, CameraSettings, EventCamera, NoiseFilter, OpenChunk, PatternScan, Roi,
    SyncMode, TestPattern, newest_words,
};
pub use clock::{Clock, RealClock};
pub use detached::{DetachedBox, DetachedCamera, Timeouts};
pub use indenter::{Indenter, IndenterCapabilities, MotionLimits, RobotSample};
pub use rig::Rig;
pub use skinrig_model::DeviceError;
pub use trigger::{TriggerBox, TriggerCapabilities};

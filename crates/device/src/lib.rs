//! What a device promises: small traits, capabilities as data, and a clock.
//!
//! All verbs return at once: a real driver owns its device on a named thread of its own and these calls
//! exchange messages with it ([`detached`]); a simulated device computes what happened up to the clock's present. The
//! controller polls. Positions cross this border in the *robot* frame; the controller knows the skin.

pub mod camera;
pub mod clock;
pub mod contract;
pub mod detached;
pub mod error;
pub mod indenter;
pub mod limits;
pub mod rig;
pub mod trigger;

pub use camera::{
    CameraCapabilities, CameraSettings, EventCamera, NoiseFilter, PatternScan, Roi, SyncMode,
    TestPattern,
};
pub use clock::{Clock, RealClock};
pub use detached::{DetachedBox, DetachedCamera, Patience};
pub use error::DeviceError;
pub use indenter::{Indenter, IndenterCapabilities, MotionLimits, RobotSample};
pub use rig::Rig;
pub use trigger::{TriggerBox, TriggerCapabilities};

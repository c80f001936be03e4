//! Causes as types, from where they arise to pages and JSON: faults of devices, motions, presses and runs.
//!
//! Sessions store them as JSON: one object whose key is the kind and whose value has the fields. Their text is made by
//! `Display`, and nothing reads it back. A new kind needs a new schema version of the session file.

mod causes;
mod device;
mod guard;
mod motion;
mod notification;
mod press;
mod run;
mod surface;
mod suspension;
mod watchdog;

pub use causes::{Causes, NoCause};
pub use device::DeviceError;
pub use guard::GuardError;
pub use motion::{NotArrived, point};
pub use notification::NotificationFault;
pub(crate) use press::CUT_OFF;
pub use press::{PressFault, PressMoment, TimingFault};
pub use run::{NotAtRest, RunFault, SinkFault};
pub use surface::{SurfaceFault, SurfaceFinding, TouchFault, TouchPhase};
pub use suspension::{Suspension, WatchedQuantity};
pub use watchdog::WatchdogTrip;

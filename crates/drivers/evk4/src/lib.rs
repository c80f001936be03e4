//! Driver of the Prophesee EVK4, the EVK3 HD and the SilkyEvCam VGA, based on the neuromorphic-drivers crate.
//!
//! **Never tested with a camera or an emulated bus.** Tests cover the adapter with a scripted [`Link`]: states, rejections, chunks with the
//! facts of their EVT3 words, and losses. neuromorphic-drivers (MIT) implements the cameras' protocols; only [`neuromorphic`] uses it.
//!
//! Limits of that crate apply here too, see [`Model`]: registers are not read back, so [`EventCamera::configure`] reports settings as
//! unverified; dropped packets are counted without their size, so a loss is an upper bound; regions and the noise filter are rejected.
//! Opening a camera by serial number sends request 0x72 to every device with its USB IDs, including an idle EVK1, which replies and is
//! otherwise left alone; [`neuromorphic::enumerate`] skips devices known to its caller.
//!
//! [`EventCamera::configure`]: skinrig_device::EventCamera::configure

pub mod camera;
pub mod link;
pub mod model;
pub mod neuromorphic;
mod stream_settings;

pub use camera::Evt3Camera;
pub use link::{Link, LinkError, Packet, Packets};
pub use model::Model;
pub use neuromorphic::{CameraState, FoundDevice, Neuromorphic, enumerate};
pub use stream_settings::{StreamSettings, TimeBase, UnsupportedSetting};

//! The Prophesee EVK4, the EVK3 HD and the SilkyEvCam VGA as event cameras, through the neuromorphic-drivers crate.
//!
//! **Never opened, neither on hardware nor on an emulated bus.** What is tested is the adapter, over a scripted [`Link`]: states,
//! refusals, chunks with the facts of their EVT3 words, loss. The cameras' own protocols are the business of
//! neuromorphic-drivers (MIT), and [`neuromorphic`] is the only module that knows it.
//!
//! What that crate does not offer is not offered here either, see [`Model`]: registers are not read back, so
//! [`EventCamera::configure`] reports what was asked for as unverified; packets that it drops are counted, not their bytes, so a
//! loss is stated as the most that it can have been; regions and the noise filter are refused. Opening a camera by its serial
//! number asks every device with its USB numbers for its type (request 0x72), an idle EVK1 included, which answers that and is left
//! alone; [`neuromorphic::enumerate`] leaves out those that its caller knows.
//!
//! [`EventCamera::configure`]: skinrig_device::EventCamera::configure

pub mod camera;
pub mod link;
pub mod model;
pub mod neuromorphic;
pub mod wanted;

pub use camera::Evt3Camera;
pub use link::{Link, LinkError, Packet, Packets};
pub use model::Model;
pub use neuromorphic::{Found, FoundState, Neuromorphic, enumerate};
pub use wanted::{TimeBase, Wanted};

//! The Prophesee EVK4 as an event camera, through the neuromorphic-drivers crate.
//!
//! **Never opened, neither on hardware nor on an emulated bus.** What is tested is the adapter, over a scripted [`Link`]: states,
//! refusals, chunks with the facts of their EVT3 words, loss. The camera's own protocol is the business of
//! neuromorphic-drivers (MIT), and [`neuromorphic`] is the only module that knows it.
//!
//! What that crate does not offer is not offered here either: registers are not read back, so [`EventCamera::configure`]
//! reports what was asked for as unverified; packets that it drops are counted, not their bytes, so a loss is stated as the most
//! that it can have been; regions and the noise filter are refused. Finding a camera by its serial number asks every device
//! with the USB numbers 04b4:00f4 for its type (request 0x72), an idle EVK1 included, which answers that and is left alone.
//!
//! [`EventCamera::configure`]: skinrig_device::EventCamera::configure

pub mod camera;
pub mod link;
pub mod neuromorphic;
pub mod wanted;

pub use camera::Evk4;
pub use link::{Link, LinkError, Packet, Packets};
pub use wanted::{TimeBase, Wanted};

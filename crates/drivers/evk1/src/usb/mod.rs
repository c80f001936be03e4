//! The way to a camera: control requests, and a stream of bytes that arrive by themselves.

mod libusb;
mod transfers;

use std::sync::Arc;
use std::time::Duration;

pub use libusb::{Access, LibUsb, Slot, bus};

use crate::config::Evk1Config;
use crate::error::UsbError;
use crate::inbox::Inbox;

/// What the driver needs from USB. The driver owns it alone, so a read and the write that follows it are never
/// separated.
pub trait Transport: Send {
    /// Vendor request to the device, IN (bmRequestType 0xC0); the number of bytes received.
    ///
    /// # Errors
    /// [`UsbError`], at the latest after a second.
    fn control_in(
        &mut self,
        request: u8,
        value: u16,
        index: u16,
        answer: &mut [u8],
    ) -> Result<usize, UsbError>;

    /// Vendor request to the device, OUT (bmRequestType 0x40).
    ///
    /// # Errors
    /// [`UsbError`], at the latest after a second; [`UsbError::Short`] unless all of `data` went out.
    fn control_out(
        &mut self,
        request: u8,
        value: u16,
        index: u16,
        data: &[u8],
    ) -> Result<(), UsbError>;

    /// Resets the device on the bus. Claims stay.
    ///
    /// # Errors
    /// [`UsbError`].
    fn reset(&mut self) -> Result<(), UsbError>;

    /// Takes a stall off the event endpoint.
    ///
    /// # Errors
    /// [`UsbError`].
    fn clear_halt(&mut self) -> Result<(), UsbError>;

    /// Reads once from the event endpoint while no stream runs; 0 when nothing came within `limit`.
    ///
    /// # Errors
    /// [`UsbError`].
    fn read_events(&mut self, buffer: &mut [u8], limit: Duration) -> Result<usize, UsbError>;

    /// Queues transfers on the event endpoint; from now on everything that arrives goes to `inbox`, stamped on
    /// arrival, and so does the error that ends the stream.
    ///
    /// # Errors
    /// [`UsbError`]; no stream runs then.
    fn start_stream(&mut self, inbox: Arc<Inbox>, config: &Evk1Config) -> Result<(), UsbError>;

    /// Takes the transfers back; what they already hold still goes to the inbox. Nothing does any more after this
    /// returns. Allowed without a stream.
    ///
    /// # Errors
    /// [`UsbError::Stuck`] when they do not come back within a second.
    fn stop_stream(&mut self) -> Result<(), UsbError>;

    /// Where the device is plugged in, for people.
    fn place(&self) -> String;
}

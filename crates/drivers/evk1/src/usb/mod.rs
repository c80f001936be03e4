//! USB transport: control requests and the event stream.

mod libusb;
mod transfers;

use std::sync::Arc;
use std::time::Duration;

pub use libusb::{Access, LibUsb, Slot, bus};

use crate::config::Evk1Config;
use crate::error::UsbError;
use crate::inbox::Inbox;

/// USB operations of the driver. The driver has exclusive access, so a read and the following write are never separated.
pub trait Transport: Send {
    /// Sends a vendor request to the device, IN (bmRequestType 0xC0). Returns the number of bytes received.
    ///
    /// # Errors
    /// [`UsbError`], after at most one second.
    fn control_in(
        &mut self,
        request: u8,
        value: u16,
        index: u16,
        answer: &mut [u8],
    ) -> Result<usize, UsbError>;

    /// Sends a vendor request to the device, OUT (bmRequestType 0x40).
    ///
    /// # Errors
    /// [`UsbError`], after at most one second; [`UsbError::Short`] if part of `data` was not sent.
    fn control_out(
        &mut self,
        request: u8,
        value: u16,
        index: u16,
        data: &[u8],
    ) -> Result<(), UsbError>;

    /// Resets the device on the bus and keeps the claim.
    ///
    /// # Errors
    /// [`UsbError`].
    fn reset(&mut self) -> Result<(), UsbError>;

    /// Clears a stall of the event endpoint.
    ///
    /// # Errors
    /// [`UsbError`].
    fn clear_halt(&mut self) -> Result<(), UsbError>;

    /// Reads once from the event endpoint while no stream runs; 0 on timeout.
    ///
    /// # Errors
    /// [`UsbError`].
    fn read_events(&mut self, buffer: &mut [u8], limit: Duration) -> Result<usize, UsbError>;

    /// Queues transfers on the event endpoint. From now on all received data goes to `inbox`, stamped on arrival, and so does the error that
    /// ends the stream.
    ///
    /// [`UsbError`]; the stream is then not running.
    /// [`UsbError`]; no stream runs then.
    fn start_stream(&mut self, inbox: Arc<Inbox>, config: &Evk1Config) -> Result<(), UsbError>;

    /// Cancels the transfers; their data still goes to the inbox. Afterwards nothing arrives. Allowed without a stream.
    ///
    /// # Errors
    /// [`UsbError::Stuck`] if they do not return within a second.
    fn stop_stream(&mut self) -> Result<(), UsbError>;

    /// Bus and port, for messages.
    fn place(&self) -> String;
}

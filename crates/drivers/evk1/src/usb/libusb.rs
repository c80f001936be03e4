//! Transport over libusb. Each camera has its own context; libusb's global one is never used, because it panics on a computer without
//! USB.

use std::sync::Arc;
use std::time::Duration;

use rusb::{Context, Device, DeviceHandle, Speed, UsbContext};
use skinrig_device::RealClock;

use super::Transport;
use super::transfers::Transfers;
use crate::config::Evk1Config;
use crate::error::UsbError;
use crate::inbox::Inbox;
use crate::requests::{EVENT_ENDPOINT, INTERFACE, TREUZELL_SUBCLASS, USB_IDS};

/// Time limit of a control request.
const CONTROL_LIMIT: Duration = Duration::from_secs(1);
/// Vendor request to the device, IN and OUT.
const VENDOR_IN: u8 = 0xc0;
const VENDOR_OUT: u8 = 0x40;

impl From<rusb::Error> for UsbError {
    fn from(error: rusb::Error) -> Self {
        match error {
            rusb::Error::NoDevice | rusb::Error::NotFound => Self::Gone,
            rusb::Error::Busy => Self::Busy,
            rusb::Error::Access => Self::NoPermission,
            rusb::Error::Pipe => Self::Stall,
            rusb::Error::Timeout => Self::Timeout,
            other => Self::Other(other.to_string()),
        }
    }
}

/// A device on the bus with USB IDs of an EVK1.
pub struct Slot {
    context: Context,
    device: Device<Context>,
    ids: (u16, u16),
}

/// Result of opening a device.
pub enum Access {
    /// Open and claimed, not queried yet.
    Open(LibUsb),
    /// A Treuzell camera according to its descriptors; left alone.
    Treuzell,
}

/// All devices on the bus with USB IDs of an EVK1.
///
/// # Errors
/// [`UsbError::NoUsb`] when libusb finds no bus.
pub fn bus() -> Result<Vec<Slot>, UsbError> {
    let context = Context::new().map_err(|e| UsbError::NoUsb(e.to_string()))?;
    let devices = context.devices()?;
    let mut slots = Vec::new();
    for device in devices.iter() {
        // Skip devices that are disconnected meanwhile.
        let Ok(descriptor) = device.device_descriptor() else {
            continue;
        };
        let ids = (descriptor.vendor_id(), descriptor.product_id());
        if USB_IDS.contains(&ids) {
            slots.push(Slot {
                context: context.clone(),
                device,
                ids,
            });
        }
    }
    slots.sort_by_key(|slot| (slot.device.bus_number(), slot.device.address()));
    Ok(slots)
}

impl Slot {
    /// Bus, address, IDs and speed.
    #[must_use]
    pub fn place(&self) -> String {
        let speed = match self.device.speed() {
            Speed::Super | Speed::SuperPlus => "USB 3",
            Speed::Unknown => "unknown speed",
            _ => "slower than USB 3: use a USB 3 port and cable",
        };
        format!(
            "USB bus {} device {}, {:04x}:{:04x}, {speed}",
            self.device.bus_number(),
            self.device.address(),
            self.ids.0,
            self.ids.1
        )
    }

    /// Port as `usb-BUS-PORT.PORT`, which is stable across reconnections; `None` if the system does not report it.
    #[must_use]
    pub fn port(&self) -> Option<String> {
        let ports = self.device.port_numbers().ok().filter(|p| !p.is_empty())?;
        let ports: Vec<String> = ports.iter().map(u8::to_string).collect();
        Some(format!(
            "usb-{}-{}",
            self.device.bus_number(),
            ports.join(".")
        ))
    }

    /// Bus number and device address.
    #[must_use]
    pub fn address(&self) -> (u8, u8) {
        (self.device.bus_number(), self.device.address())
    }

    /// Whether the descriptors are those of a Treuzell camera.
    fn treuzell(&self) -> Result<bool, UsbError> {
        let descriptor = self
            .device
            .active_config_descriptor()
            .or_else(|_| self.device.config_descriptor(0))?;
        Ok(descriptor
            .interfaces()
            .flat_map(|i| i.descriptors())
            .any(|d| d.sub_class_code() == TREUZELL_SUBCLASS))
    }

    /// Reads the descriptors; opens and claims the device if it may be an EVK1. Received data is stamped with `clock`.
    ///
    /// # Errors
    /// [`UsbError::Busy`], [`UsbError::NoPermission`], and other libusb errors.
    pub fn open(&self, clock: RealClock) -> Result<Access, UsbError> {
        if self.treuzell()? {
            return Ok(Access::Treuzell);
        }
        let handle = self.device.open()?;
        // Not every system supports this.
        if handle.kernel_driver_active(INTERFACE).unwrap_or(false) {
            handle.detach_kernel_driver(INTERFACE)?;
        }
        handle.claim_interface(INTERFACE)?;
        Ok(Access::Open(LibUsb {
            context: self.context.clone(),
            handle: Arc::new(handle),
            clock,
            place: self.place(),
            stream: None,
            stalled: false,
        }))
    }
}

/// A claimed device.
pub struct LibUsb {
    context: Context,
    handle: Arc<DeviceHandle<Context>>,
    clock: RealClock,
    place: String,
    stream: Option<Transfers>,
    stalled: bool,
}

impl LibUsb {
    /// Clears the stall that ended the previous stream, if any.
    fn unstall(&mut self) -> Result<(), UsbError> {
        if std::mem::take(&mut self.stalled) {
            self.handle.clear_halt(EVENT_ENDPOINT)?;
        }
        Ok(())
    }
}

impl Transport for LibUsb {
    fn control_in(
        &mut self,
        request: u8,
        value: u16,
        index: u16,
        answer: &mut [u8],
    ) -> Result<usize, UsbError> {
        let limit = CONTROL_LIMIT;
        Ok(self
            .handle
            .read_control(VENDOR_IN, request, value, index, answer, limit)?)
    }

    fn control_out(
        &mut self,
        request: u8,
        value: u16,
        index: u16,
        data: &[u8],
    ) -> Result<(), UsbError> {
        let limit = CONTROL_LIMIT;
        let found = self
            .handle
            .write_control(VENDOR_OUT, request, value, index, data, limit)?;
        if found == data.len() {
            Ok(())
        } else {
            let expected = data.len();
            Err(UsbError::Short { expected, found })
        }
    }

    fn reset(&mut self) -> Result<(), UsbError> {
        Ok(self.handle.reset()?)
    }

    fn clear_halt(&mut self) -> Result<(), UsbError> {
        Ok(self.handle.clear_halt(EVENT_ENDPOINT)?)
    }

    fn read_events(&mut self, buffer: &mut [u8], limit: Duration) -> Result<usize, UsbError> {
        self.unstall()?;
        match self.handle.read_bulk(EVENT_ENDPOINT, buffer, limit) {
            Err(rusb::Error::Timeout) => Ok(0),
            other => Ok(other?),
        }
    }

    fn start_stream(&mut self, inbox: Arc<Inbox>, config: &Evk1Config) -> Result<(), UsbError> {
        self.stop_stream()?;
        self.unstall()?;
        let (context, handle) = (self.context.clone(), Arc::clone(&self.handle));
        self.stream = Some(Transfers::start(
            context, handle, inbox, self.clock, config,
        )?);
        Ok(())
    }

    fn stop_stream(&mut self) -> Result<(), UsbError> {
        let Some(mut stream) = self.stream.take() else {
            return Ok(());
        };
        let stopped = stream.stop();
        self.stalled = stream.stalled();
        stopped
    }

    fn place(&self) -> String {
        self.place.clone()
    }
}

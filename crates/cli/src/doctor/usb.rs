//! The USB tree that the kernel shows under `/sys/bus/usb/devices`.

use super::machine::{Machine, MachineError};

/// Where the kernel lists devices.
const DEVICES: &str = "/sys/bus/usb/devices";

/// A device on a bus.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct UsbDevice {
    /// USB vendor.
    pub vendor: u16,
    /// Bus and address, as in libusb.
    pub place: (u8, u8),
    /// Mbit/s.
    pub speed_mbit: Option<u64>,
    /// The hub between it and the computer, as the kernel names it.
    pub hub: Option<String>,
    /// The controller of its bus. The USB 2 and USB 3 halves of a controller are two buses with the same name here.
    pub controller: Option<String>,
}

impl UsbDevice {
    /// Path of the device file.
    pub(super) fn node(&self) -> String {
        let (bus, address) = self.place;
        format!("/dev/bus/usb/{bus:03}/{address:03}")
    }
}

/// Lists all devices except root hubs.
///
/// # Errors
/// When the kernel's list cannot be read.
pub(super) fn list(machine: &Machine) -> Result<Vec<UsbDevice>, MachineError> {
    let names = machine.names(DEVICES)?;
    // `3-1.4` is port 4 of the hub at port 1 of bus 3; `3-1.4:1.0` is one of its interfaces, `usb3` the bus itself.
    let devices = names.iter().filter(|n| n.contains('-') && !n.contains(':'));
    Ok(devices.filter_map(|name| device(machine, name)).collect())
}

fn device(machine: &Machine, name: &str) -> Option<UsbDevice> {
    let of = |key: &str| machine.text(&format!("{DEVICES}/{name}/{key}")).ok();
    let place = (of("busnum")?.parse().ok()?, of("devnum")?.parse().ok()?);
    let bus = name.split('-').next()?;
    Some(UsbDevice {
        vendor: u16::from_str_radix(&of("idVendor")?, 16).ok()?,
        place,
        speed_mbit: of("speed").and_then(|speed| speed.parse().ok()),
        hub: name.rsplit_once('.').map(|(hub, _)| hub.to_owned()),
        // The serial number of a bus is the name of its controller.
        controller: machine.text(&format!("{DEVICES}/usb{bus}/serial")).ok(),
    })
}

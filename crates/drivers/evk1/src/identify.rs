//! Identifies EVK1 Gen3.1 cameras on the bus. Other cameras share their USB IDs and must not receive EVK1 requests, so descriptors are
//! read first.

use std::fmt;
use std::time::Duration;

use skinrig_device::{Clock, RealClock};
use skinrig_model::HostDuration;

use crate::access::Registers;
use crate::error::{Evk1Error, UDEV_STEP, UsbError};
use crate::registers::{ATIS_CONTROL, FPGA_VERSION, SERIAL_MSB};
use crate::requests;
use crate::tolerance::{Mismatches, Tolerance};
use crate::usb::{Access, LibUsb, Slot, Transport, bus};

/// Time within which the FPGA loads its configuration.
const BOOT_LIMIT: HostDuration = HostDuration::from_millis(10_000);
/// Polling interval meanwhile.
const BOOT_LOOK: HostDuration = HostDuration::from_millis(20);

/// Identity of a camera.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Identity {
    /// 8 lower-case hexadecimal digits.
    pub serial: String,
    /// FPGA version: major in bits 23:16, minor in 15:8, micro in 7:0.
    pub fpga_version: u32,
    /// Version of the FX3 firmware, in the same format.
    pub fx3_version: u32,
}

impl Identity {
    /// Both versions, for display and for comparison with the rig file.
    #[must_use]
    pub fn firmware(&self) -> String {
        format!(
            "FPGA {}, FX3 {}",
            dotted(self.fpga_version),
            dotted(self.fx3_version)
        )
    }
}

fn dotted(version: u32) -> String {
    let [_, major, minor, micro] = version.to_be_bytes();
    format!("{major}.{minor}.{micro}")
}

/// A device that may be an EVK1.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FoundDevice {
    /// Bus, port and speed.
    pub place: String,
    /// Bus number and device address.
    pub address: (u8, u8),
    /// Port as `usb-BUS-PORT.PORT`, which can replace an unreadable serial number.
    pub port: Option<String>,
    /// State of the device.
    pub state: CameraState,
}

/// State of a device.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum CameraState {
    /// A usable EVK1 Gen3.1.
    Ready(Identity),
    /// In use by another program; not queried.
    Busy,
    /// This user has no permission; not queried.
    NoPermission,
    /// Another camera with the same USB IDs, or an EVK1 that cannot stream.
    NotEvk1(String),
    /// It did not respond as expected.
    Faulty(String),
}

impl FoundDevice {
    /// Next step, if any.
    #[must_use]
    pub fn next_step(&self) -> Option<String> {
        match &self.state {
            CameraState::Ready(_) | CameraState::NotEvk1(_) => None,
            CameraState::Busy => Some(
                "end the program that uses the camera (another skinrig, a viewer), or reconnect it"
                    .to_owned(),
            ),
            CameraState::NoPermission => Some(UDEV_STEP.to_owned()),
            CameraState::Faulty(_) => Some(format!(
                "unplug the camera, wait 5 s, reconnect it; a camera that always responds like this may be opened by `skinrig run --tolerant`{}",
                self.port.as_ref().map_or_else(String::new, |port| format!(
                    ", with `serial: {port}` in the rig file if it does not report its serial number"
                ))
            )),
        }
    }
}

/// Lists all devices with the USB IDs of an EVK1 and queries them as far as permitted. Changes nothing on them.
///
/// # Errors
/// [`UsbError::NoUsb`] on a computer without USB.
pub fn enumerate() -> Result<Vec<FoundDevice>, UsbError> {
    let clock = RealClock::start();
    let strict = Tolerance::default();
    let ask = |slot: &Slot| query_slot(slot, clock, &strict).0;
    Ok(bus()?.iter().map(ask).collect())
}

/// Queries one device; also returns the claimed camera if it is one.
fn query_slot(
    slot: &Slot,
    clock: RealClock,
    tolerance: &Tolerance,
) -> (FoundDevice, Option<LibUsb>) {
    let (state, camera) = match slot.open(clock) {
        Ok(Access::Open(mut usb)) => {
            // Mismatches tolerated here are reported when the camera is opened.
            let mismatches = Mismatches::default();
            match identify_tolerating(&mut usb, &mut clock.clone(), tolerance, &mismatches) {
                Ok(identity) => (CameraState::Ready(identity), Some(usb)),
                Err(e) => (CameraState::of(e), None),
            }
        }
        Ok(Access::Treuzell) => (CameraState::NotEvk1(TREUZELL.to_owned()), None),
        Err(e) => (CameraState::of(e.during("opening")), None),
    };
    let found = FoundDevice {
        place: slot.place(),
        address: slot.address(),
        port: slot.port(),
        state,
    };
    (found, camera)
}

const TREUZELL: &str = "a Treuzell camera (EVK3, EVK4 or alike: interface subclass 0x19), which shares its USB IDs with the EVK1";

impl CameraState {
    fn of(error: Evk1Error) -> Self {
        match error {
            Evk1Error::Usb {
                cause: UsbError::Busy,
                ..
            } => Self::Busy,
            Evk1Error::Usb {
                cause: UsbError::NoPermission,
                ..
            } => Self::NoPermission,
            Evk1Error::NotEvk1 { found, .. } => Self::NotEvk1(found),
            e => Self::Faulty(e.to_string()),
        }
    }
}

impl fmt::Display for CameraState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Ready(id) => write!(f, "EVK1 Gen3.1, serial {}, {}", id.serial, id.firmware()),
            Self::Busy => write!(
                f,
                "in use, by another program or as another camera of this one"
            ),
            Self::NoPermission => write!(f, "no permission to open it"),
            Self::NotEvk1(what) => write!(f, "not an EVK1 Gen3.1: {what}"),
            Self::Faulty(what) => write!(f, "unexpected response: {what}"),
        }
    }
}

impl fmt::Display for FoundDevice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.place, self.state)?;
        match self.next_step() {
            Some(step) => write!(f, " ({step})"),
            None => Ok(()),
        }
    }
}

/// Opens and claims the camera with this serial number; does not touch the others.
///
/// # Errors
/// [`Evk1Error::NotFound`] lists the connected cameras; [`Evk1Error::Usb`] without USB.
pub(crate) fn open_serial(
    serial: &str,
    clock: RealClock,
    tolerance: &Tolerance,
) -> Result<LibUsb, Evk1Error> {
    let mut others = Vec::new();
    for slot in bus().map_err(|e| e.during("listing USB devices"))? {
        match query_slot(&slot, clock, tolerance) {
            (
                FoundDevice {
                    state: CameraState::Ready(identity),
                    ..
                },
                Some(camera),
            ) if identity.serial == serial || slot.port().as_deref() == Some(serial) => {
                return Ok(camera);
            }
            (other, _) => others.push(other.to_string()),
        }
    }
    Err(Evk1Error::NotFound {
        serial: serial.to_owned(),
        found: if others.is_empty() {
            "no device with the USB IDs of an EVK1: check cable and power".to_owned()
        } else {
            others.join("; ")
        },
    })
}

/// Queries the identity of a claimed device in the order of OpenEB 3.1.2, up to the system ID. Writes nothing.
///
/// # Errors
/// [`Evk1Error::NotEvk1`], [`Evk1Error::NotBooted`], [`Evk1Error::Usb`].
pub fn identify(
    transport: &mut dyn Transport,
    clock: &mut dyn Clock,
) -> Result<Identity, Evk1Error> {
    let mismatches = Mismatches::default();
    identify_tolerating(transport, clock, &Tolerance::default(), &mismatches)
}

/// Like [`identify`], but accepts mismatches allowed by `tolerance`.
pub(crate) fn identify_tolerating(
    transport: &mut dyn Transport,
    clock: &mut dyn Clock,
    tolerance: &Tolerance,
    mismatches: &Mismatches,
) -> Result<Identity, Evk1Error> {
    let place = transport.place();
    let not_evk1 = |expected: &str, found: String| Evk1Error::NotEvk1 {
        place: place.clone(),
        expected: expected.to_owned(),
        found,
    };
    match ask16(
        transport,
        requests::BOARD_VERSION,
        "reading the board version",
    ) {
        Ok(requests::BOARD_EVK1) => {}
        Ok(other) => {
            return Err(not_evk1(
                "board version 2",
                format!("board version {other}"),
            ));
        }
        Err(Evk1Error::Usb {
            cause: UsbError::Stall,
            ..
        }) => {
            return Err(not_evk1(
                "board version 2",
                "a device that reports no board version".to_owned(),
            ));
        }
        Err(e) => return Err(e),
    }
    await_fpga(transport, clock)?;
    let mut registers = Registers::new(transport, &[]).tolerating(tolerance, mismatches);
    registers.read_unpowered(ATIS_CONTROL)?; // The first read after power-up is unreliable.
    let serial = registers.read(SERIAL_MSB)?;
    let system = ask16(transport, requests::SYSTEM_ID, "reading the system ID")?;
    if system != requests::SYSTEM_GEN31 {
        let what = match system {
            requests::SYSTEM_GOLDEN => {
                "the rescue image of the FPGA: update the camera's flash with the manufacturer's tool"
                    .to_owned()
            }
            0x14 => "an EVK1 Gen2".to_owned(),
            0x15 => "an EVK1 Gen3.0".to_owned(),
            0x1a => "an EVK1 Gen4".to_owned(),
            _ => "an unknown system".to_owned(),
        };
        return Err(not_evk1("system ID 0x1c", format!("{system:#04x}, {what}")));
    }
    let mut answer = [0; 8];
    query(
        transport,
        requests::FX3_VERSION,
        &mut answer,
        "reading the FX3 version",
    )?;
    let [a, b, c, d, ..] = answer;
    let fx3_version = u32::from_le_bytes([a, b, c, d]);
    let mut registers = Registers::new(transport, &[]).tolerating(tolerance, mismatches);
    let fpga_version = registers.read(FPGA_VERSION)?;
    let identity = Identity {
        serial: format!("{serial:08x}"),
        fpga_version,
        fx3_version,
    };
    Ok(identity)
}

fn await_fpga(transport: &mut dyn Transport, clock: &mut dyn Clock) -> Result<(), Evk1Error> {
    let end = clock.now() + BOOT_LIMIT;
    while ask16(
        transport,
        requests::FPGA_BOOT_STATE,
        "reading whether the FPGA is configured",
    )? == 0
    {
        let now = clock.now();
        if now >= end {
            let limit_s = Duration::from_nanos(BOOT_LIMIT.0.unsigned_abs()).as_secs();
            return Err(Evk1Error::NotBooted { limit_s });
        }
        clock.wait_until(now + BOOT_LOOK);
    }
    Ok(())
}

fn ask16(transport: &mut dyn Transport, code: u8, doing: &str) -> Result<u16, Evk1Error> {
    let mut answer = [0; 4];
    query(transport, code, &mut answer, doing)?;
    let [_, _, low, high] = answer;
    Ok(u16::from_le_bytes([low, high]))
}

fn query(
    transport: &mut dyn Transport,
    code: u8,
    answer: &mut [u8],
    doing: &str,
) -> Result<(), Evk1Error> {
    let expected = answer.len();
    match transport.control_in(code, 0, 0, answer) {
        Ok(found) if found == expected => Ok(()),
        Ok(found) => Err(UsbError::Short { expected, found }.during(doing)),
        Err(e) => Err(e.during(doing)),
    }
}

//! Links to real cameras, based on neuromorphic-drivers.

use std::sync::Arc;
use std::time::Duration;

use neuromorphic_drivers::rusb::{self, UsbContext as _};
use neuromorphic_drivers::{
    Error, Flag, Identifier, UsbDevice, UsbEventLoop, UsbOverflow, centuryarks_vga,
    flag_and_event_loop, prophesee_evk3_hd, prophesee_evk4,
};

use crate::link::{Link, LinkError, Packet, Packets};
use crate::model::Model;
use crate::stream_settings::{StreamSettings, TimeBase};

/// A camera by model and serial number.
#[derive(Debug, Clone)]
pub struct Neuromorphic {
    model: Model,
    serial: String,
}

impl Neuromorphic {
    /// The camera with this serial number, as returned by [`enumerate`]: eight upper-case hexadecimal digits.
    #[must_use]
    pub fn new(model: Model, serial: &str) -> Self {
        Self {
            model,
            serial: serial.to_owned(),
        }
    }
}

impl Link for Neuromorphic {
    fn packet_bytes(&self) -> usize {
        let ring = match self.model {
            Model::Evk4 => prophesee_evk4::RING_CONFIGURATION,
            Model::Evk3Hd => prophesee_evk3_hd::RING_CONFIGURATION,
            Model::SilkyVga => centuryarks_vga::RING_CONFIGURATION,
        };
        ring.buffer_length
    }

    fn stream(&mut self, settings: &StreamSettings) -> Result<Box<dyn Packets>, LinkError> {
        let serial = &self.serial;
        match self.model {
            Model::Evk4 => open::<prophesee_evk4::Device>(serial, evk4(settings)),
            Model::Evk3Hd => open::<prophesee_evk3_hd::Device>(serial, evk3_hd(settings)),
            Model::SilkyVga => {
                open::<centuryarks_vga::Device>(serial, centuryarks_vga::DEFAULT_CONFIGURATION)
            }
        }
    }
}

fn open<D>(serial: &str, configuration: D::Configuration) -> Result<Box<dyn Packets>, LinkError>
where
    D: UsbDevice + Send + 'static,
    D::Error: std::fmt::Display,
    Error: From<D::Error>,
{
    let (flag, event_loop) = flag_and_event_loop().map_err(link_error)?;
    let device = D::open(
        Identifier::Serial(serial),
        configuration,
        &D::RING_CONFIGURATION,
        Arc::clone(&event_loop),
        flag.clone(),
    )
    .map_err(link_error)?;
    Ok(Box::new(Stream {
        device,
        flag,
        _event_loop: event_loop,
    }))
}

struct Stream<D> {
    device: D,
    flag: Flag<Error, UsbOverflow>,
    /// Runs the transfers; dropped after the device.
    _event_loop: Arc<UsbEventLoop>,
}

impl<D: UsbDevice + Send> Packets for Stream<D> {
    fn next(&mut self, take: &mut dyn FnMut(Packet<'_>)) -> Result<bool, LinkError> {
        if let Some(view) = self.device.next_with_timeout(&Duration::ZERO) {
            take(Packet {
                bytes: view.slice,
                age: view.delay(),
                after_loss: view.first_after_overflow,
            });
            return Ok(true);
        }
        self.flag.load_error().map(|()| false).map_err(link_error)
    }

    fn dropped(&self) -> u64 {
        self.device.dropped_packets()
    }
}

fn link_error(error: impl std::fmt::Display) -> LinkError {
    LinkError(error.to_string())
}

fn evk4(settings: &StreamSettings) -> prophesee_evk4::Configuration {
    use prophesee_evk4::Clock;
    let mut all = prophesee_evk4::DEFAULT_CONFIGURATION;
    let biases = &mut all.biases;
    for (name, to) in [
        ("diff", &mut biases.diff),
        ("diff_off", &mut biases.diff_off),
        ("diff_on", &mut biases.diff_on),
        ("fo", &mut biases.fo),
        ("hpf", &mut biases.hpf),
        ("inv", &mut biases.inv),
        ("pr", &mut biases.pr),
        ("refr", &mut biases.refr),
        ("reqpux", &mut biases.reqpux),
        ("reqpuy", &mut biases.reqpuy),
        ("sendreqpdy", &mut biases.sendreqpdy),
    ] {
        if let Some(offset) = settings.biases.get(name) {
            *to = *offset;
        }
    }
    all.enable_external_trigger = settings.trigger;
    all.clock = match settings.time_base {
        TimeBase::Standalone => Clock::Internal,
        TimeBase::Master => Clock::InternalWithOutputEnabled,
        TimeBase::Slave => Clock::External,
    };
    all
}

fn evk3_hd(settings: &StreamSettings) -> prophesee_evk3_hd::Configuration {
    let mut all = prophesee_evk3_hd::DEFAULT_CONFIGURATION;
    let biases = &mut all.biases;
    for (name, to) in [
        ("blk", &mut biases.blk),
        ("diff", &mut biases.diff),
        ("diff_off", &mut biases.diff_off),
        ("diff_on", &mut biases.diff_on),
        ("fo_n", &mut biases.fo_n),
        ("fo_p", &mut biases.fo_p),
        ("hpf", &mut biases.hpf),
        ("pr", &mut biases.pr),
        ("refr", &mut biases.refr),
        ("reqpuy", &mut biases.reqpuy),
    ] {
        // In range: `StreamSettings` was checked.
        if let Some(value) = settings
            .biases
            .get(name)
            .and_then(|v| u8::try_from(*v).ok())
        {
            *to = value;
        }
    }
    all
}

/// A device with the USB IDs of one of the models.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FoundDevice {
    /// Bus and address, as shown by `lsusb`.
    pub place: (u8, u8),
    /// State of the device.
    pub state: CameraState,
}

/// State of a device.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum CameraState {
    /// A usable camera with its serial number.
    Ready(Model, String),
    /// In use by another program; not queried.
    Busy,
    /// This user has no permission; not queried.
    NoPermission,
    /// Not one of the models.
    Other,
    /// It did not respond as expected.
    Faulty(String),
}

/// Lists all devices with the USB IDs of one of the models, except those at the addresses `known` (bus, address), which are not touched.
///
/// # Errors
/// On a computer without USB.
pub fn enumerate(known: &[(u8, u8)]) -> Result<Vec<FoundDevice>, LinkError> {
    let context = rusb::Context::new().map_err(link_error)?;
    let mut found = Vec::new();
    for device in context.devices().map_err(link_error)?.iter() {
        let place = (device.bus_number(), device.address());
        let Ok(descriptor) = device.device_descriptor() else {
            continue;
        };
        let ids = (descriptor.vendor_id(), descriptor.product_id());
        if !known.contains(&place) && Model::ALL.iter().any(|m| usb_ids(*m).contains(&ids)) {
            let state = query(&device, ids).unwrap_or_else(|e| match e {
                rusb::Error::Busy => CameraState::Busy,
                rusb::Error::Access => CameraState::NoPermission,
                other => CameraState::Faulty(other.to_string()),
            });
            found.push(FoundDevice { place, state });
        }
    }
    Ok(found)
}

const fn usb_ids(model: Model) -> &'static [(u16, u16)] {
    match model {
        Model::Evk4 => prophesee_evk4::Device::VENDOR_AND_PRODUCT_IDS,
        Model::Evk3Hd => prophesee_evk3_hd::Device::VENDOR_AND_PRODUCT_IDS,
        Model::SilkyVga => centuryarks_vga::Device::VENDOR_AND_PRODUCT_IDS,
    }
}

fn query(device: &rusb::Device<rusb::Context>, ids: (u16, u16)) -> rusb::Result<CameraState> {
    let mut handle = device.open()?;
    for model in Model::ALL {
        if !usb_ids(model).contains(&ids) {
            continue;
        }
        let serial = match model {
            Model::Evk4 => prophesee_evk4::Device::read_serial(&mut handle)?,
            Model::Evk3Hd => prophesee_evk3_hd::Device::read_serial(&mut handle)?,
            Model::SilkyVga => centuryarks_vga::Device::read_serial(&mut handle)?,
        };
        if let Some(serial) = serial {
            return Ok(CameraState::Ready(model, serial));
        }
    }
    Ok(CameraState::Other)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_bias_and_mode_has_its_place_in_the_configuration() {
        let defaults = StreamSettings::default();
        for model in Model::ALL {
            for name in model.biases() {
                let mut settings = StreamSettings::default();
                settings.biases.insert((*name).to_owned(), 7);
                let (before, report) = match model {
                    Model::Evk4 => (evk4(&defaults).biases, evk4(&settings).biases).report(),
                    _ => (evk3_hd(&defaults).biases, evk3_hd(&settings).biases).report(),
                };
                assert_ne!(before, report, "{name}");
                assert!(
                    report.contains(&format!(" {name}: 7")),
                    "{name} in {report}"
                );
            }
        }
        assert!(!evk4(&defaults).enable_external_trigger);
        let slave = StreamSettings {
            trigger: true,
            time_base: TimeBase::Slave,
            ..StreamSettings::default()
        };
        let slave = evk4(&slave);
        assert!(slave.enable_external_trigger);
        assert_eq!(slave.clock, prophesee_evk4::Clock::External);
    }

    trait DebugReport {
        fn report(&self) -> (String, String);
    }

    impl<T: std::fmt::Debug> DebugReport for (T, T) {
        fn report(&self) -> (String, String) {
            (format!("{:?}", self.0), format!("{:?}", self.1))
        }
    }

    #[test]
    fn a_machine_without_these_cameras_is_reported() {
        for model in Model::ALL {
            assert_eq!(stated(model), sensor(model), "{}", model.word());
            let mut link = Neuromorphic::new(model, "FFFFFFFF");
            assert!(link.stream(&StreamSettings::default()).is_err());
        }
    }

    fn sensor(model: Model) -> (u16, u16) {
        (model.geometry().width, model.geometry().height)
    }

    fn stated(model: Model) -> (u16, u16) {
        match model {
            Model::Evk4 => (
                prophesee_evk4::PROPERTIES.width,
                prophesee_evk4::PROPERTIES.height,
            ),
            Model::Evk3Hd => (
                prophesee_evk3_hd::PROPERTIES.width,
                prophesee_evk3_hd::PROPERTIES.height,
            ),
            Model::SilkyVga => (
                centuryarks_vga::PROPERTIES.width,
                centuryarks_vga::PROPERTIES.height,
            ),
        }
    }
}

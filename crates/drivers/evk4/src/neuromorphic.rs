//! The real camera, by neuromorphic-drivers.

use std::sync::Arc;
use std::time::Duration;

use neuromorphic_drivers::prophesee_evk4::{self, Clock, Configuration, Device, PROPERTIES};
use neuromorphic_drivers::{
    Error, Flag, GenericDevice as _, Identifier, UsbEventLoop, UsbOverflow, flag_and_event_loop,
};

use crate::link::{Link, LinkError, Packet, Packets};
use crate::wanted::{TimeBase, Wanted};

/// The EVK4 with one serial number.
#[derive(Debug, Clone)]
pub struct Neuromorphic {
    serial: String,
}

impl Neuromorphic {
    /// The camera with this serial number, as it prints it: eight upper-case hexadecimal digits.
    #[must_use]
    pub fn new(serial: &str) -> Self {
        Self {
            serial: serial.to_owned(),
        }
    }
}

impl Link for Neuromorphic {
    fn packet_bytes(&self) -> usize {
        prophesee_evk4::RING_CONFIGURATION.buffer_length
    }

    fn stream(&mut self, wanted: &Wanted) -> Result<Box<dyn Packets>, LinkError> {
        let (flag, event_loop) = flag_and_event_loop().map_err(told)?;
        let device = prophesee_evk4::open(
            Identifier::Serial(&self.serial),
            configuration(wanted),
            &prophesee_evk4::RING_CONFIGURATION,
            Arc::clone(&event_loop),
            flag.clone(),
        )
        .map_err(told)?;
        Ok(Box::new(Stream {
            device,
            flag,
            _event_loop: event_loop,
        }))
    }
}

struct Stream {
    device: Device,
    flag: Flag<Error, UsbOverflow>,
    /// Moves the transfers; ends after the device.
    _event_loop: Arc<UsbEventLoop>,
}

impl Packets for Stream {
    fn next(&mut self, take: &mut dyn FnMut(Packet<'_>)) -> Result<bool, LinkError> {
        if let Some(view) = self.device.next_with_timeout(&Duration::ZERO) {
            take(Packet {
                bytes: view.slice,
                age: view.delay(),
                after_loss: view.first_after_overflow,
            });
            return Ok(true);
        }
        self.flag.load_error().map(|()| false).map_err(told)
    }

    fn dropped(&self) -> u64 {
        self.device.dropped_packets()
    }
}

fn told(error: impl std::fmt::Display) -> LinkError {
    LinkError(error.to_string())
}

fn configuration(wanted: &Wanted) -> Configuration {
    let mut all = PROPERTIES.default_configuration;
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
        if let Some(offset) = wanted.biases.get(name) {
            *to = *offset;
        }
    }
    all.enable_external_trigger = wanted.trigger;
    all.clock = match wanted.time_base {
        TimeBase::Own => Clock::Internal,
        TimeBase::Given => Clock::InternalWithOutputEnabled,
        TimeBase::Taken => Clock::External,
    };
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wanted::BIASES;

    #[test]
    fn every_bias_and_mode_has_its_place_in_the_configuration() {
        let defaults = configuration(&Wanted::default());
        for name in BIASES {
            let mut wanted = Wanted::default();
            wanted.biases.insert(name.into(), -7);
            let biases = configuration(&wanted).biases;
            assert_ne!(biases, defaults.biases, "{name}");
            let said = format!("{biases:?}");
            assert!(said.contains(&format!(" {name}: -7")), "{name} in {said}");
        }
        assert!(!defaults.enable_external_trigger);
        let slave = Wanted {
            trigger: true,
            time_base: TimeBase::Taken,
            ..Wanted::default()
        };
        let slave = configuration(&slave);
        assert!(slave.enable_external_trigger);
        assert_eq!(slave.clock, Clock::External);
    }

    #[test]
    fn a_machine_without_this_camera_says_so() {
        let mut link = Neuromorphic::new("FFFFFFFF");
        assert!(link.stream(&Wanted::default()).is_err());
    }
}

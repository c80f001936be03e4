//! The vendor requests of an EVK1 (EVK1 reference, section 1.3).

use super::camera::{Evk1, Model};
use crate::control::Request;
use crate::usb::descriptors::Descriptors;
use crate::usb::function::{Function, Reply};
use crate::usb::usbfs::Setup;

const READ_REGISTER: u8 = 0x55;
const WRITE_REGISTER: u8 = 0x56;
const BOARD_VERSION: u8 = 0x70;
const BOOT_STATE: u8 = 0x71;
const SYSTEM_ID: u8 = 0x72;
/// FX3 ID, release version, build date, VCS ID: the real replies are not public, and nothing depends on them.
const FX3_VERSIONS: std::ops::RangeInclusive<u8> = 0x78..=0x7b;

/// Byte 0 of a successful register read.
const SUCCESS: u8 = 0x40;

impl Function for Evk1 {
    fn descriptors(&self) -> &Descriptors {
        &self.descriptors
    }

    fn control(&self, setup: Setup, data: &[u8]) -> Reply {
        if !setup.is_vendor() {
            return Reply::Stall;
        }
        let mut model = self.lock();
        model.journal.push(Request::new(setup, data));
        if model.faults.silent {
            return Reply::Silence;
        }
        let reply = self.vendor(&mut model, setup, data);
        if reply == Reply::Stall {
            model.counters.refused_requests += 1;
        }
        reply
    }
}

impl Evk1 {
    fn vendor(&self, model: &mut Model, setup: Setup, data: &[u8]) -> Reply {
        let address = u32::from(setup.index) << 16 | u32::from(setup.value);
        let word = |value: u16| {
            let [low, high] = value.to_le_bytes();
            Reply::Done(vec![0, 0, low, high])
        };
        match (setup.is_in(), setup.request) {
            (true, READ_REGISTER) => {
                let Some(value) = model.registers.read(address) else {
                    model.counters.unknown_registers += 1;
                    return Reply::Stall;
                };
                let status = if model.faults.failing_reads {
                    0
                } else {
                    SUCCESS
                };
                let mut bytes = vec![status, 0, 0, 0];
                bytes.extend(value.to_be_bytes());
                Reply::Done(bytes)
            }
            (false, WRITE_REGISTER) => {
                let Ok(value) = <[u8; 4]>::try_from(data).map(u32::from_be_bytes) else {
                    return Reply::Stall;
                };
                if model.registers.read(address).is_none() {
                    model.counters.unknown_registers += 1;
                    return Reply::Stall;
                }
                if !model.faults.ignored_registers.contains(&address) {
                    model.registers.write(address, value);
                    self.written(model, address, value);
                }
                Reply::Done(Vec::new())
            }
            (true, BOARD_VERSION) => word(self.config.board_version),
            (true, BOOT_STATE) => word(u16::from(self.is_booted())),
            (true, SYSTEM_ID) => word(self.config.system_id),
            (true, request) if FX3_VERSIONS.contains(&request) => Reply::Done(vec![0; 8]),
            _ => Reply::Stall,
        }
    }
}

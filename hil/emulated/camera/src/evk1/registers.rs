//! The registers of an EVK1 Gen3.1 and their values at power-up (EVK1 reference, sections 2.1 to 2.5).
//!
//! Values are those of the public register map; those of a real device are not public. Registers
//! that the reference does not list do not exist here: requests for them are rejected, which
//! exposes wrong addresses.

use std::collections::BTreeMap;

use crate::config::Evk1Config;

pub(super) const ATIS_CONTROL: u32 = 0x0000;
pub(super) const CCAM2_CONTROL: u32 = 0x0008;
pub(super) const OVERFLOW_HITCOUNT: u32 = 0x0018;
pub(super) const SERIAL_MSB: u32 = 0x0020;
pub(crate) const OUT_OF_FOV_X: u32 = 0x0034;
pub(crate) const OUT_OF_FOV_Y: u32 = 0x0036;
pub(super) const EXT_SYNC_OUT_MODE: u32 = 0x003c;
pub(super) const TEMPERATURE: u32 = 0x014c;
pub(crate) const TRIGGER_ENABLE: u32 = 0x01a0;
pub(crate) const TRIGGER_OUT_ENABLE: u32 = 0x01a4;
pub(crate) const TRIGGER_OUT_PERIOD: u32 = 0x01a8;
pub(crate) const TRIGGER_OUT_WIDTH: u32 = 0x01ac;
pub(super) const ROI_CTRL: u32 = 0x0204;
pub(super) const CHIP_ID: u32 = 0x0218;
pub(super) const CLK_OUT_CTRL: u32 = 0x0238;
pub(super) const NFL_CTRL: u32 = 0x0248;
pub(super) const NFL_THRESH: u32 = 0x024c;
pub(crate) const BIAS_DIFF_OFF: u32 = 0x034c;
pub(crate) const TD_ROI_X: u32 = 0x0400;
pub(crate) const TD_ROI_Y: u32 = 0x0500;
pub(super) const TEST_PATTERN_CONTROL: u32 = 0x0740;
pub(super) const TEST_PATTERN_N_PERIOD: u32 = 0x0744;
pub(super) const TEST_PATTERN_P_PERIOD: u32 = 0x0748;
pub(super) const IF_CONTROL: u32 = 0x074c;
pub(super) const SYSTEM_ID: u32 = 0x0800;
pub(super) const FPGA_VERSION: u32 = 0x0804;
pub(super) const PKT_END_ENABLE: u32 = 0x1400;
pub(super) const PKT_END_INTERVAL_US: u32 = 0x1404;

/// Read-only registers: writes are ignored.
const READ_ONLY: [u32; 14] = [
    0x000c,
    0x000e,
    0x0010,
    0x0012,
    0x0014,
    0x0016,
    OVERFLOW_HITCOUNT,
    TEMPERATURE,
    0x018c,
    CHIP_ID,
    0x0250,
    SYSTEM_ID,
    FPGA_VERSION,
    0x080c,
];

/// Registers with a non-zero value at power-up.
const POWER_UP: [(u32, u32); 20] = [
    // Soft reset, no blocking of events, HVGA remap bypassed, test bus off, both pixel resets released.
    (ATIS_CONTROL, 0x000c_8118),
    (CCAM2_CONTROL, 0x0000_0020),
    (0x0034, 640),
    (0x0036, 480),
    (0x003e, 640 << 16 | 480),
    (0x0144, 100_000),
    (TRIGGER_OUT_PERIOD, 100),
    (TRIGGER_OUT_WIDTH, 1),
    // roi_em_en, roi_td_en, roi_td_rstn.
    (ROI_CTRL, 0x0000_000b),
    (0x0208, 0x4000_0bff),
    (0x0234, 0x0000_0001),
    (0x0240, 0x0014_0500),
    (0x0244, 0x4000_0bff),
    (NFL_CTRL, 0x64 << 1),
    (NFL_THRESH, 0x64 << 14 | 0x32),
    (IF_CONTROL, 0x0000_0002),
    (PKT_END_ENABLE, 0x0000_0001),
    (PKT_END_INTERVAL_US, 0x400),
    (0x1408, 0x400),
    // 25 °C in 1/4096 °C.
    (TEMPERATURE, 25 << 12),
];

/// Existing registers: first, last, step.
const EXISTING: [(u32, u32, u32); 21] = [
    // System control; registers are two apart and 32 bits wide.
    (0x0000, 0x0000, 2),
    (0x0008, 0x001a, 2),
    // Serial number.
    (0x001c, 0x0020, 4),
    (0x0034, 0x003e, 2),
    // The FPGA's own monitor.
    (0x0040, 0x00fe, 2),
    (0x0140, 0x014c, 4),
    (0x0180, 0x018c, 4),
    (0x01a0, 0x01ac, 4),
    // Sensor.
    (0x0200, 0x0208, 4),
    (0x0214, 0x0224, 4),
    (0x022c, 0x022c, 4),
    (0x0234, 0x0250, 4),
    (0x0300, 0x0368, 4),
    (0x0400, 0x0450, 4),
    (0x0500, 0x053c, 4),
    (0x0600, 0x0650, 4),
    (0x0700, 0x073c, 4),
    (0x0740, 0x0750, 4),
    (0x0758, 0x0798, 4),
    (0x0800, 0x080c, 4),
    (0x1400, 0x1408, 4),
];

/// The registers of one camera.
#[derive(Debug, Clone)]
pub(crate) struct Registers(BTreeMap<u32, u32>);

impl Registers {
    pub(crate) fn power_up(config: &Evk1Config, serial: u32) -> Self {
        let mut values: BTreeMap<u32, u32> = EXISTING
            .iter()
            .flat_map(|&(first, last, step)| (first..=last).step_by(step as usize))
            .map(|address| (address, 0))
            .collect();
        values.extend(POWER_UP);
        values.extend([
            (SERIAL_MSB, serial),
            (CHIP_ID, config.chip_id),
            (SYSTEM_ID, u32::from(config.system_id)),
            (FPGA_VERSION, config.fpga_version),
        ]);
        // A flaw of the sensor enables half of the pixels (section 2.6); which half is assumed: columns 0..320.
        values.extend((0..10).map(|n| (TD_ROI_X + 4 * n, u32::MAX)));
        values.extend((0..15).map(|n| (TD_ROI_Y + 4 * n, u32::MAX)));
        Self(values)
    }

    /// `None` if the register does not exist.
    pub(crate) fn read(&self, address: u32) -> Option<u32> {
        self.0.get(&address).copied()
    }

    /// Value of a register that is known to exist.
    pub(crate) fn get(&self, address: u32) -> u32 {
        self.read(address).unwrap_or(0)
    }

    pub(crate) fn bit(&self, address: u32, bit: u32) -> bool {
        self.get(address) >> bit & 1 == 1
    }

    /// Host write; `false` if the register does not exist.
    pub(crate) fn write(&mut self, address: u32, value: u32) -> bool {
        let Some(slot) = self.0.get_mut(&address) else {
            return false;
        };
        let of_serial = (0x001c..=SERIAL_MSB).contains(&address);
        if !READ_ONLY.contains(&address) && !of_serial && address != 0x0808 {
            *slot = value;
        }
        true
    }

    /// Write by the device itself.
    pub(crate) fn set(&mut self, address: u32, value: u32) {
        self.0.insert(address, value);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_listed_registers_exist_and_reports_cannot_be_written() {
        let mut registers = Registers::power_up(&Evk1Config::default(), 0x1621);
        assert_eq!(registers.read(SERIAL_MSB), Some(0x1621));
        assert_eq!(registers.read(0x0002), None);
        assert_eq!(registers.read(0x0228), None);
        assert!(!registers.write(0x0454, 1));
        assert!(registers.write(CHIP_ID, 1));
        assert_eq!(registers.read(CHIP_ID), Some(0x9020_0c03));
        assert!(registers.write(0x000a, 1));
        assert_eq!(registers.read(0x000a), Some(1));
    }
}

//! The registers of an EVK1 Gen3.1 as data: names, addresses, fields and nominal defaults. No transport in here.
//!
//! Source: the register maps of OpenEB 3.1.2 (`hal_psee_plugins`, `ccam3_single_gen3_tep_register_control`,
//! `ccam2_system_monitor_trigger_ext_adc`, `stereo_fx3_hostif`, `ccam3_single_gen31_sensorif`). Addresses are opaque
//! names of 32-bit registers, not byte addresses. Defaults are those in the maps; the contents of a real device
//! after power-up are not public, so only models of the device use them. A bit whose default is not public
//! counts as 0.

/// One 32-bit register.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Register {
    /// Its name in the public register map.
    pub name: &'static str,
    /// Its complete address.
    pub address: u32,
    /// Its nominal default.
    pub default: u32,
    /// The bits that read back as written. The others are strobes, counters, or bits that the device may
    /// clear by itself.
    pub stable: u32,
}

/// A bit field of a register.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Field {
    /// The register of the field.
    pub register: Register,
    /// Its name in the public register map.
    pub name: &'static str,
    /// Its lowest bit.
    pub low: u32,
    /// Its width, 1..=32.
    pub bits: u32,
}

impl Field {
    /// The bits of the field within its register.
    #[must_use]
    pub const fn mask(self) -> u32 {
        (u32::MAX >> (32 - self.bits)) << self.low
    }

    /// The largest value that fits.
    #[must_use]
    pub const fn max(self) -> u32 {
        u32::MAX >> (32 - self.bits)
    }

    /// The field's value within `word`.
    #[must_use]
    pub const fn of(self, word: u32) -> u32 {
        (word & self.mask()) >> self.low
    }

    /// `word` with the field set to `value`; higher bits of `value` are ignored.
    #[must_use]
    pub const fn put(self, word: u32, value: u32) -> u32 {
        word & !self.mask() | (value << self.low) & self.mask()
    }
}

const fn register(name: &'static str, address: u32, default: u32) -> Register {
    Register {
        name,
        address,
        default,
        stable: u32::MAX,
    }
}

/// A register of which only the bits `stable` read back as written.
const fn volatile(name: &'static str, address: u32, default: u32, stable: u32) -> Register {
    Register {
        name,
        address,
        default,
        stable,
    }
}

const fn field(register: Register, name: &'static str, low: u32, bits: u32) -> Field {
    Field {
        register,
        name,
        low,
        bits,
    }
}

const fn bit(register: Register, name: &'static str, low: u32) -> Field {
    field(register, name, low, 1)
}

// ---- system control, base 0x0000

/// Power, resets and sync mode of the sensor.
pub const ATIS_CONTROL: Register = register("ATIS_CONTROL", 0x0000, 0x000c_8118);
/// Analogue supply of the sensor.
pub const EN_VDDA: Field = bit(ATIS_CONTROL, "EN_VDDA", 0);
/// Core supply of the sensor.
pub const EN_VDDC: Field = bit(ATIS_CONTROL, "EN_VDDC", 1);
/// Digital supply of the sensor.
pub const EN_VDDD: Field = bit(ATIS_CONTROL, "EN_VDDD", 2);
/// Soft reset of the sensor.
pub(crate) const SENSOR_SOFT_RESET: Field = bit(ATIS_CONTROL, "SENSOR_SOFT_RESET", 3);
/// The sensor interface does not block.
pub(crate) const IN_EVT_NO_BLOCKING_MODE: Field = bit(ATIS_CONTROL, "IN_EVT_NO_BLOCKING_MODE", 4);
/// 1 for 640 x 480, 0 for the 480 x 360 variant.
pub(crate) const SISLEY_HVGA_REMAP_BYPASS: Field = bit(ATIS_CONTROL, "SISLEY_HVGA_REMAP_BYPASS", 8);
/// The time base is the camera's own.
pub const MASTER_MODE: Field = bit(ATIS_CONTROL, "MASTER_MODE", 12);
/// The time base uses the sync line.
pub const USE_EXT_START: Field = bit(ATIS_CONTROL, "USE_EXT_START", 14);
/// Reset of the change detection, active low.
pub const TD_RSTN: Field = bit(ATIS_CONTROL, "TD_RSTN", 18);
/// Reset of the exposure measurement, active low.
pub(crate) const EM_RSTN: Field = bit(ATIS_CONTROL, "EM_RSTN", 19);

/// The FPGA's host side.
pub const CCAM2_CONTROL: Register = register("CCAM2_CONTROL", 0x0008, 0x0000_0020);
/// The interface to the host.
pub(crate) const HOST_IF_ENABLE: Field = bit(CCAM2_CONTROL, "HOST_IF_ENABLE", 8);
/// The time base runs.
pub const STEREO_MERGE_ENABLE: Field = bit(CCAM2_CONTROL, "STEREO_MERGE_ENABLE", 9);
/// Drop events outside the window of `OUT_OF_FOV_FILTER_X` and `_Y`.
pub(crate) const ENABLE_OUT_OF_FOV: Field = bit(CCAM2_CONTROL, "ENABLE_OUT_OF_FOV", 11);

/// Write strobes; their read-back values are not public.
pub(crate) const TRIGGERS: Register = volatile("TRIGGERS", 0x000a, 0, 0);
/// Resets the FPGA's registers and time base: 0, then 1.
pub(crate) const SOFT_RESET: Field = bit(TRIGGERS, "SOFT_RESET", 0);

/// Number of FIFO overflows, judging by its name. No public code reads it.
pub const OVERFLOW_HITCOUNT: Register = volatile("OVERFLOW_HITCOUNT", 0x0018, 0, 0);
/// The low half of the serial number.
pub(crate) const SERIAL_LSB: Register = volatile("SERIAL_LSB", 0x001c, 0, 0);
/// High half of the serial number, which is the printed one.
pub const SERIAL_MSB: Register = volatile("SERIAL_MSB", 0x0020, 0, 0);

/// Columns that pass the field-of-view filter.
pub(crate) const OUT_OF_FOV_FILTER_X: Register = register("OUT_OF_FOV_FILTER_X", 0x0034, 640);
/// Width in pixels.
pub(crate) const FOV_WIDTH: Field = field(OUT_OF_FOV_FILTER_X, "WIDTH", 0, 11);
/// First column.
pub(crate) const FOV_ORIGIN_X: Field = field(OUT_OF_FOV_FILTER_X, "ORIGIN", 16, 11);
/// Rows that pass the field-of-view filter.
pub(crate) const OUT_OF_FOV_FILTER_Y: Register = register("OUT_OF_FOV_FILTER_Y", 0x0036, 480);
/// Height in pixels.
pub(crate) const FOV_HEIGHT: Field = field(OUT_OF_FOV_FILTER_Y, "HEIGHT", 0, 11);
/// 0: the output line carries the sync clock; 1: trigger-out pulses.
pub const EXT_SYNC_OUT_MODE: Register = register("EXT_SYNC_OUT_MODE", 0x003c, 0);
/// The bit of [`EXT_SYNC_OUT_MODE`].
pub(crate) const SYNC_OUT_IS_TRIGGER: Field = bit(EXT_SYNC_OUT_MODE, "EXT_SYNC_OUT_MODE", 0);
/// Size of the image.
pub(crate) const IMAGE_SIZE: Register = register("IMAGE_SIZE", 0x003e, 0x0280_01e0);

// ---- system monitor, base 0x0040

/// Switches of the temperature monitor.
pub(crate) const EXT_TEMP_CONTROL: Register = register("EXT_TEMP_CONTROL", 0x0148, 0);
/// Reads the board's temperature sensor.
pub(crate) const EXT_TEMP_MONITOR_SPI_EN: Field =
    bit(EXT_TEMP_CONTROL, "EXT_TEMP_MONITOR_SPI_EN", 2);
/// The board's temperature; whether it is signed is not public.
pub const EVK_EXT_TEMP_VALUE: Register = volatile("EVK_EXT_TEMP_VALUE", 0x014c, 0, 0);
/// In 1/4096 °C.
pub const TEMPERATURE: Field = field(EVK_EXT_TEMP_VALUE, "EVK_EXT_TEMP_VALUE", 0, 22);
/// Trigger inputs: bit n enables channel n.
pub const EXT_TRIGGERS_ENABLE: Register = register("EXT_TRIGGERS/ENABLE", 0x01a0, 0);
/// Trigger output.
pub const EXT_TRIGGERS_OUT_ENABLE: Register = register("EXT_TRIGGERS/OUT_ENABLE", 0x01a4, 0);
/// The bit of [`EXT_TRIGGERS_OUT_ENABLE`].
pub(crate) const TRIGGER_OUT: Field = bit(EXT_TRIGGERS_OUT_ENABLE, "OUT_ENABLE", 0);
/// Period of the trigger output, µs.
pub const OUT_PULSE_PERIOD: Register = register("EXT_TRIGGERS/OUT_PULSE_PERIOD", 0x01a8, 100);
/// Width of a pulse of the trigger output, µs.
pub const OUT_PULSE_WIDTH: Register = register("EXT_TRIGGERS/OUT_PULSE_WIDTH", 0x01ac, 1);

/// Enables trigger input `channel`.
#[must_use]
pub const fn trigger_input(channel: u8) -> Field {
    bit(EXT_TRIGGERS_ENABLE, "TRIGGER", channel as u32 & 7)
}

// ---- sensor, base 0x0200

/// Global switches of the sensor.
pub(crate) const GLOBAL_CTRL: Register = register("global_ctrl", 0x0200, 0);
/// Global enable.
pub(crate) const SW_GLOBAL_EN: Field = bit(GLOBAL_CTRL, "sw_global_en", 1);
/// Reset of the bias generator, active low.
pub(crate) const BGEN_RSTN: Field = bit(GLOBAL_CTRL, "bgen_rstn", 3);
/// Bias generator.
pub(crate) const BGEN_EN: Field = bit(GLOBAL_CTRL, "bgen_en", 4);

/// Region of interest. Whether the two shadow triggers (bits 4 and 5) clear by themselves is not public.
pub const ROI_CTRL: Register = volatile("roi_ctrl", 0x0204, 0x0000_000b, !0x30);
/// The region applies to change detection.
pub(crate) const ROI_TD_EN: Field = bit(ROI_CTRL, "roi_td_en", 1);
/// 0 holds all pixels in reset: no events.
pub const ROI_TD_RSTN: Field = bit(ROI_CTRL, "roi_td_rstn", 3);
/// Takes over the region's bit maps.
pub(crate) const ROI_TD_SHADOW_TRIGGER: Field = bit(ROI_CTRL, "roi_td_shadow_trigger", 5);

/// Readout of change detection.
pub(crate) const READOUT_CTRL: Register = register("readout_ctrl", 0x0208, 0x4000_0bff);
/// Readout of the exposure measurement, with the same layout as [`READOUT_CTRL`].
pub(crate) const ROE_CTRL: Register = register("roe_ctrl", 0x0244, 0x4000_03ff);

/// `ro_act_pdy_ctrl` of [`READOUT_CTRL`] or [`ROE_CTRL`].
#[must_use]
pub(crate) const fn act_pdy(of: Register) -> Field {
    field(of, "ro_act_pdy_ctrl", 17, 3)
}

/// `ro_act_pdx_ctrl` of [`READOUT_CTRL`] or [`ROE_CTRL`].
#[must_use]
pub(crate) const fn act_pdx(of: Register) -> Field {
    field(of, "ro_act_pdx_ctrl", 20, 3)
}

/// `ro_act_pux_ctrl` of [`READOUT_CTRL`] or [`ROE_CTRL`].
#[must_use]
pub(crate) const fn act_pux(of: Register) -> Field {
    field(of, "ro_act_pux_ctrl", 11, 3)
}

/// Illumination meter: bits 25:0 count, bit 29 marks a valid count.
pub(crate) const LIFO_CTRL: Register = volatile("lifo_ctrl", 0x0214, 0, 0xc000_0000);
/// Illumination meter.
pub(crate) const LIFO_EN: Field = bit(LIFO_CTRL, "lifo_en", 31);
/// Chip ID; the default is that of the variant with exposure measurement, the only one listed.
pub const CHIP_ID: Register = volatile("chip_id", 0x0218, 0x9020_0c03, 0);
/// Spare bits of the sensor.
pub const SPARE_CTRL: Register = register("spare_ctrl", 0x021c, 0);
/// Spare bit 0.
pub(crate) const SPARE0: Field = bit(SPARE_CTRL, "spare0", 0);
/// Shutter of the exposure measurement.
pub(crate) const EM_SHUTTER: Field = bit(SPARE_CTRL, "em_shutter", 8);
/// Pull-up at the top of the readout.
pub(crate) const RO_TOP_ACT_PU_EN: Field = bit(SPARE_CTRL, "ro_top_act_pu_en", 28);
/// Removal of events out of range.
pub(crate) const OOR_CTRL: Register = register("oor_ctrl", 0x0220, 0);
/// Switch of [`OOR_CTRL`].
pub(crate) const OOR_EN: Field = bit(OOR_CTRL, "oor_en", 0);
/// The sensor's clock output.
pub const CLK_OUT_CTRL: Register = register("clk_out_ctrl", 0x0238, 0);
/// Clock output.
pub const CLK_OUT_EN: Field = bit(CLK_OUT_CTRL, "clk_out_en", 0);
/// Bypasses the clock gate.
pub(crate) const CLK_GATE_BYPASS: Field = bit(CLK_OUT_CTRL, "clk_gate_bypass", 1);
/// Bus between readout and interface.
pub(crate) const ROB_CTRL: Register = register("rob_ctrl", 0x0240, 0x0014_0500);
/// Two buses.
pub(crate) const RO_DUAL_CTRL: Field = bit(ROB_CTRL, "ro_dual_ctrl", 0);
/// Event-rate noise filter.
pub const NFL_CTRL: Register = register("nfl_ctrl", 0x0248, 0x0000_00c8);
/// Switch of the filter.
pub const NFL_EN: Field = bit(NFL_CTRL, "nfl_en", 0);
/// Thresholds of the filter.
pub const NFL_THRESH: Register = register("nfl_thresh", 0x024c, 0x0019_0032);
/// Events per period below which the filter drops everything.
pub const NFL_EVT_THRESH: Field = field(NFL_THRESH, "evt_thresh", 0, 14);
/// Length of a period, µs.
pub(crate) const NFL_PERIOD_CNT_THRESH: Field = field(NFL_THRESH, "period_cnt_thresh", 14, 10);

/// Number of bias generators.
pub(crate) const BIAS_GENERATORS: usize = 27;

/// Initial values of the 27 bias generators; also the initial state of a device model.
pub(crate) const BIAS_INIT: [u32; BIAS_GENERATORS] = [
    0x5900_009f,
    0x5900_009f,
    0x5900_009b,
    0x5900_00a9,
    0x7900_008c,
    0x7900_0070,
    0x7900_008c,
    0x7900_00c0,
    0x7900_003e,
    0x7900_0036,
    0x5900_00b7,
    0x7900_0000,
    0x7900_00f7,
    0x7102_c400,
    0x7107_ff00,
    0x7100_8200,
    0x7900_00e2,
    0x7900_00f0,
    0x7900_008c,
    0x7900_001f,
    0x7900_0033,
    0x7900_0029,
    0x7100_3600,
    0x5103_4f00,
    0x5100_4f00,
    0x5100_0100,
    0x6101_3100,
];

const BIAS_NAMES: [&str; BIAS_GENERATORS] = [
    "bgen_00", "bgen_01", "bgen_02", "bgen_03", "bgen_04", "bgen_05", "bgen_06", "bgen_07",
    "bgen_08", "bgen_09", "bgen_10", "bgen_11", "bgen_12", "bgen_13", "bgen_14", "bgen_15",
    "bgen_16", "bgen_17", "bgen_18", "bgen_19", "bgen_20", "bgen_21", "bgen_22", "bgen_23",
    "bgen_24", "bgen_25", "bgen_26",
];

/// Bias generator `n`, 0..=26. The map lists no defaults; 0 is used instead.
///
/// # Panics
/// For a larger `n`.
#[must_use]
pub const fn bias_generator(n: usize) -> Register {
    register(BIAS_NAMES[n], 0x0300 + 4 * n as u32, 0)
}

/// `vdac` of bias generator `n`: code of the voltage DAC.
#[must_use]
pub(crate) const fn bias_vdac(n: usize) -> Field {
    field(bias_generator(n), "vdac", 0, 8)
}

/// `idac` of bias generator `n`: code of the current DAC.
#[must_use]
pub(crate) const fn bias_idac(n: usize) -> Field {
    field(bias_generator(n), "idac", 8, 13)
}

/// `type` of bias generator `n`: 1 voltage DAC, 0 current DAC.
#[must_use]
pub(crate) const fn bias_type(n: usize) -> Field {
    bit(bias_generator(n), "type", 27)
}

/// Words of the map of columns.
pub(crate) const ROI_X_WORDS: usize = 20;
/// Words of the map of rows.
pub(crate) const ROI_Y_WORDS: usize = 15;

/// Word `n` of the map of columns: bit x % 32 of word x / 32 enables column x.
#[must_use]
pub const fn roi_x(n: usize) -> Register {
    register("td_roi_x", 0x0400 + 4 * n as u32, 0)
}

/// Word `n` of the map of rows: bit y % 32 of word y / 32 enables row y.
#[must_use]
pub(crate) const fn roi_y(n: usize) -> Register {
    register("td_roi_y", 0x0500 + 4 * n as u32, 0)
}

/// The four bits beyond the map of columns; always 0.
pub(crate) const ROI_X_END: Register = register("td_roi_x20", 0x0450, 0);
/// The four bits beyond the map of rows; always 0.
pub(crate) const ROI_Y_END: Register = register("td_roi_y15", 0x053c, 0);

/// The FPGA's pattern generator, which replaces the sensor.
pub const TEST_PATTERN_CONTROL: Register = register("IF/TEST_PATTERN_CONTROL", 0x0740, 0);
/// Enables event generation.
pub const PATTERN_ENABLE: Field = bit(TEST_PATTERN_CONTROL, "ENABLE", 0);
/// 0: column after column; 1: the diagonal.
pub(crate) const PATTERN_TYPE: Field = bit(TEST_PATTERN_CONTROL, "TYPE", 4);
/// 0: change detection; 1: exposure measurement.
pub(crate) const PATTERN_PIXEL_TYPE: Field = bit(TEST_PATTERN_CONTROL, "PIXEL_TYPE", 8);
/// The events' polarity.
pub(crate) const PATTERN_PIXEL_POLARITY: Field = bit(TEST_PATTERN_CONTROL, "PIXEL_POLARITY", 12);
/// The first of two alternating periods.
pub const TEST_PATTERN_N_PERIOD: Register = register("IF/TEST_PATTERN_N_PERIOD", 0x0744, 0);
/// The second period.
pub const TEST_PATTERN_P_PERIOD: Register = register("IF/TEST_PATTERN_P_PERIOD", 0x0748, 0);

/// `VALID_RATIO` of [`TEST_PATTERN_N_PERIOD`] or [`TEST_PATTERN_P_PERIOD`]: clock cycles of 10 ns with an event, of 1024.
#[must_use]
pub(crate) const fn pattern_valid_ratio(of: Register) -> Field {
    field(of, "VALID_RATIO", 0, 10)
}

/// `LENGTH` of [`TEST_PATTERN_N_PERIOD`] or [`TEST_PATTERN_P_PERIOD`].
#[must_use]
pub(crate) const fn pattern_length(of: Register) -> Field {
    field(of, "LENGTH", 16, 16)
}

/// The FPGA's interface to the sensor.
pub const IF_CONTROL: Register = register("IF/CONTROL", 0x074c, 0x0000_0002);
/// The sensor's clock.
pub const SENSOR_CLK_EN: Field = bit(IF_CONTROL, "SENSOR_CLK_EN", 1);

// ---- identity, base 0x0800

/// System ID in bits 7:0.
pub const SYSTEM_ID: Register = volatile("SYSTEM_ID", 0x0800, 0x0000_001c, 0);
/// FPGA version: major in bits 23:16, minor in 15:8, micro in 7:0.
pub const FPGA_VERSION: Register = volatile("FPGA_VERSION", 0x0804, 0x0003_0000, 0);
/// FPGA build date, unix time.
pub(crate) const FPGA_BUILD_DATE: Register = volatile("FPGA_BUILD_DATE", 0x0808, 0, 0);

// ---- host interface, base 0x1400

/// Whether the FPGA closes partly filled packets.
pub const PKT_END_ENABLE: Register = register("PKT_END_ENABLE", 0x1400, 0x0000_0001);
/// Time after which it closes them, µs.
pub const PKT_END_INTERVAL_US: Register = register("PKT_END_INTERVAL_US", 0x1404, 0x0400);
/// Amount of data after which it closes them.
pub(crate) const PKT_END_DATA_COUNT: Register = register("PKT_END_DATA_COUNT", 0x1408, 0x0400);

const SINGLE: &[Register] = &[
    ATIS_CONTROL,
    CCAM2_CONTROL,
    TRIGGERS,
    OVERFLOW_HITCOUNT,
    SERIAL_LSB,
    SERIAL_MSB,
    OUT_OF_FOV_FILTER_X,
    OUT_OF_FOV_FILTER_Y,
    EXT_SYNC_OUT_MODE,
    IMAGE_SIZE,
    EXT_TEMP_CONTROL,
    EVK_EXT_TEMP_VALUE,
    EXT_TRIGGERS_ENABLE,
    EXT_TRIGGERS_OUT_ENABLE,
    OUT_PULSE_PERIOD,
    OUT_PULSE_WIDTH,
    GLOBAL_CTRL,
    ROI_CTRL,
    READOUT_CTRL,
    LIFO_CTRL,
    CHIP_ID,
    SPARE_CTRL,
    OOR_CTRL,
    CLK_OUT_CTRL,
    ROB_CTRL,
    ROE_CTRL,
    NFL_CTRL,
    NFL_THRESH,
    ROI_X_END,
    ROI_Y_END,
    TEST_PATTERN_CONTROL,
    TEST_PATTERN_N_PERIOD,
    TEST_PATTERN_P_PERIOD,
    IF_CONTROL,
    SYSTEM_ID,
    FPGA_VERSION,
    FPGA_BUILD_DATE,
    PKT_END_ENABLE,
    PKT_END_INTERVAL_US,
    PKT_END_DATA_COUNT,
];

/// Every register that the driver accesses, and those of the host interface: the registers of a device model.
pub fn all() -> impl Iterator<Item = Register> {
    SINGLE
        .iter()
        .copied()
        .chain((0..BIAS_GENERATORS).map(bias_generator))
        .chain((0..ROI_X_WORDS).map(roi_x))
        .chain((0..ROI_Y_WORDS).map(roi_y))
}

/// The register at `address`.
#[must_use]
pub fn at(address: u32) -> Option<Register> {
    all().find(|r| r.address == address)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn addresses_are_unique_and_those_of_the_maps() {
        let addresses: BTreeSet<u32> = all().map(|r| r.address).collect();
        assert_eq!(addresses.len(), all().count());
        assert_eq!(bias_generator(21).address, 0x0354);
        assert_eq!(roi_x(ROI_X_WORDS - 1).address, 0x044c);
        assert_eq!(roi_y(ROI_Y_WORDS - 1).address, 0x0538);
        assert_eq!(at(0x0248), Some(NFL_CTRL));
        assert_eq!(at(0x0002), None);
    }

    #[test]
    fn fields_change_their_bits_and_no_others() {
        let f = NFL_PERIOD_CNT_THRESH;
        assert_eq!(f.mask(), 0x00ff_c000);
        assert_eq!(f.of(NFL_THRESH.default), 0x64);
        assert_eq!(f.put(u32::MAX, 0), !f.mask());
        assert_eq!(f.put(0, u32::MAX), f.mask());
        assert_eq!(f.max(), 1023);
        assert_eq!(NFL_EVT_THRESH.of(NFL_THRESH.default), 0x32);
    }
}

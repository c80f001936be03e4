//! Sequences of register accesses that initialise, start, stop and close a camera.
//!
//! Source: OpenEB 3.1.2, `hal_psee_plugins/src/devices/gen31` (`gen31_fx3_facilities_builder`, `gen31_evk1_fpga`,
//! `gen31_system_control`, `gen31_sensor_if_ctrl`, `gen31_sensor`, `gen31_digital`, `gen31_analog`,
//! `gen31_roi_command`) and `src/boards/fx3/fx3_libusb_board_command`. The order is theirs; the read-back is ours.

use std::time::Duration;

use skinrig_device::Clock;
use skinrig_model::{HostDuration, SENSOR_HEIGHT, SENSOR_WIDTH};

use crate::access::Registers;
use crate::error::{Evk1Error, FirstError};
use crate::registers as r;
use crate::roi::Map;

/// Start-up burst of the pixels, which the noise filter removes.
pub(crate) const SWALLOW: Duration = Duration::from_millis(500);

/// First FPGA version with a trigger output, as in register `FPGA_VERSION`.
pub(crate) const TRIGGER_OUT_SINCE: u32 = 0x0003_0000;

/// Powers the sensor down and resets the FPGA, from any state. The sensor's own register is not read back, because the
/// sensor may be unpowered.
///
/// # Errors
/// [`Evk1Error::Usb`], [`Evk1Error::ReadBack`].
pub(crate) fn power_down(registers: &mut Registers<'_>) -> Result<(), Evk1Error> {
    let mut done = FirstError::default();
    done.after(registers.set_blind(r::CLK_OUT_EN, 0));
    for off in [
        r::TD_RSTN,
        r::EN_VDDA,
        r::SENSOR_CLK_EN,
        r::SENSOR_SOFT_RESET,
        r::EN_VDDC,
        r::EN_VDDD,
    ] {
        done.after(registers.set(off, 0));
    }
    done.after(soft_reset(registers));
    done.outcome()
}

fn soft_reset(registers: &mut Registers<'_>) -> Result<(), Evk1Error> {
    registers.set(r::SOFT_RESET, 0)?;
    registers.set(r::SOFT_RESET, 1)
}

/// Powers up the FPGA's side and the sensor: VDDC, VDDD, clock, VDDA. The camera is then standalone.
///
/// # Errors
/// [`Evk1Error::Usb`], [`Evk1Error::ReadBack`].
pub fn init_fpga(registers: &mut Registers<'_>) -> Result<(), Evk1Error> {
    registers.write(r::ATIS_CONTROL, 0)?;
    soft_reset(registers)?;
    for (field, value) in [
        (r::TD_RSTN, 0),
        (r::EM_RSTN, 0),
        (r::SENSOR_SOFT_RESET, 1),
        (r::EN_VDDC, 1),
        (r::EN_VDDD, 1),
        (r::SENSOR_SOFT_RESET, 0),
        (r::MASTER_MODE, 1),
        (r::USE_EXT_START, 0),
        (r::HOST_IF_ENABLE, 1),
        (r::IN_EVT_NO_BLOCKING_MODE, 1),
        (r::SISLEY_HVGA_REMAP_BYPASS, 1),
        (r::FOV_WIDTH, SENSOR_WIDTH.into()),
        (r::FOV_ORIGIN_X, 0),
        (r::FOV_HEIGHT, SENSOR_HEIGHT.into()),
        (r::ENABLE_OUT_OF_FOV, 1),
        (r::SENSOR_CLK_EN, 1),
        (r::EN_VDDA, 1),
        (r::TD_RSTN, 1),
        (r::EM_RSTN, 1),
        (r::EXT_TEMP_MONITOR_SPI_EN, 1),
    ] {
        registers.set(field, value)?;
    }
    Ok(())
}

/// Initialises the sensor with its pixels held in reset. The contrast biases stay in voltage mode throughout: in current mode
/// the sensor overheats.
///
/// # Errors
/// [`Evk1Error::Usb`], [`Evk1Error::ReadBack`].
pub fn init_sensor(registers: &mut Registers<'_>) -> Result<(), Evk1Error> {
    registers.set(r::CLK_OUT_EN, 1)?;
    registers.set(r::CLK_GATE_BYPASS, 0)?;
    for (n, word) in r::BIAS_INIT.into_iter().enumerate() {
        registers.write(r::bias_generator(n), word)?;
    }
    for (field, value) in [
        (r::EM_SHUTTER, 1),
        (r::BGEN_EN, 1),
        (r::BGEN_RSTN, 1),
        (r::SW_GLOBAL_EN, 1),
        (r::RO_DUAL_CTRL, 1),
        (r::bias_vdac(0), 0xb0),
        (r::bias_vdac(1), 0xb0),
        (r::act_pdy(r::READOUT_CTRL), 1),
        (r::act_pdx(r::READOUT_CTRL), 0),
        (r::act_pux(r::READOUT_CTRL), 0),
        (r::act_pdy(r::ROE_CTRL), 1),
        (r::act_pdx(r::ROE_CTRL), 0),
        (r::act_pux(r::ROE_CTRL), 0),
        (r::RO_TOP_ACT_PU_EN, 1),
        (r::SPARE0, 1),
        (r::bias_vdac(7), 0xc0),
        (r::bias_type(19), 1),
        (r::bias_vdac(19), 0x1e),
        (r::bias_type(20), 1),
        (r::bias_vdac(20), 0x35),
        (r::bias_type(21), 1),
        (r::bias_vdac(21), 0x29),
        (r::bias_idac(22), 0x3d),
        (r::CLK_GATE_BYPASS, 0),
        (r::OOR_EN, 1),
        (r::ROI_TD_RSTN, 0),
        (r::ROI_TD_EN, 1),
    ] {
        registers.set(field, value)?;
    }
    registers.write(r::ROI_X_END, 0)?;
    registers.write(r::ROI_Y_END, 0)?;
    registers.set(r::ROI_TD_SHADOW_TRIGGER, 1)
}

/// Sets the facilities to a known state: no trigger inputs, no trigger output, all pixels in the region. The
/// region must be written, because half of a fresh sensor's pixels are off.
///
/// # Errors
/// [`Evk1Error::Usb`], [`Evk1Error::ReadBack`].
pub(crate) fn init_facilities(
    registers: &mut Registers<'_>,
    fpga_version: u32,
) -> Result<(), Evk1Error> {
    for channel in crate::triggers::CHANNELS {
        registers.set(r::trigger_input(channel), 0)?;
    }
    if fpga_version >= TRIGGER_OUT_SINCE {
        registers.set(r::SYNC_OUT_IS_TRIGGER, 0)?;
        registers.set(r::TRIGGER_OUT, 0)?;
    }
    registers.set(r::LIFO_EN, 1)?;
    Map::ALL.write(registers)
}

/// Brings the camera from any state to one in which it can be started.
///
/// # Errors
/// [`Evk1Error::Usb`], [`Evk1Error::ReadBack`].
pub fn initialise(registers: &mut Registers<'_>, fpga_version: u32) -> Result<(), Evk1Error> {
    power_down(registers)?;
    init_fpga(registers)?;
    init_sensor(registers)?;
    init_facilities(registers, fpga_version)
}

/// Starts the time base and releases the pixels while the noise filter drops everything; calls `wait` for the
/// start-up burst; then restores the filter's setting. Transfers must be queued before.
///
/// # Errors
/// [`Evk1Error::Usb`], [`Evk1Error::ReadBack`].
pub fn start(
    registers: &mut Registers<'_>,
    wait: &mut dyn FnMut(Duration),
) -> Result<(), Evk1Error> {
    registers.set(r::STEREO_MERGE_ENABLE, 1)?;
    registers.set(r::ROI_TD_EN, 1)?;
    registers.set(r::ROI_TD_SHADOW_TRIGGER, 1)?;
    let thresholds = registers.read(r::NFL_THRESH)?;
    let enabled = registers.get(r::NFL_EN)?;
    registers.set(r::NFL_EVT_THRESH, r::NFL_EVT_THRESH.max())?;
    registers.set(r::NFL_PERIOD_CNT_THRESH, 0x0a)?;
    registers.set(r::NFL_EN, 1)?;
    registers.set(r::ROI_TD_RSTN, 1)?;
    wait(SWALLOW);
    registers.set(r::NFL_EN, 0)?;
    registers.set(r::NFL_EVT_THRESH, r::NFL_EVT_THRESH.of(thresholds))?;
    registers.set(
        r::NFL_PERIOD_CNT_THRESH,
        r::NFL_PERIOD_CNT_THRESH.of(thresholds),
    )?;
    registers.set(r::NFL_EN, enabled)
}

/// Holds the pixels in reset and stops the time base. Transfers must be cancelled before.
///
/// # Errors
/// [`Evk1Error::Usb`], [`Evk1Error::ReadBack`].
pub fn stop(registers: &mut Registers<'_>) -> Result<(), Evk1Error> {
    let mut done = FirstError::default();
    done.after(registers.set(r::ROI_TD_RSTN, 0));
    done.after(registers.set(r::STEREO_MERGE_ENABLE, 0));
    done.outcome()
}

/// Longest wait for bytes that may not exist.
const READ_LIMIT: Duration = Duration::from_millis(100);

/// Longest time for emptying the buffers. If the camera still sends its time base, no read ever returns empty,
/// and a limit in bytes would take too long.
const EMPTYING_LIMIT: HostDuration = HostDuration::from_millis(2000);

fn read_events(registers: &mut Registers<'_>, buffer: &mut [u8]) -> Result<usize, Evk1Error> {
    let read = registers.transport().read_events(buffer, READ_LIMIT);
    read.map_err(|e| e.during("emptying the event endpoint"))
}

/// Empties the buffers between sensor and host after a stop; their data would otherwise precede the next
/// start, with old times. Returns the number of bytes. The public driver does not empty them.
///
/// # Errors
/// [`Evk1Error::Usb`]; [`Evk1Error::StillSending`] if bytes still arrive after 2 s on `clock`, or after more bytes
/// than all buffers contain.
pub(crate) fn clear_left_over(
    registers: &mut Registers<'_>,
    clock: &dyn Clock,
) -> Result<u64, Evk1Error> {
    const ENOUGH_BYTES: u64 = 16 << 20;
    let end = clock.now() + EMPTYING_LIMIT;
    let mut buffer = vec![0; 128 << 10];
    let mut total = 0;
    loop {
        match read_events(registers, &mut buffer)? {
            0 => return Ok(total),
            n => total += n as u64,
        }
        if total > ENOUGH_BYTES || clock.now() >= end {
            return Err(Evk1Error::StillSending { bytes: total });
        }
    }
}

/// Powers down, and empties the buffers of the camera and the host: up to 8 rounds, until a round without
/// data, 300 000 bytes, or 2 s on `clock`. Later data stay there.
///
/// # Errors
/// [`Evk1Error::Usb`], [`Evk1Error::ReadBack`].
pub fn close(registers: &mut Registers<'_>, clock: &dyn Clock) -> Result<(), Evk1Error> {
    let mut done = FirstError::default();
    done.after(power_down(registers));
    let cleared = registers.transport().clear_halt();
    done.after(cleared.map_err(|e| e.during("clearing the event endpoint")));
    done.after(empty_buffers(registers, clock));
    done.outcome()
}

fn empty_buffers(registers: &mut Registers<'_>, clock: &dyn Clock) -> Result<(), Evk1Error> {
    const ROUNDS: u32 = 8;
    const ENOUGH_BYTES: usize = 300_000;
    let end = clock.now() + EMPTYING_LIMIT;
    let mut total = 0;
    for _ in 0..ROUNDS {
        let before = total;
        registers.write_blind(r::TRIGGERS, 0)?;
        let mut buffer = [0; 1024];
        while total <= ENOUGH_BYTES && clock.now() < end {
            match read_events(registers, &mut buffer)? {
                0 => break,
                n => total += n,
            }
        }
        if total == before || total > ENOUGH_BYTES || clock.now() >= end {
            break;
        }
    }
    Ok(())
}

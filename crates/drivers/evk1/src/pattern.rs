//! The FPGA's pattern generator: events in a known order at a known rate, independent of scene and sensor.
//!
//! Source: OpenEB 3.1.2, `gen31_pattern_generator` and the register map of its bank. One event is possible per clock cycle of 10 ns, and
//! `VALID_RATIO` of 1024 cycles have one. The scan has the geometry of the public pattern checker. That rows beyond the sensor pass only
//! without the field-of-view filter is inferred; none of this was verified on a camera.

use skinrig_device::{PatternScan, TestPattern};

use crate::access::Registers;
use crate::error::{Evk1Error, FirstError};
use crate::registers as r;

/// Columns of the scan.
pub const COLUMNS: u16 = 512;
/// Rows of the scan.
pub const ROWS: u16 = 1024;

/// Event rate when every cycle has an event, events per second.
const EVERY_CYCLE_EV_S: f64 = 100e6;
/// Number of cycles to which `VALID_RATIO` refers.
const CYCLES: f64 = 1024.0;
/// `LENGTH` of both periods, as in the public driver. They are equal, so the value does not matter.
const LENGTH: u32 = 30_720;

/// `VALID_RATIO` for the rate nearest to the requested one.
///
/// # Errors
/// [`Evk1Error::Refused`] for an unsupported rate.
fn ratio(pattern: TestPattern) -> Result<u32, Evk1Error> {
    let expected = (pattern.rate_ev_s / EVERY_CYCLE_EV_S * CYCLES).round();
    let most = f64::from(r::pattern_valid_ratio(r::TEST_PATTERN_N_PERIOD).max());
    if (1.0..=most).contains(&expected) {
        return Ok(expected as u32);
    }
    Err(Evk1Error::refused(
        "a pattern of 97656 to 99902344 events/s",
        format!("{} events/s", pattern.rate_ev_s),
    ))
}

/// Configures the generator and switches it on. The camera must be stopped.
///
/// # Errors
/// [`Evk1Error::Refused`] before anything is written; [`Evk1Error::Usb`], [`Evk1Error::ReadBack`].
pub fn on(registers: &mut Registers<'_>, pattern: TestPattern) -> Result<PatternScan, Evk1Error> {
    let ratio = ratio(pattern)?;
    registers.set(r::PATTERN_ENABLE, 0)?;
    registers.set(r::ENABLE_OUT_OF_FOV, 0)?;
    for period in [r::TEST_PATTERN_N_PERIOD, r::TEST_PATTERN_P_PERIOD] {
        registers.set(r::pattern_length(period), LENGTH)?;
        registers.set(r::pattern_valid_ratio(period), ratio)?;
    }
    registers.set(r::PATTERN_TYPE, 0)?;
    registers.set(r::PATTERN_PIXEL_TYPE, 0)?;
    registers.set(r::PATTERN_PIXEL_POLARITY, 1)?;
    registers.set(r::PATTERN_ENABLE, 1)?;
    Ok(PatternScan {
        rate_ev_s: f64::from(ratio) / CYCLES * EVERY_CYCLE_EV_S,
        columns: COLUMNS,
        rows: ROWS,
    })
}

/// Switches back to the sensor and restores the field-of-view filter.
///
/// # Errors
/// [`Evk1Error::Usb`], [`Evk1Error::ReadBack`].
pub fn disable(registers: &mut Registers<'_>) -> Result<(), Evk1Error> {
    let mut done = FirstError::default();
    done.after(registers.set(r::PATTERN_ENABLE, 0));
    done.after(registers.set(r::ENABLE_OUT_OF_FOV, 1));
    done.outcome()
}

/// Switches off a generator that an interrupted program may have left on: it is not published whether initialisation does so.
///
/// # Errors
/// [`Evk1Error::Usb`], [`Evk1Error::ReadBack`].
pub fn clear(registers: &mut Registers<'_>) -> Result<(), Evk1Error> {
    match registers.get(r::PATTERN_ENABLE)? {
        0 => Ok(()),
        _ => registers.set(r::PATTERN_ENABLE, 0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_rates_of_the_generator_are_accepted() {
        let of = |rate_ev_s| ratio(TestPattern { rate_ev_s }).ok();
        assert_eq!(of(1e6), Some(10));
        assert_eq!(of(50e6), Some(512));
        assert_eq!(of(97_656.25), Some(1));
        assert_eq!(of(99.9e6), Some(1023));
        for bad in [0.0, 40e3, 100e6, -1e6, f64::NAN, f64::INFINITY] {
            assert_eq!(of(bad), None, "{bad}");
        }
    }
}

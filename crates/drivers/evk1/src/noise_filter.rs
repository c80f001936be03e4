//! The sensor's noise filter, which drops all events while the sensor's total rate is below a threshold.

use skinrig_device::NoiseFilter;

use crate::access::Registers;
use crate::error::Evk1Error;
use crate::registers::{NFL_EN, NFL_EVT_THRESH, NFL_PERIOD_CNT_THRESH, NFL_THRESH};

/// Thresholds that the filter accepts, events per second (OpenEB 3.1.2, `gen31_event_rate_noise_filter_module`).
pub(crate) const RATES_EV_S: std::ops::RangeInclusive<u32> = 10_000..=10_000_000;
/// Counting period, µs.
const PERIOD_US: u32 = 1023;

/// Threshold in events per period, and period in µs; the device's values without a filter.
fn thresholds(filter: Option<NoiseFilter>) -> (u32, u32) {
    match filter {
        Some(f) => {
            let events = u64::from(f.min_rate_ev_s) * u64::from(PERIOD_US);
            ((events as f64 / 1e6).round() as u32, PERIOD_US)
        }
        None => (
            NFL_EVT_THRESH.of(NFL_THRESH.default),
            NFL_PERIOD_CNT_THRESH.of(NFL_THRESH.default),
        ),
    }
}

/// Checks the threshold.
///
/// # Errors
/// [`Evk1Error::Refused`].
pub fn check(filter: Option<NoiseFilter>) -> Result<(), Evk1Error> {
    match filter {
        Some(f) if !RATES_EV_S.contains(&f.min_rate_ev_s) => Err(Evk1Error::refused(
            "a noise filter threshold of 10000 to 10000000 events/s",
            f.min_rate_ev_s.to_string(),
        )),
        _ => Ok(()),
    }
}

/// Writes the filter.
///
/// # Errors
/// [`Evk1Error::Usb`], [`Evk1Error::ReadBack`].
pub fn write(registers: &mut Registers<'_>, filter: Option<NoiseFilter>) -> Result<(), Evk1Error> {
    let (events, period_us) = thresholds(filter);
    registers.set(NFL_PERIOD_CNT_THRESH, period_us)?;
    registers.set(NFL_EVT_THRESH, events)?;
    registers.set(NFL_EN, filter.is_some().into())
}

/// Describes a setting.
#[must_use]
pub fn describe(filter: Option<NoiseFilter>) -> String {
    let (events, period_us) = thresholds(filter);
    describe_filter(filter.is_some(), events, period_us)
}

/// Reads and describes the setting.
///
/// # Errors
/// [`Evk1Error::Usb`].
pub fn read(registers: &mut Registers<'_>) -> Result<String, Evk1Error> {
    let enabled = registers.get(NFL_EN)? == 1;
    let word = registers.read(NFL_THRESH)?;
    Ok(describe_filter(
        enabled,
        NFL_EVT_THRESH.of(word),
        NFL_PERIOD_CNT_THRESH.of(word),
    ))
}

fn describe_filter(enabled: bool, events: u32, period_us: u32) -> String {
    if enabled {
        format!("below {events} events in {period_us} µs")
    } else {
        "off".to_owned()
    }
}

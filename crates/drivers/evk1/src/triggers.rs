//! Trigger inputs and the trigger output.

use skinrig_device::SyncMode;

use crate::access::Registers;
use crate::error::Evk1Error;
use crate::registers::{
    EXT_TRIGGERS_ENABLE, OUT_PULSE_PERIOD, OUT_PULSE_WIDTH, SYNC_OUT_IS_TRIGGER, TRIGGER_OUT,
    trigger_input,
};

/// Inputs that exist: 0 main, 6 loop-back of the trigger output, 7 auxiliary (OpenEB 3.1.2,
/// `gen31_trigger_event`).
pub const CHANNELS: [u8; 3] = [MAIN, LOOP_BACK, AUXILIARY];
/// TRIG IN.
pub(crate) const MAIN: u8 = 0;
/// The camera's own trigger output, without a wire.
pub const LOOP_BACK: u8 = 6;
/// The auxiliary input; its line carries the sync clock of a slave.
pub const AUXILIARY: u8 = 7;

/// Checks the channels to enable.
///
/// # Errors
/// [`Evk1Error::Refused`] for a channel that does not exist, or the auxiliary one of a slave.
pub fn check(channels: &[u8], sync: SyncMode) -> Result<(), Evk1Error> {
    if let Some(channel) = channels.iter().find(|c| !CHANNELS.contains(c)) {
        return Err(Evk1Error::refused(
            "trigger channel 0, 6 or 7",
            channel.to_string(),
        ));
    }
    if sync == SyncMode::Slave && channels.contains(&AUXILIARY) {
        return Err(Evk1Error::refused(
            "trigger channel 0 or 6 for a slave, whose sync clock comes on the line of channel 7",
            "channel 7",
        ));
    }
    Ok(())
}

/// Enables `channels` and disables the others.
///
/// # Errors
/// [`Evk1Error::Usb`], [`Evk1Error::ReadBack`].
pub fn write(registers: &mut Registers<'_>, channels: &[u8]) -> Result<(), Evk1Error> {
    for channel in CHANNELS {
        registers.set(trigger_input(channel), channels.contains(&channel).into())?;
    }
    Ok(())
}

/// The channels that are enabled, in rising order.
///
/// # Errors
/// [`Evk1Error::Usb`].
pub fn read(registers: &mut Registers<'_>) -> Result<Vec<u8>, Evk1Error> {
    let word = registers.read(EXT_TRIGGERS_ENABLE)?;
    Ok((0..8).filter(|&c| trigger_input(c).of(word) == 1).collect())
}

/// Pulses of the trigger output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TriggerOut {
    /// Period, µs: 2 µs to 1 h.
    pub period_us: u32,
    /// Width, µs: at least 1, less than the period.
    pub width_us: u32,
}

impl TriggerOut {
    /// Checks the ranges in which the output is known to work (README of the public `metavision_driver`).
    ///
    /// # Errors
    /// [`Evk1Error::Refused`].
    pub fn check(self) -> Result<(), Evk1Error> {
        if !(2..=3_600_000_000).contains(&self.period_us) {
            return Err(Evk1Error::refused(
                "a period of the trigger output of 2 µs to 1 h",
                format!("{} µs", self.period_us),
            ));
        }
        if !(1..self.period_us).contains(&self.width_us) {
            return Err(Evk1Error::refused(
                format!("a pulse width of 1 µs to below {} µs", self.period_us),
                format!("{} µs", self.width_us),
            ));
        }
        Ok(())
    }
}

/// Switches the trigger output on, or off.
///
/// # Errors
/// [`Evk1Error::Usb`], [`Evk1Error::ReadBack`].
pub(crate) fn write_out(
    registers: &mut Registers<'_>,
    pulses: Option<TriggerOut>,
) -> Result<(), Evk1Error> {
    if let Some(pulses) = pulses {
        registers.write(OUT_PULSE_PERIOD, pulses.period_us)?;
        registers.write(OUT_PULSE_WIDTH, pulses.width_us)?;
    }
    registers.set(SYNC_OUT_IS_TRIGGER, pulses.is_some().into())?;
    registers.set(TRIGGER_OUT, pulses.is_some().into())
}

/// Whether the trigger output is on.
///
/// # Errors
/// [`Evk1Error::Usb`].
pub(crate) fn read_out(registers: &mut Registers<'_>) -> Result<bool, Evk1Error> {
    Ok(registers.get(TRIGGER_OUT)? == 1)
}

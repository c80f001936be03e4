//! Sync modes: the time base that a camera follows.

use skinrig_device::SyncMode;

use crate::access::Registers;
use crate::error::Evk1Error;
use crate::registers::{ATIS_CONTROL, MASTER_MODE, USE_EXT_START};

/// The name used in settings.
#[must_use]
pub fn name(mode: SyncMode) -> &'static str {
    match mode {
        SyncMode::Standalone => "standalone",
        SyncMode::Master => "master",
        SyncMode::Slave => "slave",
    }
}

/// MASTER_MODE and USE_EXT_START of a mode (OpenEB 3.1.2, `gen31_device_control`).
fn bits(mode: SyncMode) -> (u32, u32) {
    match mode {
        SyncMode::Standalone => (1, 0),
        SyncMode::Master => (1, 1),
        SyncMode::Slave => (0, 1),
    }
}

/// Checks that the output line is free for the sync clock of a master.
///
/// # Errors
/// [`Evk1Error::Refused`].
pub fn check(mode: SyncMode, trigger_out: bool) -> Result<(), Evk1Error> {
    if mode == SyncMode::Master && trigger_out {
        return Err(Evk1Error::refused(
            "a master's trigger output off: its line carries the sync clock",
            "it on",
        ));
    }
    Ok(())
}

/// Sets the mode; only while stopped.
///
/// # Errors
/// [`Evk1Error::Usb`], [`Evk1Error::ReadBack`].
pub fn write(registers: &mut Registers<'_>, mode: SyncMode) -> Result<(), Evk1Error> {
    let (master, external) = bits(mode);
    registers.set(MASTER_MODE, master)?;
    registers.set(USE_EXT_START, external)
}

/// The name of the current mode.
///
/// # Errors
/// [`Evk1Error::Usb`].
pub fn read(registers: &mut Registers<'_>) -> Result<String, Evk1Error> {
    let word = registers.read(ATIS_CONTROL)?;
    let found = (MASTER_MODE.of(word), USE_EXT_START.of(word));
    let known = [SyncMode::Standalone, SyncMode::Master, SyncMode::Slave];
    Ok(known.into_iter().find(|&m| bits(m) == found).map_or_else(
        || format!("MASTER_MODE {}, USE_EXT_START {}", found.0, found.1),
        |mode| name(mode).to_owned(),
    ))
}

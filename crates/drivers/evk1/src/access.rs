//! Register access: fields are changed by read-modify-write, and every write is read back.

use crate::error::{Evk1Error, UsbError};
use crate::registers::{Field, Register};
use crate::requests;
use crate::tolerance::{Mismatches, Tolerance, ToleranceKey};
use crate::usb::Transport;

/// The registers of one camera. Borrows the transport, so that nothing interrupts a read-modify-write.
pub struct Registers<'a> {
    transport: &'a mut dyn Transport,
    exceptions: &'a [u32],
    tolerance: Tolerance,
    mismatches: Mismatches,
}

impl<'a> Registers<'a> {
    /// Registers behind `transport`. Writes to the addresses in `exceptions` need not read back.
    pub fn new(transport: &'a mut dyn Transport, exceptions: &'a [u32]) -> Self {
        Self {
            transport,
            exceptions,
            tolerance: Tolerance::default(),
            mismatches: Mismatches::default(),
        }
    }

    /// Accepts mismatches allowed by `tolerance`; adds mismatches that are only tolerated to `mismatches`.
    #[must_use]
    pub(crate) fn tolerating(self, tolerance: &Tolerance, mismatches: &Mismatches) -> Self {
        Self {
            tolerance: tolerance.clone(),
            mismatches: mismatches.clone(),
            ..self
        }
    }

    /// The transport, for requests other than register access.
    pub(crate) fn transport(&mut self) -> &mut dyn Transport {
        self.transport
    }

    /// Whether a register is known to read back differently.
    #[must_use]
    pub(crate) fn excuses(&self, register: Register) -> bool {
        self.exceptions.contains(&register.address) || self.tolerance.everything
    }

    /// Whether a read with this status byte is valid.
    fn accepts(&self, status: u8) -> bool {
        if status == requests::READ_OK || self.tolerance.read_status.contains(&status) {
            return true;
        }
        if self.tolerance.everything {
            self.mismatches.add(
                ToleranceKey::ReadStatus(status),
                format!("expected status 0x40 of register reads, found {status:#04x}"),
            );
        }
        self.tolerance.everything
    }

    /// Reads a register.
    ///
    /// # Errors
    /// [`Evk1Error::Usb`], [`Evk1Error::Status`].
    pub fn read(&mut self, register: Register) -> Result<u32, Evk1Error> {
        let (value, index) = halves(register.address);
        let doing = || format!("reading {} ({:#06x})", register.name, register.address);
        let mut answer = [0; 8];
        let found = self
            .transport
            .control_in(requests::READ_REGISTER, value, index, &mut answer)
            .map_err(|e| e.during(doing()))?;
        if found != answer.len() {
            let expected = answer.len();
            return Err(UsbError::Short { expected, found }.during(doing()));
        }
        let [status, _, _, _, a, b, c, d] = answer;
        if !self.accepts(status) {
            return Err(Evk1Error::Status {
                name: register.name,
                address: register.address,
                status,
            });
        }
        Ok(u32::from_be_bytes([a, b, c, d]))
    }

    /// Reads a register of a part that may be unpowered: `None` if it does not respond, whatever the status byte.
    ///
    /// # Errors
    /// [`Evk1Error::Usb`].
    pub(crate) fn read_unpowered(&mut self, register: Register) -> Result<Option<u32>, Evk1Error> {
        let tolerance = std::mem::take(&mut self.tolerance);
        let read = self.read(register);
        self.tolerance = tolerance;
        match read {
            Ok(word) => Ok(Some(word)),
            Err(Evk1Error::Status { .. }) => Ok(None),
            Err(e) => Err(e),
        }
    }

    /// Reads a field.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn get(&mut self, field: Field) -> Result<u32, Evk1Error> {
        Ok(field.of(self.read(field.register)?))
    }

    /// Writes a whole register without reading it first, then reads it back.
    ///
    /// # Errors
    /// As [`Self::read`]; [`Evk1Error::ReadBack`] when a stable bit differs.
    pub fn write(&mut self, register: Register, word: u32) -> Result<(), Evk1Error> {
        self.write_blind(register, word)?;
        if register.stable == 0 || self.exceptions.contains(&register.address) {
            return Ok(());
        }
        let found = self.read(register)?;
        if (found ^ word) & register.stable == 0 {
            return Ok(());
        }
        if !self.tolerance.everything {
            return Err(Evk1Error::read_back(register, word, found));
        }
        self.mismatches.add(
            ToleranceKey::ReadBack(register.address),
            format!(
                "expected {word:#010x} in {} after writing, found {found:#010x}",
                register.name
            ),
        );
        Ok(())
    }

    /// Sets a field, keeps the register's other bits, and reads back.
    ///
    /// # Errors
    /// As [`Self::write`].
    pub fn set(&mut self, field: Field, value: u32) -> Result<(), Evk1Error> {
        let word = self.read(field.register)?;
        self.write(field.register, field.put(word, value))
    }

    /// Like [`Self::set`] without reading back, for a part that may be unpowered or without clock. An unreadable register counts as its
    /// nominal default.
    ///
    /// # Errors
    /// [`Evk1Error::Usb`].
    pub(crate) fn set_blind(&mut self, field: Field, value: u32) -> Result<(), Evk1Error> {
        let word = self.read_unpowered(field.register)?;
        let word = word.unwrap_or(field.register.default);
        self.write_blind(field.register, field.put(word, value))
    }

    /// Writes a whole register without reading back.
    ///
    /// # Errors
    /// [`Evk1Error::Usb`].
    pub(crate) fn write_blind(&mut self, register: Register, word: u32) -> Result<(), Evk1Error> {
        let (value, index) = halves(register.address);
        self.transport
            .control_out(requests::WRITE_REGISTER, value, index, &word.to_be_bytes())
            .map_err(|e| {
                e.during(format!(
                    "writing {} ({:#06x})",
                    register.name, register.address
                ))
            })
    }
}

/// The wValue and wIndex of an address.
fn halves(address: u32) -> (u16, u16) {
    (address as u16, (address >> 16) as u16)
}

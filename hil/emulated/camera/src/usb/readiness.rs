//! Makes `poll` work on an emulated device: its file is a FIFO with a capacity of exactly one byte.
//!
//! libusb opens the file for reading and writing and polls it for writing; the kernel reports a device as writable when
//! a transfer has finished. A FIFO that is full is not writable, an empty one is.

use std::fs::{File, OpenOptions};
use std::io::{Read, Write};
use std::path::Path;

use rustix::fs::{CWD, Mode, mkfifoat};
use rustix::pipe::fcntl_setpipe_size;

/// The file of a device.
#[derive(Debug)]
pub(crate) struct Readiness {
    fifo: File,
    full: bool,
}

impl Readiness {
    /// Creates the file in the state without finished transfers.
    pub(crate) fn create(path: &Path) -> std::io::Result<Self> {
        mkfifoat(CWD, path, Mode::from_raw_mode(0o666))?;
        let fifo = OpenOptions::new().read(true).write(true).open(path)?;
        // One page is the smallest; a byte that has not been read occupies all of it.
        fcntl_setpipe_size(&fifo, 4096)?;
        let mut this = Self { fifo, full: false };
        this.set(false);
        Ok(this)
    }

    /// Sets whether there are finished transfers to fetch.
    pub(crate) fn set(&mut self, ready: bool) {
        // Never blocks: a byte is read only when there is one, and written only when there is none.
        let moved = match (ready, self.full) {
            (true, true) => self.fifo.read_exact(&mut [0]),
            (false, false) => self.fifo.write_all(&[0]),
            _ => return,
        };
        if moved.is_ok() {
            self.full = !ready;
        }
    }
}

//! The emulator's end of the connection to one open device: receives requests, reads and writes the
//! process's memory.

use std::io::{self, Read, Write};
use std::os::unix::net::UnixStream;

/// Words of umockdev's protocol (`ioctl_tree.h`); the preload library describes it.
const IOCTL: u64 = 1;
const DONE: u64 = 3;
const READ_MEM: u64 = 5;
const WRITE_MEM: u64 = 6;

/// Upper limit of a transfer, bytes. A larger request is a fault of the process under test.
const LONGEST: usize = 64 << 20;

/// One open device.
pub(crate) struct Wire {
    stream: UnixStream,
    /// Messages to send with the next write.
    held: Vec<u8>,
}

/// An `ioctl` that waits for its result.
#[derive(Debug, Clone, Copy)]
pub(crate) struct IoctlRequest {
    pub request: u64,
    pub argument: u64,
}

fn message(words: [u64; 3]) -> [u8; 24] {
    let mut bytes = [0; 24];
    for (to, word) in bytes.chunks_exact_mut(8).zip(words) {
        to.copy_from_slice(&word.to_ne_bytes());
    }
    bytes
}

impl Wire {
    pub(crate) fn new(stream: UnixStream) -> Self {
        Self {
            stream,
            held: Vec::with_capacity(512),
        }
    }

    /// The next `ioctl`; `None` when the process closed the device. Other calls on it fail.
    pub(crate) fn next(&mut self) -> io::Result<Option<IoctlRequest>> {
        loop {
            let mut bytes = [0; 24];
            match self.stream.read_exact(&mut bytes) {
                Err(e) if e.kind() == io::ErrorKind::UnexpectedEof => return Ok(None),
                other => other?,
            }
            let word = |n: usize| {
                let mut word = [0; 8];
                word.copy_from_slice(&bytes[n * 8..n * 8 + 8]);
                u64::from_ne_bytes(word)
            };
            if word(0) == IOCTL {
                return Ok(Some(IoctlRequest {
                    request: word(1),
                    argument: word(2),
                }));
            }
            self.done(Err(rustix::io::Errno::INVAL))?;
        }
    }

    /// Reads the process's memory.
    pub(crate) fn read_memory(&mut self, address: u64, length: usize) -> io::Result<Vec<u8>> {
        if length > LONGEST {
            return Err(io::Error::other(format!(
                "expected a transfer of at most {LONGEST} bytes, found {length}"
            )));
        }
        self.stream
            .write_all(&message([READ_MEM, address, length as u64]))?;
        let mut bytes = vec![0; length];
        self.stream.read_exact(&mut bytes)?;
        Ok(bytes)
    }

    /// Writes to the process's memory; sent with the result at the latest.
    pub(crate) fn write_memory(&mut self, address: u64, bytes: &[u8]) -> io::Result<()> {
        self.held
            .extend_from_slice(&message([WRITE_MEM, address, bytes.len() as u64]));
        if bytes.len() <= 4096 {
            self.held.extend_from_slice(bytes);
            return Ok(());
        }
        self.stream.write_all(&self.held)?;
        self.held.clear();
        self.stream.write_all(bytes)
    }

    /// Returns the result of the `ioctl`.
    pub(crate) fn done(&mut self, result: Result<(), rustix::io::Errno>) -> io::Result<()> {
        let words = match result {
            Ok(()) => [DONE, 0, 0],
            Err(errno) => [DONE, u64::MAX, errno.raw_os_error() as u64],
        };
        self.held.extend_from_slice(&message(words));
        self.stream.write_all(&self.held)?;
        self.held.clear();
        Ok(())
    }
}

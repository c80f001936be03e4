//! Forwards an `ioctl` to the emulator.
//!
//! A message has three native words. The process sends `[IOCTL, request, argument]`; the emulator then accesses the process's memory like
//! the kernel (`[READ_MEM, address, length]`, `[WRITE_MEM, address, length]` with the bytes), and ends with `[DONE, result, errno]`.

use std::os::fd::{AsRawFd, RawFd};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::time::Duration;

use libc::{c_int, c_void};

const IOCTL: usize = 1;
const DONE: usize = 3;
const READ_MEM: usize = 5;
const WRITE_MEM: usize = 6;

/// Time limit of a reply; the emulator replies at once.
const REPLY_TIMEOUT: Duration = Duration::from_secs(20);

/// The connection to the emulator failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ConnectionLost;

/// Connects to the emulator's socket of one device.
pub fn connect(path: &Path) -> std::io::Result<UnixStream> {
    let stream = UnixStream::connect(path)?;
    stream.set_read_timeout(Some(REPLY_TIMEOUT))?;
    stream.set_write_timeout(Some(REPLY_TIMEOUT))?;
    Ok(stream)
}

/// Result and errno of an `ioctl`.
///
/// # Safety
/// `argument` is that of the `ioctl` caller: the request defines which memory behind it may be accessed. The emulator accesses only that
/// memory, like the kernel.
pub unsafe fn ioctl(
    stream: &UnixStream,
    request: usize,
    argument: *mut c_void,
) -> Result<(c_int, c_int), ConnectionLost> {
    let fd = stream.as_raw_fd();
    let mut message = [IOCTL, request, argument.expose_provenance()];
    let (words, length) = (message.as_mut_ptr().cast::<u8>(), size_of_val(&message));
    // SAFETY: `words` is `length` bytes of `message`, which outlives the call.
    unsafe { send(fd, words, length)? };
    loop {
        // SAFETY: as above; any bytes make a valid array of integers.
        unsafe { receive(fd, words, length)? };
        let [what, a, b] = message;
        match what {
            // The emulator widens a C int to a word.
            DONE => return Ok((a as c_int, b as c_int)),
            // SAFETY: the emulator names memory that the request lets the kernel read (see above).
            READ_MEM => unsafe { send(fd, std::ptr::with_exposed_provenance(a), b)? },
            // SAFETY: the emulator names memory that the request lets the kernel write (see above).
            WRITE_MEM => unsafe { receive(fd, std::ptr::with_exposed_provenance_mut(a), b)? },
            _ => return Err(ConnectionLost),
        }
    }
}

/// # Safety
/// `from` is readable for `left` bytes.
unsafe fn send(fd: RawFd, mut from: *const u8, mut left: usize) -> Result<(), ConnectionLost> {
    while left > 0 {
        // SAFETY: the caller's promise, shrunk by what has been sent.
        let sent = unsafe { libc::send(fd, from.cast(), left, libc::MSG_NOSIGNAL) };
        let done = progress(sent)?;
        // SAFETY: `done <= left`, so this stays within the caller's memory or one past its end.
        from = unsafe { from.add(done) };
        left -= done;
    }
    Ok(())
}

/// # Safety
/// `to` is writable for `left` bytes.
unsafe fn receive(fd: RawFd, mut to: *mut u8, mut left: usize) -> Result<(), ConnectionLost> {
    while left > 0 {
        // SAFETY: the caller's promise, shrunk by what has been received.
        let received = unsafe { libc::recv(fd, to.cast(), left, libc::MSG_WAITALL) };
        let done = progress(received)?;
        if done == 0 && received == 0 {
            return Err(ConnectionLost);
        }
        // SAFETY: `done <= left`, so this stays within the caller's memory or one past its end.
        to = unsafe { to.add(done) };
        left -= done;
    }
    Ok(())
}

/// Bytes transferred by a call; 0 after a signal.
fn progress(result: isize) -> Result<usize, ConnectionLost> {
    match usize::try_from(result) {
        Ok(bytes) => Ok(bytes),
        Err(_) if std::io::Error::last_os_error().kind() == std::io::ErrorKind::Interrupted => {
            Ok(0)
        }
        Err(_) => Err(ConnectionLost),
    }
}

#[cfg(test)]
mod tests {
    use std::io::{Read, Write};
    use std::thread;

    use super::*;

    fn words(message: [usize; 3]) -> Vec<u8> {
        message.iter().flat_map(|w| w.to_ne_bytes()).collect()
    }

    #[test]
    fn an_ioctl_reads_and_writes_the_callers_memory() {
        let (ours, mut theirs) = UnixStream::pair().unwrap();
        let mut memory = *b"question";
        let argument = memory.as_mut_ptr();
        let address = argument.expose_provenance();
        let emulator = thread::spawn(move || {
            let mut requested = [0; 24];
            theirs.read_exact(&mut requested).unwrap();
            assert_eq!(requested[..], words([IOCTL, 7, address]));
            theirs.write_all(&words([READ_MEM, address, 8])).unwrap();
            let mut read = [0; 8];
            theirs.read_exact(&mut read).unwrap();
            assert_eq!(&read, b"question");
            theirs.write_all(&words([WRITE_MEM, address, 6])).unwrap();
            theirs.write_all(b"answer").unwrap();
            theirs.write_all(&words([DONE, usize::MAX, 110])).unwrap();
        });
        // SAFETY: the emulator above names eight bytes of `memory` only.
        let result = unsafe { ioctl(&ours, 7, argument.cast()) };
        emulator.join().unwrap();
        assert_eq!(result, Ok((-1, 110)));
        assert_eq!(&memory, b"answeron");
    }

    #[test]
    fn an_emulator_that_ends_breaks_the_line() {
        let (ours, theirs) = UnixStream::pair().unwrap();
        drop(theirs);
        // SAFETY: no memory is accessed.
        let result = unsafe { ioctl(&ours, 7, std::ptr::null_mut()) };
        assert_eq!(result, Err(ConnectionLost));
    }
}

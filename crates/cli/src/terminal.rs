//! Lines to standard output and standard error, whose readers may go away.
//!
//! `println!` panics when its reader has gone. Here a closed pipe (`skinrig show ... | head`) is no fault, and
//! nothing that happens to the terminal ever stops a run. Any other fault of standard output, a full disk for
//! example, is remembered, so that the program can end with an error.

use std::fmt::Arguments;
use std::io::{ErrorKind, Write};
use std::sync::atomic::{AtomicBool, Ordering};

static OUTPUT_FAILED: AtomicBool = AtomicBool::new(false);

/// Writes to standard output.
pub fn out(text: Arguments<'_>) {
    let mut out = std::io::stdout().lock();
    if let Err(e) = out.write_fmt(text).and_then(|()| out.flush())
        && e.kind() != ErrorKind::BrokenPipe
    {
        OUTPUT_FAILED.store(true, Ordering::Relaxed);
    }
}

/// Writes to standard error; there is nowhere to report a fault of it.
pub fn err(text: Arguments<'_>) {
    let _ = std::io::stderr().lock().write_fmt(text);
}

/// Whether something that was to go to standard output did not, for another reason than a reader that went away.
pub fn output_failed() -> bool {
    OUTPUT_FAILED.load(Ordering::Relaxed)
}

/// A line on standard output.
macro_rules! outln {
    ($($text:tt)*) => {
        $crate::terminal::out(format_args!("{}\n", format_args!($($text)*)))
    };
}

/// A line on standard error.
macro_rules! errln {
    ($($text:tt)*) => {
        $crate::terminal::err(format_args!("{}\n", format_args!($($text)*)))
    };
}

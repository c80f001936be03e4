//! Turns an executable that links this crate into the firmware, before its `main`.

use std::ffi::OsString;
use std::io::Read;
use std::path::Path;

/// Runs in every process that links this crate, before `main`; returns at once unless the variable is set.
extern "C" fn run_firmware_if_requested() {
    if let Some(directory) = std::env::var_os(crate::FIRMWARE_VARIABLE) {
        run_firmware(&directory);
    }
}

/// The linker's list of functions to call at start-up.
#[used]
#[cfg_attr(target_os = "macos", unsafe(link_section = "__DATA,__mod_init_func"))]
#[cfg_attr(not(target_os = "macos"), unsafe(link_section = ".init_array"))]
static AT_START: extern "C" fn() = run_firmware_if_requested;

/// Referenced wherever a firmware is started, so that the linker keeps this file.
pub fn link_entry() -> usize {
    &raw const AT_START as usize
}

fn run_firmware(directory: &OsString) -> ! {
    // The parent holds the other end of standard input, so that no orphan outlives it.
    std::thread::spawn(|| {
        let mut rest = Vec::new();
        let _ = std::io::stdin().read_to_end(&mut rest);
        std::process::exit(0);
    });
    let code = match crate::firmware::run(Path::new(directory), true) {
        Ok(()) => 0,
        Err(_) => 1,
    };
    std::process::exit(code)
}

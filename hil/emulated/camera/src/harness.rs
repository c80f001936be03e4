//! Runs a test again in a process whose USB bus is an emulated one.
//!
//! ```text
//! #[test]
//! fn a_camera_is_found() {
//!     on_bus("a_camera_is_found", vec![Evk1Config::new("00001621").into()], |remote| {
//!         // in this process libusb sees the emulated camera, and `remote` controls it
//!     });
//! }
//! ```
//!
//! The test program needs the preload library next to it: a dev-dependency on `skinrig-usbshim`.

use std::fs::{self, File};
use std::process::Stdio;
use std::thread;
use std::time::{Duration, Instant};

use crate::bus::Bus;
use crate::config::{BusConfig, DeviceConfig};
use crate::control::Remote;
use crate::error::BusError;

/// Time limit of a test.
const TIMEOUT: Duration = Duration::from_secs(180);

/// Written by the process that runs a test's body, so that a misspelt name fails.
const RAN: &str = "ran";

/// Runs `body` on a bus with these devices. `test` is the full name of the calling test, as cargo prints it.
///
/// # Panics
/// When the body panics or does not end within three minutes.
pub fn on_bus(test: &str, devices: Vec<DeviceConfig>, body: impl FnOnce(&Remote)) {
    let remote = Remote::from_environment();
    if let Some(remote) = remote.expect("the emulator that started this process must listen") {
        fs::write(remote.root().join(RAN), "").expect("the folder of the bus takes a file");
        body(&remote);
        return;
    }
    let bus = Bus::start(&BusConfig { devices }).expect("an emulated bus");
    let output = in_child(&bus, test).expect("the test's own process");
    assert!(
        bus.root().join(RAN).exists(),
        "there is no test named `{test}`:\n{output}"
    );
}

/// Runs the test with this name under the preload library; returns its output.
fn in_child(bus: &Bus, test: &str) -> Result<String, BusError> {
    let log = bus.root().join("log");
    let file = File::create(&log)?;
    let mut child = bus
        .command(std::env::current_exe()?)?
        .args([test, "--exact", "--nocapture", "--include-ignored"])
        .stdin(Stdio::null())
        .stdout(file.try_clone()?)
        .stderr(file)
        .spawn()?;
    let deadline = Instant::now() + TIMEOUT;
    let status = loop {
        if let Some(status) = child.try_wait()? {
            break Some(status);
        }
        if Instant::now() > deadline {
            child.kill()?;
            child.wait()?;
            break None;
        }
        thread::sleep(Duration::from_millis(5));
    };
    let output = fs::read_to_string(&log)?;
    match status {
        Some(status) if status.success() => Ok(output),
        Some(status) => panic!("on the emulated bus: {status}\n{output}"),
        None => {
            panic!("on the emulated bus: expected the test to end within {TIMEOUT:?}\n{output}")
        }
    }
}

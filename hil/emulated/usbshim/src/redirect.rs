//! Redirection of paths to the emulated bus.

use std::ffi::{CStr, CString, OsStr};
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// Environment variable with the folder of the emulated bus.
const ROOT: &str = "UMOCKDEV_DIR";

const DEVICES: &[u8] = b"/dev/bus/usb";
const EMULATED: [&[u8]; 3] = [DEVICES, b"/sys/bus/usb", b"/sys/devices"];

/// The folder of the emulated bus; `None` in a process without one.
pub fn root() -> Option<&'static Path> {
    static FOLDER: OnceLock<Option<PathBuf>> = OnceLock::new();
    FOLDER
        .get_or_init(|| std::env::var_os(ROOT).map(PathBuf::from))
        .as_deref()
}

/// Redirected path; `None` if `path` does not belong to the bus.
pub(crate) fn redirected(root: &Path, path: &CStr) -> Option<CString> {
    let emulated = EMULATED.iter().any(|p| begins_with(path.to_bytes(), p));
    emulated
        .then(|| below(root, b"", path.to_bytes()))
        .and_then(|p| CString::new(p.into_os_string().into_encoded_bytes()).ok())
}

/// Whether `path` is a device file (and not a folder).
pub(crate) fn is_device(path: &CStr) -> bool {
    let path = path.to_bytes();
    begins_with(path, DEVICES) && path.len() > DEVICES.len() + 4
}

/// The emulator's socket for a device.
pub fn socket(root: &Path, device: &CStr) -> PathBuf {
    below(root, b"/ioctl", device.to_bytes())
}

/// Error number of opening a device that must not be opened.
pub fn refusal(root: &Path, device: &CStr) -> Option<i32> {
    let text = std::fs::read_to_string(below(root, b"/refuse", device.to_bytes())).ok()?;
    text.trim().parse().ok()
}

/// Whether `path` is `folder` or below it.
fn begins_with(path: &[u8], folder: &[u8]) -> bool {
    path.strip_prefix(folder)
        .is_some_and(|rest| rest.is_empty() || rest[0] == b'/')
}

fn below(root: &Path, middle: &[u8], path: &[u8]) -> PathBuf {
    let joined = [root.as_os_str().as_bytes(), middle, path].concat();
    PathBuf::from(OsStr::from_bytes(&joined))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_paths_of_the_bus_are_redirected() {
        let to = |path: &CStr| redirected(Path::new("/tmp/usb1"), path);
        for (path, expected) in [
            (
                c"/dev/bus/usb/001/002",
                Some(c"/tmp/usb1/dev/bus/usb/001/002"),
            ),
            (
                c"/sys/bus/usb/devices",
                Some(c"/tmp/usb1/sys/bus/usb/devices"),
            ),
            (
                c"/sys/devices/pci0/usb1/1-1/descriptors",
                Some(c"/tmp/usb1/sys/devices/pci0/usb1/1-1/descriptors"),
            ),
            (c"/dev/bus/usb", Some(c"/tmp/usb1/dev/bus/usb")),
            (c"/dev/bus/usbmon", None),
            (c"/dev/null", None),
            (c"relative/dev/bus/usb", None),
            (c"", None),
        ] {
            assert_eq!(to(path).as_deref(), expected, "{path:?}");
        }
    }

    #[test]
    fn a_device_is_a_file_and_has_a_socket() {
        assert!(is_device(c"/dev/bus/usb/001/002"));
        assert!(!is_device(c"/dev/bus/usb/001"));
        assert!(!is_device(c"/sys/bus/usb/devices/1-1/busnum"));
        assert_eq!(
            socket(Path::new("/t"), c"/dev/bus/usb/001/002"),
            Path::new("/t/ioctl/dev/bus/usb/001/002")
        );
    }
}

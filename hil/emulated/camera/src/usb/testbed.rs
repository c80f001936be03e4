//! The folder that replaces a computer's `/sys` and `/dev` for a process under test.

use std::fs;
use std::io;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};

use super::descriptors::Descriptors;

const HUB: &str = "devices/pci0000:00/0000:00:14.0/usb1";

/// Maximum length of a Unix socket path on Linux, without the terminator.
const SOCKET_PATH: usize = 107;

/// The folder; removed on drop.
#[derive(Debug)]
pub(crate) struct TestBed(tempfile::TempDir);

/// Address of a device.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Address {
    /// Port of the only hub, from 1; depends on where the device is plugged in.
    pub port: u8,
    /// Device number on the bus, from 2; new after every plugging.
    pub number: u8,
}

impl Address {
    fn node(self) -> String {
        format!("dev/bus/usb/001/{:03}", self.number)
    }
}

impl TestBed {
    /// A folder without devices.
    pub(crate) fn create() -> io::Result<Self> {
        let folder = tempfile::Builder::new().prefix("usb").tempdir()?;
        let root = folder.path();
        if root.join("ioctl/dev/bus/usb/001/002").as_os_str().len() > SOCKET_PATH {
            return Err(io::Error::other(format!(
                "expected a short path for temporary files (Unix sockets end at {SOCKET_PATH} bytes), found {}: set TMPDIR=/tmp",
                root.display()
            )));
        }
        for sub in [
            "sys/bus/usb/devices",
            "sys/dev/char",
            "sys/class",
            "sys/block",
            "dev/bus/usb/001",
            "dev/.node",
            "ioctl/dev/bus/usb/001",
            "refuse/dev/bus/usb/001",
        ] {
            fs::create_dir_all(root.join(sub))?;
        }
        fs::create_dir_all(root.join("sys").join(HUB))?;
        Ok(Self(folder))
    }

    pub(crate) fn root(&self) -> &Path {
        self.0.path()
    }

    /// The device file.
    pub(crate) fn node(&self, at: Address) -> PathBuf {
        self.root().join(at.node())
    }

    /// The socket for its system calls.
    pub(crate) fn socket(&self, at: Address) -> PathBuf {
        self.root().join("ioctl").join(at.node())
    }

    /// Makes opening the device fail with this error.
    pub(crate) fn refuse(&self, at: Address, errno: rustix::io::Errno) -> io::Result<()> {
        let file = self.root().join("refuse").join(at.node());
        fs::write(file, errno.raw_os_error().to_string())
    }

    /// Lists a device.
    pub(crate) fn add(&self, at: Address, descriptors: &Descriptors) -> io::Result<()> {
        let sys = self.root().join("sys");
        let Address { port, number } = at;
        let place = format!("{HUB}/1-{port}");
        let device = sys.join(&place);
        fs::create_dir_all(&device)?;
        let mut all = descriptors.device().to_vec();
        all.extend(descriptors.configuration());
        fs::write(device.join("descriptors"), all)?;
        let minor = number - 1;
        let (vendor, product) = (descriptors.vendor, descriptors.product);
        for (name, value) in [
            ("busnum", "1".to_owned()),
            ("devnum", number.to_string()),
            ("devpath", port.to_string()),
            ("speed", descriptors.speed_mbit.to_string()),
            ("bConfigurationValue", "1".to_owned()),
            ("bNumConfigurations", "1".to_owned()),
            ("idVendor", format!("{vendor:04x}")),
            ("idProduct", format!("{product:04x}")),
            ("dev", format!("189:{minor}")),
            (
                "uevent",
                format!(
                    "MAJOR=189\nMINOR={minor}\nDEVNAME=bus/usb/001/{number:03}\nDEVTYPE=usb_device\n\
                     BUSNUM=001\nDEVNUM={number:03}\nPRODUCT={vendor:x}/{product:x}/0"
                ),
            ),
        ] {
            fs::write(device.join(name), format!("{value}\n"))?;
        }
        for (name, text) in ["manufacturer", "product", "serial"]
            .into_iter()
            .zip(&descriptors.strings)
        {
            if let Some(text) = text {
                fs::write(device.join(name), format!("{text}\n"))?;
            }
        }
        symlink("../../../../../bus/usb", device.join("subsystem"))?;
        symlink(
            format!("../../{place}"),
            sys.join(format!("dev/char/189:{minor}")),
        )?;
        // umockdev's preload library finds the device's numbers here.
        symlink(
            format!("189:{minor}"),
            self.root()
                .join(format!("dev/.node/bus_usb_001_{number:03}")),
        )?;
        // Last: this makes it visible.
        symlink(
            format!("../../../{place}"),
            sys.join(format!("bus/usb/devices/1-{port}")),
        )
    }

    /// Removes a device from the list. Its file remains for processes that have it open.
    pub(crate) fn remove(&self, at: Address) -> io::Result<()> {
        let sys = self.root().join("sys");
        fs::remove_file(sys.join(format!("bus/usb/devices/1-{}", at.port)))?;
        fs::remove_file(sys.join(format!("dev/char/189:{}", at.number - 1)))?;
        fs::remove_dir_all(sys.join(format!("{HUB}/1-{}", at.port)))?;
        fs::remove_file(self.socket(at))
    }
}

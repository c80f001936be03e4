//! A preload library that redirects a process's USB system calls to an emulated bus.
//!
//! ```text
//! LD_PRELOAD=libusbshim.so UMOCKDEV_DIR=FOLDER program
//! ```
//!
//! libusb uses files to reach the kernel: it reads descriptors below `/sys/bus/usb` and `/sys/devices`, opens `/dev/bus/usb/BBB/DDD`, and
//! performs every transfer with `ioctl`. In a process started as above, these paths are redirected to the folder `UMOCKDEV_DIR`, and an
//! `ioctl` on an emulated device becomes a message on the Unix socket `UMOCKDEV_DIR/ioctl/dev/bus/usb/BBB/DDD`. All other calls reach the
//! C library unchanged, as do all calls without `UMOCKDEV_DIR`. The program and its libusb are those of production.
//!
//! Variable, folder and messages are those of umockdev's preload library (its `ioctl_tree.h` and `libumockdev-preload.c`), which can
//! therefore replace this one. This library needs no installation, supports several devices at a time and transfers more than a gigabyte
//! per second. One extension: for a device that must not be opened, the file `UMOCKDEV_DIR/refuse/dev/bus/usb/BBB/DDD` contains the error
//! number of `open`.
//!
//! Requires Linux with the GNU C library on x86_64 or aarch64, where a C-variadic function can be defined with a fixed third argument;
//! elsewhere the library is empty. libusb must be built without libudev, which makes other calls. Dependents never `use` this crate: a
//! dev-dependency makes Cargo build the library.

#[cfg(all(
    target_os = "linux",
    target_env = "gnu",
    any(target_arch = "x86_64", target_arch = "aarch64")
))]
#[expect(unsafe_code, reason = "stands in for functions of the C library")]
mod interpose;
#[cfg(all(
    target_os = "linux",
    target_env = "gnu",
    any(target_arch = "x86_64", target_arch = "aarch64")
))]
mod redirect;
#[cfg(all(
    target_os = "linux",
    target_env = "gnu",
    any(target_arch = "x86_64", target_arch = "aarch64")
))]
#[expect(unsafe_code, reason = "reads and writes the memory behind an ioctl")]
mod wire;

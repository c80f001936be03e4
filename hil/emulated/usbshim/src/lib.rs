//! A preload library that sends a process's USB system calls to an emulated bus.
//!
//! ```text
//! LD_PRELOAD=libusbshim.so UMOCKDEV_DIR=FOLDER program
//! ```
//!
//! libusb reaches the kernel through files: it reads descriptors below `/sys/bus/usb` and `/sys/devices`, opens
//! `/dev/bus/usb/BBB/DDD`, and sends every transfer as an `ioctl` on it. In a process that was started as above these
//! paths lead into the folder `UMOCKDEV_DIR`, and an `ioctl` on an emulated device goes to the emulator as a message
//! on the Unix socket `UMOCKDEV_DIR/ioctl/dev/bus/usb/BBB/DDD`. Everything else reaches the C library untouched, and
//! without `UMOCKDEV_DIR` everything does. The program itself, and the libusb in it, are those of production.
//!
//! Variable, folder and messages are those of umockdev's preload library (its `ioctl_tree.h` and
//! `libumockdev-preload.c`), which can therefore take this one's place. This one needs nothing installed, serves several
//! devices at a time and carries more than a gigabyte per second. One thing is its own: a device that must not
//! be opened has a file `UMOCKDEV_DIR/refuse/dev/bus/usb/BBB/DDD` with the error number that `open` gives.
//!
//! Linux with the GNU C library on x86_64 and aarch64, where a C-variadic function can be defined with a fixed
//! third argument; elsewhere the library is empty. libusb must be built without libudev, which uses further calls.
//! A dependent never `use`s this crate: a dev-dependency on it is what makes cargo build the library.

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

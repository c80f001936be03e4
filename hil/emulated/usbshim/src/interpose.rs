//! Interposed functions of the C library: same behaviour as the originals, but redirected to the emulated bus where needed.

use std::ffi::CStr;
use std::os::unix::net::UnixStream;
use std::sync::{Mutex, OnceLock, PoisonError};

use libc::{DIR, Ioctl, c_char, c_int, c_uint, c_void};

use crate::{redirect, wire};

type Open = unsafe extern "C" fn(*const c_char, c_int, c_uint) -> c_int;
type OpenAt = unsafe extern "C" fn(c_int, *const c_char, c_int, c_uint) -> c_int;
type OpenDir = unsafe extern "C" fn(*const c_char) -> *mut DIR;
type Close = unsafe extern "C" fn(c_int) -> c_int;
type IoctlFn = unsafe extern "C" fn(c_int, Ioctl, *mut c_void) -> c_int;

/// The original of an interposed function, from the next library.
macro_rules! original {
    ($kind:ty, $name:literal) => {{
        static ADDRESS: OnceLock<usize> = OnceLock::new();
        let address = *ADDRESS.get_or_init(|| {
            // SAFETY: RTLD_NEXT and a C string; the C library has all functions that are looked up here.
            unsafe { libc::dlsym(libc::RTLD_NEXT, $name.as_ptr()) }.expose_provenance()
        });
        assert!(address != 0, "the C library has no {:?}", $name);
        // SAFETY: the address is that of the C library's function of this name, and `$kind` is its type.
        unsafe {
            std::mem::transmute::<*const c_void, $kind>(std::ptr::with_exposed_provenance(address))
        }
    }};
}

/// Connection to the emulator of each open emulated device, by file descriptor.
///
/// Locked during an `ioctl`, as the kernel locks a device.
static LINES: [Mutex<Option<UnixStream>>; 4096] = [const { Mutex::new(None) }; 4096];

fn line(fd: c_int) -> Option<&'static Mutex<Option<UnixStream>>> {
    usize::try_from(fd).ok().and_then(|n| LINES.get(n))
}

fn replace_line(fd: c_int, with: Option<UnixStream>) -> bool {
    let Some(slot) = line(fd) else { return false };
    let before = std::mem::replace(
        &mut *slot.lock().unwrap_or_else(PoisonError::into_inner),
        with,
    );
    // Closing it calls `close` below, which needs the slot unlocked.
    drop(before);
    true
}

fn fail(errno: c_int) -> c_int {
    // SAFETY: the address of this thread's errno is always valid.
    unsafe { *libc::__errno_location() = errno };
    -1
}

/// Opens `path` with `open`, redirected if it belongs to the bus.
fn open_with(path: &CStr, open: impl Fn(&CStr) -> c_int) -> c_int {
    let Some((root, there)) =
        redirect::root().and_then(|r| Some((r, redirect::redirected(r, path)?)))
    else {
        return open(path);
    };
    if !redirect::is_device(path) {
        return open(&there);
    }
    if let Some(errno) = redirect::refusal(root, path) {
        return fail(errno);
    }
    let fd = open(&there);
    if fd < 0 {
        return fd;
    }
    let connected = wire::connect(&redirect::socket(root, path));
    if connected.is_ok_and(|stream| replace_line(fd, Some(stream))) {
        return fd;
    }
    let original = original!(Close, c"close");
    // SAFETY: `fd` was opened above and is not used elsewhere.
    unsafe { original(fd) };
    fail(libc::ENODEV)
}

macro_rules! interpose_open {
    ($($name:ident = $original:literal),*) => {$(
        /// # Safety
        /// As for the C function of this name.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name(path: *const c_char, flags: c_int, mode: c_uint) -> c_int {
            // SAFETY: a caller of `open` passes a C string.
            let path = unsafe { CStr::from_ptr(path) };
            open_with(path, |path| {
                let original = original!(Open, $original);
                // SAFETY: a C string and the caller's own flags and mode, which is ignored unless they ask for it.
                unsafe { original(path.as_ptr(), flags, mode) }
            })
        }
    )*};
}

macro_rules! interpose_openat {
    ($($name:ident = $original:literal),*) => {$(
        /// # Safety
        /// As for the C function of this name.
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name(
            folder: c_int,
            path: *const c_char,
            flags: c_int,
            mode: c_uint,
        ) -> c_int {
            // SAFETY: a caller of `openat` passes a C string.
            let path = unsafe { CStr::from_ptr(path) };
            open_with(path, |path| {
                let original = original!(OpenAt, $original);
                // SAFETY: a C string and the caller's own folder, flags and mode.
                unsafe { original(folder, path.as_ptr(), flags, mode) }
            })
        }
    )*};
}

// The names with underscores replace `open` under _FORTIFY_SOURCE; they take no mode.
interpose_open!(
    open = c"open",
    open64 = c"open64",
    __open_2 = c"open",
    __open64_2 = c"open64"
);
interpose_openat!(
    openat = c"openat",
    openat64 = c"openat64",
    __openat_2 = c"openat",
    __openat64_2 = c"openat64"
);

/// # Safety
/// As for the C function of this name.
#[unsafe(no_mangle)]
pub(crate) unsafe extern "C" fn opendir(path: *const c_char) -> *mut DIR {
    // SAFETY: a caller of `opendir` passes a C string.
    let requested = unsafe { CStr::from_ptr(path) };
    let there = redirect::root().and_then(|root| redirect::redirected(root, requested));
    let path = there.as_deref().unwrap_or(requested);
    let original = original!(OpenDir, c"opendir");
    // SAFETY: a C string.
    unsafe { original(path.as_ptr()) }
}

/// # Safety
/// As for the C function of this name.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn close(fd: c_int) -> c_int {
    replace_line(fd, None);
    let original = original!(Close, c"close");
    // SAFETY: the caller's own descriptor.
    unsafe { original(fd) }
}

/// # Safety
/// As for the C function of this name.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn ioctl(fd: c_int, request: Ioctl, argument: *mut c_void) -> c_int {
    let slot = line(fd).map(|slot| slot.lock().unwrap_or_else(PoisonError::into_inner));
    let Some(stream) = slot.as_deref().and_then(Option::as_ref) else {
        drop(slot);
        let original = original!(IoctlFn, c"ioctl");
        // SAFETY: the caller's own descriptor, request and argument.
        return unsafe { original(fd, request, argument) };
    };
    // A request has 32 bits; the caller may have sign-extended it.
    let request = (request & 0xffff_ffff) as usize;
    // SAFETY: `argument` is what the caller passed with this request.
    match unsafe { wire::ioctl(stream, request, argument) } {
        Ok((result, errno)) => {
            fail(errno);
            result
        }
        Err(wire::ConnectionLost) => {
            // The message may be incomplete, so the connection is unusable.
            let _ = stream.shutdown(std::net::Shutdown::Both);
            fail(libc::ENODEV)
        }
    }
}

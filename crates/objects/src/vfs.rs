//! A file system of SQLite whose files are objects, for reading only. Interface: sqlite.org/vfs.html, sqlite.org/c3ref/vfs.html,
//! sqlite.org/c3ref/io_methods.html.
//!
//! Every function gets pointers that SQLite keeps valid for the call; SQLite uses a file in one thread at a time.
#![expect(unsafe_code, reason = "SQLite takes file systems as C functions")]

use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, SystemTime};

use libsqlite3_sys::{
    SQLITE_CANTOPEN, SQLITE_IOCAP_IMMUTABLE, SQLITE_IOERR, SQLITE_IOERR_DELETE, SQLITE_IOERR_READ,
    SQLITE_IOERR_SHORT_READ, SQLITE_NOTFOUND, SQLITE_OK, SQLITE_OPEN_MAIN_DB, SQLITE_OPEN_READONLY,
    SQLITE_READONLY, sqlite3_file, sqlite3_int64, sqlite3_io_methods, sqlite3_vfs,
    sqlite3_vfs_register,
};

use crate::address::ObjectUrl;
use crate::pages::Pages;
use crate::store::Store;

/// Longest address, bytes.
const LONGEST: c_int = 2048;
/// Julian day of the Unix epoch, milliseconds.
const EPOCH_MS: i64 = 210_866_760_000_000;

/// The store behind the file system.
static STORE: OnceLock<Arc<Store>> = OnceLock::new();

/// A file as SQLite allocates it.
#[repr(C)]
struct ObjectFile {
    base: sqlite3_file,
    /// Owned; null before it is opened and after it is closed.
    pages: *mut Pages,
}

static METHODS: sqlite3_io_methods = sqlite3_io_methods {
    iVersion: 1,
    xClose: Some(close),
    xRead: Some(read),
    xWrite: Some(write),
    xTruncate: Some(truncate),
    xSync: Some(sync),
    xFileSize: Some(file_size),
    xLock: Some(lock),
    xUnlock: Some(lock),
    xCheckReservedLock: Some(check_reserved_lock),
    xFileControl: Some(file_control),
    xSectorSize: Some(sector_size),
    xDeviceCharacteristics: Some(characteristics),
    xShmMap: None,
    xShmLock: None,
    xShmBarrier: None,
    xShmUnmap: None,
    xFetch: None,
    xUnfetch: None,
};

/// Registers the file system under `name`, with `store` behind it. Returns false if SQLite refuses, or it is registered already.
pub(crate) fn register(name: &str, store: Arc<Store>) -> bool {
    let Ok(name) = CString::new(name) else {
        return false;
    };

    if STORE.set(store).is_err() {
        return false;
    }
    let vfs = Box::leak(Box::new(sqlite3_vfs {
        iVersion: 2,
        szOsFile: size_of::<ObjectFile>() as c_int,
        mxPathname: LONGEST,
        pNext: std::ptr::null_mut(),
        zName: name.into_raw(),
        pAppData: std::ptr::null_mut(),
        xOpen: Some(open),
        xDelete: Some(delete),
        xAccess: Some(access),
        xFullPathname: Some(full_pathname),
        xDlOpen: None,
        xDlError: None,
        xDlSym: None,
        xDlClose: None,
        xRandomness: Some(randomness),
        xSleep: Some(sleep),
        xCurrentTime: Some(current_time),
        xGetLastError: None,
        xCurrentTimeInt64: Some(current_time_ms),
        xSetSystemCall: None,
        xGetSystemCall: None,
        xNextSystemCall: None,
    }));
    // SAFETY: the structure and its name live as long as the program, and its functions fulfil their contracts below.
    unsafe { sqlite3_vfs_register(vfs, 0) == SQLITE_OK }
}

/// The open object of a file.
///
/// # Safety
/// `file` is one that [`open`] filled.
unsafe fn pages<'a>(file: *mut sqlite3_file) -> Option<&'a mut Pages> {
    // SAFETY: SQLite allocated `szOsFile` bytes, of which `open` made an `ObjectFile`; no other thread uses it now.
    unsafe { (*file.cast::<ObjectFile>()).pages.as_mut() }
}

unsafe extern "C" fn open(
    _: *mut sqlite3_vfs,
    name: *const c_char,
    file: *mut sqlite3_file,
    flags: c_int,
    out_flags: *mut c_int,
) -> c_int {
    // SAFETY: SQLite allocated `szOsFile` bytes for the file. Without methods it does not call `close` for it.
    unsafe {
        file.cast::<ObjectFile>().write(ObjectFile {
            base: sqlite3_file {
                pMethods: std::ptr::null(),
            },
            pages: std::ptr::null_mut(),
        });
    }
    if name.is_null() || flags & SQLITE_OPEN_MAIN_DB == 0 {
        return SQLITE_CANTOPEN;
    }
    // SAFETY: a name that is not null ends with a zero.
    let name = unsafe { CStr::from_ptr(name) };
    let url = name
        .to_str()
        .ok()
        .and_then(|name| ObjectUrl::parse(name).ok());
    let Some((url, store)) = url.zip(STORE.get()) else {
        return SQLITE_CANTOPEN;
    };
    match Pages::open(store.clone(), url.clone()) {
        Ok(pages) => {
            // SAFETY: as above; `out_flags` is null or valid.
            unsafe {
                file.cast::<ObjectFile>().write(ObjectFile {
                    base: sqlite3_file {
                        pMethods: &raw const METHODS,
                    },
                    pages: Box::into_raw(Box::new(pages)),
                });
                if let Some(out) = out_flags.as_mut() {
                    *out = SQLITE_OPEN_READONLY | SQLITE_OPEN_MAIN_DB;
                }
            }
            SQLITE_OK
        }
        Err(e) => {
            store.keep(&url, e);
            SQLITE_CANTOPEN
        }
    }
}

unsafe extern "C" fn close(file: *mut sqlite3_file) -> c_int {
    // SAFETY: `open` filled the file; what it owns is freed once.
    unsafe {
        let file = file.cast::<ObjectFile>();
        let pages = std::mem::replace(&mut (*file).pages, std::ptr::null_mut());
        if !pages.is_null() {
            drop(Box::from_raw(pages));
        }
    }
    SQLITE_OK
}

unsafe extern "C" fn read(
    file: *mut sqlite3_file,
    to: *mut c_void,
    count: c_int,
    offset: sqlite3_int64,
) -> c_int {
    // SAFETY: `open` filled the file.
    let Some(pages) = (unsafe { pages(file) }) else {
        return SQLITE_IOERR_READ;
    };
    let (Ok(count), Ok(offset)) = (usize::try_from(count), u64::try_from(offset)) else {
        return SQLITE_IOERR_READ;
    };
    // SAFETY: SQLite gives `count` bytes; they are written before they are read as a slice of initialized bytes.
    let out = unsafe {
        to.cast::<u8>().write_bytes(0, count);
        std::slice::from_raw_parts_mut(to.cast::<u8>(), count)
    };
    match pages.read(offset, out) {
        Ok(read) if read == count => SQLITE_OK,
        // The rest stays zero, as SQLite demands.
        Ok(_) => SQLITE_IOERR_SHORT_READ,
        Err(e) => {
            pages.store().keep(pages.url(), e);
            SQLITE_IOERR_READ
        }
    }
}

unsafe extern "C" fn write(
    _: *mut sqlite3_file,
    _: *const c_void,
    _: c_int,
    _: sqlite3_int64,
) -> c_int {
    SQLITE_READONLY
}

unsafe extern "C" fn truncate(_: *mut sqlite3_file, _: sqlite3_int64) -> c_int {
    SQLITE_READONLY
}

unsafe extern "C" fn sync(_: *mut sqlite3_file, _: c_int) -> c_int {
    SQLITE_OK
}

unsafe extern "C" fn file_size(file: *mut sqlite3_file, out: *mut sqlite3_int64) -> c_int {
    // SAFETY: `open` filled the file; `out` is valid.
    let (pages, out) = unsafe { (pages(file), out.as_mut()) };
    match (pages.map(|p| sqlite3_int64::try_from(p.bytes)), out) {
        (Some(Ok(bytes)), Some(out)) => {
            *out = bytes;
            SQLITE_OK
        }
        _ => SQLITE_IOERR,
    }
}

/// An object never changes: nobody has to be locked out.
unsafe extern "C" fn lock(_: *mut sqlite3_file, _: c_int) -> c_int {
    SQLITE_OK
}

unsafe extern "C" fn check_reserved_lock(_: *mut sqlite3_file, out: *mut c_int) -> c_int {
    // SAFETY: `out` is valid.
    unsafe { *out = 0 };
    SQLITE_OK
}

unsafe extern "C" fn file_control(_: *mut sqlite3_file, _: c_int, _: *mut c_void) -> c_int {
    SQLITE_NOTFOUND
}

unsafe extern "C" fn sector_size(_: *mut sqlite3_file) -> c_int {
    4096
}

unsafe extern "C" fn characteristics(_: *mut sqlite3_file) -> c_int {
    SQLITE_IOCAP_IMMUTABLE
}

unsafe extern "C" fn delete(_: *mut sqlite3_vfs, _: *const c_char, _: c_int) -> c_int {
    SQLITE_IOERR_DELETE
}

/// There are no journals beside an object.
unsafe extern "C" fn access(
    _: *mut sqlite3_vfs,
    _: *const c_char,
    _: c_int,
    out: *mut c_int,
) -> c_int {
    // SAFETY: `out` is valid.
    unsafe { *out = 0 };
    SQLITE_OK
}

unsafe extern "C" fn full_pathname(
    _: *mut sqlite3_vfs,
    name: *const c_char,
    room: c_int,
    out: *mut c_char,
) -> c_int {
    // SAFETY: the name ends with a zero.
    let name = unsafe { CStr::from_ptr(name) }.to_bytes_with_nul();
    if usize::try_from(room).is_ok_and(|room| name.len() <= room) {
        // SAFETY: `out` has `room` bytes, and is not part of the name.
        unsafe {
            out.cast::<u8>()
                .copy_from_nonoverlapping(name.as_ptr(), name.len())
        };
        return SQLITE_OK;
    }
    SQLITE_CANTOPEN
}

/// Fills the bytes from the clock: readers need no randomness.
unsafe extern "C" fn randomness(_: *mut sqlite3_vfs, count: c_int, out: *mut c_char) -> c_int {
    let bytes = unix_time().as_nanos().to_le_bytes();
    for at in 0..usize::try_from(count).unwrap_or(0) {
        // SAFETY: `out` has `count` bytes.
        unsafe { *out.cast::<u8>().add(at) = bytes[at % bytes.len()] };
    }
    count
}

unsafe extern "C" fn sleep(_: *mut sqlite3_vfs, microseconds: c_int) -> c_int {
    std::thread::sleep(Duration::from_micros(microseconds.max(0) as u64));
    microseconds
}

fn unix_time() -> Duration {
    SystemTime::now()
        .duration_since(SystemTime::UNIX_EPOCH)
        .unwrap_or_default()
}

unsafe extern "C" fn current_time(_: *mut sqlite3_vfs, days: *mut f64) -> c_int {
    // SAFETY: `days` is valid.
    unsafe { *days = (unix_time().as_millis() as f64 + EPOCH_MS as f64) / 86_400_000.0 };
    SQLITE_OK
}

unsafe extern "C" fn current_time_ms(_: *mut sqlite3_vfs, out: *mut sqlite3_int64) -> c_int {
    // SAFETY: `out` is valid.
    unsafe { *out = i64::try_from(unix_time().as_millis()).unwrap_or(0) + EPOCH_MS };
    SQLITE_OK
}

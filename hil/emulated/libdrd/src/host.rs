//! The library in the driving process: connection to the arm, open devices, errors per thread.

use std::cell::Cell;
use std::ffi::{CStr, OsStr};
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};

use skinrig_drd_abi::{DEFAULT_DEVICE, ErrorCode};

use crate::journal::Writer;
use crate::page::{ArmState, Page};
use crate::wire::{Call, Connection, Reply, Request};
use crate::{ARM_VARIABLE, file};

thread_local! {
    static LAST_ERROR: Cell<i32> = const { Cell::new(0) };
}

/// Properties of the arm found at the first call.
#[derive(Debug)]
pub struct Link {
    connection: Mutex<Connection>,
    page: Page,
    /// SDK version to report.
    pub sdk: [i32; 3],
    /// Whether true is returned as a byte other than 1.
    pub odd_bools: bool,
    /// Index of the device with an arm.
    arm: i8,
    open: Mutex<OpenDevices>,
    journal: Option<Writer>,
}

/// Devices opened by this process.
#[derive(Debug, Default)]
struct OpenDevices {
    ids: Vec<i8>,
    default: Option<i8>,
}

static LINK: OnceLock<Link> = OnceLock::new();
static EXPERT: AtomicBool = AtomicBool::new(false);

/// The arm, if there is one. A missing arm is not cached, because it may appear later.
pub fn link() -> Option<&'static Link> {
    static FINDING: Mutex<()> = Mutex::new(());
    let _one_at_a_time = lock(&FINDING);
    match LINK.get() {
        Some(link) => Some(link),
        None => {
            let found = Link::find(&arm_directory()?).ok()?;
            Some(LINK.get_or_init(|| found))
        }
    }
}

/// Directory of the arm: that of this library if it contains a socket, otherwise the one in the environment.
fn arm_directory() -> Option<PathBuf> {
    let beside = own_directory().filter(|d| d.join(file::SOCKET).exists());
    beside.or_else(|| std::env::var_os(ARM_VARIABLE).map(PathBuf::from))
}

fn own_directory() -> Option<PathBuf> {
    // SAFETY: an all-zero `Dl_info` is valid: four pointers and numbers.
    let mut info: libc::Dl_info = unsafe { std::mem::zeroed() };
    let inside = own_directory as fn() -> Option<PathBuf> as *const libc::c_void;
    // SAFETY: an address inside this library and a place that lives through the call.
    if unsafe { libc::dladdr(inside, &raw mut info) } == 0 || info.dli_fname.is_null() {
        return None;
    }
    // SAFETY: dladdr succeeded, so the name is a C string that lives as long as the library.
    let name = unsafe { CStr::from_ptr(info.dli_fname) };
    let path = Path::new(OsStr::from_bytes(name.to_bytes()))
        .canonicalize()
        .ok()?;
    path.parent().map(Path::to_owned)
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Link {
    fn find(directory: &Path) -> std::io::Result<Self> {
        let mut connection = Connection::connect(directory)?;
        let about = connection
            .request(&Request::Hello {
                pid: std::process::id(),
            })?
            .values;
        let &[major, minor, release, arm, odd_bools, journal_reads] = about.as_slice() else {
            return Err(std::io::ErrorKind::InvalidData.into());
        };
        Ok(Self {
            connection: Mutex::new(connection),
            page: Page::open(&directory.join(file::PAGE))?,
            sdk: [major, minor, release].map(integer),
            odd_bools: odd_bools != 0.0,
            arm: i8::try_from(integer(arm)).map_err(std::io::Error::other)?,
            open: Mutex::default(),
            journal: Writer::open(directory, journal_reads != 0.0).ok(),
        })
    }

    fn request(&self, request: &Request) -> Reply {
        // A dead firmware means a disconnected device.
        lock(&self.connection)
            .request(request)
            .unwrap_or_else(|_| Reply::failed(ErrorCode::COM))
    }
}

/// Converts a number that was transferred as `f64`.
#[expect(
    clippy::cast_possible_truncation,
    reason = "small integers; a float cast saturates"
)]
pub fn integer(value: f64) -> i32 {
    value as i32
}

/// Last error of the calling thread.
pub fn last_error() -> i32 {
    LAST_ERROR.get()
}

/// Sets the last error of the calling thread.
pub(crate) fn set_error(code: ErrorCode) {
    LAST_ERROR.set(code.0);
}

/// Enables or disables expert mode.
pub(crate) fn set_expert(on: bool) {
    EXPERT.store(on, Ordering::SeqCst);
}

/// Checks that expert mode is enabled.
pub fn expert() -> Result<(), ErrorCode> {
    if EXPERT.load(Ordering::SeqCst) {
        Ok(())
    } else {
        Err(ErrorCode::EXPERT_MODE_DISABLED)
    }
}

/// Writes a call to the journal.
pub fn journal(began_ns: u64, name: &str, arguments: &[f64], result: f64) {
    if let Some(writer) = link().and_then(|l| l.journal.as_ref()) {
        writer.write(began_ns, name, arguments, result);
    }
}

/// Number of devices: connected, and free.
pub fn count() -> Result<[i32; 2], ErrorCode> {
    let Some(link) = link() else {
        return Ok([0, 0]);
    };
    match checked(link.request(&Request::Count))?.as_slice() {
        &[all, free] => Ok([integer(all), integer(free)]),
        _ => Err(ErrorCode::UNDOCUMENTED),
    }
}

/// Opens a device by index.
pub fn open(id: i8) -> Result<i8, ErrorCode> {
    let link = link().ok_or(ErrorCode::NO_DEVICE_FOUND)?;
    let index = usize::try_from(id).map_err(|_| ErrorCode::INVALID_INDEX)?;
    checked(link.request(&Request::Device {
        index,
        call: Call::Open,
    }))?;
    let mut open = lock(&link.open);
    if !open.ids.contains(&id) {
        open.ids.push(id);
    }
    open.default = Some(id);
    Ok(id)
}

/// Closes a device.
pub fn close(id: i8) -> Result<(), ErrorCode> {
    let (link, id) = device(id)?;
    checked(link.request(&Request::Device {
        index: index(id),
        call: Call::Close,
    }))?;
    let mut open = lock(&link.open);
    open.ids.retain(|i| *i != id);
    if open.default == Some(id) {
        open.default = open.ids.last().copied();
    }
    Ok(())
}

fn index(id: i8) -> usize {
    usize::try_from(id).unwrap_or(usize::MAX)
}

/// The open device with this ID; -1 is the one opened most recently.
fn device(id: i8) -> Result<(&'static Link, i8), ErrorCode> {
    let link = link().ok_or(ErrorCode::NO_DEVICE_FOUND)?;
    let open = lock(&link.open);
    let default = open.default.ok_or(ErrorCode::NO_DEVICE_FOUND)?;
    let id = if id == DEFAULT_DEVICE { default } else { id };
    if open.ids.contains(&id) {
        Ok((link, id))
    } else {
        Err(ErrorCode::INVALID_INDEX)
    }
}

/// Calls the firmware about an open device.
pub fn call(id: i8, call: Call) -> Result<Vec<f64>, ErrorCode> {
    let (link, id) = device(id)?;
    checked(link.request(&Request::Device {
        index: index(id),
        call,
    }))
}

/// State of the arm as reported by the library, read without a message.
pub fn state(id: i8) -> Result<ArmState, ErrorCode> {
    let (link, id) = device(id)?;
    if id != link.arm {
        return Err(ErrorCode::NOT_AVAILABLE);
    }
    let state = link.page.read().ok_or(ErrorCode::COM)?;
    if state.connected && state.held {
        Ok(state)
    } else {
        Err(ErrorCode::COM)
    }
}

fn checked(reply: Reply) -> Result<Vec<f64>, ErrorCode> {
    if reply.rc < 0 {
        Err(ErrorCode(reply.code))
    } else {
        Ok(reply.values)
    }
}

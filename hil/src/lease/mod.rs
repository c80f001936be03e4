//! The lease of a bench: at most one program holds it.
//!
//! A lease is a file named after the robot. The holder keeps an exclusive lock on it, which the kernel releases when the process ends.
//! On one computer the lock alone decides, and no clock is involved. If computers share the folder without sharing locks, the
//! holder's heartbeat decides: it increments a counter in the file, and another program watches the counter for [`LeaseTiming::expiry`].
//! Clocks are never compared.
//!
//! Releasing a lease keeps the file: after a removal two programs could lock two files of the same name.

mod file;
mod owner;

use std::fs::{File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

pub use file::{VARIABLE, folder};
pub use owner::Owner;
use owner::{Entry, VERSION};

/// How often an entry that cannot be read is read, over one heartbeat.
const SETTLE_READS: u32 = 10;

/// Intervals of a lease.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LeaseTiming {
    /// Interval between heartbeats.
    pub heartbeat: Duration,
    /// How long another computer watches for a heartbeat before the lease expires.
    pub expiry: Duration,
    /// A lock that lasts longer than this is a holder's. Programs that only inspect a lease lock it
    /// for less.
    pub lock_wait: Duration,
}

impl Default for LeaseTiming {
    fn default() -> Self {
        Self {
            heartbeat: Duration::from_secs(3),
            expiry: Duration::from_secs(15),
            lock_wait: Duration::from_millis(300),
        }
    }
}

/// Why the lease could not be taken.
#[derive(Debug, thiserror::Error)]
pub enum LeaseError {
    /// Another program holds it.
    #[error(
        "expected a free bench, found it in use by {}; lease {}\n  next: wait until it finishes, or end it ({}); `skinrig hil lease` shows the holder",
        holder(owner.as_deref()), path.display(), how_to_end(owner.as_deref())
    )]
    Held {
        /// The holder; `None` in the moment before it writes its name.
        owner: Option<Box<Owner>>,
        /// The lease file.
        path: PathBuf,
    },
    /// The lease file cannot be used.
    #[error("{}: cannot be used as the bench's lease: {cause}\n  next: make it writable for every user of the bench, or name a folder for leases in {VARIABLE}", path.display())]
    File {
        /// The lease file.
        path: PathBuf,
        /// Error of the operating system.
        cause: io::Error,
    },
}

fn holder(owner: Option<&Owner>) -> String {
    owner.map_or_else(
        || "a program that is just acquiring it".to_owned(),
        |o| o.to_string(),
    )
}

fn how_to_end(owner: Option<&Owner>) -> String {
    owner.map_or_else(
        || "try again".to_owned(),
        |o| format!("on {}: kill {}", o.host, o.pid),
    )
}

/// Path of a robot's lease.
#[must_use]
pub fn path_of(folder: &Path, robot: &str) -> PathBuf {
    folder.join(format!("skinrig-{robot}.lease"))
}

/// A held lease. Dropping it, or the end of the process, releases it.
#[derive(Debug)]
pub struct Lease {
    shared: Arc<Shared>,
    stop: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
    note: Option<String>,
}

#[derive(Debug)]
struct Shared {
    path: PathBuf,
    file: Mutex<(File, Entry)>,
    lost: AtomicBool,
}

impl Lease {
    /// Takes the lease at `path` for `owner`. Returns at once, unless the last holder is on another computer and did not release it:
    /// then this call waits for a heartbeat.
    ///
    /// # Errors
    /// [`LeaseError::Held`] or [`LeaseError::File`].
    pub fn take(path: &Path, owner: Owner, timing: LeaseTiming) -> Result<Self, LeaseError> {
        let file_error = |cause| LeaseError::File {
            path: path.to_owned(),
            cause,
        };
        let mut file = file::open(path).map_err(file_error)?;
        if !lock(&file, timing.lock_wait).map_err(file_error)? {
            let held = file::read(&mut file).ok().flatten();
            return Err(LeaseError::Held {
                owner: held.map(|e| Box::new(e.owner)),
                path: path.to_owned(),
            });
        }
        let previous = settled(&mut file, timing).map_err(file_error)?;
        let previous = previous.filter(|e| !e.released);
        if let Some(entry) = &previous
            && entry.owner.host != owner.host
            && has_heartbeat(&mut file, entry, timing).map_err(file_error)?
        {
            return Err(LeaseError::Held {
                owner: Some(Box::new(entry.owner.clone())),
                path: path.to_owned(),
            });
        }
        let note = previous.map(|e| {
            format!(
                "taken over from {}, which ended without releasing it; its last heartbeat was at {}",
                e.owner, e.beat_at
            )
        });
        let entry = Entry {
            version: VERSION,
            token: format!("{}/{}/{}", owner.host, owner.pid, nonce()),
            owner,
            beats: 0,
            beat_at: now(),
            released: false,
        };
        file::write(&mut file, &entry).map_err(file_error)?;
        if let Some(note) = &note {
            let line = format!("{}: {note}", entry.owner);
            file::log(path, &line).map_err(file_error)?;
        }
        let shared = Arc::new(Shared {
            path: path.to_owned(),
            file: Mutex::new((file, entry)),
            lost: AtomicBool::new(false),
        });
        let (stop, stopped) = channel();
        let thread = Arc::clone(&shared);
        let thread = std::thread::Builder::new()
            .name("lease".to_owned())
            .spawn(move || {
                while stopped.recv_timeout(timing.heartbeat) == Err(RecvTimeoutError::Timeout) {
                    thread.beat();
                }
            })
            .map_err(file_error)?;
        Ok(Self {
            shared,
            stop: Some(stop),
            thread: Some(thread),
            note,
        })
    }

    /// Describes the takeover, if the last holder did not release the lease.
    #[must_use]
    pub fn note(&self) -> Option<&str> {
        self.note.as_deref()
    }

    /// The lease file.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.shared.path
    }

    /// Whether another program took the lease. That is possible only after this computer missed
    /// heartbeats for longer than the expiry.
    #[must_use]
    pub fn is_lost(&self) -> bool {
        self.shared.lost.load(Ordering::SeqCst)
    }

    /// [`is_lost`](Self::is_lost) as a function, for code that does not own the lease.
    pub fn watch(&self) -> impl Fn() -> bool + use<> {
        let shared = Arc::clone(&self.shared);
        move || shared.lost.load(Ordering::SeqCst)
    }
}

impl Drop for Lease {
    fn drop(&mut self) {
        self.stop = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
        if !self.is_lost() {
            let mut held = self.shared.lock_file();
            let (file, entry) = &mut *held;
            entry.released = true;
            entry.beat_at = now();
            // If this fails the next holder reports a takeover: the lock is released anyway.
            let _ = file::write(file, entry);
            // A child process that is just being started still has the file open: closing it here would not release the lock.
            let _ = file.unlock();
        }
    }
}

impl Shared {
    fn lock_file(&self) -> std::sync::MutexGuard<'_, (File, Entry)> {
        self.file.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Increments the counter, unless another program took the lease. The next heartbeat repeats a
    /// failed read or write.
    fn beat(&self) {
        let mut held = self.lock_file();
        let (file, entry) = &mut *held;
        match file::read(file) {
            Ok(Some(there)) if there.token != entry.token => {
                self.lost.store(true, Ordering::SeqCst)
            }
            Ok(_) => {
                entry.beats += 1;
                entry.beat_at = now();
                let _ = file::write(file, entry);
            }
            Err(_) => {}
        }
    }
}

/// Tries to lock the file for `lock_wait`: another program may hold a short lock to inspect it.
fn lock(file: &File, lock_wait: Duration) -> io::Result<bool> {
    let until = Instant::now() + lock_wait;
    loop {
        match file.try_lock() {
            Ok(()) => return Ok(true),
            Err(TryLockError::WouldBlock) if Instant::now() >= until => return Ok(false),
            Err(TryLockError::WouldBlock) => std::thread::sleep(lock_wait / 10),
            Err(TryLockError::Error(e)) => return Err(e),
        }
    }
}

/// Reads the entry. One that cannot be read may be half written by a holder whose lock is invisible here: it is read again.
fn settled(file: &mut File, timing: LeaseTiming) -> io::Result<Option<Entry>> {
    for _ in 0..SETTLE_READS {
        let entry = file::read(file)?;
        if entry.is_some() || file.metadata()?.len() == 0 {
            return Ok(entry);
        }
        std::thread::sleep(timing.heartbeat.min(timing.expiry) / 10);
    }
    Ok(None)
}

/// Whether the holder of `last` still sends heartbeats.
fn has_heartbeat(file: &mut File, last: &Entry, timing: LeaseTiming) -> io::Result<bool> {
    let until = Instant::now() + timing.expiry;
    loop {
        match file::read(file)? {
            Some(now) if now.token == last.token && now.released => return Ok(false),
            Some(now) if now.token != last.token || now.beats != last.beats => return Ok(true),
            _ if Instant::now() >= until => return Ok(false),
            _ => std::thread::sleep(timing.heartbeat.min(timing.expiry) / 10),
        }
    }
}

/// State of a lease.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LeaseState {
    /// Never taken, or released.
    Free {
        /// The last holder.
        last: Option<Box<Owner>>,
    },
    /// In use.
    Held {
        /// The holder; `None` in the moment before it writes its name.
        owner: Option<Box<Owner>>,
        /// Its last heartbeat, by its own clock.
        beat_at: Option<String>,
    },
    /// The last holder ended without releasing it, or is on another computer whose locks are invisible here.
    Abandoned {
        /// The last holder.
        owner: Box<Owner>,
        /// Its last heartbeat, by its own clock.
        beat_at: String,
    },
}

/// Reads the state of the lease at `path` without taking it.
///
/// # Errors
/// Errors of the operating system.
pub fn inspect(path: &Path) -> io::Result<LeaseState> {
    let mut file = match File::open(path) {
        Err(e) if e.kind() == io::ErrorKind::NotFound => {
            return Ok(LeaseState::Free { last: None });
        }
        opened => opened?,
    };
    // A short shared lock fails if a holder has its exclusive lock.
    let held = match file.try_lock_shared() {
        Ok(()) => {
            file.unlock()?;
            false
        }
        Err(TryLockError::WouldBlock) => true,
        Err(TryLockError::Error(e)) => return Err(e),
    };
    let entry = file::read(&mut file)?;
    Ok(match entry {
        Some(e) if held => LeaseState::Held {
            owner: (!e.released).then(|| Box::new(e.owner)),
            beat_at: (!e.released).then_some(e.beat_at),
        },
        None if held => LeaseState::Held {
            owner: None,
            beat_at: None,
        },
        Some(e) if !e.released => LeaseState::Abandoned {
            owner: Box::new(e.owner),
            beat_at: e.beat_at,
        },
        other => LeaseState::Free {
            last: other.map(|e| Box::new(e.owner)),
        },
    })
}

fn now() -> String {
    chrono::Utc::now().to_rfc3339_opts(chrono::SecondsFormat::Millis, true)
}

/// Distinguishes two leases taken by one process.
fn nonce() -> String {
    use std::sync::atomic::AtomicU64;
    static COUNTER: AtomicU64 = AtomicU64::new(0);
    format!("{}-{}", now(), COUNTER.fetch_add(1, Ordering::SeqCst))
}

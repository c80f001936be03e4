//! The lease of a bench: one holder at a time, whoever asks, and from whichever program.
//!
//! A lease is a file named after the robot. Its holder keeps an exclusive lock on it, which the kernel takes away when the
//! process ends, however it ends: on one computer the lock alone decides, and no clock. Where the folder is shared between computers that do not see
//! each other's locks, the holder's heartbeat decides: it counts up in the file, and who asks watches for [`Pace::expiry`]
//! whether it does. Clocks of two computers, or one that was set back, are never compared.
//!
//! The file stays when the lease is released: removing it would let two holders lock two files of one name.

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

/// How fast a lease's heart beats.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pace {
    /// From one beat to the next.
    pub beat: Duration,
    /// Who asks on another computer watches so long for a beat.
    pub expiry: Duration,
    /// A lock that somebody holds for so long is held; shorter is somebody who only looks.
    pub glance: Duration,
}

impl Default for Pace {
    fn default() -> Self {
        Self {
            beat: Duration::from_secs(3),
            expiry: Duration::from_secs(15),
            glance: Duration::from_millis(300),
        }
    }
}

/// Why a bench could not be had.
#[derive(Debug, thiserror::Error)]
pub enum LeaseError {
    /// Somebody has it.
    #[error(
        "expected the bench for ourselves, found it held by {}; lease {}\n  next: wait for its end, or end it ({}); `skinrig hil lease` shows who holds it",
        of(owner.as_deref()), path.display(), how_to_end(owner.as_deref())
    )]
    Held {
        /// Who; `None` in the moment before it wrote its name.
        owner: Option<Box<Owner>>,
        /// The file.
        path: PathBuf,
    },
    /// The file cannot be used.
    #[error("{}: cannot be used as the bench's lease: {cause}\n  next: make it writable for every user of the bench, or name a folder for leases in {VARIABLE}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What the system said.
        cause: io::Error,
    },
}

fn of(owner: Option<&Owner>) -> String {
    owner.map_or_else(
        || "somebody who is just taking it".to_owned(),
        |o| o.to_string(),
    )
}

fn how_to_end(owner: Option<&Owner>) -> String {
    owner.map_or_else(
        || "try again".to_owned(),
        |o| format!("on {}: kill {}", o.host, o.pid),
    )
}

/// The name of a robot's lease.
#[must_use]
pub fn path_of(folder: &Path, robot: &str) -> PathBuf {
    folder.join(format!("skinrig-{robot}.lease"))
}

/// A bench that is ours until this is dropped, or the process ends.
#[derive(Debug)]
pub struct Lease {
    shared: Arc<Shared>,
    stop: Option<Sender<()>>,
    heart: Option<JoinHandle<()>>,
    note: Option<String>,
}

#[derive(Debug)]
struct Shared {
    path: PathBuf,
    file: Mutex<(File, Entry)>,
    lost: AtomicBool,
}

impl Lease {
    /// Takes the lease at `path` for `owner`. Comes back at once, except where the last holder is on another computer and did
    /// not release it: then a heartbeat is waited for.
    ///
    /// # Errors
    /// [`LeaseError`].
    pub fn take(path: &Path, owner: Owner, pace: Pace) -> Result<Self, LeaseError> {
        let wrong = |cause| LeaseError::File {
            path: path.to_owned(),
            cause,
        };
        let mut file = file::open(path).map_err(wrong)?;
        if !lock(&file, pace.glance).map_err(wrong)? {
            let held = file::read(&mut file).ok().flatten();
            return Err(LeaseError::Held {
                owner: held.map(|e| Box::new(e.owner)),
                path: path.to_owned(),
            });
        }
        let left = file::read(&mut file).map_err(wrong)?;
        let left = left.filter(|e| !e.released);
        if let Some(entry) = &left
            && entry.owner.host != owner.host
            && beats(&mut file, entry, pace).map_err(wrong)?
        {
            return Err(LeaseError::Held {
                owner: Some(Box::new(entry.owner.clone())),
                path: path.to_owned(),
            });
        }
        let note = left.map(|e| {
            format!(
                "taken over from {}, which ended without releasing it; its last sign of life was at {}",
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
        file::write(&mut file, &entry).map_err(wrong)?;
        if let Some(note) = &note {
            let line = format!("{}: {note}", entry.owner);
            file::log(path, &line).map_err(wrong)?;
        }
        let shared = Arc::new(Shared {
            path: path.to_owned(),
            file: Mutex::new((file, entry)),
            lost: AtomicBool::new(false),
        });
        let (stop, stopped) = channel();
        let heart = Arc::clone(&shared);
        let thread = std::thread::Builder::new()
            .name("lease".to_owned())
            .spawn(move || {
                while stopped.recv_timeout(pace.beat) == Err(RecvTimeoutError::Timeout) {
                    heart.beat();
                }
            })
            .map_err(wrong)?;
        Ok(Self {
            shared,
            stop: Some(stop),
            heart: Some(thread),
            note,
        })
    }

    /// How it was taken over, when it was.
    #[must_use]
    pub fn note(&self) -> Option<&str> {
        self.note.as_deref()
    }

    /// Its file.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.shared.path
    }

    /// Whether somebody else took it, which can only be after this computer showed no sign of life for long.
    #[must_use]
    pub fn is_lost(&self) -> bool {
        self.shared.lost.load(Ordering::SeqCst)
    }

    /// [`is_lost`](Self::is_lost), for whoever does not hold the lease itself.
    pub fn watch(&self) -> impl Fn() -> bool + use<> {
        let shared = Arc::clone(&self.shared);
        move || shared.lost.load(Ordering::SeqCst)
    }
}

impl Drop for Lease {
    fn drop(&mut self) {
        self.stop = None;
        if let Some(heart) = self.heart.take() {
            let _ = heart.join();
        }
        if !self.is_lost() {
            let mut held = self.shared.held();
            let (file, entry) = &mut *held;
            entry.released = true;
            entry.beat_at = now();
            // Should that fail, the next holder takes it over, for the lock goes with the file.
            let _ = file::write(file, entry);
        }
    }
}

impl Shared {
    fn held(&self) -> std::sync::MutexGuard<'_, (File, Entry)> {
        self.file.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Counts up, unless the file became another's. What cannot be read or written now may be a moment later.
    fn beat(&self) {
        let mut held = self.held();
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

/// Tries to lock the file for as long as somebody may only be looking.
fn lock(file: &File, glance: Duration) -> io::Result<bool> {
    let until = Instant::now() + glance;
    loop {
        match file.try_lock() {
            Ok(()) => return Ok(true),
            Err(TryLockError::WouldBlock) if Instant::now() >= until => return Ok(false),
            Err(TryLockError::WouldBlock) => std::thread::sleep(glance / 10),
            Err(TryLockError::Error(e)) => return Err(e),
        }
    }
}

/// Whether the heart of `last` beats.
fn beats(file: &mut File, last: &Entry, pace: Pace) -> io::Result<bool> {
    let until = Instant::now() + pace.expiry;
    loop {
        match file::read(file)? {
            Some(now) if now.token == last.token && now.released => return Ok(false),
            Some(now) if now.token != last.token || now.beats != last.beats => return Ok(true),
            _ if Instant::now() >= until => return Ok(false),
            _ => std::thread::sleep(pace.beat.min(pace.expiry) / 10),
        }
    }
}

/// How a lease stands.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Standing {
    /// Nobody ever took it, or the last holder released it.
    Free {
        /// The last holder.
        last: Option<Box<Owner>>,
    },
    /// Somebody holds it.
    Held {
        /// Who; `None` in the moment before it wrote its name.
        owner: Option<Box<Owner>>,
        /// Its last sign of life, by its own clock.
        beat_at: Option<String>,
    },
    /// The last holder ended without releasing it, or is on another computer whose locks are not seen here.
    Left {
        /// Who.
        owner: Box<Owner>,
        /// Its last sign of life, by its own clock.
        beat_at: String,
    },
}

/// How the lease at `path` stands. Takes nothing.
///
/// # Errors
/// What the system answers.
pub fn look(path: &Path) -> io::Result<Standing> {
    let mut file = match File::open(path) {
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(Standing::Free { last: None }),
        opened => opened?,
    };
    // Shared, and for a moment only: a holder keeps an exclusive one.
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
        Some(e) if held => Standing::Held {
            owner: (!e.released).then(|| Box::new(e.owner)),
            beat_at: (!e.released).then_some(e.beat_at),
        },
        None if held => Standing::Held {
            owner: None,
            beat_at: None,
        },
        Some(e) if !e.released => Standing::Left {
            owner: Box::new(e.owner),
            beat_at: e.beat_at,
        },
        other => Standing::Free {
            last: other.map(|e| Box::new(e.owner)),
        },
    })
}

fn now() -> String {
    chrono::Utc::now().to_rfc3339_opts(chrono::SecondsFormat::Millis, true)
}

/// Tells two takings of one process apart.
fn nonce() -> String {
    use std::sync::atomic::AtomicU64;
    static TAKEN: AtomicU64 = AtomicU64::new(0);
    format!("{}-{}", now(), TAKEN.fetch_add(1, Ordering::SeqCst))
}

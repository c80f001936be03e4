//! An open catalogue: registers sessions, and compares itself with folders.

use std::path::{Path, PathBuf};
use std::time::Duration;

use rayon::prelude::*;
use serde::Serialize;
use skinrig_recorder::{RecorderError, SESSION_SUFFIX, session_bytes};
use tokio::runtime::Runtime;

use crate::address::Address;
use crate::db::Db;
use crate::entry::{self, SessionEntry};
use crate::error::CatalogueError;
use crate::folder::Folder;
use crate::open::{self, Access};
use crate::prototypes::Prototypes;
use crate::status::{self, FolderStatus, Staleness, Unreadable, is_under_way};
use crate::write::{self, FileEntry};

/// Sessions that are read, in several threads, before they are written in one transaction.
const BATCH: usize = 32;
/// How often a session is read again when it changes meanwhile.
const TRIES: usize = 4;

/// An open catalogue.
#[derive(Debug)]
pub struct Catalogue {
    address: Address,
    pub(crate) place: String,
    pub(crate) runtime: Runtime,
    pub(crate) db: Db,
}

/// Result of registering sessions.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct Registration {
    /// Files that were read.
    pub registered: Vec<String>,
    /// Number of files whose entries were current.
    pub unchanged: usize,
    /// Files that could not be read.
    pub unreadable: Vec<Unreadable>,
    /// Sessions that are being recorded, and therefore left out.
    pub under_way: Vec<String>,
    /// Entries removed because their file is gone.
    pub forgotten: Vec<String>,
    /// Number of prototypes declared in the folder; `None` if they were not read.
    pub prototypes: Option<usize>,
    /// Findings in the file of prototypes; the catalogue then keeps those that it has.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub prototypes_problem: Option<String>,
}

/// A session file that was read, or not.
struct ReadFile {
    file: FileEntry,
    entry: Result<SessionEntry, RecorderError>,
}

/// Why tags and notes of a session were not replaced.
#[derive(Debug, thiserror::Error)]
enum NotAnnotated {
    /// The session cannot be read.
    #[error(transparent)]
    Session(RecorderError),
    /// Its tags cannot be read.
    #[error("{0}")]
    Tags(String),
    /// It was never registered.
    #[error("not in the catalogue: register it first")]
    Unknown,
}

impl Catalogue {
    /// Opens a catalogue; waits up to `wait` for another program that writes it.
    ///
    /// # Errors
    /// [`CatalogueError`] for a missing or unsuitable catalogue, a server that does not answer, and a catalogue that stays in use.
    pub fn open(address: Address, access: Access, wait: Duration) -> Result<Self, CatalogueError> {
        let place = address.to_string();
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .build()
            .map_err(|e| CatalogueError::sql(&place, "starting to read it", e.into()))?;
        let db = runtime.block_on(open::open(&address, access, wait))?;
        Ok(Self {
            address,
            place,
            runtime,
            db,
        })
    }

    /// Its address, without a password.
    #[must_use]
    pub fn place(&self) -> &str {
        &self.place
    }

    /// Name of a folder in this catalogue.
    pub(crate) fn store_of(&self, folder: &Path) -> Result<String, CatalogueError> {
        self.address.store_of(folder)
    }

    /// The computer of a folder of this name in this catalogue; `None` in a file.
    pub(crate) fn computer_of<'a>(&self, store: &'a str) -> Option<&'a str> {
        self.address.computer_of(store)
    }

    /// The folder of this name in this catalogue, if it is on this computer.
    pub(crate) fn folder_of(&self, store: &str) -> Option<PathBuf> {
        self.address.folder_of(store)
    }

    /// Creates a catalogue, or reads every session of a folder into an existing one again. A damaged file is replaced.
    ///
    /// # Errors
    /// As [`open`](Self::open) and [`refresh`](Self::refresh).
    pub fn rebuild(
        address: Address,
        folder: &Path,
        wait: Duration,
    ) -> Result<(Self, Registration), CatalogueError> {
        let try_once = |address: Address| {
            let mut catalogue = Self::open(address, Access::Write, wait)?;
            let done = catalogue.refresh(folder, true)?;
            Ok((catalogue, done))
        };
        match (try_once(address.clone()), &address) {
            (Err(CatalogueError::Damaged { .. }), Address::File(file)) => {
                open::remove(file)?;
                try_once(address)
            }
            (done, _) => done,
        }
    }

    /// Closes it; the last program to do so leaves one file. Without this call nothing is lost.
    ///
    /// # Errors
    /// If the database fails.
    pub fn close(self) -> Result<(), CatalogueError> {
        let closed = self.runtime.block_on(self.db.close());
        closed.map_err(|e| CatalogueError::sql(&self.place, "closing it", e))
    }

    /// Compares it with a folder of sessions.
    ///
    /// # Errors
    /// If the folder or the catalogue cannot be read.
    pub fn status(&mut self, folder: &Path) -> Result<FolderStatus, CatalogueError> {
        let store = self.address.store_of(folder)?;
        let files = Folder::list(folder)?;
        let compared = status::compare(&mut self.db, &self.place, &store, &files);
        self.runtime.block_on(compared)
    }

    /// Registers these session files, whatever the catalogue has of them. A file that cannot be read is part of the result.
    ///
    /// # Errors
    /// [`CatalogueError::OtherName`] for a file that the next list of its folder would leave out. If a folder or the catalogue cannot be read or written.
    pub fn register(&mut self, sessions: &[PathBuf]) -> Result<Registration, CatalogueError> {
        let is_unlisted = |path: &&PathBuf| !path.to_string_lossy().ends_with(SESSION_SUFFIX);
        if let Some(path) = sessions.iter().find(is_unlisted) {
            let path = path.to_owned();
            return Err(CatalogueError::OtherName { path });
        }
        let mut done = Registration::default();
        let folder_of = |path: &Path| path.parent().unwrap_or(Path::new("")).to_owned();
        let mut rest = sessions;
        while let Some(first) = rest.first() {
            let folder = folder_of(first);
            let same = rest.iter().take_while(|path| folder_of(path) == folder);
            let (now, later) = rest.split_at(same.count());
            rest = later;
            let files = Folder::list(&folder)?;
            let store = self.address.store_of(&folder)?;
            let name = |path: &PathBuf| {
                let name = path.file_name().unwrap_or_default();
                name.to_string_lossy().into_owned()
            };
            let names: Vec<String> = now.iter().map(name).collect();
            self.read_all(&store, &files, &names, false, &mut done)?;
        }
        Ok(done)
    }

    /// Replaces the tags and notes of these sessions, and nothing else; each must be in the catalogue. Until it is registered, such a
    /// session counts as stale. A file that cannot be used is part of the result.
    ///
    /// # Errors
    /// If a folder or the catalogue cannot be read or written.
    pub fn register_annotations(
        &mut self,
        sessions: &[PathBuf],
    ) -> Result<Registration, CatalogueError> {
        let mut done = Registration::default();
        for path in sessions {
            let name = path.file_name().unwrap_or_default();
            let file = name.to_string_lossy().into_owned();
            match self.annotate(path)? {
                Ok(()) => done.registered.push(file),
                Err(reason) => done.unreadable.push(Unreadable {
                    file,
                    reason: reason.to_string(),
                }),
            }
        }
        Ok(done)
    }

    /// Replaces the tags and notes of one session, or tells why not.
    fn annotate(&mut self, path: &Path) -> Result<Result<(), NotAnnotated>, CatalogueError> {
        let entry = match entry::read(path, &[]) {
            Ok(entry) => entry,
            Err(e) => return Ok(Err(NotAnnotated::Session(e))),
        };
        if let Some(problem) = &entry.tags_problem {
            return Ok(Err(NotAnnotated::Tags(problem.clone())));
        }
        let doing = "registering tags and notes";
        let is_known = self.transaction(doing, async |db| write::annotate(db, &entry).await)?;
        Ok(is_known.then_some(()).ok_or(NotAnnotated::Unknown))
    }

    /// Registers sessions that the caller has read, each with the name of its file in the catalogue's folder, in one transaction.
    ///
    /// # Errors
    /// If the catalogue cannot be written.
    pub fn add(&mut self, sessions: &[(String, SessionEntry)]) -> Result<(), CatalogueError> {
        self.transaction("registering sessions", async |db| {
            for (name, entry) in sessions {
                let file = FileEntry {
                    store: String::new(),
                    name: name.clone(),
                    size_bytes: entry.totals.map_or(0, |t| t.stored_bytes),
                    is_sealed: entry.content_sha256.is_some(),
                    fingerprint: String::new(),
                };
                write::session(db, &file, entry, true).await?;
            }
            Ok(())
        })
    }

    /// Registers what is stale in a folder, forgets what is gone, and reads its file of prototypes. `all`: reads every session again.
    ///
    /// # Errors
    /// As [`register`](Self::register).
    pub fn refresh(&mut self, folder: &Path, all: bool) -> Result<Registration, CatalogueError> {
        let (prototypes, prototypes_problem) = match Prototypes::of_folder(folder) {
            Ok(found) => (Some(found), None),
            Err(e) => (None, Some(e.to_string())),
        };
        let store = self.address.store_of(folder)?;
        let files = Folder::list(folder)?;
        let compared = status::compare(&mut self.db, &self.place, &store, &files);
        let found = self.runtime.block_on(compared)?;
        let (gone, stale): (Vec<_>, Vec<_>) = found
            .stale
            .into_iter()
            .partition(|s| s.why == Staleness::Gone);
        let mut done = Registration {
            forgotten: gone.into_iter().map(|s| s.file).collect(),
            prototypes: prototypes.as_ref().map(Vec::len),
            prototypes_problem,
            ..Registration::default()
        };
        self.transaction("forgetting files", async |db| {
            db.lock(&store).await?;
            for name in &done.forgotten {
                write::forget(db, &store, name).await?;
            }
            match &prototypes {
                Some(all) => write::prototypes(db, &store, all).await,
                None => Ok(()),
            }
        })?;
        let names: Vec<String> = match all {
            true => files.sessions.clone(),
            false => stale.into_iter().map(|s| s.file).collect(),
        };
        if !all {
            done.unchanged = found.current;
            done.under_way = found.under_way;
        }
        self.read_all(&store, &files, &names, all, &mut done)?;
        // Copies that became stale because their source changed or went.
        let compared = status::compare(&mut self.db, &self.place, &store, &files);
        let again = self.runtime.block_on(compared)?.stale.into_iter();
        let again = again
            .filter(|s| s.why == Staleness::Missing)
            .map(|s| s.file);
        let again: Vec<String> = again.collect();
        self.read_all(&store, &files, &again, false, &mut done)?;
        Ok(done)
    }

    /// Reads sessions and writes them, in batches; adds what happened to `done`.
    fn read_all(
        &mut self,
        store: &str,
        files: &Folder,
        names: &[String],
        force: bool,
        done: &mut Registration,
    ) -> Result<(), CatalogueError> {
        for batch in names.chunks(BATCH) {
            let mut pending: Vec<String> = batch.to_vec();
            for _ in 0..TRIES {
                let (busy, ready): (Vec<_>, Vec<_>) = pending
                    .into_iter()
                    .partition(|name| is_under_way(&files.file(name)));
                done.under_way.extend(busy);
                let read: Vec<ReadFile> = ready
                    .par_iter()
                    .map(|name| read(store, files, name))
                    .collect();
                let changed = self.write(store, &read, force)?;
                // What changed while it was read is read again: a slower program must not leave an older state behind.
                let (stale, settled): (Vec<_>, Vec<_>) =
                    read.into_iter().zip(changed).partition(|(read, _)| {
                        files.fingerprint(&read.file.name) != read.file.fingerprint
                    });
                for (read, is_new) in settled {
                    match read.entry {
                        Err(e) => done.unreadable.push(Unreadable {
                            file: read.file.name,
                            reason: e.to_string(),
                        }),
                        Ok(_) if is_new => done.registered.push(read.file.name),
                        Ok(_) => done.unchanged += 1,
                    }
                }
                pending = stale.into_iter().map(|(read, _)| read.file.name).collect();
                if pending.is_empty() {
                    break;
                }
            }
            done.unreadable
                .extend(pending.into_iter().map(|file| Unreadable {
                    file,
                    reason: "it kept changing while it was read".to_owned(),
                }));
        }
        Ok(())
    }

    /// Writes sessions in one transaction; returns which of them changed something.
    fn write(
        &mut self,
        store: &str,
        read: &[ReadFile],
        force: bool,
    ) -> Result<Vec<bool>, CatalogueError> {
        // All programs lock sessions in the same order.
        let key = |at: &usize| match &read[*at].entry {
            Ok(entry) => Some(&entry.headline.session_id),
            Err(_) => None,
        };
        let mut order: Vec<usize> = (0..read.len()).collect();
        order.sort_by(|a, b| key(a).cmp(&key(b)));
        let mut changed = vec![false; read.len()];
        if read.is_empty() {
            return Ok(changed);
        }
        self.transaction("registering sessions", async |db| {
            for at in order {
                let ReadFile { file, entry } = &read[at];
                changed[at] = match entry {
                    Ok(entry) => write::session(db, file, entry, force).await?,
                    Err(e) => {
                        let (name, seen) = (&file.name, &file.fingerprint);
                        write::unreadable(db, store, name, seen, &e.to_string()).await?;
                        true
                    }
                };
            }
            Ok(())
        })?;
        Ok(changed)
    }

    /// Runs statements in one transaction.
    pub(crate) fn transaction<T>(
        &mut self,
        doing: &'static str,
        work: impl AsyncFnOnce(&mut Db) -> Result<T, sqlx::Error>,
    ) -> Result<T, CatalogueError> {
        let db = &mut self.db;
        let done = self.runtime.block_on(async {
            db.begin().await?;
            let result = work(db).await;
            db.end(result).await
        });
        done.map_err(|e| CatalogueError::sql(&self.place, doing, e))
    }
}

/// Reads a session. What changes while it is read makes its fingerprint another one, because that is taken first.
fn read(store: &str, files: &Folder, name: &str) -> ReadFile {
    let path = files.file(name);
    let fingerprint = files.fingerprint(name);
    let size_bytes = session_bytes(&path);
    let entry = entry::read(&path, files.analyses(name));
    ReadFile {
        file: FileEntry {
            store: store.to_owned(),
            name: name.to_owned(),
            size_bytes,
            is_sealed: entry.as_ref().is_ok_and(|e| e.content_sha256.is_some()),
            fingerprint,
        },
        entry,
    }
}

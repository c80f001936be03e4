//! Sessions whose bytes lie in an object store: a small reference in the session's place, and the store behind it.
//!
//! Everything beside a session (results, tags, the catalogue) stays in its folder. SQLite reads the object by pages, through the file
//! system [`OBJECTS_VFS`] that the program registers together with an [`ObjectStore`].

use std::fs::File;
use std::io::{Read, Seek};
use std::path::Path;
use std::sync::OnceLock;

use serde::{Deserialize, Serialize};

use crate::error::{ObjectError, RecorderError};

/// Name of SQLite's file system for objects; its file names are addresses.
pub const OBJECTS_VFS: &str = "skinrig-objects";
/// Longest reference, bytes. Every session is longer: its first page has 4096.
const MAX_BYTES: u64 = 4095;
/// Version of the format.
const VERSION: u32 = 1;

/// The place of a session that lies in an object store.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SessionReference {
    /// Version of this format.
    #[serde(rename = "skinrig_session_reference")]
    pub version: u32,
    /// Address of the object.
    pub url: String,
    /// Size of the object.
    pub bytes: u64,
    /// Identifier of the session.
    pub session_id: String,
    /// Hash of its seal.
    pub content_sha256: String,
}

/// Bytes that can be read anywhere.
pub trait ReadSeek: Read + Seek + Send {}

impl<T: Read + Seek + Send> ReadSeek for T {}

/// A store of objects, behind the file system [`OBJECTS_VFS`].
pub trait ObjectStore: Send + Sync {
    /// Size of an object, bytes.
    ///
    /// # Errors
    /// If the store does not answer, or has no such object.
    fn size(&self, url: &str) -> Result<u64, ObjectError>;

    /// Opens an object to read its bytes.
    ///
    /// # Errors
    /// As [`size`](Self::size).
    fn open(&self, url: &str) -> Result<Box<dyn ReadSeek>, ObjectError>;

    /// Takes the error that made SQLite's last access to this object fail, if there is one.
    fn failure(&self, url: &str) -> Option<ObjectError>;
}

/// Starts the access to the store, and registers [`OBJECTS_VFS`].
pub type StartStore = fn() -> Result<Box<dyn ObjectStore>, ObjectError>;

/// How this program starts its store, at the first reference.
static START: OnceLock<StartStore> = OnceLock::new();
/// The store of this program.
static STORE: OnceLock<Box<dyn ObjectStore>> = OnceLock::new();

/// Makes references readable: `start` is called at the first one. A second call changes nothing.
pub fn use_object_store(start: StartStore) {
    let _ = START.set(start);
}

/// The store of this program; `None` if it has none.
fn store() -> Result<Option<&'static dyn ObjectStore>, ObjectError> {
    if let Some(store) = STORE.get() {
        return Ok(Some(&**store));
    }
    match START.get() {
        None => Ok(None),
        Some(start) => {
            let started = start()?;
            Ok(Some(&**STORE.get_or_init(|| started)))
        }
    }
}

/// The error of the last access to the object, or else `source`.
pub(crate) fn explain(path: &Path, url: &str, source: RecorderError) -> RecorderError {
    let known = STORE.get().and_then(|store| store.failure(url));
    known.map_or(source, |source| RecorderError::Object {
        path: path.to_owned(),
        url: url.to_owned(),
        source,
    })
}

impl SessionReference {
    /// A reference to the object at `url`.
    #[must_use]
    pub fn new(url: String, bytes: u64, session_id: String, content_sha256: String) -> Self {
        Self {
            version: VERSION,
            url,
            bytes,
            session_id,
            content_sha256,
        }
    }

    /// The reference in the place of a session; `None` for anything else.
    ///
    /// # Errors
    /// [`RecorderError::NotASession`] for a damaged reference, or one of another version.
    pub fn of(path: &Path) -> Result<Option<Self>, RecorderError> {
        let is_short = std::fs::metadata(path).is_ok_and(|m| m.is_file() && m.len() <= MAX_BYTES);
        if !is_short {
            return Ok(None);
        }
        let mut text = Vec::new();
        // What cannot be read is reported by whoever opens it as a session.
        let read = File::open(path).and_then(|file| file.take(MAX_BYTES).read_to_end(&mut text));
        if read.is_err() || !text.starts_with(b"{\"skinrig_session_reference\"") {
            return Ok(None);
        }
        let not = |found: String| RecorderError::NotASession {
            path: path.to_owned(),
            found: format!(
                "a reference to an object that cannot be read ({found}): restore the file from a copy"
            ),
        };
        let found: Self = serde_json::from_slice(&text).map_err(|e| not(e.to_string()))?;
        match found.version {
            VERSION => Ok(Some(found)),
            other => Err(not(format!("version {other}"))),
        }
    }

    /// Its text.
    ///
    /// # Errors
    /// [`RecorderError::Record`] for an address that is too long.
    pub fn text(&self) -> Result<String, RecorderError> {
        let mut text = serde_json::to_string(self).unwrap_or_default();
        text.push('\n');
        if text.len() as u64 <= MAX_BYTES {
            return Ok(text);
        }
        Err(RecorderError::Record {
            record: "reference".to_owned(),
            expected: format!("an address of at most {MAX_BYTES} bytes with its hashes"),
            found: format!("{} bytes", text.len()),
        })
    }

    /// Rejects an object of another size.
    pub(crate) fn check_size(&self, path: &Path) -> Result<(), RecorderError> {
        match size(path, &self.url)? {
            found if found == self.bytes => Ok(()),
            found => Err(self.other(path, format!("{found} bytes"))),
        }
    }

    /// The object is not the one of this reference.
    pub(crate) fn other(&self, path: &Path, found: String) -> RecorderError {
        RecorderError::OtherObject {
            path: path.to_owned(),
            url: self.url.clone(),
            expected: format!(
                "session {} of {} bytes, sealed as {}",
                self.session_id, self.bytes, self.content_sha256
            ),
            found,
        }
    }
}

/// Runs `work` with the store of the object at `url`, to which `path` refers.
pub(crate) fn with_store<T>(
    path: &Path,
    url: &str,
    work: impl FnOnce(&dyn ObjectStore) -> Result<T, ObjectError>,
) -> Result<T, RecorderError> {
    let (path, url) = (path.to_owned(), url.to_owned());
    match store() {
        Ok(Some(store)) => {
            work(store).map_err(|source| RecorderError::Object { path, url, source })
        }
        Ok(None) => Err(RecorderError::NoObjectStore { path, url }),
        Err(source) => Err(RecorderError::Object { path, url, source }),
    }
}

/// Size of the object at `url`.
pub(crate) fn size(path: &Path, url: &str) -> Result<u64, RecorderError> {
    with_store(path, url, |store| store.size(url))
}

/// Size of a session, bytes: of its file, or of the object to which it refers. 0 if it cannot be read.
#[must_use]
pub fn session_bytes(path: &Path) -> u64 {
    match SessionReference::of(path) {
        Ok(Some(reference)) => reference.bytes,
        Ok(None) | Err(_) => std::fs::metadata(path).map_or(0, |m| m.len()),
    }
}

/// Opens the bytes of a session: its file, or the object to which it refers.
pub(crate) fn open_bytes(path: &Path) -> Result<Box<dyn ReadSeek>, RecorderError> {
    match SessionReference::of(path)? {
        Some(of) => with_store(path, &of.url, |store| store.open(&of.url)),
        None => match File::open(path) {
            Ok(file) => Ok(Box::new(file)),
            Err(source) => Err(RecorderError::Io {
                path: path.to_owned(),
                doing: "reading it",
                source,
            }),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reference() -> SessionReference {
        SessionReference::new("s3://lab/a".into(), 8192, "ab".repeat(16), "cd".repeat(32))
    }

    #[test]
    fn a_reference_is_read_back_and_anything_else_is_not_one() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.session.sqlite");
        assert_eq!(SessionReference::of(&path).unwrap(), None);
        let text = reference().text().unwrap();
        std::fs::write(&path, &text).unwrap();
        assert_eq!(SessionReference::of(&path).unwrap(), Some(reference()));
        for other in ["", "{}", "SQLite format 3\0", &"x".repeat(9000)] {
            std::fs::write(&path, other).unwrap();
            assert_eq!(SessionReference::of(&path).unwrap(), None, "{other}");
        }
        for damaged in [
            &text[..text.len() - 9],
            &text.replace(":1,", ":2,"),
            &text.replace("url", "uri"),
        ] {
            std::fs::write(&path, damaged).unwrap();
            let refused = SessionReference::of(&path).unwrap_err().to_string();
            assert!(refused.contains("a reference to an object"), "{refused}");
        }
        let long = SessionReference {
            url: "s3://".to_owned() + &"k".repeat(5000),
            ..reference()
        };
        assert!(matches!(long.text(), Err(RecorderError::Record { .. })));
    }
}

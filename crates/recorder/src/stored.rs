//! Sessions between files and an object store: copies of them, and references to them.

use std::fs::File;
use std::path::Path;

use crate::error::RecorderError;
use crate::object::{self, SessionReference, with_store};
use crate::open::{Source, check_object, connect, runtime};
use crate::reader::SessionReader;

/// Describes the sealed session in the object at `url`.
///
/// # Errors
/// [`RecorderError::NotASession`] for any other object; errors of the store.
pub fn reference_to(url: &str) -> Result<SessionReference, RecorderError> {
    let path = Path::new(url);
    let bytes = object::size(path, url)?;
    let found = runtime(path)?.block_on(async {
        let mut conn = connect(path, &Source::Object(url.to_owned())).await?;
        let found = check_object(&mut conn).await;
        found.map_err(|fault| fault.at(path, "reading its seal"))
    });
    match found.map_err(|e| object::explain(path, url, e))? {
        Some((id, seal)) => Ok(SessionReference::new(url.to_owned(), bytes, id, seal)),
        None => Err(RecorderError::NotASession {
            path: path.to_owned(),
            found: "an object that is no sealed session of this version".to_owned(),
        }),
    }
}

/// Copies a sealed session to a new file: its file, or the object to which it refers.
///
/// # Errors
/// [`RecorderError::Io`], [`RecorderError::Object`]; [`RecorderError::OtherObject`] if the copy is not the session of the reference,
/// and is then removed.
pub fn copy_session(from: &Path, to: &Path) -> Result<(), RecorderError> {
    let Some(reference) = SessionReference::of(from)? else {
        let copied = std::fs::copy(from, to);
        return copied.map(drop).map_err(|source| RecorderError::Io {
            path: to.to_owned(),
            doing: "copying a session to it",
            source,
        });
    };
    reference.check_size(from)?;
    let url = &reference.url;
    let mut object = with_store(from, url, |store| store.open(url))?;
    let fetched = File::create_new(to).and_then(|mut file| {
        std::io::copy(&mut object, &mut file)?;
        file.sync_all()
    });
    if let Err(source) = fetched {
        if source.kind() != std::io::ErrorKind::AlreadyExists {
            let _ = std::fs::remove_file(to);
        }
        return Err(RecorderError::Io {
            path: to.to_owned(),
            doing: "copying a session to it",
            source,
        });
    }
    let found = SessionReader::open(to).and_then(|copy| Ok((copy.session_id()?, copy.seal()?)));
    let error = match found {
        Ok((id, Some(seal)))
            if (&id, &seal.content_sha256())
                == (&reference.session_id, &reference.content_sha256) =>
        {
            return Ok(());
        }
        Ok((id, _)) => reference.other(from, format!("session {id}, sealed otherwise")),
        Err(e) => reference.other(from, e.to_string()),
    };
    let _ = std::fs::remove_file(to);
    Err(error)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_a_store_the_next_step_is_named() {
        let reference =
            SessionReference::new("s3://lab/a".into(), 8192, "ab".repeat(16), "cd".repeat(32));
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.session.sqlite");
        std::fs::write(&path, reference.text().unwrap()).unwrap();
        let refused = SessionReader::open(&path).unwrap_err();
        assert!(matches!(refused, RecorderError::NoObjectStore { .. }));
        assert!(refused.to_string().contains("--features s3"), "{refused}");
    }
}

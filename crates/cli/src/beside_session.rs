//! Reads results of other commands beside a session: of `tradeoff` and `scene predict`.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use skinrig_catalogue::results_digest::{self, DigestError};
use skinrig_recorder::{RecorderError, SessionReader};

use crate::paths::beside;

/// A kind of results beside a session.
#[derive(Debug, PartialEq, Eq)]
pub struct ResultsKind {
    /// Value of the document's `format`.
    pub(crate) format: &'static str,
    /// Value of its `format_version`.
    pub(crate) version: u32,
    /// Key of the results in the document.
    key: &'static str,
    /// End of the file's name.
    ending: &'static str,
    /// The results in words.
    words: &'static str,
    /// The command that writes them.
    command: &'static str,
}

/// Results of `skinrig tradeoff`.
pub(crate) const TRADEOFF: ResultsKind = ResultsKind {
    format: "skinrig-tradeoff",
    version: 5,
    key: "tradeoff",
    ending: ".tradeoff.json",
    words: "trade-off",
    command: "skinrig tradeoff",
};

/// Results of `skinrig scene predict`.
pub(crate) const SCENE: ResultsKind = ResultsKind {
    format: "skinrig-scene-prediction",
    version: 1,
    key: "prediction",
    ending: ".scene.json",
    words: "scene prediction",
    command: "skinrig scene predict",
};

/// Results of `skinrig twin`.
pub(crate) const TWIN: ResultsKind = ResultsKind {
    format: "skinrig-twin",
    version: 1,
    key: "twin",
    ending: ".twin.json",
    words: "twin",
    command: "skinrig twin",
};

/// The session of the results, as it was.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub(crate) struct SessionIdentity {
    pub session_id: String,
    /// Of its seal; `None` without one.
    pub content_sha256: Option<String>,
}

impl SessionIdentity {
    /// That of an opened session.
    pub(crate) fn of(reader: &SessionReader) -> Result<Self, RecorderError> {
        Ok(Self {
            session_id: reader.session_id()?,
            content_sha256: reader.seal()?.map(|seal| seal.content_sha256()),
        })
    }
}

/// Results beside a session cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum BesideSessionError {
    /// The file cannot be read.
    #[error("{}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// The file is not a document of this kind.
    #[error("{}", Self::wrong_format(path, kind, source))]
    Parse {
        /// The file.
        path: PathBuf,
        /// What it should hold.
        kind: &'static ResultsKind,
        /// Error of the parser.
        source: serde_json::Error,
    },
    /// The file was changed after it was written.
    #[error(
        "{}: expected the digest of its content at its end, found {}; next: `{}` rewrites it",
        path.display(),
        match source {
            DigestError::Missing => "none",
            DigestError::Differs => "that of another content",
        },
        kind.command
    )]
    Changed {
        /// The file.
        path: PathBuf,
        /// What it should hold.
        kind: &'static ResultsKind,
        /// What its digest is.
        source: DigestError,
    },
    /// The results are not of this session as it is.
    #[error(
        "{}: expected the {} of this session, found that of another one or of an earlier content; next: `{}` rewrites it",
        path.display(), kind.words, kind.command
    )]
    OtherSession {
        /// The file.
        path: PathBuf,
        /// What it should hold.
        kind: &'static ResultsKind,
    },
    /// The document has another format or version.
    #[error("{}", Self::wrong_format(path, kind, &format_args!("found {format} version {version}")))]
    Version {
        /// The file.
        path: PathBuf,
        /// What it should hold.
        kind: &'static ResultsKind,
        /// Its format.
        format: String,
        /// Its version.
        version: u32,
    },
}

impl BesideSessionError {
    fn wrong_format(path: &Path, kind: &ResultsKind, found: &dyn fmt::Display) -> String {
        format!(
            "{}: expected {} version {}, {found}; next: `{}` rewrites it",
            path.display(),
            kind.format,
            kind.version,
            kind.command
        )
    }
}

/// Reads earlier results of this kind beside a session with this identity; `None` if there are none.
pub(crate) fn read<T: DeserializeOwned>(
    kind: &'static ResultsKind,
    session: &Path,
    identity: &SessionIdentity,
) -> Option<Result<T, BesideSessionError>> {
    let path = beside(session, kind.ending);
    match std::fs::read_to_string(&path) {
        Ok(text) => Some(parse(kind, path, &text, identity)),
        Err(e) if e.kind() == io::ErrorKind::NotFound => None,
        Err(source) => Some(Err(BesideSessionError::Read { path, source })),
    }
}

fn parse<T: DeserializeOwned>(
    kind: &'static ResultsKind,
    path: PathBuf,
    text: &str,
    identity: &SessionIdentity,
) -> Result<T, BesideSessionError> {
    let mut document: Document = match serde_json::from_str(text) {
        Ok(document) => document,
        Err(source) => return Err(BesideSessionError::Parse { path, kind, source }),
    };
    if (document.format.as_str(), document.format_version) != (kind.format, kind.version) {
        return Err(BesideSessionError::Version {
            path,
            kind,
            format: document.format,
            version: document.format_version,
        });
    }
    let results = document.results.remove(kind.key).unwrap_or(Value::Null);
    let results = match serde_json::from_value(results) {
        Ok(results) => results,
        Err(source) => return Err(BesideSessionError::Parse { path, kind, source }),
    };
    if let Err(source) = results_digest::check(text.as_bytes()) {
        return Err(BesideSessionError::Changed { path, kind, source });
    }
    if document.session != *identity {
        return Err(BesideSessionError::OtherSession { path, kind });
    }
    Ok(results)
}

/// A document of any kind.
#[derive(Deserialize)]
struct Document {
    format: String,
    format_version: u32,
    #[serde(default)]
    session: SessionIdentity,
    #[serde(flatten)]
    results: Map<String, Value>,
}

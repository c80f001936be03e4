//! Reads the trade-off results beside a session.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use skinrig_analysis::tradeoff::Tradeoff;
use skinrig_catalogue::results_digest::{self, DigestError};
use skinrig_recorder::{RecorderError, SessionReader};

use crate::analyses::tradeoff_path;

/// Values of the document's `format` and `format_version`.
pub(crate) const FORMAT: (&str, u32) = ("skinrig-tradeoff", 5);

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

/// The trade-off results beside a session cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum TradeoffFileError {
    /// The file cannot be read.
    #[error("{}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// The file is not a trade-off document.
    #[error("{}", Self::wrong_format(path, source))]
    Parse {
        /// The file.
        path: PathBuf,
        /// Error of the parser.
        source: serde_json::Error,
    },
    /// The file was changed after it was written.
    #[error(
        "{}: expected the digest of its content at its end, found {}; next: `skinrig tradeoff` rewrites it",
        path.display(),
        match source {
            DigestError::Missing => "none",
            DigestError::Differs => "that of another content",
        }
    )]
    Changed {
        /// The file.
        path: PathBuf,
        /// What its digest is.
        source: DigestError,
    },
    /// The results are not of this session as it is.
    #[error(
        "{}: expected the trade-off of this session, found that of another one or of an earlier content; next: `skinrig tradeoff` \
         rewrites it",
        path.display()
    )]
    OtherSession {
        /// The file.
        path: PathBuf,
    },
    /// The document has another format or version.
    #[error("{}", Self::wrong_format(path, &format_args!("found {format} version {version}")))]
    Version {
        /// The file.
        path: PathBuf,
        /// Its format.
        format: String,
        /// Its version.
        version: u32,
    },
}

impl TradeoffFileError {
    fn wrong_format(path: &Path, found: &dyn fmt::Display) -> String {
        format!(
            "{}: expected {} version {}, {found}; next: `skinrig tradeoff` rewrites it",
            path.display(),
            FORMAT.0,
            FORMAT.1
        )
    }
}

/// Reads the results of an earlier `skinrig tradeoff` beside a session with this identity; `None` if there are none.
pub(crate) fn beside_session(
    session: &Path,
    identity: &SessionIdentity,
) -> Option<Result<Tradeoff, TradeoffFileError>> {
    let path = tradeoff_path(session, None).with_extension("json");
    let text = match std::fs::read_to_string(&path) {
        Ok(text) => text,
        Err(e) if e.kind() == io::ErrorKind::NotFound => return None,
        Err(source) => return Some(Err(TradeoffFileError::Read { path, source })),
    };
    Some(match serde_json::from_str::<Document>(&text) {
        Err(source) => Err(TradeoffFileError::Parse { path, source }),
        Ok(d) if (d.format.as_str(), d.format_version) == FORMAT => {
            match results_digest::check(text.as_bytes()) {
                Err(source) => Err(TradeoffFileError::Changed { path, source }),
                Ok(()) if d.session != *identity => Err(TradeoffFileError::OtherSession { path }),
                Ok(()) => Ok(d.tradeoff),
            }
        }
        Ok(d) => Err(TradeoffFileError::Version {
            path,
            format: d.format,
            version: d.format_version,
        }),
    })
}

/// The part of the document that is read.
#[derive(Deserialize)]
struct Document {
    format: String,
    format_version: u32,
    #[serde(default)]
    session: SessionIdentity,
    tradeoff: Tradeoff,
}

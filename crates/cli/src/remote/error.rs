//! Errors of the connection between a run and other terminals.

use std::io;
use std::path::PathBuf;

/// A run did not answer.
#[derive(Debug, thiserror::Error)]
pub(crate) enum RemoteError {
    /// No program is listening: there is no run, or it was killed.
    #[error("no program is listening")]
    NotListening,
    /// A program is listening, but the exchange failed.
    #[error(transparent)]
    Failed(#[from] ExchangeError),
}

/// The exchange with a listening program failed.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ExchangeError {
    /// The session has no path for a socket.
    #[error(transparent)]
    Place(io::Error),
    /// The socket belongs to another user.
    #[error("{}: the run belongs to another user", place.display())]
    OtherUser {
        /// The socket.
        place: PathBuf,
    },
    /// The other end is rejected.
    #[error(transparent)]
    Peer(#[from] PeerError),
    /// Sending or receiving failed.
    #[error("no answer from the run: {0}")]
    NoAnswer(#[source] io::Error),
    /// The reply is not of this version.
    #[error("expected a reply of this version of skinrig, found other bytes: {0}")]
    Unreadable(#[source] serde_json::Error),
}

/// The other end of a socket is rejected.
#[derive(Debug, thiserror::Error)]
pub(crate) enum PeerError {
    /// The kernel does not report its user.
    #[error("cannot identify the other end: {0}")]
    Unidentified(#[source] io::Error),
    /// It is another user.
    #[error("expected user {expected} at the other end, found user {found}")]
    OtherUser {
        /// The user of this process.
        expected: u32,
        /// The user at the other end.
        found: u32,
    },
}

/// A run cannot listen for requests.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ServerError {
    /// The thread cannot be started, or the session's folder is missing.
    #[error(transparent)]
    System(#[from] io::Error),
    /// The socket can be created at neither path.
    #[error("{}: {beside_error}; {}: {own_error}", beside.display(), own.display())]
    Bind {
        /// The path beside the session.
        beside: PathBuf,
        /// Why it cannot be used.
        beside_error: io::Error,
        /// The path in the user's folder.
        own: PathBuf,
        /// Why it cannot be used.
        #[source]
        own_error: io::Error,
    },
    /// The system has no sockets in the file system.
    #[cfg(not(unix))]
    #[error("this system has no control from another terminal; use ctrl-C")]
    Unsupported,
}

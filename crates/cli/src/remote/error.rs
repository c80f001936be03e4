//! Owns the errors between a run and other terminals.

use std::io;
use std::path::PathBuf;

/// Why a run gave no answer.
#[derive(Debug, thiserror::Error)]
pub(crate) enum RemoteError {
    /// No program is listening: there is no run, or it was killed.
    #[error("no program is listening")]
    NotListening,
    /// A program is listening, but the exchange failed.
    #[error(transparent)]
    Failed(#[from] ExchangeError),
}

/// Why the exchange with a listening program failed.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ExchangeError {
    /// The session has no place for a socket.
    #[error(transparent)]
    Place(io::Error),
    /// The socket belongs to another user.
    #[error("{}: the run belongs to another user", place.display())]
    OtherUser {
        /// The socket.
        place: PathBuf,
    },
    /// The other end is not who it should be.
    #[error(transparent)]
    Peer(#[from] PeerError),
    /// Sending or receiving failed.
    #[error("no answer from the run: {0}")]
    NoAnswer(#[source] io::Error),
    /// The answer is not one of this version.
    #[error("an unreadable answer: {0}")]
    Unreadable(#[source] serde_json::Error),
}

/// Why the other end of a socket may not take part.
#[derive(Debug, thiserror::Error)]
pub(crate) enum PeerError {
    /// The kernel does not tell its user.
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

/// Why a run cannot listen to other terminals.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ServerError {
    /// The system refuses the thread, or the session's folder is gone.
    #[error(transparent)]
    System(#[from] io::Error),
    /// No place takes the socket.
    #[error("{}: {beside_error}; {}: {own_error}", beside.display(), own.display())]
    Bind {
        /// The place beside the session.
        beside: PathBuf,
        /// Why it cannot be used.
        beside_error: io::Error,
        /// The place in the user's own folder.
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

//! Control of a run from another terminal, over a Unix socket beside the session.
//!
//! A request and its reply are one line of JSON each; touches are a line each until the run ends. Only the user of the run and root
//! may connect; there is no network port. The controller never waits for a terminal: requests are bits of its
//! [`ControlHandle`](skinrig_controller::ControlHandle), notes go through a short queue, and the progress is a copy that it updates
//! while no terminal reads it.

mod answer;
mod board;
mod client;
mod error;
mod newest;
#[cfg(unix)]
mod place;
#[cfg(unix)]
mod server;
mod touches;
mod wire;

pub(crate) use board::Remote;
pub(crate) use client::{ask, follow};
pub(crate) use error::RemoteError;
pub(crate) use wire::{
    LivePress, LiveTouch, MOST_NAME_CHARS, NewestEvents, Reply, Request, RunRequest, RunSnapshot,
};

/// This system has no Unix sockets.
#[cfg(not(unix))]
mod server {
    use std::path::Path;

    use super::ServerError;
    use super::answer::Answer;
    use super::wire::Request;

    /// Never opened.
    pub(crate) struct Server;

    impl Server {
        /// # Errors
        /// Always.
        pub fn open(
            _session: &Path,
            _answer: impl FnMut(Request) -> Answer + Send + 'static,
        ) -> Result<Self, ServerError> {
            Err(ServerError::Unsupported)
        }
    }
}

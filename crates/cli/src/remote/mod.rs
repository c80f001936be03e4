//! The hand on a run from another terminal: a socket of the file system beside the session, and what goes over it.
//!
//! One line of JSON asks, one answers. Only the user of the run (and root) gets in; there is no network port. The controller
//! never waits for any of it: requests are bits of its [`ControlHandle`](skinrig_controller::ControlHandle), remarks a short
//! queue, and what is told of the run is a copy that it leaves behind when nobody is reading.

mod board;
mod client;
mod error;
#[cfg(unix)]
mod place;
#[cfg(unix)]
mod server;
mod wire;

pub(crate) use board::Remote;
pub(crate) use client::ask;
pub(crate) use error::RemoteError;
pub(crate) use wire::{Live, MOST_NAME_CHARS, Reply, Request, RunRequest};

/// No sockets of the file system here.
#[cfg(not(unix))]
mod server {
    use std::path::Path;

    use super::{Reply, Request, ServerError};

    /// Nothing listens.
    pub(crate) struct Server;

    impl Server {
        /// # Errors
        /// Always.
        pub fn open(
            _session: &Path,
            _answer: impl FnMut(Request) -> Reply + Send + 'static,
        ) -> Result<Self, ServerError> {
            Err(ServerError::Unsupported)
        }
    }
}

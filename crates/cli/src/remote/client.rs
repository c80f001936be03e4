//! The client side: queries the run that is writing a session.

use std::path::Path;

use super::error::RemoteError;
use super::wire::{Reply, Request};

/// Sends a request to the run that writes `session`, and returns its reply.
///
/// # Errors
/// [`RemoteError`].
#[cfg(unix)]
pub(crate) fn ask(session: &Path, request: &Request) -> Result<Reply, RemoteError> {
    use std::io::ErrorKind;
    use std::os::unix::net::UnixStream;

    use super::error::ExchangeError;

    for place in super::place::places(session).map_err(ExchangeError::Place)? {
        match UnixStream::connect(&place) {
            Ok(stream) => return exchange(stream, request),
            Err(e) => match e.kind() {
                ErrorKind::PermissionDenied => {
                    return Err(ExchangeError::OtherUser { place }.into());
                }
                // No file, no listener, not a socket, or a path too long for a socket.
                _ => continue,
            },
        }
    }
    Err(RemoteError::NotListening)
}

/// # Errors
/// Always.
#[cfg(not(unix))]
pub fn ask(_session: &Path, _request: &Request) -> Result<Reply, RemoteError> {
    Err(RemoteError::NotListening)
}

#[cfg(unix)]
fn exchange(
    stream: std::os::unix::net::UnixStream,
    request: &Request,
) -> Result<Reply, RemoteError> {
    use std::io::{ErrorKind, Read, Write};
    use std::time::Duration;

    use super::error::ExchangeError;

    /// Longest wait for a reply: other requests may come first.
    const ANSWER_WITHIN: Duration = Duration::from_secs(5);

    super::place::check_peer(&stream, super::place::may_answer).map_err(ExchangeError::Peer)?;
    let mut reply = Vec::new();
    let mut transfer = || -> std::io::Result<()> {
        let mut stream = &stream;
        stream.set_read_timeout(Some(ANSWER_WITHIN))?;
        stream.set_write_timeout(Some(ANSWER_WITHIN))?;
        let mut line = serde_json::to_vec(request)?;
        line.push(b'\n');
        stream.write_all(&line)?;
        let most = super::wire::MOST_REPLY_BYTES as u64;
        stream.take(most).read_to_end(&mut reply)?;
        Ok(())
    };
    match transfer() {
        // The run ended during the exchange.
        Err(e) if matches!(e.kind(), ErrorKind::BrokenPipe | ErrorKind::ConnectionReset) => {
            Err(RemoteError::NotListening)
        }
        Err(e) => Err(ExchangeError::NoAnswer(e).into()),
        Ok(()) if reply.is_empty() => Err(RemoteError::NotListening),
        Ok(()) => Ok(serde_json::from_slice(&reply).map_err(ExchangeError::Unreadable)?),
    }
}

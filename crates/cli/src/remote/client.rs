//! The client side: queries the run that is writing a session.

#[cfg(not(unix))]
pub(crate) use other::{ask, follow};
#[cfg(unix)]
pub(crate) use unix::{ask, follow};

#[cfg(unix)]
mod unix {
    use std::io::{self, BufRead, BufReader, ErrorKind, Read, Write};
    use std::os::unix::net::UnixStream;
    use std::path::Path;
    use std::time::Duration;

    use crate::remote::error::{ExchangeError, RemoteError};
    use crate::remote::place::{check_peer, may_answer, places};
    use crate::remote::wire::{MOST_REPLY_BYTES, Reply, Request};

    /// Longest wait for a reply: other requests may come first.
    const ANSWER_WITHIN: Duration = Duration::from_secs(5);

    /// Sends a request to the run that writes `session`, and returns its reply.
    ///
    /// # Errors
    /// [`RemoteError`].
    pub(crate) fn ask(session: &Path, request: &Request) -> Result<Reply, RemoteError> {
        let stream = connect(session)?;
        let mut reply = Vec::new();
        let mut transfer = || -> io::Result<()> {
            stream.set_read_timeout(Some(ANSWER_WITHIN))?;
            send(&stream, request)?;
            (&stream)
                .take(MOST_REPLY_BYTES as u64)
                .read_to_end(&mut reply)?;
            Ok(())
        };
        transfer().map_err(no_answer)?;
        if reply.is_empty() {
            return Err(RemoteError::NotListening);
        }
        parse(&reply)
    }

    /// Sends a request with many replies, and passes each to `each` until the run ends them.
    ///
    /// # Errors
    /// [`RemoteError`].
    pub(crate) fn follow(
        session: &Path,
        request: &Request,
        mut each: impl FnMut(Reply),
    ) -> Result<(), RemoteError> {
        let stream = connect(session)?;
        send(&stream, request).map_err(no_answer)?;
        let mut replies = BufReader::new(stream);
        let mut line = Vec::new();
        loop {
            line.clear();
            let most = MOST_REPLY_BYTES as u64;
            let read = replies.by_ref().take(most).read_until(b'\n', &mut line);
            if read.map_err(no_answer)? == 0 {
                return Ok(());
            }
            each(parse(&line)?);
        }
    }

    /// A connection to the run that writes `session`.
    fn connect(session: &Path) -> Result<UnixStream, RemoteError> {
        for place in places(session).map_err(ExchangeError::Place)? {
            match UnixStream::connect(&place) {
                Ok(stream) => {
                    check_peer(&stream, may_answer).map_err(ExchangeError::Peer)?;
                    return Ok(stream);
                }
                Err(e) if e.kind() == ErrorKind::PermissionDenied => {
                    return Err(ExchangeError::OtherUser { place }.into());
                }
                // No file, no listener, not a socket, or a path too long for a socket.
                Err(_) => {}
            }
        }
        Err(RemoteError::NotListening)
    }

    fn send(mut stream: &UnixStream, request: &Request) -> io::Result<()> {
        stream.set_write_timeout(Some(ANSWER_WITHIN))?;
        let mut line = serde_json::to_vec(request)?;
        line.push(b'\n');
        stream.write_all(&line)
    }

    fn parse(line: &[u8]) -> Result<Reply, RemoteError> {
        Ok(serde_json::from_slice(line).map_err(ExchangeError::Unreadable)?)
    }

    fn no_answer(error: io::Error) -> RemoteError {
        match error.kind() {
            // The run ended during the exchange.
            ErrorKind::BrokenPipe | ErrorKind::ConnectionReset => RemoteError::NotListening,
            _ => ExchangeError::NoAnswer(error).into(),
        }
    }
}

/// A system without sockets in the file system: nothing ever listens.
#[cfg(not(unix))]
mod other {
    use std::path::Path;

    use crate::remote::error::RemoteError;
    use crate::remote::wire::{Reply, Request};

    /// # Errors
    /// Always.
    pub(crate) fn ask(_session: &Path, _request: &Request) -> Result<Reply, RemoteError> {
        Err(RemoteError::NotListening)
    }

    /// # Errors
    /// Always.
    pub(crate) fn follow(
        _session: &Path,
        _request: &Request,
        _each: impl FnMut(Reply),
    ) -> Result<(), RemoteError> {
        Err(RemoteError::NotListening)
    }
}

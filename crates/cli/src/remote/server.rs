//! Listens for requests of other terminals; a short-lived thread serves each one, so that none waits for another.

use std::fs;
use std::io::{self, Read, Write};
use std::os::unix::fs::{FileTypeExt, MetadataExt, PermissionsExt};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::answer::Answer;
use super::error::ServerError;
use super::place;
use super::wire::{MOST_REQUEST_BYTES, Reply, Request, RequestError};

/// Time limit for a caller to send its request.
const ASK_WITHIN: Duration = Duration::from_millis(300);
/// Callers served at once; a further one is served on the listening thread, so that the next ones wait.
const MOST_AT_ONCE: usize = 256;
/// Time limit for a program that follows touches to take a line once its buffer is full.
const TAKE_WITHIN: Duration = Duration::from_secs(5);
/// Pause after the system failed to accept a caller (no free file descriptor).
const TRY_AGAIN: Duration = Duration::from_millis(100);

/// Listens until it is dropped, which removes the socket.
#[derive(Debug)]
pub(crate) struct Server {
    path: PathBuf,
    /// Device and inode of the socket, so that no other one is removed.
    id: (u64, u64),
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Server {
    /// Listens for requests to `session`. This process is its only writer, so an existing socket is a leftover.
    ///
    /// # Errors
    /// [`ServerError`] when no socket can be created.
    pub(super) fn open(
        session: &Path,
        answer: impl FnMut(Request) -> Answer + Send + 'static,
    ) -> Result<Self, ServerError> {
        let answer = Arc::new(Mutex::new(answer));
        let [beside, own] = place::places(session)?;
        let (listener, path) = match bind(&beside) {
            Ok(listener) => (listener, beside),
            Err(beside_error) => match place::make_own_folder().and_then(|()| bind(&own)) {
                Ok(listener) => (listener, own),
                Err(own_error) => {
                    return Err(ServerError::Bind {
                        beside,
                        beside_error,
                        own,
                        own_error,
                    });
                }
            },
        };
        let id = identity(&path)?;
        let stop = Arc::new(AtomicBool::new(false));
        let is_stopped = Arc::clone(&stop);
        let thread = std::thread::Builder::new()
            .name("control".to_owned())
            .spawn(move || {
                for caller in listener.incoming() {
                    if is_stopped.load(Ordering::Acquire) {
                        return;
                    }
                    match caller {
                        // A caller that disconnects or sends nonsense does not affect the run.
                        Ok(stream) => spawn_serve(stream, &answer),
                        Err(_) => std::thread::sleep(TRY_AGAIN),
                    }
                }
            })?;
        Ok(Self {
            path,
            id,
            stop,
            thread: Some(thread),
        })
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Release);
        // Connect once to wake the thread. If the socket was removed, the thread sleeps until the process ends.
        let woken = identity(&self.path).is_ok_and(|id| id == self.id)
            && UnixStream::connect(&self.path).is_ok();
        if let Some(thread) = self.thread.take()
            && woken
        {
            let _ = thread.join();
            if identity(&self.path).is_ok_and(|id| id == self.id) {
                let _ = fs::remove_file(&self.path);
            }
        }
    }
}

/// Serves a caller on its own thread, so that a slow or silent one does not delay others.
fn spawn_serve<A>(stream: UnixStream, answer: &Arc<Mutex<A>>)
where
    A: FnMut(Request) -> Answer + Send + 'static,
{
    if Arc::strong_count(answer) > MOST_AT_ONCE {
        return drop(serve(stream, answer, false));
    }
    let answer = Arc::clone(answer);
    let serving = std::thread::Builder::new().name("control-caller".to_owned());
    // If the thread cannot be started, the caller gets no reply and may try again.
    let _ = serving.spawn(move || drop(serve(stream, &answer, true)));
}

/// A socket at `path` that only this user can connect to.
fn bind(path: &Path) -> io::Result<UnixListener> {
    match fs::symlink_metadata(path) {
        Ok(found) if found.file_type().is_socket() => fs::remove_file(path)?,
        Ok(_) => return Err(io::Error::other("expected no file, found one")),
        Err(_) => {}
    }
    let listener = UnixListener::bind(path)?;
    fs::set_permissions(path, fs::Permissions::from_mode(0o600))?;
    Ok(listener)
}

fn identity(path: &Path) -> io::Result<(u64, u64)> {
    fs::symlink_metadata(path).map(|m| (m.dev(), m.ino()))
}

/// Reads one request and answers it. Only a caller that `may_stay` gets touches.
fn serve(
    mut stream: UnixStream,
    answer: &Mutex<impl FnMut(Request) -> Answer>,
    may_stay: bool,
) -> io::Result<()> {
    let reply = match place::check_peer(&stream, place::may_ask) {
        Err(why) => Reply::Refused(why.to_string()),
        Ok(()) => match read_request(&mut stream)? {
            Err(why) => Reply::Refused(why.to_string()),
            Ok(Request::Touches) if !may_stay => Reply::Refused(format!(
                "expected at most {MOST_AT_ONCE} callers at once, found more: try again"
            )),
            Ok(request) => {
                let mut answer = answer.lock().unwrap_or_else(PoisonError::into_inner);
                let answered = (*answer)(request);
                drop(answer);
                match answered {
                    Answer::Once(reply) => reply,
                    Answer::Touches(touches) => {
                        stream.set_write_timeout(Some(TAKE_WITHIN))?;
                        for touch in touches {
                            write_line(&mut stream, &Reply::Touch(touch))?;
                        }
                        Reply::TouchesEnded
                    }
                }
            }
        },
    };
    stream.set_write_timeout(Some(ASK_WITHIN))?;
    write_line(&mut stream, &reply)
}

fn write_line(stream: &mut UnixStream, reply: &Reply) -> io::Result<()> {
    let mut line = serde_json::to_vec(reply)?;
    line.push(b'\n');
    stream.write_all(&line)
}

/// Reads one line within the limits on time and length.
fn read_request(stream: &mut UnixStream) -> io::Result<Result<Request, RequestError>> {
    let until = Instant::now() + ASK_WITHIN;
    let (mut line, mut block) = (Vec::new(), [0; 1024]);
    loop {
        let left = until.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Ok(Err(RequestError::Late));
        }
        stream.set_read_timeout(Some(left))?;
        let n = match stream.read(&mut block) {
            Err(e) if e.kind() == io::ErrorKind::Interrupted => continue,
            // Timed out: the next turn returns.
            Err(e)
                if matches!(
                    e.kind(),
                    io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut
                ) =>
            {
                continue;
            }
            other => other?,
        };
        line.extend_from_slice(&block[..n]);
        if let Some(end) = line.iter().position(|b| *b == b'\n') {
            return Ok(Request::parse(&line[..end]));
        }
        if n == 0 || line.len() > MOST_REQUEST_BYTES {
            return Ok(Err(RequestError::Endless { found: line.len() }));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::client::{ask, follow};
    use super::super::error::RemoteError;
    use super::super::wire::RunRequest;
    use super::*;

    fn session() -> (tempfile::TempDir, PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let session = folder.path().join("a.session.sqlite");
        fs::write(&session, "").unwrap();
        (folder, session)
    }

    fn server(session: &Path) -> Server {
        Server::open(session, |request| match request {
            Request::Control(RunRequest::Pause) => Answer::Once(Reply::Handed(7)),
            other => Answer::Once(Reply::Refused(format!("{other:?}"))),
        })
        .unwrap()
    }

    const PAUSE: Request = Request::Control(RunRequest::Pause);

    #[test]
    fn a_stale_socket_is_replaced_and_the_new_one_removed_at_exit() {
        let (folder, session) = session();
        let place = &place::places(&session).unwrap()[0];
        // A killed process leaves its socket without a listener.
        drop(UnixListener::bind(place).unwrap());
        assert!(matches!(
            ask(&session, &PAUSE),
            Err(RemoteError::NotListening)
        ));
        let running = server(&session);
        assert_eq!(fs::metadata(place).unwrap().mode() & 0o777, 0o600);
        assert_eq!(ask(&session, &PAUSE).unwrap(), Reply::Handed(7));
        drop(running);
        assert!(matches!(
            ask(&session, &PAUSE),
            Err(RemoteError::NotListening)
        ));
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_fallback_path_is_used_without_a_socket_beside_the_session() {
        let (_folder, session) = session();
        let [beside, own] = place::places(&session).unwrap();
        // Another file has that name, and stays.
        fs::write(&beside, "mine").unwrap();
        let running = server(&session);
        assert_eq!(ask(&session, &PAUSE).unwrap(), Reply::Handed(7));
        assert!(own.exists());
        drop(running);
        assert!(!own.exists());
        assert_eq!(fs::read(&beside).unwrap(), b"mine");
        // A path too long for a socket.
        let deep = session.parent().unwrap().join("d".repeat(120));
        fs::create_dir(&deep).unwrap();
        let far = deep.join("a.session.sqlite");
        fs::write(&far, "").unwrap();
        let running = server(&far);
        assert_eq!(ask(&far, &PAUSE).unwrap(), Reply::Handed(7));
        drop(running);
    }

    /// A killed run ends the connection without saying so.
    #[test]
    fn the_last_reply_about_touches_says_that_the_run_has_ended() {
        let (_folder, session) = session();
        let (touches, queue) = std::sync::mpsc::sync_channel(1);
        let mut queue = Some(queue);
        let running = Server::open(&session, move |_| Answer::Touches(queue.take().unwrap()));
        drop(touches);
        let mut replies = Vec::new();
        follow(&session, &Request::Touches, |reply| replies.push(reply)).unwrap();
        assert_eq!(replies, [Reply::TouchesEnded]);
        drop(running);
    }

    #[test]
    fn hostile_callers_are_rejected_and_the_next_one_is_served() {
        let (_folder, session) = session();
        let running = server(&session);
        let place = &place::places(&session).unwrap()[0];
        let call = |bytes: &[u8]| {
            let mut stream = UnixStream::connect(place).unwrap();
            // The server may hang up before all is written.
            let _ = stream.write_all(bytes);
            let _ = stream.shutdown(std::net::Shutdown::Write);
            let mut reply = Vec::new();
            let _ = stream.read_to_end(&mut reply);
            String::from_utf8(reply).unwrap()
        };
        assert!(call(b"\xff\0\n").contains("refused"));
        assert!(call(b"").contains("without an end"));
        assert!(call(&[b'x'; 500]).contains("without an end"));
        call(&vec![b'['; 50 * MOST_REQUEST_BYTES]);
        // Forty silent callers, each of which could delay the others by 300 ms, and one that disconnects at once.
        let silent: Vec<_> = (0..40)
            .map(|_| UnixStream::connect(place).unwrap())
            .collect();
        drop(UnixStream::connect(place).unwrap());
        assert_eq!(ask(&session, &PAUSE).unwrap(), Reply::Handed(7));
        drop((silent, running));
    }
}

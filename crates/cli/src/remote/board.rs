//! State of a run for other terminals, and their requests to it.

use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use skinrig_controller::{ControlHandle, Progress, State};
use skinrig_model::{CameraId, RawChunk, TouchEstimate};

use super::answer::Answer;
use super::error::ServerError;
use super::newest::NewestBytes;
use super::server::Server;
use super::touches::{MOST_FOLLOWERS, TouchFeed};
use super::wire::{Reply, Request, RunRequest, RunSnapshot};

/// Shortest interval between updates caused by bulk data.
const UPDATE_EVERY: Duration = Duration::from_millis(100);

/// A copy of the run's progress, updated by the controller's thread.
#[derive(Debug)]
pub(crate) struct Board {
    progress: Arc<Mutex<Progress>>,
    control: ControlHandle,
    began: Instant,
    newest: Arc<NewestBytes>,
    feels: bool,
    touches: Arc<TouchFeed>,
}

impl Board {
    /// A board for a run without progress, which `feels` touches or not.
    #[must_use]
    pub(crate) fn new(control: ControlHandle, feels: bool) -> Self {
        Self {
            progress: Arc::default(),
            control,
            began: Instant::now(),
            newest: Arc::new(NewestBytes::new()),
            feels,
            touches: Arc::new(TouchFeed::new(feels)),
        }
    }

    /// Answers one request; never waits.
    #[must_use]
    pub(crate) fn answer(&self, request: Request) -> Answer {
        if let Request::Touches = request
            && let Some(touches) = self.touches.follow()
        {
            return Answer::Touches(touches);
        }
        Answer::Once(self.reply(request))
    }

    fn reply(&self, request: Request) -> Reply {
        match request {
            Request::Status => Reply::Live(Box::new(self.live())),
            Request::Newest => Reply::Newest(self.newest.ask().map(Into::into)),
            // The acknowledgement of a request to a finished run would never come.
            _ if self.control.state() == State::Finished => {
                Reply::Refused("expected a run under way, found one that has ended".to_owned())
            }
            Request::Touches if !self.feels => Reply::Refused(
                "expected a run that feels touches (`online` in its protocol), found one that does not"
                    .to_owned(),
            ),
            Request::Touches => Reply::Refused(format!(
                "expected at most {MOST_FOLLOWERS} programs that follow touches, found as many already"
            )),
            Request::Control(what) => {
                match what {
                    RunRequest::Pause => self.control.pause(),
                    RunRequest::PauseNow => self.control.pause_now(),
                    RunRequest::Resume => self.control.resume(),
                    RunRequest::Stop => self.control.stop(),
                    RunRequest::Abort => self.control.abort(),
                    RunRequest::Halt => self.control.halt(),
                }
                Reply::Handed(self.control.requests_made())
            }
            Request::Note { by, text } => match self.control.note(format!("{by}: {text}")) {
                Ok(number) => Reply::Handed(number),
                Err(full) => Reply::Refused(full.to_string()),
            },
        }
    }

    fn live(&self) -> RunSnapshot {
        let c = &self.control;
        // Read the acknowledgements first: a state that is read later is at least as new.
        let counts = [c.requests_acknowledged(), c.notes_recorded()];
        let [heard, noted] = counts;
        let progress = self.progress.lock().unwrap_or_else(PoisonError::into_inner);
        let waited_s = self.began.elapsed().as_secs_f64();
        RunSnapshot::of(
            &progress,
            c.state(),
            [c.requests_made(), heard, noted],
            waited_s,
        )
    }
}

/// The run's end of the connection: answers other terminals until it is dropped.
pub(crate) struct Remote {
    progress: Arc<Mutex<Progress>>,
    updated: Option<Instant>,
    newest: Arc<NewestBytes>,
    touches: Arc<TouchFeed>,
    _server: Server,
}

impl Remote {
    /// Listens for requests to `session`, which this process writes, of a run that `feels` touches or not.
    ///
    /// # Errors
    /// [`ServerError`] when that is not possible; the run continues without it.
    pub(crate) fn open(
        session: &Path,
        control: &ControlHandle,
        feels: bool,
    ) -> Result<Self, ServerError> {
        let board = Board::new(control.clone(), feels);
        let (progress, newest) = (Arc::clone(&board.progress), Arc::clone(&board.newest));
        let touches = Arc::clone(&board.touches);
        let server = Server::open(session, move |request| board.answer(request))?;
        Ok(Self {
            progress,
            updated: None,
            newest,
            touches,
            _server: server,
        })
    }

    /// Updates the progress; for `bulk` data only from time to time. Skips the update while another terminal reads.
    pub(crate) fn show(&mut self, progress: &Progress, bulk: bool) {
        if bulk && self.updated.is_some_and(|t| t.elapsed() < UPDATE_EVERY) {
            return;
        }
        if let Ok(mut shown) = self.progress.try_lock() {
            shown.clone_from(progress);
            self.updated = Some(Instant::now());
        }
    }

    /// Hands a touch to the programs that follow.
    pub(crate) fn show_touch(&self, touch: &TouchEstimate) {
        self.touches.send(touch);
    }

    /// No more touches will be felt.
    pub(crate) fn end_touches(&self) {
        self.touches.end();
    }

    /// Most bytes per camera to copy at the next tick; `None` unless another terminal looks at the newest events.
    pub(crate) fn wants_newest(&self) -> Option<usize> {
        self.newest.wants()
    }

    /// Takes a copy of the newest bytes of a camera that are in no chunk yet.
    pub(crate) fn show_newest(&self, camera: CameraId, bytes: Vec<u8>) {
        self.newest.copy(camera, bytes);
    }

    /// Takes the end of a chunk while another terminal looks.
    pub(crate) fn show_chunk(&self, chunk: &RawChunk) {
        self.newest.chunk(chunk);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn requests_reach_the_controller_and_return_their_number() {
        let control = ControlHandle::new();
        let board = Board::new(control.clone(), false);
        assert!(matches!(
            board.answer(Request::Touches),
            Answer::Once(Reply::Refused(why)) if why.contains("`online`")
        ));
        assert_eq!(
            board.reply(Request::Control(RunRequest::Pause)),
            Reply::Handed(1)
        );
        assert_eq!(
            board.reply(Request::Control(RunRequest::Halt)),
            Reply::Handed(2)
        );
        let note = Request::Note {
            by: "Ann".into(),
            text: "warm".into(),
        };
        assert_eq!(board.reply(note.clone()), Reply::Handed(1));
        for n in 2..=16 {
            assert_eq!(board.reply(note.clone()), Reply::Handed(n));
        }
        assert!(matches!(board.reply(note), Reply::Refused(_)));
        let Reply::Live(live) = board.reply(Request::Status) else {
            panic!("expected the run");
        };
        assert_eq!((live.asked, live.heard, live.noted), (2, 0, 0));
        assert_eq!(live.state, "planned");
    }
}

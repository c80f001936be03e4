//! Owns the analysis of a session that grows: the whole one, again and again, at low priority.
//!
//! A round takes as long as `skinrig analyze` without the studies. It rests four times as long, and ends at the next chunk when the session
//! is about to be sealed.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use skinrig_analysis::Analysis;
use skinrig_results::{AnalysisOptions, ResultsError, Session};

/// Rest after a round, in durations of the round.
const REST: u32 = 4;
/// Shortest rest.
const SHORTEST_REST: Duration = Duration::from_secs(1);
/// Resamples of the bootstrap: an interval to watch, not to publish.
const RESAMPLES: u32 = 200;
/// Added to the nice value of the thread.
#[cfg(target_os = "linux")]
const NICE: i32 = 10;

/// The newest analysis, and the running round.
pub(super) struct Estimates {
    path: PathBuf,
    stop: Arc<AtomicBool>,
    newest: Arc<Mutex<Option<Arc<Analysis>>>>,
    round: Option<JoinHandle<Duration>>,
    /// Outcomes that the newest round saw.
    outcomes: usize,
    rest_until: Option<Instant>,
}

impl Estimates {
    /// Of the session at `path`; a round ends early once `stop` is set.
    pub(super) fn new(path: &Path, stop: &Arc<AtomicBool>) -> Self {
        Self {
            path: path.to_owned(),
            stop: Arc::clone(stop),
            newest: Arc::default(),
            round: None,
            outcomes: 0,
            rest_until: None,
        }
    }

    pub(super) fn newest(&self) -> Option<Arc<Analysis>> {
        self.newest
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .clone()
    }

    /// Begins a round if there are new outcomes, no round is running, and the rest is over.
    pub(super) fn renew(&mut self, outcomes: usize) {
        if let Some(round) = self.round.take_if(|round| round.is_finished()) {
            let took = round.join().unwrap_or_default();
            self.rest_until = Some(Instant::now() + (REST * took).max(SHORTEST_REST));
        }
        let rests = self.rest_until.is_some_and(|until| Instant::now() < until);
        if self.round.is_some() || rests || outcomes == self.outcomes {
            return;
        }
        self.outcomes = outcomes;
        let (path, stop, newest) = (
            self.path.clone(),
            Arc::clone(&self.stop),
            Arc::clone(&self.newest),
        );
        let thread = std::thread::Builder::new().name("estimates".to_owned());
        self.round = thread
            .spawn(move || {
                let began = Instant::now();
                lower_priority();
                // A session of which too little is recorded has no analysis yet; the next round tries again.
                if let Ok(analysis) = analyze(&path, &stop)
                    && !stop.load(Ordering::Relaxed)
                {
                    *newest.lock().unwrap_or_else(PoisonError::into_inner) =
                        Some(Arc::new(analysis));
                }
                began.elapsed()
            })
            .ok();
    }
}

fn analyze(path: &Path, stop: &Arc<AtomicBool>) -> Result<Analysis, ResultsError> {
    let session = Session::open(path, AnalysisOptions::default())?;
    let mut aligned = session.read_input()?.align();
    aligned.input.settings.study_presses = 0;
    aligned.input.settings.bootstrap_resamples = RESAMPLES;
    // The file closes: only the passes over the events open it from here on.
    drop(aligned.session);
    let events = aligned.events.stopping_on(Arc::clone(stop));
    Ok(skinrig_analysis::analyze(&aligned.input, &events)?)
}

/// Lets everything else on this machine go first, the recording most of all.
fn lower_priority() {
    #[cfg(target_os = "linux")]
    {
        // On Linux this is the thread's; one that the system refuses runs as it is.
        let _ = rustix::process::nice(NICE);
    }
}

//! Owns the thread that follows one session.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use serde_json::json;
use skinrig_recorder::{RecorderError, writer_of};

use super::alarms;
use super::estimates::Estimates;
use super::newest::{self, LiveState};
use super::parts::{Sender, publish};
use super::snapshot::SessionSnapshot;
use crate::lab::{Lab, RunState};

/// Between two questions to the run, and two looks at the state of the file.
const TICK: Duration = Duration::from_millis(100);
/// A session without pages is left after this.
const UNWATCHED: Duration = Duration::from_secs(3);
/// A session whose run does not answer, or has ended, may be being sealed, for which its writer needs the file alone: it is left alone
/// for three times as long as the writer waits at first, and some.
const LEFT_ALONE: Duration = Duration::from_secs(10);

/// Since when a session may be being sealed.
#[derive(Default)]
struct SealTimer(Option<Instant>);

impl SealTimer {
    fn may_go_on(&mut self, run: Option<&RunState>, is_written: bool) -> bool {
        if run.is_some_and(|run| !run.is_over) || !is_written {
            self.0 = None;
            return false;
        }
        self.0.get_or_insert_with(Instant::now).elapsed() < LEFT_ALONE
    }
}

/// Follows the session at `path` until it has neither writer nor viewers; `leave` forgets it.
pub(super) fn follow(
    leave: impl Fn(&Path, bool) -> bool,
    lab: &Arc<dyn Lab>,
    path: &Path,
    to: &Sender,
) {
    let live = LiveState::default();
    std::thread::scope(|scope| {
        let pictures = std::thread::Builder::new().name("pictures".to_owned());
        // Without this thread, pictures come from the file.
        let _ = pictures.spawn_scoped(scope, || newest::watch(lab, path, to, &live));
        let _over = OverOnDrop(&live);
        follow_file(leave, lab, path, to, &live);
    });
}

/// Ends the pictures with the follower, however it ends.
struct OverOnDrop<'a>(&'a LiveState);

impl Drop for OverOnDrop<'_> {
    fn drop(&mut self) {
        self.0.over.store(true, Ordering::Relaxed);
    }
}

/// Follows the file, and the run's own report.
fn follow_file(
    leave: impl Fn(&Path, bool) -> bool,
    lab: &Arc<dyn Lab>,
    path: &Path,
    to: &Sender,
    live: &LiveState,
) {
    let stop = Arc::new(AtomicBool::new(false));
    let mut snapshot = SessionSnapshot::new(path);
    let mut estimates = Estimates::new(path, &stop);
    let mut sealing = SealTimer::default();
    let mut unwatched: Option<Instant> = None;
    loop {
        // The writer first: a run that ends in between has then left its end in the file.
        let writer = writer_of(path);
        let run = writer.as_ref().and_then(|_| lab.run(path));
        let may_be_sealing = sealing.may_go_on(run.as_ref(), writer.is_some());
        stop.store(may_be_sealing, Ordering::Relaxed);
        let refreshed = if may_be_sealing {
            Ok(())
        } else {
            let has_pictures = live.answers.load(Ordering::Relaxed);
            snapshot.refresh(estimates.newest().as_deref(), has_pictures, to)
        };
        if writer.is_some() && !may_be_sealing {
            estimates.renew(snapshot.outcomes());
        }
        if let Some(analysis) = estimates.newest() {
            publish(to, "analysis", &crate::document::summary(&analysis));
        }
        let free_bytes = lab.free_bytes(path);
        let alarms = alarms::alarms(
            writer.is_some(),
            run.as_ref(),
            &snapshot,
            estimates.newest().as_deref(),
            free_bytes,
        );
        publish(to, "alarms", &alarms);
        let report = run.as_ref().map(|run| &run.report);
        publish(
            to,
            "run",
            &json!({ "run": report, "writer": writer, "free_bytes": free_bytes }),
        );
        match refreshed {
            Err(e) if writer.is_none() || !is_beginning(&e) => {
                publish(to, "over", &json!({ "error": e.to_string() }));
                break;
            }
            Ok(()) if writer.is_none() => {
                publish(to, "over", &json!({}));
                break;
            }
            _ => {}
        }
        if to.receiver_count() > 0 {
            unwatched = None;
        } else if unwatched.get_or_insert_with(Instant::now).elapsed() > UNWATCHED
            && leave(path, false)
        {
            break;
        }
        std::thread::sleep(TICK);
    }
    stop.store(true, Ordering::Relaxed);
    leave(path, true);
}

/// A run whose first records are not on the disk yet.
fn is_beginning(error: &RecorderError) -> bool {
    matches!(
        error,
        RecorderError::Empty { .. } | RecorderError::NotASession { .. }
    )
}

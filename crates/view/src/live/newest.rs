//! Owns the pictures of what a run receives at this moment: asked from the run itself, because the file is as old as its newest chunk.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use serde_json::json;
use skinrig_model::{CameraId, StreamFormat};
use skinrig_recorder::SessionReader;

use super::parts::{Sender, publish};
use super::picture;
use crate::lab::Lab;

/// Interval between requests to the run.
const LOOK: Duration = Duration::from_millis(50);
/// The same for a run that does not answer, and interval between checks for viewers.
const IDLE: Duration = Duration::from_millis(200);

/// State shared with the follower of the file.
#[derive(Debug, Default)]
pub(super) struct LiveState {
    /// True while the run itself answers: pictures from the file are older.
    pub answers: AtomicBool,
    /// Set at the end of the session.
    pub over: AtomicBool,
}

/// Publishes pictures until the session is over.
pub(super) fn watch(lab: &Arc<dyn Lab>, path: &Path, to: &Sender, state: &LiveState) {
    let mut formats = None;
    while !state.over.load(Ordering::Relaxed) {
        let answers = to.receiver_count() > 0 && look(&**lab, path, to, &mut formats);
        state.answers.store(answers, Ordering::Relaxed);
        std::thread::sleep(if answers { LOOK } else { IDLE });
    }
}

/// Publishes what the run has now; false if it does not answer.
fn look(lab: &dyn Lab, path: &Path, to: &Sender, formats: &mut Option<[StreamFormat; 2]>) -> bool {
    let Some(found) = lab.newest(path) else {
        return false;
    };
    if formats.is_none() {
        // The file is read once; it may be about to be created.
        let header = SessionReader::open(path).and_then(|reader| reader.header());
        *formats = header.ok().map(|header| header.stream_formats);
    }
    let Some(formats) = formats else {
        return false;
    };
    let pictures = CameraId::ALL.map(|camera| {
        let k = camera.index();
        picture::from_bytes(formats[k], &found[k].bytes, found[k].unix_s)
    });
    publish(to, "pictures", &json!(pictures));
    true
}

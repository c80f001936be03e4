//! Sessions that are being recorded: one follower thread per session, shared by all its pages.
//!
//! Pages get the newest value of each part as server-sent events. A page that reads slowly misses values in between, so memory does not
//! grow with the number of pages or their speed.

mod alarms;
mod estimates;
mod follower;
mod newest;
mod parts;
mod picture;
mod snapshot;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use axum::body::{Body, Bytes};
use axum::http::header;
use axum::response::{IntoResponse, Response};
use tokio::sync::watch;

use crate::lab::Lab;
use crate::problem::Problem;
use parts::{Parts, Sender};

/// A comment is sent after this long without news, so that a connection that is gone is noticed.
const KEEP_ALIVE: Duration = Duration::from_secs(15);
/// Sessions that are followed at a time, at most.
const MOST_FOLLOWED: usize = 16;

/// The sessions that are followed.
#[derive(Clone, Default)]
pub(crate) struct Hub(Arc<Mutex<BTreeMap<PathBuf, Arc<Sender>>>>);

impl Hub {
    /// Stream of the session at `path`; starts its follower if there is none yet.
    pub(crate) fn stream(&self, lab: &Arc<dyn Lab>, path: &Path) -> Result<Response, Problem> {
        let mut followed = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let receiver = match followed.get(path) {
            Some(sender) => sender.subscribe(),
            None if followed.len() >= MOST_FOLLOWED => {
                return Err(Problem::new(
                    axum::http::StatusCode::SERVICE_UNAVAILABLE,
                    format!(
                        "expected at most {MOST_FOLLOWED} sessions followed at a time\n  next: close other pages"
                    ),
                ));
            }
            None => {
                let (sender, receiver) = watch::channel(Parts::default());
                let sender = Arc::new(sender);
                let (hub, lab, of) = (self.clone(), Arc::clone(lab), path.to_owned());
                let its = Arc::clone(&sender);
                let leave = move |path: &Path, in_any_case| hub.leave(path, in_any_case);
                std::thread::Builder::new()
                    .name("follow".to_owned())
                    .spawn(move || follower::follow(leave, &lab, &of, &its))
                    .map_err(Problem::internal)?;
                followed.insert(path.to_owned(), sender);
                receiver
            }
        };
        drop(followed);
        let kind = (header::CONTENT_TYPE, "text/event-stream");
        Ok(([kind], Body::from_stream(events(receiver))).into_response())
    }

    /// Forgets `path` if nobody watches it any more, or in any case; true if it is forgotten.
    fn leave(&self, path: &Path, in_any_case: bool) -> bool {
        let mut followed = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let unwatched = followed.get(path).is_none_or(|s| s.receiver_count() == 0);
        if unwatched || in_any_case {
            followed.remove(path);
        }
        unwatched || in_any_case
    }
}

/// New parts until the follower ends.
fn events(
    receiver: watch::Receiver<Parts>,
) -> impl futures_util::Stream<Item = Result<Bytes, std::convert::Infallible>> {
    futures_util::stream::unfold((receiver, 0), async |(mut receiver, seen)| {
        loop {
            let (version, block) = {
                let parts = receiver.borrow_and_update();
                (parts.version, parts.since(seen))
            };
            if !block.is_empty() {
                return Some((Ok(block), (receiver, version)));
            }
            match tokio::time::timeout(KEEP_ALIVE, receiver.changed()).await {
                Ok(Ok(())) => {}
                // The follower has ended, and all of its parts are sent.
                Ok(Err(_)) => return None,
                Err(_) => return Some((Ok(Bytes::from_static(b":\n\n")), (receiver, seen))),
            }
        }
    })
}

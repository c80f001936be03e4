//! Runs the estimator of a recording: where the bytes arrive, or on a thread of its own that never makes them wait.

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};

use skinrig_model::{CameraId, StreamFormat};

use crate::run_estimator::RunEstimator;
use crate::skin_model::SkinModel;
use crate::stream::{CameraLeads, Estimate, StreamError};

/// Bytes that wait for the thread before further ones are skipped: 0.5 s of two cameras at 1 Mev/s.
const MOST_QUEUED: usize = 4 << 20;

/// Result of a worker.
#[derive(Debug, Clone, PartialEq)]
pub enum News {
    /// Touches are felt from now on.
    Started,
    /// No touches are felt any more.
    Failed(StreamError),
    /// An estimate, with the standard deviation of its times, µs.
    Estimate(Estimate, f64),
    /// Bytes were skipped, because they came faster than they were taken, or from one camera alone. Both cameras' events are
    /// evaluated until this host time, µs; the skin counts as idle afterwards.
    Skipped {
        /// Host time, µs.
        until_us: i64,
    },
}

/// Input of a worker.
enum Job {
    Bytes {
        camera: CameraId,
        lost: u64,
        bytes: Vec<u8>,
    },
    Start(Box<SkinModel>),
    Skip([u64; 2]),
}

/// Does the work.
struct Core {
    estimator: RunEstimator,
}

impl Core {
    fn bytes(&mut self, camera: CameraId, lost: u64, bytes: &[u8], mut each: impl FnMut(News)) {
        let fed = self.estimator.feed(camera, lost, bytes, |skin, estimate| {
            let at_us = match estimate {
                Estimate::Felt(d) => d.host_us,
                Estimate::Position { host_us, .. } => host_us,
            };
            each(News::Estimate(estimate, skin.time_sd_us(at_us as f64)));
        });
        if let Err(CameraLeads { .. }) = fed {
            self.skip([0, 0], each);
        }
    }

    fn skip(&mut self, bytes: [u64; 2], mut each: impl FnMut(News)) {
        if let Some(until_us) = self.estimator.reached_us() {
            each(News::Skipped { until_us });
        }
        if let Err(e) = self.estimator.skip(bytes) {
            each(News::Failed(e));
        }
    }

    fn start(&mut self, skin: SkinModel) -> News {
        match self.estimator.start(skin) {
            Ok(()) => News::Started,
            Err(e) => News::Failed(e),
        }
    }
}

/// The estimator of a recording.
pub struct Worker(Place);

enum Place {
    Here {
        core: Box<Core>,
        news: VecDeque<News>,
    },
    Thread(Thread),
}

impl Worker {
    /// Works where the bytes arrive: for rigs whose time stands still meanwhile. Positions of a touch come every so many µs.
    #[must_use]
    pub fn here(formats: [StreamFormat; 2], every_us: i64) -> Self {
        let estimator = RunEstimator::new(formats, every_us);
        Self(Place::Here {
            core: Box::new(Core { estimator }),
            news: VecDeque::new(),
        })
    }

    /// Works on a thread of its own.
    ///
    /// # Errors
    /// If the system starts no thread.
    pub fn on_a_thread(formats: [StreamFormat; 2], every_us: i64) -> std::io::Result<Self> {
        Thread::start(RunEstimator::new(formats, every_us))
            .map(|thread| Self(Place::Thread(thread)))
    }

    /// Feels from the bytes that follow.
    pub fn start(&mut self, skin: SkinModel) {
        match &mut self.0 {
            Place::Here { core, news } => news.push_back(core.start(skin)),
            Place::Thread(thread) => thread.send(Job::Start(Box::new(skin))),
        }
    }

    /// The next bytes of a camera, with `lost` bytes missing before them.
    pub fn feed(&mut self, camera: CameraId, lost: u64, bytes: &[u8]) {
        match &mut self.0 {
            Place::Here { core, news } => core.bytes(camera, lost, bytes, |n| news.push_back(n)),
            Place::Thread(thread) => thread.feed(camera, lost, bytes),
        }
    }

    /// The next news, if any; never waits.
    pub fn news(&mut self) -> Option<News> {
        match &mut self.0 {
            Place::Here { news, .. } => news.pop_front(),
            Place::Thread(thread) => thread.news.try_recv().ok(),
        }
    }
}

/// A worker on its own thread, which ends when this is dropped.
struct Thread {
    jobs: Sender<Job>,
    news: Receiver<News>,
    queued: Arc<AtomicUsize>,
    /// Bytes skipped since the queue was full.
    skipped: Option<[u64; 2]>,
}

impl Thread {
    fn start(estimator: RunEstimator) -> std::io::Result<Self> {
        let (jobs, todo) = channel();
        let (to, news) = channel();
        let queued = Arc::new(AtomicUsize::new(0));
        let waiting = Arc::clone(&queued);
        std::thread::Builder::new()
            .name("touch".to_owned())
            .spawn(move || work(Core { estimator }, &todo, &to, &waiting))?;
        Ok(Self {
            jobs,
            news,
            queued,
            skipped: None,
        })
    }

    /// Fails only if the thread panicked; then there is no more news.
    fn send(&self, job: Job) {
        let _ = self.jobs.send(job);
    }

    fn feed(&mut self, camera: CameraId, lost: u64, bytes: &[u8]) {
        let queued = self.queued.load(Ordering::Acquire);
        if let Some(skipped) = &mut self.skipped {
            if queued > 0 {
                skipped[camera.index()] += lost + bytes.len() as u64;
                return;
            }
            let skipped = *skipped;
            self.skipped = None;
            self.send(Job::Skip(skipped));
        } else if queued + bytes.len() > MOST_QUEUED {
            let mut skipped = [0; 2];
            skipped[camera.index()] = lost + bytes.len() as u64;
            self.skipped = Some(skipped);
            return;
        }
        self.queued.fetch_add(bytes.len(), Ordering::AcqRel);
        self.send(Job::Bytes {
            camera,
            lost,
            bytes: bytes.to_vec(),
        });
    }
}

fn work(mut core: Core, jobs: &Receiver<Job>, to: &Sender<News>, queued: &AtomicUsize) {
    for job in jobs {
        // Fails only if the receiver is gone.
        let each = |news| drop(to.send(news));
        match job {
            Job::Bytes {
                camera,
                lost,
                bytes,
            } => {
                core.bytes(camera, lost, &bytes, each);
                queued.fetch_sub(bytes.len(), Ordering::AcqRel);
            }
            Job::Start(skin) => each(core.start(*skin)),
            Job::Skip(bytes) => core.skip(bytes, each),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bytes that do not fit are skipped until the queue is empty; they are counted, and reported before the bytes that follow.
    #[test]
    fn a_full_queue_skips_and_reports_it() {
        let (jobs, todo) = channel();
        let (_, news) = channel();
        let queued = Arc::new(AtomicUsize::new(0));
        let mut thread = Thread {
            jobs,
            news,
            queued: Arc::clone(&queued),
            skipped: None,
        };
        let block = vec![0; MOST_QUEUED / 4];
        for _ in 0..6 {
            thread.feed(CameraId::One, 0, &block);
        }
        thread.feed(CameraId::Two, 7, &[1, 2, 3, 4]);
        let taken = |todo: &Receiver<Job>| todo.try_iter().collect::<Vec<_>>();
        let first = taken(&todo);
        assert_eq!(first.len(), 4);
        queued.fetch_sub(MOST_QUEUED / 2, Ordering::AcqRel);
        thread.feed(CameraId::Two, 0, &[5, 6]);
        assert!(taken(&todo).is_empty());
        queued.store(0, Ordering::Release);
        thread.feed(CameraId::One, 0, &[7, 8]);
        let rest = taken(&todo);
        let [
            Job::Skip(skipped),
            Job::Bytes {
                camera,
                lost,
                bytes,
            },
        ] = &rest[..]
        else {
            panic!("{} jobs", rest.len());
        };
        assert_eq!(*skipped, [2 * block.len() as u64, 7 + 4 + 2]);
        assert_eq!(
            (*camera, *lost, &bytes[..]),
            (CameraId::One, 0, &[7, 8][..])
        );
    }
}

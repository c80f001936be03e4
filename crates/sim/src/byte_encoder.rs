//! From what happens to a simulated camera to its bytes, on a thread of its own.

use std::panic::resume_unwind;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};

use skinrig_formats::{Scanner, evt2};
use skinrig_model::{CameraId, HostTime, StreamFormat};

use crate::camera_stream::{OutputQueue, StreamState};
use crate::config::CameraClockConfig;
use crate::drifting::DriftingClock;
use crate::faults::STORM_NS;
use crate::line::LineEdge;
use crate::scene::TipSample;

/// What happens to a camera between two polls.
pub(crate) struct Interval {
    /// The tip, from the end of the previous interval on.
    pub tips: Vec<TipSample>,
    /// Edges on its trigger input.
    pub edges: Vec<LineEdge>,
    pub faults: CameraFaults,
}

/// Faults of a camera in world time, ns.
pub(crate) struct CameraFaults {
    pub unplugged_ns: Option<i64>,
    pub stalled_ns: Option<i64>,
    pub storms_ns: Vec<i64>,
    pub losses: Vec<(i64, u64)>,
    pub steps: Vec<(i64, u32)>,
}

/// Encodes a camera's events and trigger edges as EVT2 bytes.
pub(crate) struct ByteEncoder {
    id: CameraId,
    chunk_bytes: usize,
    buffer_bytes: usize,
    /// Drawn at the first start.
    pub clock: Option<DriftingClock>,
    stream: Option<StreamState>,
    scanner: Scanner,
    pub out: OutputQueue,
    /// Whether the camera was unplugged.
    pub gone: bool,
}

impl ByteEncoder {
    pub(crate) fn new(id: CameraId, config: CameraClockConfig) -> Self {
        Self {
            id,
            chunk_bytes: config.chunk_bytes.max(4) / 4 * 4,
            buffer_bytes: config.buffer_bytes.max(4) / 4 * 4,
            clock: None,
            stream: None,
            scanner: Scanner::new(StreamFormat::Evt2),
            out: OutputQueue::default(),
            gone: false,
        }
    }

    /// Begins a stream.
    pub(crate) fn start(&mut self, stream: StreamState) {
        self.stream = Some(stream);
    }

    /// Ends the stream.
    pub(crate) fn stop(&mut self) {
        self.stream = None;
    }

    /// Closes the current chunk.
    pub(crate) fn close_chunk(&mut self) {
        self.out.close(self.id, &mut self.scanner);
    }

    /// Encodes what happened; nothing without a stream.
    fn encode(&mut self, interval: &Interval) {
        let (Some(stream), Some(mut clock)) = (&mut self.stream, self.clock) else {
            return;
        };
        let due = &interval.faults;
        stream.edges.extend(&interval.edges);
        // Bytes that were not fetched in time are lost, newest first.
        let mut room = self.buffer_bytes;
        for pair in interval.tips.windows(2) {
            let (from, to) = (pair[0], pair[1]);
            if due.unplugged_ns.is_some_and(|t| t <= from.t_ns) {
                self.gone = true;
                break;
            }
            let within = |t: &i64| (from.t_ns..to.t_ns).contains(t);
            let lose: u64 = due
                .losses
                .iter()
                .filter(|(t, _)| within(t))
                .map(|(_, words)| words * 4)
                .sum();
            if lose > 0 {
                self.out.close(self.id, &mut self.scanner);
                self.out.to_lose += lose;
            }
            for (_, by_us) in due.steps.iter().filter(|(t, _)| within(t)) {
                clock = clock.stepped(i64::from(*by_us));
                self.clock = Some(clock);
                stream.encoder = evt2::Encoder::new(clock.own_us(from.t_ns));
            }
            let stormy = |t: &i64| (*t..*t + STORM_NS).contains(&from.t_ns);
            let storm = due.storms_ns.iter().any(stormy);
            stream.step(from, to, clock, storm);
            if due.stalled_ns.is_some_and(|t| t <= from.t_ns) {
                stream.fresh.clear();
                continue;
            }
            if stream.fresh.len() > room {
                if self.out.lost_before == 0 {
                    self.out.close(self.id, &mut self.scanner);
                }
                self.out.lost_before += stream.fresh.len() as u64;
                stream.fresh.clear();
                continue;
            }
            room -= stream.fresh.len();
            self.out.take(
                &mut stream.fresh,
                HostTime(to.t_ns),
                self.id,
                &mut self.scanner,
                self.chunk_bytes,
            );
        }
    }
}

/// An encoder and the thread that it works on. The caller alone decides when to wait for it, so that threads change no byte.
pub(crate) struct Encoding {
    encoder: Arc<Mutex<ByteEncoder>>,
    queue: Arc<Mutex<Vec<Interval>>>,
    thread: Option<JoinHandle<()>>,
}

impl Encoding {
    pub(crate) fn new(encoder: ByteEncoder) -> Self {
        Self {
            encoder: Arc::new(Mutex::new(encoder)),
            queue: Arc::default(),
            thread: None,
        }
    }

    /// Whether a thread was started and not waited for.
    pub(crate) const fn is_running(&self) -> bool {
        self.thread.is_some()
    }

    /// The encoder, when it has encoded all that it was given.
    pub(crate) fn ended(&mut self) -> MutexGuard<'_, ByteEncoder> {
        self.join();
        // What came after the thread's last look.
        encode_all(&self.encoder, &self.queue);
        lock(&self.encoder)
    }

    /// Encodes what happened, after what happened before, on a thread; on this one if there can be no other.
    pub(crate) fn run(&mut self, intervals: &mut Vec<Interval>) {
        lock(&self.queue).append(intervals);
        if let Some(thread) = &self.thread
            && !thread.is_finished()
        {
            return;
        }
        self.join();
        let (encoder, queue) = (Arc::clone(&self.encoder), Arc::clone(&self.queue));
        let thread = thread::Builder::new().name("camera".to_owned());
        self.thread = thread.spawn(move || encode_all(&encoder, &queue)).ok();
    }

    /// Encodes what happened, after what happened before, on this thread.
    pub(crate) fn finish(&mut self, intervals: &mut Vec<Interval>) {
        lock(&self.queue).append(intervals);
        drop(self.ended());
    }

    fn join(&mut self) {
        if let Some(Err(panic)) = self.thread.take().map(JoinHandle::join) {
            resume_unwind(panic);
        }
    }
}

fn encode_all(encoder: &Mutex<ByteEncoder>, queue: &Mutex<Vec<Interval>>) {
    let mut encoder = lock(encoder);
    loop {
        let intervals = std::mem::take(&mut *lock(queue));
        if intervals.is_empty() {
            return;
        }
        for interval in intervals {
            encoder.encode(&interval);
        }
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

//! A camera that plays a recorded file: events or bytes in, EVT2 chunks out, behind the device trait.
//!
//! A thread reads the file and hands chunks over through a short queue, so that memory stays bounded however
//! long the recording is. The file's clock and the schedule's clock are unrelated until the analysis aligns
//! them; a chunk therefore "arrives" when the schedule's time reaches the file's time, and the last ones at
//! the stop.

use std::io;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

use skinrig_device::{CameraCapabilities, CameraSettings, Clock, DeviceError, EventCamera};
use skinrig_formats::{FormatsError, Geometry, Scanner, evt2};
use skinrig_model::{
    CameraId, CdEvent, ChunkFacts, DeviceIdentity, DeviceRole, RawChunk, Setting, StreamFormat,
    TriggerEdge,
};
use skinrig_sim::SimClock;

/// A chunk is closed at this size, bytes.
const CHUNK_BYTES: usize = 1 << 20;
/// Or when it spans this much camera time, µs: shorter than any press, so that bytes arrive during each press.
const CHUNK_SPAN_US: u64 = 400_000;
/// Bytes of a file that are scanned at once; a multiple of all words.
const PIECE_BYTES: usize = 1 << 14;
/// Chunks that may wait between the reading thread and the run.
const QUEUE: usize = 4;
/// A camera may have been started this long after the schedule's begin, µs; its file then ends as much earlier.
const LATE_START_US: u64 = 60_000_000;
/// A camera may go on for as long again as the schedule, or for this long, µs, after the last press.
const LATE_END_US: u64 = 3_600_000_000;
/// Time words of encoded streams come this often, µs: the sparsest that EVT2 allows, because a container without
/// time words gives no reason for more.
const TIME_HIGH_EVERY_US: u64 = 64;

/// A recording cannot be read to its end.
#[derive(Debug, thiserror::Error)]
pub(crate) enum RecordingError {
    /// The file is damaged, or has events that EVT2 cannot hold.
    #[error(transparent)]
    Formats(#[from] FormatsError),
    /// The container has no events.
    #[error("{}: expected events, found none", path.display())]
    NoEvents {
        /// The file.
        path: PathBuf,
    },
    /// The stream has no words.
    #[error("{}: expected events, found nothing after the header", path.display())]
    NoWords {
        /// The file.
        path: PathBuf,
    },
    /// Most words of the stream cannot be of the format that its header names.
    #[error(
        "{0}: expected words of {format}, as its header says, found {strange} of {words} that cannot be: the header is of another \
         recording\n  next: ask the program that recorded it for the format; the header's line `% evt` or `% format` names it",
        path.display()
    )]
    OtherFormat {
        /// The file.
        path: PathBuf,
        /// The format of the header.
        format: &'static str,
        /// Words that cannot be of it.
        strange: u64,
        /// Words that were tested, without those of the time base.
        words: u64,
    },
    /// The header names a sensor of another size.
    #[error(
        "{}: expected a recording of {} x {} pixels, found {width} x {height} in its header: its columns would be read as other angles\n  \
         next: import a recording of an EVK1 at full resolution; if the header is of another recording, correct its line `% geometry`",
        path.display(), Geometry::EVK1.width, Geometry::EVK1.height
    )]
    OtherSensor {
        /// The file.
        path: PathBuf,
        /// Columns.
        width: u16,
        /// Rows.
        height: u16,
    },
    /// The stream ends within a word.
    #[error(
        "{0}: expected whole words of {word} bytes, found {rest} bytes after the last one: the file is cut off\n  next: copy it \
         again; if that is all of it, `truncate --size {whole} \"{0}\"` leaves the whole words",
        path.display()
    )]
    CutOff {
        /// The file.
        path: PathBuf,
        /// Bytes per word.
        word: u64,
        /// Bytes after the last whole word.
        rest: u64,
        /// Bytes of the file up to its end.
        whole: u64,
    },
}

/// The thread that reads a recording cannot be started.
#[derive(Debug, thiserror::Error)]
#[error("cannot start a reading thread: {0}")]
pub(crate) struct ThreadError(#[from] io::Error);

type QueuedChunk = Result<(Vec<u8>, ChunkFacts, Vec<TriggerEdge>), RecordingError>;

/// Input side of the queue, used by the reading thread.
pub(crate) struct ChunkFeed {
    queue: SyncSender<QueuedChunk>,
    format: StreamFormat,
    scanner: Scanner,
    encoder: Option<evt2::Encoder>,
    open: OpenChunk,
    /// Begin of the open chunk of encoded events.
    chunk_from_us: u64,
}

/// The chunk that is being filled.
#[derive(Default)]
struct OpenChunk {
    bytes: Vec<u8>,
    /// Bytes of them that were scanned.
    scanned: usize,
    /// What was found in these.
    facts: ChunkFacts,
    triggers: Vec<TriggerEdge>,
}

impl OpenChunk {
    /// Scans the rest.
    fn scan(&mut self, scanner: &mut Scanner) {
        let (facts, triggers) = scanner.push(&self.bytes[self.scanned..]);
        self.scanned = self.bytes.len();
        self.facts = ChunkFacts {
            cd_events: self.facts.cd_events + facts.cd_events,
            on_events: self.facts.on_events + facts.on_events,
            trigger_edges: self.facts.trigger_edges + facts.trigger_edges,
            first_us: self.facts.first_us.or(facts.first_us),
            last_us: facts.last_us.or(self.facts.last_us),
        };
        self.triggers.extend(triggers);
    }
}

/// The run ended before the file, so reading stops.
#[derive(Debug)]
pub(super) struct ImportEnded;

impl ChunkFeed {
    /// Encodes the next events of a container that stores no words, in time order.
    ///
    /// # Errors
    /// [`ImportEnded`]; [`ChunkFeed::fail`] has been called when an event cannot be encoded.
    pub(super) fn events(&mut self, events: &[CdEvent]) -> Result<(), ImportEnded> {
        for event in events {
            if self.encoder.is_none() {
                let first = event.t_us - event.t_us % TIME_HIGH_EVERY_US;
                match evt2::Encoder::with_cadence(first, TIME_HIGH_EVERY_US) {
                    Ok(encoder) => self.encoder = Some(encoder),
                    Err(e) => return self.fail(e.into()),
                }
                self.chunk_from_us = first;
            }
            // Idle stretches are closed piece by piece, so that no chunk spans hours.
            while event.t_us - self.chunk_from_us >= CHUNK_SPAN_US {
                let end = self.chunk_from_us + CHUNK_SPAN_US;
                if let Some(Err(e)) = self
                    .encoder
                    .as_mut()
                    .map(|x| x.advance_to(end, &mut self.open.bytes))
                {
                    return self.fail(e.into());
                }
                self.send()?;
                self.chunk_from_us = end;
            }
            // Events outside the sensor stay outside: EVT2 holds no larger coordinates.
            let event = CdEvent {
                x: event.x.min(evt2::MAX_COORDINATE),
                y: event.y.min(evt2::MAX_COORDINATE),
                ..*event
            };
            if let Some(Err(e)) = self
                .encoder
                .as_mut()
                .map(|x| x.cd(event, &mut self.open.bytes))
            {
                return self.fail(e.into());
            }
            if self.open.bytes.len() >= CHUNK_BYTES {
                self.send()?;
                self.chunk_from_us = event.t_us;
            }
        }
        Ok(())
    }

    /// Takes the next bytes of a stream that is recorded unchanged; a whole number of words, but for the last ones.
    ///
    /// # Errors
    /// [`ImportEnded`].
    pub(super) fn raw(&mut self, bytes: &[u8]) -> Result<(), ImportEnded> {
        for piece in bytes.chunks(PIECE_BYTES) {
            self.piece(piece)?;
        }
        Ok(())
    }

    /// Takes bytes into the open chunk, or into a new one if that would span too much time. A file that another program wrote may have
    /// no time words between its events: few bytes then span minutes.
    fn piece(&mut self, bytes: &[u8]) -> Result<(), ImportEnded> {
        let (facts, _) = self.scanner.clone().push(bytes);
        let is_long = |first_us: Option<u64>| {
            let span_us = facts
                .last_us
                .zip(first_us)
                .map(|(b, a)| b.saturating_sub(a));
            span_us.is_some_and(|us| us >= CHUNK_SPAN_US)
        };
        let word = self.format.word_bytes();
        if is_long(facts.first_us) && bytes.len() > word {
            let (one, two) = bytes.split_at((bytes.len() / 2).next_multiple_of(word));
            self.piece(one)?;
            return self.piece(two);
        }
        if is_long(self.open.facts.first_us) {
            self.send()?;
        }
        self.open.bytes.extend_from_slice(bytes);
        self.open.scan(&mut self.scanner);
        if self.open.bytes.len() >= CHUNK_BYTES {
            self.send()?;
        }
        Ok(())
    }

    /// Ends the stream with an error.
    ///
    /// # Errors
    /// Always [`ImportEnded`].
    pub(super) fn fail(&mut self, error: RecordingError) -> Result<(), ImportEnded> {
        self.queue.send(Err(error)).map_err(|_| ImportEnded)?;
        Err(ImportEnded)
    }

    fn send(&mut self) -> Result<(), ImportEnded> {
        if self.open.bytes.is_empty() {
            return Ok(());
        }
        self.open.scan(&mut self.scanner);
        let chunk = std::mem::take(&mut self.open);
        self.queue
            .send(Ok((chunk.bytes, chunk.facts, chunk.triggers)))
            .map_err(|_| ImportEnded)
    }
}

/// The camera.
pub(crate) struct FileCamera {
    camera: CameraId,
    identity: DeviceIdentity,
    format: StreamFormat,
    clock: SimClock,
    queue: Receiver<QueuedChunk>,
    waiting: Option<(Vec<u8>, ChunkFacts, Vec<TriggerEdge>)>,
    base_us: Option<u64>,
    /// End of the last chunk handed over, after the file's first word.
    reached_us: u64,
    seq: u64,
    streaming: bool,
}

impl FileCamera {
    /// A camera whose stream `read` produces on a thread of its own. `read` ends with an error or
    /// when the file does.
    ///
    /// # Errors
    /// When the thread cannot be started.
    pub(super) fn new(
        camera: CameraId,
        identity: DeviceIdentity,
        format: StreamFormat,
        clock: SimClock,
        read: impl FnOnce(&mut ChunkFeed) -> Result<(), RecordingError> + Send + 'static,
    ) -> Result<Self, ThreadError> {
        let (sender, queue) = sync_channel(QUEUE);
        std::thread::Builder::new()
            .name(format!("read-camera-{}", camera.number()))
            .spawn(move || {
                let mut feed = ChunkFeed {
                    queue: sender,
                    format,
                    scanner: Scanner::new(format),
                    encoder: None,
                    open: OpenChunk::default(),
                    chunk_from_us: 0,
                };
                let _ = match read(&mut feed) {
                    Ok(()) => feed.send(),
                    Err(error) => feed.fail(error),
                };
            })?;
        Ok(Self {
            camera,
            identity,
            format,
            clock,
            queue,
            waiting: None,
            base_us: None,
            reached_us: 0,
            seq: 0,
            streaming: false,
        })
    }

    /// Hands over chunks that end within `until_us` after the file's first word; all with `None`.
    fn hand_over(
        &mut self,
        until_us: Option<u64>,
        chunks: &mut Vec<RawChunk>,
    ) -> Result<(), DeviceError> {
        loop {
            let (bytes, facts, triggers) = match self.waiting.take() {
                Some(waiting) => waiting,
                None => match self.queue.recv() {
                    Ok(Ok(next)) => next,
                    Ok(Err(error)) => return Err(self.lost(error.to_string())),
                    Err(_) => return self.ended(until_us),
                },
            };
            let base_us = *self.base_us.get_or_insert(facts.first_us.unwrap_or(0));
            let due = match (until_us, facts.last_us) {
                (Some(until), Some(last)) => last.saturating_sub(base_us) <= until,
                _ => true,
            };
            if until_us.is_none() {
                self.check_end(facts.last_us.map_or(0, |last| last.saturating_sub(base_us)))?;
            }
            if !due {
                self.waiting = Some((bytes, facts, triggers));
                return Ok(());
            }
            if let Some(last) = facts.last_us {
                self.reached_us = last.saturating_sub(base_us);
            }
            chunks.push(RawChunk {
                camera: self.camera,
                seq: self.seq,
                host_time: self.clock.now(),
                lost_before: 0,
                lost_from_us: None,
                bytes,
                facts,
                triggers,
            });
            self.seq += 1;
        }
    }

    /// Called after the last press: an error if the recording, which has `reached_us` by now, goes on and on. Its times then have
    /// another unit, and to encode days of an idle camera would fill the memory.
    fn check_end(&self, reached_us: u64) -> Result<(), DeviceError> {
        let now_us = u64::try_from(self.clock.now().0 / 1_000).unwrap_or(0);
        if reached_us <= now_us + now_us.max(LATE_END_US) {
            return Ok(());
        }
        Err(self.lost(format!(
            "the recording goes on for more than {:.0} s after the schedule's end at {:.0} s: expected a recording as long as its \
             schedule; are its times in the unit of the format, and is it the schedule of this recording?",
            now_us.max(LATE_END_US) as f64 * 1e-6,
            now_us as f64 * 1e-6
        )))
    }

    /// Called at the end of the file: an error if the schedule continues long after it.
    fn ended(&self, until_us: Option<u64>) -> Result<(), DeviceError> {
        match until_us {
            Some(now_us) if now_us > self.reached_us + LATE_START_US => Err(self.lost(format!(
                "the recording ends after {:.0} s, but the schedule has presses until {:.0} s: expected a \
                 recording as long as its schedule; is it the schedule of this recording?",
                self.reached_us as f64 * 1e-6,
                now_us as f64 * 1e-6
            ))),
            _ => Ok(()),
        }
    }

    fn lost(&self, detail: String) -> DeviceError {
        DeviceError::Lost {
            role: DeviceRole::of_camera(self.camera),
            serial: self.identity.serial.clone(),
            detail,
        }
    }
}

impl EventCamera for FileCamera {
    fn camera(&self) -> CameraId {
        self.camera
    }

    fn identity(&self) -> DeviceIdentity {
        self.identity.clone()
    }

    fn capabilities(&self) -> CameraCapabilities {
        CameraCapabilities {
            width: skinrig_model::SENSOR_WIDTH,
            height: skinrig_model::SENSOR_HEIGHT,
            format: self.format,
            trigger_channels: vec![0, 6, 7],
            biases: Vec::new(),
        }
    }

    fn configure(&mut self, _settings: &CameraSettings) -> Result<Vec<Setting>, DeviceError> {
        Ok(Vec::new())
    }

    fn start(&mut self) -> Result<(), DeviceError> {
        self.streaming = true;
        Ok(())
    }

    fn poll(&mut self, chunks: &mut Vec<RawChunk>) -> Result<(), DeviceError> {
        if !self.streaming {
            return Ok(());
        }
        let now_us = u64::try_from(self.clock.now().0 / 1_000).unwrap_or(0);
        self.hand_over(Some(now_us), chunks)
    }

    fn flush(&mut self, chunks: &mut Vec<RawChunk>) -> Result<(), DeviceError> {
        self.poll(chunks)
    }

    fn stop(&mut self, chunks: &mut Vec<RawChunk>) -> Result<(), DeviceError> {
        if !self.streaming {
            return Ok(());
        }
        self.streaming = false;
        self.hand_over(None, chunks)
    }
}

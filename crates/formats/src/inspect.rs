//! Inspects an event file: kind, header, counts, time span, rate, gaps. Streams, so files may have any size.

use std::io::Read as _;
use std::path::Path;

use skinrig_model::{CdEvent, Polarity, StreamFormat, TriggerEdge};

use crate::error::FormatsError;
use crate::hdf5::Container;
use crate::raw::RawReader;
use crate::regular;
use crate::stream::{Discontinuity, EventSink, Geometry, StreamStats};

/// Gaps and discontinuities beyond this number are counted but not listed.
pub(crate) const LIST_LIMIT: usize = 100;

/// Kind of a file, according to its first bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FileKind {
    /// Prophesee RAW: text that begins with `% `.
    Raw,
    /// HDF5.
    Hdf5,
    /// SQLite, the format of sessions.
    Sqlite,
    /// None of these.
    Unknown,
}

impl FileKind {
    /// Reads the first bytes of `path`.
    ///
    /// # Errors
    /// [`FormatsError::Io`].
    pub fn detect(path: &Path) -> Result<Self, FormatsError> {
        let mut start = Vec::new();
        regular::open(path)
            .and_then(|file| file.take(16).read_to_end(&mut start))
            .map_err(FormatsError::io(path))?;
        Ok(match &start[..] {
            [b'%', b' ', ..] => Self::Raw,
            [0x89, b'H', b'D', b'F', b'\r', b'\n', 0x1a, b'\n', ..] => Self::Hdf5,
            s if s.starts_with(b"SQLite format 3\0") => Self::Sqlite,
            _ => Self::Unknown,
        })
    }
}

/// Result of inspecting a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Inspection {
    /// Kind of the file.
    pub kind: FileKind,
    /// Keys and values of the header, in file order; for HDF5 the program that wrote the file.
    pub header: Vec<(String, String)>,
    /// Word format; `None` for HDF5.
    pub format: Option<StreamFormat>,
    /// The sensor's size, if the file states it.
    pub geometry: Option<Geometry>,
    /// The sensors: one in RAW files, one or more in HDF5.
    pub streams: Vec<StreamInspection>,
}

/// Statistics of one sensor.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StreamInspection {
    /// Its name in an HDF5 container; empty if it is the only one.
    pub name: String,
    /// Counts.
    pub stats: StreamStats,
    /// Time of the first timed word or row, µs.
    pub first_us: Option<u64>,
    /// Time of the last timed word or row, µs.
    pub last_us: Option<u64>,
    /// Seconds added to the camera's time (HDF5).
    pub ts_offset_s: Option<f64>,
    /// Silences longer than the threshold: no CD event and no trigger edge. At most `LIST_LIMIT` of them.
    pub gaps: Vec<Gap>,
    /// Total number of silences.
    pub gap_count: u64,
    /// Steps of the time base that are neither progress nor a wrap. At most `LIST_LIMIT` of them; all are
    /// counted in `stats`.
    pub discontinuities: Vec<Discontinuity>,
    steps_back: bool,
    previous_us: Option<u64>,
    threshold_us: u64,
}

/// A silence between two events.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Gap {
    /// The event before it, µs.
    pub from_us: u64,
    /// The event after it, µs.
    pub to_us: u64,
}

impl StreamInspection {
    /// Starts inspecting a stream called `name`; reports silences longer than `gap_us`. Feed it as the
    /// sink of a [`Decoder`](crate::Decoder), then call [`Self::finish`].
    #[must_use]
    pub fn new(name: &str, gap_us: u64) -> Self {
        Self {
            name: name.into(),
            threshold_us: gap_us,
            ..Self::default()
        }
    }

    /// Takes the counts and times of the decoder.
    pub fn finish(&mut self, decoder: &crate::Decoder) {
        self.stats = decoder.stats();
        self.first_us = decoder.first_us();
        self.last_us = decoder.last_us();
    }

    /// Length of the recording in seconds; `None` without two times in order, or where the time steps back.
    #[must_use]
    pub fn span_s(&self) -> Option<f64> {
        if self.steps_back {
            return None;
        }
        let span_us = self.last_us?.checked_sub(self.first_us?)?;
        Some(span_us as f64 * 1e-6)
    }

    /// CD events per second over the whole span, Hz; `None` for an empty span.
    #[must_use]
    pub fn mean_rate_hz(&self) -> Option<f64> {
        let span_s = self.span_s().filter(|s| *s > 0.0)?;
        Some(self.stats.cd_events() as f64 / span_s)
    }

    fn see(&mut self, t_us: u64) {
        if let Some(from_us) = self.previous_us
            && t_us.saturating_sub(from_us) > self.threshold_us
        {
            self.gap_count += 1;
            if self.gaps.len() < LIST_LIMIT {
                self.gaps.push(Gap {
                    from_us,
                    to_us: t_us,
                });
            }
        }
        self.previous_us = Some(t_us);
    }
}

impl EventSink for StreamInspection {
    fn on_cd(&mut self, events: &[CdEvent]) {
        for event in events {
            self.see(event.t_us);
        }
    }
    fn on_trigger(&mut self, edge: TriggerEdge) {
        self.see(edge.t_us);
    }
    fn on_discontinuity(&mut self, step: Discontinuity) {
        self.steps_back |= step.to_us < step.from_us;
        if self.discontinuities.len() < LIST_LIMIT {
            self.discontinuities.push(step);
        }
    }
}

/// Reads all of `path`, a RAW or HDF5 file, and reports silences longer than `gap_us`.
///
/// # Errors
/// As [`RawReader`], [`Container`] and its events; [`FormatsError::Container`] for other kinds of files.
pub fn inspect(path: &Path, gap_us: u64) -> Result<Inspection, FormatsError> {
    let found = match FileKind::detect(path)? {
        FileKind::Raw => return inspect_raw(path, gap_us),
        FileKind::Hdf5 => return inspect_hdf5(path, gap_us),
        FileKind::Sqlite => "an SQLite database",
        FileKind::Unknown => "another kind of file",
    };
    Err(FormatsError::Container {
        path: path.into(),
        expected: "a Prophesee RAW file or an HDF5 file".into(),
        found: found.into(),
    })
}

fn inspect_raw(path: &Path, gap_us: u64) -> Result<Inspection, FormatsError> {
    let mut reader = RawReader::open(path)?;
    let mut decoder = reader.decoder();
    let mut stream = StreamInspection::new("", gap_us);
    loop {
        match reader.next_chunk()? {
            [] => break,
            bytes => decoder.push(bytes, &mut stream),
        }
    }
    stream.finish(&decoder);
    let header = reader.header();
    Ok(Inspection {
        kind: FileKind::Raw,
        header: header.entries.clone(),
        format: Some(header.format),
        geometry: header.geometry,
        streams: vec![stream],
    })
}

fn inspect_hdf5(path: &Path, gap_us: u64) -> Result<Inspection, FormatsError> {
    let container = Container::open(path)?;
    let mut streams = Vec::new();
    for entry in container.entries() {
        let mut stream = StreamInspection::new(&entry.name, gap_us);
        stream.ts_offset_s = entry.ts_offset_s;
        let mut events = container.events(Some(&entry.name), Geometry::EVK1)?;
        loop {
            let batch = events.next_batch()?;
            let (Some(first), Some(last)) = (batch.first(), batch.last()) else {
                break;
            };
            let on = batch.iter().filter(|e| e.polarity == Polarity::On).count() as u64;
            stream.stats.cd_on += on;
            stream.stats.cd_off += batch.len() as u64 - on;
            stream.first_us.get_or_insert(first.t_us);
            stream.last_us = Some(last.t_us);
            stream.on_cd(batch);
        }
        streams.push(stream);
    }
    Ok(Inspection {
        kind: FileKind::Hdf5,
        header: vec![("written by".into(), container.written_by().into())],
        format: None,
        geometry: None,
        streams,
    })
}

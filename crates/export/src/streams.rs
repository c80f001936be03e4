//! Owns the long tables, written in batches: events and robot poses.

use skinrig_model::{CameraId, CdEvent, HostTime, Polarity, PoseSample, StreamFormat};
use skinrig_recorder::SessionReader;

use crate::cameras::for_each_events;
use crate::error::ExportError;
use crate::source::{Source, TableName};
use crate::table::{Column, Kind, Layout, TableWriter, Values};

/// Rows per batch: about 10 MB of events.
const BATCH: usize = 1 << 19;

fn layout(name: &'static str, columns: &[(&str, Kind)]) -> Layout {
    let columns = columns.iter().map(|(name, kind)| Column {
        name: (*name).to_owned(),
        kind: *kind,
    });
    Layout {
        name,
        columns: columns.collect(),
    }
}

/// Columns of a batch of events.
#[derive(Default)]
struct EventBatch {
    t_us: Vec<i64>,
    x: Vec<u16>,
    y: Vec<u16>,
    on: Vec<bool>,
}

impl EventBatch {
    fn extend(&mut self, events: &[CdEvent]) {
        // Camera times stay far below 2^63 µs.
        let time = |e: &CdEvent| i64::try_from(e.t_us).unwrap_or(i64::MAX);
        self.t_us.extend(events.iter().map(time));
        self.x.extend(events.iter().map(|e| e.x));
        self.y.extend(events.iter().map(|e| e.y));
        self.on
            .extend(events.iter().map(|e| e.polarity == Polarity::On));
    }

    /// Returns the rows collected so far and clears them.
    fn take(&mut self) -> [Values; 4] {
        let Self { t_us, x, y, on } = std::mem::take(self);
        [
            Values::Int(t_us),
            Values::Pixel(x),
            Values::Pixel(y),
            Values::Flag(on),
        ]
    }
}

/// Number of events, from the chunk facts. Sessions with losses are decoded again, because the decoder
/// of old versions ignored losses.
fn count(
    reader: &SessionReader,
    format: StreamFormat,
    camera: CameraId,
) -> Result<u64, ExportError> {
    let index = reader.chunk_index(camera)?;
    if index.iter().all(|chunk| chunk.lost_before == 0) {
        return Ok(index.iter().map(|chunk| chunk.facts.cd_events).sum());
    }
    let mut events = 0;
    for_each_events(reader, format, camera, |slice| {
        events += slice.len() as u64;
        Ok(())
    })?;
    Ok(events)
}

/// Writes the CD events of a camera, in stream order, on its own clock.
pub(crate) fn events(
    source: &Source<'_>,
    camera: CameraId,
    name: &'static str,
    to: &mut dyn TableWriter,
) -> Result<(), ExportError> {
    let format = source.header.stream_formats[camera.index()];
    let expected = count(source.reader, format, camera)?;
    let columns = [
        ("t_us", Kind::Int),
        ("x_px", Kind::Pixel),
        ("y_px", Kind::Pixel),
        ("on", Kind::Flag),
    ];
    to.begin(&layout(name, &columns), expected)?;
    let mut found = 0;
    let mut batch = EventBatch::default();
    for_each_events(source.reader, format, camera, |events| {
        found += events.len() as u64;
        for part in events.chunks(BATCH) {
            batch.extend(part);
            if batch.t_us.len() >= BATCH {
                to.append(&batch.take())?;
            }
        }
        Ok(())
    })?;
    to.append(&batch.take())?;
    ExportError::check_rows(name, expected, found)?;
    to.end()
}

/// Writes the poses of the robot: commanded and measured, skin frame.
pub(crate) fn pose(source: &Source<'_>, to: &mut dyn TableWriter) -> Result<(), ExportError> {
    let name = TableName::Pose.name();
    let numbers = [
        "commanded_x_mm",
        "commanded_y_mm",
        "commanded_z_mm",
        "measured_x_mm",
        "measured_y_mm",
        "measured_z_mm",
        "force_n",
    ];
    let mut columns = vec![("t_ns", Kind::Int)];
    columns.extend(numbers.map(|name| (name, Kind::Real)));
    let expected = source.reader.pose_samples()?;
    to.begin(&layout(name, &columns), expected)?;
    let (mut found, mut fault) = (0, None);
    let mut samples: Vec<PoseSample> = Vec::new();
    let (from, until) = (HostTime(i64::MIN), HostTime(i64::MAX));
    source.reader.for_each_pose_block(from, until, |block| {
        found += block.len() as u64;
        samples.extend_from_slice(block);
        if samples.len() >= BATCH && fault.is_none() {
            fault = to.append(&pose_batch(&samples)).err();
            samples.clear();
        }
    })?;
    if let Some(fault) = fault {
        return Err(fault);
    }
    to.append(&pose_batch(&samples))?;
    ExportError::check_rows(name, expected, found)?;
    to.end()
}

fn pose_batch(samples: &[PoseSample]) -> Vec<Values> {
    let real = |of: fn(&PoseSample) -> f64| Values::Real(samples.iter().map(of).collect());
    vec![
        Values::Int(samples.iter().map(|s| s.t.0).collect()),
        real(|s| s.commanded.x_mm),
        real(|s| s.commanded.y_mm),
        real(|s| s.commanded.z_mm),
        real(|s| s.measured.x_mm),
        real(|s| s.measured.y_mm),
        real(|s| s.measured.z_mm),
        real(|s| s.force_n),
    ]
}

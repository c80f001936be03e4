//! Exports camera streams in their own formats, and decodes them for tables.

use std::path::Path;

use skinrig_formats::Decoder;
use skinrig_formats::hdf5::EventWriter;
use skinrig_formats::raw::{RawMetadata, RawWriter};
use skinrig_model::{CameraId, CdEvent, DeviceRole, RunHeader, StreamFormat};
use skinrig_recorder::SessionReader;

use crate::error::ExportError;

/// Calls `each` with the events of `camera` in stream order, leg after leg, in camera times as recorded.
pub(crate) fn for_each_events(
    reader: &SessionReader,
    format: StreamFormat,
    camera: CameraId,
    mut each: impl FnMut(&[CdEvent]) -> Result<(), ExportError>,
) -> Result<(), ExportError> {
    let mut decoder = Decoder::new(format);
    let mut fault = None;
    reader.for_each_chunk(camera, 0, |meta, bytes| {
        if fault.is_some() {
            return;
        }
        if let Some(origin_us) = meta.restart_us {
            decoder.restart(origin_us);
        }
        decoder.lost(meta.lost_before);
        decoder.for_each_slice(bytes, |events| {
            if fault.is_none() {
                fault = each(events).err();
            }
        });
    })?;
    fault.map_or(Ok(()), Err)
}

/// Writes the bytes of one camera to a Prophesee RAW file at `path`, unmodified.
///
/// # Errors
/// When the session cannot be read, or the file exists or cannot be written.
pub fn write_raw(
    reader: &SessionReader,
    header: &RunHeader,
    camera: CameraId,
    path: &Path,
) -> Result<(), ExportError> {
    let devices = reader.devices()?;
    let device = devices
        .iter()
        .find(|d| d.role == DeviceRole::of_camera(camera));
    let serial = device.map_or("unknown", |d| d.identity.serial.as_str());
    // RAW headers have a civil date without a time zone; the session's start is UTC.
    let date = header
        .started_at
        .chars()
        .take(19)
        .collect::<String>()
        .replace('T', " ");
    // The header has the fields of an EVK1; this one names what the events came from.
    let model = device.map_or("", |d| d.identity.model.as_str());
    let source: Vec<&str> = model.split_whitespace().collect();
    let more = match source.is_empty() {
        true => Vec::new(),
        false => vec![("skinrig_source".to_owned(), source.join(" "))],
    };
    let metadata = RawMetadata {
        more,
        format: header.stream_formats[camera.index()],
        ..RawMetadata::evk1(&date, serial)
    };
    let mut writer = RawWriter::create(path, &metadata).map_err(ExportError::file(path))?;
    let mut fault = None;
    reader.for_each_chunk(camera, 0, |_, bytes| {
        if fault.is_none() {
            fault = writer.write(bytes).err();
        }
    })?;
    fault
        .map_or_else(|| writer.finish(), Err)
        .map_err(ExportError::file(path))
}

/// Writes the events of one camera to a bimvee HDF5 container at `path`; times count from the camera's first event.
///
/// # Errors
/// When the session cannot be read, or the file exists or cannot be written.
pub fn write_hdf5(
    reader: &SessionReader,
    header: &RunHeader,
    camera: CameraId,
    path: &Path,
) -> Result<(), ExportError> {
    let format = header.stream_formats[camera.index()];
    let mut writer: Option<EventWriter> = None;
    for_each_events(reader, format, camera, |events| {
        let Some(first) = events.first() else {
            return Ok(());
        };
        match &mut writer {
            Some(writer) => writer.append(events),
            None => EventWriter::create(path, first.t_us)
                .and_then(|created| writer.insert(created).append(events)),
        }
        .map_err(ExportError::file(path))
    })?;
    let writer = match writer {
        Some(writer) => writer,
        None => EventWriter::create(path, 0).map_err(ExportError::file(path))?,
    };
    writer.finish().map(drop).map_err(ExportError::file(path))
}

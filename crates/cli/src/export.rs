//! `skinrig export`: a session's data in other programs' formats.

use std::path::Path;

use skinrig_formats::Decoder;
use skinrig_formats::hdf5::EventWriter;
use skinrig_formats::raw::{RawMetadata, RawWriter};
use skinrig_model::{CameraId, DeviceRole, HostTime, PoseSample, RunHeader};
use skinrig_recorder::SessionReader;

use crate::args::{ExportArgs, ExportKind};
use crate::exit::{Exit, Failure, Outcome};
use crate::paths::beside;

/// Writes what was asked for and names the files.
///
/// # Errors
/// [`Failure::input`] for an unreadable session; [`Failure::internal`] when a file cannot be written.
pub fn export(args: &ExportArgs, json: bool) -> Outcome {
    let reader = SessionReader::open(&args.session).map_err(Failure::input)?;
    let header = reader.header().map_err(Failure::input)?;
    let wants = |kind| args.kinds.contains(&kind) || args.kinds.contains(&ExportKind::All);
    if let Some(folder) = &args.out {
        std::fs::create_dir_all(folder)
            .map_err(|e| Failure::internal(format!("{}: cannot make it: {e}", folder.display())))?;
    }
    let target = |ending: &str| {
        let path = beside(&args.session, ending);
        match (&args.out, path.file_name()) {
            (Some(folder), Some(name)) => folder.join(name),
            _ => path,
        }
    };
    let mut written = Vec::new();
    if wants(ExportKind::Raw) {
        for camera in CameraId::ALL {
            let path = target(&format!(".camera{}.raw", camera.number()));
            raw(&reader, &header, camera, &path)?;
            written.push(path);
        }
    }
    if wants(ExportKind::Hdf5) {
        for camera in CameraId::ALL {
            let path = target(&format!(".camera{}.hdf5", camera.number()));
            hdf5(&reader, &header, camera, &path)?;
            written.push(path);
        }
    }
    if wants(ExportKind::Presses) {
        let path = target(".presses.csv");
        presses(&reader, &path)?;
        written.push(path);
    }
    if wants(ExportKind::Poses) {
        let path = target(".poses.csv");
        poses(&reader, &path)?;
        written.push(path);
    }
    if json {
        crate::print_json(&serde_json::json!({ "written": written }));
    } else {
        for path in &written {
            outln!("{}", path.display());
        }
    }
    Ok(Exit::Ok)
}

fn failed<E: std::fmt::Display>(path: &Path) -> impl Fn(E) -> Failure + '_ {
    move |e| {
        Failure::internal(format!(
            "{}: {e}\n  next: move an older export away, or choose another folder with --out",
            path.display()
        ))
    }
}

/// One camera's bytes as a Prophesee RAW file, unmodified.
fn raw(
    reader: &SessionReader,
    header: &RunHeader,
    camera: CameraId,
    path: &Path,
) -> Result<(), Failure> {
    let devices = reader.devices().map_err(Failure::input)?;
    let device = devices
        .iter()
        .find(|d| d.role == DeviceRole::of_camera(camera));
    let serial = device.map_or("unknown", |d| d.identity.serial.as_str());
    // RAW headers carry a civil date without a zone; the session's start is UTC.
    let date = header
        .started_at
        .chars()
        .take(19)
        .collect::<String>()
        .replace('T', " ");
    let format = header.stream_formats[camera.index()];
    let model = device.map_or("", |d| d.identity.model.as_str());
    let more = if model.contains("re-encoded") {
        vec![("skinrig_source".to_owned(), model.to_owned())]
    } else {
        Vec::new()
    };
    let metadata = RawMetadata {
        more,
        format,
        ..RawMetadata::evk1(&date, serial)
    };
    let mut writer = RawWriter::create(path, &metadata).map_err(failed(path))?;
    let mut fault = None;
    reader
        .for_each_chunk(camera, 0, |_, bytes| {
            if fault.is_none() {
                fault = writer.write(bytes).err();
            }
        })
        .map_err(Failure::input)?;
    match fault {
        Some(e) => Err(failed(path)(e)),
        None => writer.finish().map_err(failed(path)),
    }
}

/// One camera's events as a bimvee HDF5 container; times count from the camera's first event.
fn hdf5(
    reader: &SessionReader,
    header: &RunHeader,
    camera: CameraId,
    path: &Path,
) -> Result<(), Failure> {
    let mut decoder = Decoder::new(header.stream_formats[camera.index()]);
    let mut writer: Option<EventWriter> = None;
    let mut fault = None;
    reader
        .for_each_chunk(camera, 0, |meta, bytes| {
            if let Some(origin_us) = meta.restart_us {
                decoder.restart(origin_us);
            }
            decoder.for_each_slice(bytes, |events| {
                if fault.is_some() || events.is_empty() {
                    return;
                }
                let appended = match &mut writer {
                    Some(writer) => writer.append(events),
                    None => EventWriter::create(path, events[0].t_us)
                        .and_then(|w| writer.insert(w).append(events)),
                };
                fault = appended.err();
            });
        })
        .map_err(Failure::input)?;
    if let Some(e) = fault {
        return Err(failed(path)(e));
    }
    let writer = match writer {
        Some(writer) => writer,
        None => EventWriter::create(path, 0).map_err(failed(path))?,
    };
    writer.finish().map(drop).map_err(failed(path))
}

fn csv_file(path: &Path) -> Result<csv::Writer<std::fs::File>, Failure> {
    std::fs::File::create_new(path)
        .map(csv::Writer::from_writer)
        .map_err(failed(path))
}

fn seconds(t: Option<HostTime>) -> String {
    t.map_or_else(String::new, |t| format!("{:.9}", t.as_secs_f64()))
}

fn number(v: Option<f64>) -> String {
    v.map_or_else(String::new, |v| format!("{v:.6}"))
}

/// One row per attempt; empty cells are values that do not exist.
fn presses(reader: &SessionReader, path: &Path) -> Result<(), Failure> {
    let mut out = csv_file(path)?;
    let unwritable = |e: csv::Error| Failure::internal(format!("{}: {e}", path.display()));
    out.write_record([
        "press",
        "role",
        "repetition",
        "location",
        "x_mm",
        "y_mm",
        "depth_mm",
        "attempt",
        "verdict",
        "reason",
        "scheduled",
        "approach_s",
        "contact_s",
        "at_depth_s",
        "retract_s",
        "release_s",
        "clear_s",
        "measured_x_mm",
        "measured_y_mm",
        "measured_depth_mm",
        "peak_force_n",
    ])
    .map_err(unwritable)?;
    for (planned, attempts) in reader.presses().map_err(Failure::input)? {
        for attempt in attempts {
            let o = attempt.outcome.as_ref();
            let t = o.and_then(|o| o.timing);
            let at = o.and_then(|o| o.measured_at);
            let role = serde_json::to_value(planned.role).map_err(Failure::internal)?;
            out.write_record([
                planned.id.0.to_string(),
                role.as_str().unwrap_or_default().to_owned(),
                (planned.repetition + 1).to_string(),
                (planned.location + 1).to_string(),
                format!("{:.6}", planned.at.x_mm),
                format!("{:.6}", planned.at.y_mm),
                format!("{:.6}", planned.depth_mm),
                attempt.id.number.to_string(),
                o.map_or("open", |o| o.verdict.name()).to_owned(),
                o.and_then(|o| o.verdict.reason())
                    .unwrap_or_default()
                    .to_owned(),
                o.map_or_else(String::new, |o| o.scheduled.to_string()),
                seconds(t.map(|t| t.approach)),
                seconds(t.map(|t| t.contact)),
                seconds(t.map(|t| t.at_depth)),
                seconds(t.map(|t| t.retract)),
                seconds(t.map(|t| t.release)),
                seconds(t.map(|t| t.clear)),
                number(at.map(|p| p.x_mm)),
                number(at.map(|p| p.y_mm)),
                number(o.and_then(|o| o.measured_depth_mm)),
                number(o.and_then(|o| o.peak_force_n)),
            ])
            .map_err(unwritable)?;
        }
    }
    out.flush()
        .map_err(|e| Failure::internal(format!("{}: {e}", path.display())))
}

/// One row per pose sample.
fn poses(reader: &SessionReader, path: &Path) -> Result<(), Failure> {
    let mut out = csv_file(path)?;
    let unwritable = |e: csv::Error| Failure::internal(format!("{}: {e}", path.display()));
    out.write_record([
        "t_s",
        "commanded_x_mm",
        "commanded_y_mm",
        "commanded_z_mm",
        "measured_x_mm",
        "measured_y_mm",
        "measured_z_mm",
        "force_n",
    ])
    .map_err(unwritable)?;
    let mut fault = None;
    reader
        .for_each_pose_block(HostTime(i64::MIN), HostTime(i64::MAX), |block| {
            for sample in block {
                if fault.is_none() {
                    fault = out.write_record(pose_row(sample)).err();
                }
            }
        })
        .map_err(Failure::input)?;
    if let Some(e) = fault {
        return Err(unwritable(e));
    }
    out.flush()
        .map_err(|e| Failure::internal(format!("{}: {e}", path.display())))
}

fn pose_row(s: &PoseSample) -> Vec<String> {
    let mut row = vec![format!("{:.9}", s.t.as_secs_f64())];
    let coordinates = [s.commanded.to_array(), s.measured.to_array()];
    row.extend(coordinates.as_flattened().iter().map(|v| format!("{v:.6}")));
    row.push(if s.force_n.is_nan() {
        String::new()
    } else {
        format!("{:.4}", s.force_n)
    });
    row
}

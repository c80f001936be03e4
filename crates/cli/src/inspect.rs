//! `skinrig inspect`: contents of a RAW, HDF5 or session file.

use std::path::Path;

use serde_json::{Value, json};
use skinrig_formats::inspect::{FileKind, Inspection, StreamInspection, inspect as inspect_events};
use skinrig_formats::{Decoder, StreamStats};
use skinrig_model::CameraId;
use skinrig_recorder::SessionReader;

use crate::args::InspectArgs;
use crate::exit::{Exit, Failure, Outcome};

/// Inspects a file.
///
/// # Errors
/// [`Failure::input`] when the file is of no known kind or cannot be read to its end.
pub(crate) fn inspect(args: &InspectArgs, as_json: bool) -> Outcome {
    if !(args.gap > 0.0 && args.gap.is_finite()) {
        return Err(Failure::input(format!(
            "--gap: expected a time above 0 ms, found {}",
            args.gap
        )));
    }
    let gap_us = (args.gap * 1e3).round() as u64;
    let found = match FileKind::detect(&args.file).map_err(Failure::input)? {
        FileKind::Sqlite => inspect_session(&args.file, gap_us)?,
        _ => inspect_events(&args.file, gap_us).map_err(Failure::input)?,
    };
    if as_json {
        crate::terminal::print_json(&document(&args.file, &found));
    } else {
        print(&args.file, &found, args.gap);
    }
    Ok(Exit::Ok)
}

/// A session's camera streams, decoded from its chunks.
fn inspect_session(path: &Path, gap_us: u64) -> Result<Inspection, Failure> {
    let reader = SessionReader::open_unchanged(path).map_err(Failure::session)?;
    let header = reader.header().map_err(Failure::session)?;
    let mut streams = Vec::new();
    for camera in CameraId::ALL {
        let mut stream = StreamInspection::new(&camera.to_string(), gap_us);
        let mut decoder = Decoder::new(header.stream_formats[camera.index()]);
        reader
            .for_each_chunk(camera, 0, |meta, bytes| {
                if let Some(origin_us) = meta.restart_us {
                    decoder.restart(origin_us);
                }
                decoder.lost(meta.lost_before);
                decoder.push(bytes, &mut stream);
            })
            .map_err(Failure::session)?;
        stream.finish(&decoder);
        streams.push(stream);
    }
    let entry = |key: &str, value: &str| (key.to_owned(), value.to_owned());
    Ok(Inspection {
        kind: FileKind::Sqlite,
        header: vec![
            entry("session", &reader.session_id().map_err(Failure::session)?),
            entry("started", &header.started_at),
            entry("prototype", &header.prototype),
            entry("protocol", &header.protocol_name),
            entry("rig", &header.rig_name),
            entry(
                "format",
                header.stream_formats.map(|f| f.name()).join(", ").as_str(),
            ),
        ],
        format: None,
        geometry: None,
        streams,
    })
}

const fn kind_name(kind: FileKind) -> &'static str {
    match kind {
        FileKind::Raw => "Prophesee RAW",
        FileKind::Hdf5 => "bimvee HDF5",
        FileKind::Sqlite => "skinrig session",
        FileKind::Unknown => "unknown",
    }
}

/// The counts that are not zero, with their names.
fn counts(s: &StreamStats) -> Vec<(String, u64)> {
    let mut rows: Vec<(String, u64)> = vec![
        ("CD events ON".into(), s.cd_on),
        ("CD events OFF".into(), s.cd_off),
    ];
    for (channel, n) in s.triggers.iter().enumerate() {
        rows.push((format!("trigger edges, channel {channel}"), *n));
    }
    rows.extend([
        ("time words".into(), s.time_high + s.time_low),
        ("address words".into(), s.address),
        ("monitoring words".into(), s.monitoring),
        ("skipped words".into(), s.skipped_words()),
        (
            "events before the first time word".into(),
            s.dropped_before_time,
        ),
        (
            "events before their address".into(),
            s.dropped_before_address,
        ),
        ("wraps of the time base".into(), s.wraps),
        ("steps of the time base".into(), s.discontinuities),
        ("events outside the sensor".into(), s.out_of_geometry),
        ("vectors not aligned to 32 columns".into(), s.unaligned),
        ("bytes of an unfinished word".into(), s.trailing_bytes),
    ]);
    rows.retain(|(name, n)| *n > 0 || name.starts_with("CD"));
    rows
}

fn document(path: &Path, found: &Inspection) -> Value {
    let streams: Vec<Value> = found
        .streams
        .iter()
        .map(|s| {
            let counts: serde_json::Map<String, Value> = counts(&s.stats)
                .into_iter()
                .map(|(k, n)| (k, n.into()))
                .collect();
            json!({
                "name": s.name, "events": s.stats.cd_events(), "counts": counts,
                "first_us": s.first_us, "last_us": s.last_us, "span_s": s.span_s(),
                "mean_rate_hz": s.mean_rate_hz(), "ts_offset_s": s.ts_offset_s,
                "gap_count": s.gap_count,
                "gaps_us": s.gaps.iter().map(|g| [g.from_us, g.to_us]).collect::<Vec<_>>(),
                "discontinuities_us":
                    s.discontinuities.iter().map(|d| [d.from_us, d.to_us]).collect::<Vec<_>>(),
            })
        })
        .collect();
    let header: Vec<[&str; 2]> = found
        .header
        .iter()
        .map(|(k, v)| [k.as_str(), v.as_str()])
        .collect();
    json!({
        "file": path, "kind": kind_name(found.kind), "header": header,
        "format": found.format.map(|f| f.name()),
        "geometry": found.geometry.map(|g| [g.width, g.height]), "streams": streams,
    })
}

fn print(path: &Path, found: &Inspection, gap_ms: f64) {
    outln!("{}: {}", path.display(), kind_name(found.kind));
    for (key, value) in &found.header {
        outln!("  {key:<24} {value}");
    }
    if let Some(g) = found.geometry {
        outln!("  {:<24} {} x {}", "sensor", g.width, g.height);
    }
    for stream in &found.streams {
        outln!(
            "{}",
            if stream.name.is_empty() {
                "events"
            } else {
                &stream.name
            }
        );
        for (name, n) in counts(&stream.stats) {
            outln!("  {n:>14}  {name}");
        }
        match (stream.first_us, stream.last_us, stream.span_s()) {
            (Some(first), Some(last), Some(span)) => {
                outln!("  {first} to {last} µs on the camera's clock: {span:.6} s");
            }
            (Some(first), Some(last), None) => {
                outln!("  {first} to {last} µs on the camera's clock: time runs backwards");
            }
            _ => outln!("  no time"),
        }
        if let Some(offset) = stream.ts_offset_s {
            outln!("  tsOffset {offset} s (camera time = ts - tsOffset)");
        }
        if let Some(rate) = stream.mean_rate_hz() {
            outln!("  {:.1} kev/s on average", rate / 1e3);
        }
        outln!("  {} silence(s) longer than {gap_ms} ms", stream.gap_count);
        for g in stream.gaps.iter().take(10) {
            outln!(
                "    {} to {} µs: {:.3} s",
                g.from_us,
                g.to_us,
                (g.to_us - g.from_us) as f64 * 1e-6
            );
        }
        for d in stream.discontinuities.iter().take(10) {
            outln!("    time base steps from {} to {} µs", d.from_us, d.to_us);
        }
    }
}

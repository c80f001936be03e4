//! Checks `idle` and `test_pattern`: data rate and loss.

use skinrig_device::{DeviceError, EventCamera, PatternScan, TestPattern};
use skinrig_model::{CameraId, HostDuration};
use skinrig_nightly::{Evidence, EvidenceKind};
use skinrig_protocol::suite::{Check, Measure};

use super::pixels::{Reader, watch};
use crate::bench::Bench;
use crate::device_evidence;
use crate::findings::Findings;
use crate::streams::{StreamStats, Streams};

const IDLE: &[&str] = &["data_rate", "lost", "gaps"];
const PATTERN: &[&str] = &["received", "lost", "gaps"];

/// Streaming time before counting starts, to skip start-up bursts.
const SETTLE: HostDuration = HostDuration::from_millis(500);

/// Runs the check.
pub(super) fn idle(check: &Check, bench: &mut dyn Bench, found: &mut Findings) {
    let Measure::Idle { duration } = check.measure else {
        return;
    };
    let mut readers = [None, None];
    let mut prepare = |id: CameraId, camera: &mut dyn EventCamera| -> Result<(), DeviceError> {
        readers[id.index()] = Some(Reader::time_base_only(&camera.capabilities()));
        Ok(())
    };
    let streams = Streams::start(bench, &mut prepare);
    for (camera, seen, reader) in watch(streams, [SETTLE, duration], readers, found, IDLE) {
        let subject = device_evidence::camera_subject(camera);
        let Some(span_s) = seen.span_s() else {
            for metric in IDLE {
                found.unmeasured(subject, metric);
            }
            continue;
        };
        found.value(subject, "data_rate", seen.bytes as f64 / span_s);
        losses(subject, &seen, reader.counts.jumps, 0, found);
    }
}

/// Runs the check.
pub(super) fn test_pattern(check: &Check, bench: &mut dyn Bench, found: &mut Findings) {
    let Measure::TestPattern {
        duration,
        rate_ev_s,
    } = check.measure
    else {
        return;
    };
    let mut readers = [None, None];
    let mut scans: [Option<PatternScan>; 2] = [None, None];
    let mut prepare = |id: CameraId, camera: &mut dyn EventCamera| -> Result<(), DeviceError> {
        if let Some(scan) = camera.test_pattern(Some(TestPattern { rate_ev_s }))? {
            scans[id.index()] = Some(scan);
            let reader = Reader::following_scan(&camera.capabilities(), scan.columns, scan.rows);
            readers[id.index()] = Some(reader);
        }
        Ok(())
    };
    let streams = Streams::start(bench, &mut prepare);
    let watched = watch(streams, [SETTLE, duration], readers, found, PATTERN);
    disable_test_pattern(bench, found);
    let refused = |e: &&Evidence| e.kind == EvidenceKind::Refused;
    if scans == [None, None] && found.evidence.iter().filter(refused).count() == scans.len() {
        let whats = found.evidence.iter().map(|e| e.what.as_str());
        found.not_applicable = Some(whats.collect::<Vec<_>>().join("; "));
        return;
    }
    for (camera, seen, reader) in watched {
        let subject = device_evidence::camera_subject(camera);
        let (Some(span_s), Some(scan)) = (seen.span_s(), scans[camera.index()]) else {
            for metric in PATTERN {
                found.unmeasured(subject, metric);
            }
            continue;
        };
        let expected = scan.rate_ev_s * span_s;
        let events = reader.counts.events;
        let followed = reader.counts.scan;
        let (columns, rows) = followed.as_ref().map_or((0, 0), |s| s.largest);
        found
            .value(subject, "received", events as f64 / expected * 100.0)
            .with_note(format!(
                "{events} of {expected:.0} events at {:.0} events/s; largest column {columns}, largest row {rows} of {} x {}",
                scan.rate_ev_s, scan.columns, scan.rows
            ));
        let breaks = followed.map_or(0, |s| s.breaks);
        losses(subject, &seen, reader.counts.jumps, breaks, found);
    }
}

/// Adds lost bytes and gaps: losses, time base jumps and breaks of the test pattern.
fn losses(subject: &str, seen: &StreamStats, jumps: u64, breaks: u64, found: &mut Findings) {
    let lost = found.value(subject, "lost", seen.lost_bytes as f64);
    if !seen.notes.is_empty() {
        lost.with_note(seen.notes.join("; "));
    }
    let gaps = seen.losses + jumps + breaks;
    found.value(subject, "gaps", gaps as f64);
    if gaps > 0 {
        let what = format!(
            "expected a stream without gaps, found {} losses with {} bytes in total, {jumps} time base jumps and {breaks} breaks of the test pattern",
            seen.losses, seen.lost_bytes
        );
        let next = "check the cable, the port (USB 3, no hub) and what else runs on this computer";
        found
            .evidence
            .push(Evidence::new(EvidenceKind::DataLost, subject, what).next(next));
    }
}

/// Switches the test pattern off on both cameras; a failure becomes evidence.
fn disable_test_pattern(bench: &mut dyn Bench, found: &mut Findings) {
    for camera in bench.devices().cameras.iter_mut().flatten() {
        if let Err(e) = camera.test_pattern(None) {
            found.evidence.push(*device_evidence::from_error(&e));
        }
    }
}

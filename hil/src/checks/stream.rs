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
pub(super) fn idle(check: &Check, bench: &mut dyn Bench, findings: &mut Findings) {
    let Measure::Idle { duration } = check.measure else {
        return;
    };
    let mut readers = [None, None];
    let mut prepare = |id: CameraId, camera: &mut dyn EventCamera| -> Result<(), DeviceError> {
        readers[id.index()] = Some(Reader::time_base_only(&camera.capabilities()));
        Ok(())
    };
    let streams = Streams::start(bench, &mut prepare);
    for (camera, stats, reader) in watch(streams, [SETTLE, duration], readers, findings, IDLE) {
        let subject = device_evidence::camera_subject(camera);
        let Some(span_s) = stats.span_s() else {
            for metric in IDLE {
                findings.unmeasured(subject, metric);
            }
            continue;
        };
        findings.value(subject, "data_rate", stats.bytes as f64 / span_s);
        losses(subject, &stats, reader.counts.jumps, 0, findings);
    }
}

/// Runs the check.
pub(super) fn test_pattern(check: &Check, bench: &mut dyn Bench, findings: &mut Findings) {
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
    let watched = watch(streams, [SETTLE, duration], readers, findings, PATTERN);
    disable_test_pattern(bench, findings);
    let refused = |e: &&Evidence| e.kind == EvidenceKind::Refused;
    if scans == [None, None] && findings.evidence.iter().filter(refused).count() == scans.len() {
        let whats = findings.evidence.iter().map(|e| e.what.as_str());
        findings.not_applicable = Some(whats.collect::<Vec<_>>().join("; "));
        return;
    }
    for (camera, stats, reader) in watched {
        let subject = device_evidence::camera_subject(camera);
        let (Some(span_s), Some(scan)) = (stats.span_s(), scans[camera.index()]) else {
            for metric in PATTERN {
                findings.unmeasured(subject, metric);
            }
            continue;
        };
        let expected = scan.rate_ev_s * span_s;
        let events = reader.counts.events;
        let followed = reader.counts.scan;
        let (columns, rows) = followed.as_ref().map_or((0, 0), |s| s.largest);
        findings
            .value(subject, "received", events as f64 / expected * 100.0)
            .with_note(format!(
                "{events} of {expected:.0} events at {:.0} events/s; largest column {columns}, largest row {rows} of {} x {}",
                scan.rate_ev_s, scan.columns, scan.rows
            ));
        let breaks = followed.map_or(0, |s| s.breaks);
        losses(subject, &stats, reader.counts.jumps, breaks, findings);
    }
}

/// Adds lost bytes and gaps: losses, time base jumps and breaks of the test pattern.
fn losses(subject: &str, stats: &StreamStats, jumps: u64, breaks: u64, findings: &mut Findings) {
    let lost = findings.value(subject, "lost", stats.lost_bytes as f64);
    if !stats.notes.is_empty() {
        lost.with_note(stats.notes.join("; "));
    }
    let gaps = stats.losses + jumps + breaks;
    findings.value(subject, "gaps", gaps as f64);
    if gaps > 0 {
        let what = format!(
            "expected a stream without gaps, found {} losses with {} bytes in total, {jumps} time base jumps and {breaks} breaks of the test pattern",
            stats.losses, stats.lost_bytes
        );
        let next = "check the cable, the port (USB 3, no hub) and what else runs on this computer";
        findings
            .evidence
            .push(Evidence::new(EvidenceKind::DataLost, subject, what).next(next));
    }
}

/// Switches the test pattern off on both cameras; a failure becomes evidence.
fn disable_test_pattern(bench: &mut dyn Bench, findings: &mut Findings) {
    for camera in bench.devices().cameras.iter_mut().flatten() {
        if let Err(e) = camera.test_pattern(None) {
            findings.evidence.push(*device_evidence::from_error(&e));
        }
    }
}

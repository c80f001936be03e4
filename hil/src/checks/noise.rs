//! Checks `noise_dark` and `noise_lit`: noise floor and hot pixels.

use skinrig_device::{DeviceError, EventCamera};
use skinrig_model::{CameraId, HostDuration};
use skinrig_protocol::suite::{Check, Light, Measure};

use super::pixels::{Counts, Reader, watch};
use crate::bench::{Bench, Problem};
use crate::device_evidence;
use crate::findings::Findings;
use crate::streams::Streams;

const METRICS: &[&str] = &["rate", "hot_pixels", "hottest"];

/// Settling time of the lamps, and of the pixels after the light changes.
const SETTLE: HostDuration = HostDuration::from_millis(1_000);
/// Minimum number of events of a hot pixel; fewer may be chance.
const MIN_EVENTS: u32 = 5;

/// Runs the check.
pub(super) fn noise(check: &Check, bench: &mut dyn Bench, findings: &mut Findings) {
    let Measure::Noise {
        light,
        duration,
        hot_above_ev_s,
    } = check.measure
    else {
        return;
    };
    let switched = match bench.set_light(light) {
        Ok(switched) => switched,
        Err(problem) => return light_failed(&problem, findings),
    };
    if light == Light::Dark && !switched {
        let why = "the rig file names no program that switches the lamps (`hil.light`)";
        findings.not_applicable = Some(why.to_owned());
        return;
    }
    measure(bench, duration, hot_above_ev_s, switched, findings);
    // All other checks and campaigns need the light.
    if light == Light::Dark
        && let Err(problem) = bench.set_light(Light::Lit)
    {
        findings.evidence.push(*problem);
    }
}

/// Records that the lamps failed: the light is unknown, so nothing was measured.
fn light_failed(problem: &Problem, findings: &mut Findings) {
    findings.evidence.push(*problem.clone());
    for camera in CameraId::ALL {
        for metric in METRICS {
            findings.unmeasured(device_evidence::camera_subject(camera), metric);
        }
    }
}

fn measure(
    bench: &mut dyn Bench,
    duration: HostDuration,
    hot_above_ev_s: f64,
    switched: bool,
    findings: &mut Findings,
) {
    let mut readers = [None, None];
    let mut prepare = |id: CameraId, camera: &mut dyn EventCamera| -> Result<(), DeviceError> {
        readers[id.index()] = Some(Reader::per_pixel(&camera.capabilities()));
        Ok(())
    };
    let streams = Streams::start(bench, &mut prepare);
    for (camera, stats, reader) in watch(streams, [SETTLE, duration], readers, findings, METRICS) {
        let subject = device_evidence::camera_subject(camera);
        let Some(span_s) = stats.span_s() else {
            for metric in METRICS {
                findings.unmeasured(subject, metric);
            }
            continue;
        };
        add_rates(subject, &reader.counts, span_s, hot_above_ev_s, findings);
        if !switched && let Some(rate) = findings.values.iter_mut().rfind(|v| v.metric == "rate") {
            rate.with_note("lamps not switched: the rig file names no program for them");
        }
    }
}

/// Adds the event rates of the sensor and of its hottest pixels.
fn add_rates(
    subject: &str,
    counts: &Counts,
    span_s: f64,
    hot_above_ev_s: f64,
    findings: &mut Findings,
) {
    let rate = |events: f64| events / span_s;
    let events = counts.events as f64;
    // 95 % interval of a Poisson count.
    let half = 1.96 * events.sqrt();
    findings.value(subject, "rate", rate(events)).interval =
        Some([rate((events - half).max(0.0)), rate(events + half)]);
    let is_hot = |n: &&u32| **n >= MIN_EVENTS && rate(f64::from(**n)) > hot_above_ev_s;
    let hot = counts.by_pixel.iter().filter(is_hot).count();
    findings.value(subject, "hot_pixels", hot as f64);
    let hottest = counts.by_pixel.iter().enumerate().max_by_key(|(_, n)| **n);
    if let Some((at, n)) = hottest {
        findings
            .value(subject, "hottest", rate(f64::from(*n)))
            .with_note(counts.pixel_name(at));
    }
}

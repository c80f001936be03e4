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

/// Time for the lamps, and for the pixels that saw them change, to settle.
const SETTLE: HostDuration = HostDuration::from_millis(1_000);
/// Events that one pixel needs before it can be hot; fewer may be chance.
const MIN_EVENTS: u32 = 5;

/// Runs the check.
pub(super) fn noise(check: &Check, bench: &mut dyn Bench, found: &mut Findings) {
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
        Err(problem) => return light_failed(&problem, found),
    };
    if light == Light::Dark && !switched {
        let why = "the rig file names no program that switches the lamps (`hil.light`)";
        found.not_applicable = Some(why.to_owned());
        return;
    }
    measure(bench, duration, hot_above_ev_s, switched, found);
    // All other checks and campaigns need the light.
    if light == Light::Dark
        && let Err(problem) = bench.set_light(Light::Lit)
    {
        found.evidence.push(*problem);
    }
}

/// The lamps failed, so the light is unknown.
fn light_failed(problem: &Problem, found: &mut Findings) {
    found.evidence.push(*problem.clone());
    for camera in CameraId::ALL {
        for metric in METRICS {
            found.unmeasured(device_evidence::camera_subject(camera), metric);
        }
    }
}

fn measure(
    bench: &mut dyn Bench,
    duration: HostDuration,
    hot_above_ev_s: f64,
    switched: bool,
    found: &mut Findings,
) {
    let mut readers = [None, None];
    let mut prepare = |id: CameraId, camera: &mut dyn EventCamera| -> Result<(), DeviceError> {
        readers[id.index()] = Some(Reader::per_pixel(&camera.capabilities()));
        Ok(())
    };
    let streams = Streams::start(bench, &mut prepare);
    for (camera, seen, reader) in watch(streams, [SETTLE, duration], readers, found, METRICS) {
        let subject = device_evidence::camera_subject(camera);
        let Some(span_s) = seen.span_s() else {
            for metric in METRICS {
                found.unmeasured(subject, metric);
            }
            continue;
        };
        add_rates(subject, &reader.counts, span_s, hot_above_ev_s, found);
        if !switched && let Some(rate) = found.values.iter_mut().rfind(|v| v.metric == "rate") {
            rate.with_note("lamps not switched: the rig file names no program for them");
        }
    }
}

/// Adds the rates of the sensor and of its pixels.
fn add_rates(
    subject: &str,
    counts: &Counts,
    span_s: f64,
    hot_above_ev_s: f64,
    found: &mut Findings,
) {
    let rate = |events: f64| events / span_s;
    let events = counts.events as f64;
    // 95 % interval of a Poisson count.
    let half = 1.96 * events.sqrt();
    found.value(subject, "rate", rate(events)).interval =
        Some([rate((events - half).max(0.0)), rate(events + half)]);
    let is_hot = |n: &&u32| **n >= MIN_EVENTS && rate(f64::from(**n)) > hot_above_ev_s;
    let hot = counts.by_pixel.iter().filter(is_hot).count();
    found.value(subject, "hot_pixels", hot as f64);
    let hottest = counts.by_pixel.iter().enumerate().max_by_key(|(_, n)| **n);
    if let Some((at, n)) = hottest {
        found
            .value(subject, "hottest", rate(f64::from(*n)))
            .with_note(counts.pixel_name(at));
    }
}

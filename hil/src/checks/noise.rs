//! Checks: noise floor and hot pixels.

use skinrig_device::{DeviceError, EventCamera};
use skinrig_model::{CameraId, HostDuration};
use skinrig_protocol::suite::{Check, Light, Measure};

use super::pixels::{Counts, Reader, watch};
use crate::bench::{Bench, Trouble};
use crate::findings::Findings;
use crate::streams::Streams;
use crate::trouble;

const METRICS: &[&str] = &["rate", "hot_pixels", "hottest"];

/// Lamps that were switched, and pixels that saw it, come to rest within this.
const SETTLE: HostDuration = HostDuration::from_millis(1_000);
/// Events that a rate of one pixel needs before it is called hot: fewer may be chance.
const LEAST_EVENTS: u32 = 5;

/// Makes the check.
pub fn noise(check: &Check, bench: &mut dyn Bench, found: &mut Findings) {
    let Measure::Noise {
        light,
        duration,
        hot_above_ev_s,
    } = check.measure
    else {
        return;
    };
    let switched = match bench.light(light) {
        Ok(switched) => switched,
        Err(trouble) => return no_light(&trouble, found),
    };
    if light == Light::Dark && !switched {
        let why = "the rig file names no programs that switch the lamps (`hil.light`)";
        found.not_here = Some(why.to_owned());
        return;
    }
    measure(bench, duration, hot_above_ev_s, switched, found);
    // Every other check, and every campaign, is made in the light.
    if light == Light::Dark
        && let Err(trouble) = bench.light(Light::Lit)
    {
        found.evidence.push(*trouble);
    }
}

/// The lamps did not obey: nothing is known about the light.
fn no_light(trouble: &Trouble, found: &mut Findings) {
    found.evidence.push(*trouble.clone());
    for camera in CameraId::ALL {
        for metric in METRICS {
            found.unmeasured(trouble::of_camera(camera), metric);
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
        readers[id.index()] = Some(Reader::of_pixels(&camera.capabilities()));
        Ok(())
    };
    let streams = Streams::start(bench, &mut prepare);
    for (camera, seen, reader) in watch(streams, [SETTLE, duration], readers, found, METRICS) {
        let subject = trouble::of_camera(camera);
        let Some(span_s) = seen.span_s() else {
            for metric in METRICS {
                found.unmeasured(subject, metric);
            }
            continue;
        };
        tell(subject, &reader.counts, span_s, hot_above_ev_s, found);
        if !switched && let Some(rate) = found.values.iter_mut().rfind(|v| v.metric == "rate") {
            rate.noting("the lamps as they are: the rig file names no programs that switch them");
        }
    }
}

/// Rate of the sensor, and of its pixels.
fn tell(subject: &str, counts: &Counts, span_s: f64, hot_above_ev_s: f64, found: &mut Findings) {
    let rate = |events: f64| events / span_s;
    let events = counts.events as f64;
    // Of a number of events that come by chance, one by one (Poisson).
    let half = 1.96 * events.sqrt();
    found.value(subject, "rate", rate(events)).interval =
        Some([rate((events - half).max(0.0)), rate(events + half)]);
    let is_hot = |n: &&u32| **n >= LEAST_EVENTS && rate(f64::from(**n)) > hot_above_ev_s;
    let hot = counts.by_pixel.iter().filter(is_hot).count();
    found.value(subject, "hot_pixels", hot as f64);
    let hottest = counts.by_pixel.iter().enumerate().max_by_key(|(_, n)| **n);
    if let Some((at, n)) = hottest {
        found
            .value(subject, "hottest", rate(f64::from(*n)))
            .noting(counts.place(at));
    }
}

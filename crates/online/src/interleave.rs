//! Reads both cameras of an event source at once and merges their slices in order of time.

use std::sync::mpsc::{Receiver, sync_channel};

use skinrig_analysis::result::ClockFit;
use skinrig_analysis::{EventSource, EventSourceError};
use skinrig_model::{CameraId, CdEvent};

/// Slices read ahead of each camera.
const AHEAD: usize = 16;
/// Most events of a slice.
const SLICE: usize = 512;
/// Host time by which a slice may be ahead of the other camera, µs.
const LEAD_US: f64 = 50e3;

/// Calls `each` with slices of both cameras, always of the camera that is behind on host time, until it returns false or a camera
/// ends; and with the time of the next event of each camera before that, camera µs.
///
/// # Errors
/// If the events of a camera cannot be read.
pub fn interleave(
    source: &dyn EventSource,
    clocks: &[ClockFit; 2],
    mut each: impl FnMut(CameraId, &[CdEvent], [u64; 2]) -> bool,
) -> Result<(), EventSourceError> {
    std::thread::scope(|scope| {
        let [one, two] = CameraId::ALL.map(|camera| {
            let (send, slices) = sync_channel::<Vec<CdEvent>>(AHEAD);
            let reader = scope.spawn(move || {
                let mut wanted = true;
                source.for_each_slice(camera, &mut |events| {
                    for slice in events.chunks(SLICE) {
                        wanted = wanted && send.send(slice.to_vec()).is_ok();
                    }
                })
            });
            (slices, reader)
        });
        let slices = [one.0, two.0];
        merge(&slices, clocks, &mut each);
        drop(slices);
        for reader in [one.1, two.1] {
            match reader.join() {
                Ok(read) => read?,
                Err(panic) => std::panic::resume_unwind(panic),
            }
        }
        Ok(())
    })
}

/// Slices of one camera, read ahead.
struct Ahead<'a> {
    slices: &'a Receiver<Vec<CdEvent>>,
    slice: Vec<CdEvent>,
    at: usize,
}

impl Ahead<'_> {
    /// Time of the next event, camera µs; `None` at the end.
    fn next_us(&mut self) -> Option<u64> {
        while self.at == self.slice.len() {
            (self.slice, self.at) = (self.slices.recv().ok()?, 0);
        }
        Some(self.slice[self.at].t_us)
    }
}

fn merge(
    slices: &[Receiver<Vec<CdEvent>>; 2],
    clocks: &[ClockFit; 2],
    each: &mut impl FnMut(CameraId, &[CdEvent], [u64; 2]) -> bool,
) {
    let mut cameras = [0, 1].map(|k| Ahead {
        slices: &slices[k],
        slice: Vec::new(),
        at: 0,
    });
    let host = |k: usize, us: u64| clocks[k].host_us_of_camera(us as f64);
    while let [Some(one), Some(two)] = [cameras[0].next_us(), cameras[1].next_us()] {
        let (next, hosts) = ([one, two], [host(0, one), host(1, two)]);
        let k = usize::from(hosts[1] < hosts[0]);
        let limit = clocks[k].camera_us(hosts[1 - k] + LEAD_US);
        let own = &mut cameras[k];
        let rest = &own.slice[own.at..];
        let until = rest.iter().position(|e| e.t_us as f64 >= limit);
        let count = until.unwrap_or(rest.len()).max(1);
        if !each(CameraId::ALL[k], &rest[..count], next) {
            return;
        }
        own.at += count;
    }
}

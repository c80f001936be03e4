//! Owns the comparison of two recordings by their events: whether one holds what the other recorded, whatever it is called.

use std::collections::BTreeSet;

use skinrig_analysis::{AnalysisError, EventSource};
use skinrig_model::{CameraId, CdEvent, Polarity};

/// Events in a row that identify a recording: pixels and polarities, not times, which an import may have rounded.
const RUN: usize = 32;
/// Fewer pixels in a run are those of a hot pixel or a flicker, which other recordings have too.
const MIN_PIXELS: usize = 16;
/// One run in so many is compared, chosen by its content: cutting a recording does not change which.
const ONE_IN: u64 = 64;
/// Multiplier of the rolling hash; odd, so that no bit is lost.
const FACTOR: u64 = 0x9e37_79b9_7f4a_7c15;

/// Hashes of runs of events.
pub(crate) type EventRuns = BTreeSet<u64>;

/// The runs of both cameras.
///
/// # Errors
/// [`AnalysisError::Events`] when a stream cannot be read to its end.
pub(crate) fn event_runs(source: &dyn EventSource) -> Result<EventRuns, AnalysisError> {
    let mut found = EventRuns::new();
    for camera in CameraId::ALL {
        let mut runs = RollingRuns::default();
        let mut each = |events: &[CdEvent]| {
            events.iter().for_each(|event| {
                found.extend(runs.push(event));
            });
        };
        let read = source.for_each_slice(camera, &mut each);
        read.map_err(|source| AnalysisError::Events { camera, source })?;
    }
    Ok(found)
}

/// Share of the smaller recording that is in the other one, 0 to 1.
pub(crate) fn shared(a: &EventRuns, b: &EventRuns) -> f64 {
    let smaller = a.len().min(b.len());
    if smaller == 0 {
        return 0.0;
    }
    a.intersection(b).count() as f64 / smaller as f64
}

/// The last events of a stream, and their rolling hash.
#[derive(Default)]
struct RollingRuns {
    last: [u64; RUN],
    events: usize,
    hash: u64,
}

impl RollingRuns {
    /// Hash of the run that ends with this event, if it is one to compare.
    fn push(&mut self, event: &CdEvent) -> Option<u64> {
        let on = event.polarity == Polarity::On;
        let pixel = u64::from(event.x) | u64::from(event.y) << 16 | u64::from(on) << 32;
        let at = self.events % RUN;
        let oldest = std::mem::replace(&mut self.last[at], pixel);
        let beyond = mixed(oldest).wrapping_mul(FACTOR.wrapping_pow(RUN as u32));
        let longer = self.hash.wrapping_mul(FACTOR).wrapping_add(mixed(pixel));
        self.events += 1;
        self.hash = if self.events > RUN {
            longer.wrapping_sub(beyond)
        } else {
            longer
        };
        let hash = mixed(self.hash);
        let is_compared =
            self.events >= RUN && hash.is_multiple_of(ONE_IN) && self.pixels() >= MIN_PIXELS;
        is_compared.then_some(hash)
    }

    fn pixels(&self) -> usize {
        self.last.iter().collect::<BTreeSet<_>>().len()
    }
}

/// Finaliser of `SplitMix64` (Steele, Lea and Flood 2014).
const fn mixed(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Events of a seed; `mixed` is random enough.
    fn events(seed: u64, n: u64) -> Vec<CdEvent> {
        let event = |k: u64| {
            let r = mixed(mixed(seed) ^ k.wrapping_mul(FACTOR));
            CdEvent {
                t_us: k * 7,
                x: (r % 640) as u16,
                y: (r >> 20) as u16 % 480,
                polarity: if r >> 63 == 1 {
                    Polarity::On
                } else {
                    Polarity::Off
                },
            }
        };
        (0..n).map(event).collect()
    }

    fn runs(events: &[CdEvent]) -> EventRuns {
        let mut runs = RollingRuns::default();
        events.iter().filter_map(|e| runs.push(e)).collect()
    }

    #[test]
    fn a_part_of_a_recording_is_found_in_it_and_other_recordings_are_not() {
        let all = events(1, 40_000);
        let whole = runs(&all);
        assert!((500..800).contains(&whole.len()), "{}", whole.len());
        // Cut anywhere, at other times, and continued by other events.
        let late: Vec<CdEvent> = all[7_003..21_001]
            .iter()
            .map(|e| CdEvent {
                t_us: e.t_us + 123_456,
                ..*e
            })
            .collect();
        assert!(shared(&runs(&late), &whole) == 1.0);
        let continued = [&late[..], &events(2, 30_000)].concat();
        assert!(shared(&runs(&continued), &whole) > 0.3);
        assert!(shared(&runs(&events(3, 40_000)), &whole) == 0.0);
        assert!(shared(&runs(&all[..RUN - 1]), &whole) == 0.0);
    }

    #[test]
    fn a_hot_pixel_is_no_recording() {
        let hot = |n| vec![events(4, 1)[0]; n];
        assert!(runs(&hot(100_000)).is_empty());
    }
}

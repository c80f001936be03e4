//! Owns the comparison of two recordings by their events: whether one holds what the other recorded, whatever it is called.

use std::collections::BTreeSet;

use skinrig_analysis::event_runs::{RollingRuns, token};
use skinrig_analysis::{AnalysisError, EventSource};
use skinrig_model::{CameraId, CdEvent};

/// One run in so many is compared.
const ONE_IN: u64 = 64;

/// Hashes of runs of events.
pub(crate) type EventRuns = BTreeSet<u64>;

/// The runs of both cameras.
///
/// # Errors
/// [`AnalysisError::Events`] when a stream cannot be read to its end.
pub(crate) fn event_runs(source: &dyn EventSource) -> Result<EventRuns, AnalysisError> {
    let mut found = EventRuns::new();
    for camera in CameraId::ALL {
        let mut runs = RollingRuns::new(ONE_IN);
        let mut each = |events: &[CdEvent]| {
            events.iter().for_each(|event| {
                // Not times, which an import may have rounded.
                found.extend(runs.push(token(event, 0)));
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

#[cfg(test)]
mod tests {
    use skinrig_analysis::event_runs::RUN;
    use skinrig_model::Polarity;
    use skinrig_statistics::seeded;

    use super::*;

    fn events(seed: u64, n: u64) -> Vec<CdEvent> {
        let mut rng = seeded::generator(seed, 1);
        let mut event = |k: u64| CdEvent {
            t_us: k * 7,
            x: seeded::index(&mut rng, 640) as u16,
            y: seeded::index(&mut rng, 480) as u16,
            polarity: if seeded::index(&mut rng, 2) == 1 {
                Polarity::On
            } else {
                Polarity::Off
            },
        };
        (0..n).map(&mut event).collect()
    }

    fn runs(events: &[CdEvent]) -> EventRuns {
        let mut runs = RollingRuns::new(ONE_IN);
        let each = events.iter();
        each.filter_map(|e| runs.push(token(e, 0))).collect()
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

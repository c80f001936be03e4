//! Evaluates the trigger line of one camera pulse by pulse, against the reports of the trigger box.

use skinrig_model::{BoxReport, Label, TriggerEdge};

use super::edges::Edges;
use super::epochs::epochs;
use super::error::CameraClockError;
use crate::result::LineCounts;

/// Pulses of a train.
const PULSES: u32 = skinrig_model::pulse::PULSES_PER_TRAIN as u32;

/// Trigger line of one camera while a box sent trains.
#[derive(Debug, Clone, PartialEq)]
pub struct Wire {
    /// Every train of the box in time order.
    pub trains: Vec<WireTrain>,
    /// Edges of all trains.
    pub counts: LineCounts,
    /// Standard deviation of the rising edges about their own train's mean, µs, and the number of edges.
    pub jitter: Option<(f64, u64)>,
}

/// A train that the box sent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WireTrain {
    /// Label of the train.
    pub label: Label,
    /// Instant on the box's clock, µs.
    pub box_us: u64,
    /// Pulses that did not arrive completely.
    pub lost_pulses: u32,
}

/// Searches every sent pulse among the `edges` of `channel`. If the box's clock was reset, the run with the most trains is
/// used.
///
/// # Errors
/// Why the box's clock cannot be aligned with the camera's: no trains, or fewer than three identifiable ones.
pub fn wire(
    reports: &[BoxReport],
    edges: &[TriggerEdge],
    channel: u8,
) -> Result<Wire, CameraClockError> {
    let epochs = epochs(reports, &[]);
    let Some(epoch) = epochs.iter().max_by_key(|e| e.trains.len()) else {
        return Err(CameraClockError::NoTrain);
    };
    let found = Edges::new(edges, channel).map(epoch, &[])?;
    let trains = epoch.trains.iter().zip(&found.whole_pulses);
    Ok(Wire {
        trains: trains
            .map(|(sent, whole)| WireTrain {
                label: sent.label,
                box_us: epoch.reference_us.wrapping_add_signed(sent.box_us as i64),
                lost_pulses: PULSES - whole,
            })
            .collect(),
        counts: found.counts,
        jitter: found.jitter,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use skinrig_model::{BoxTime, Mark, MarkKind, PressId, PulseTrain};

    fn sent(n: u32) -> (Vec<BoxReport>, Vec<TriggerEdge>) {
        let (mut reports, mut edges) = (Vec::new(), Vec::new());
        for k in 0..n {
            let mark = Mark {
                kind: MarkKind::ALL[k as usize % 5],
                press: PressId::from_index(k * 977),
            };
            let us = 5_000_000 + u64::from(k) * 40_000;
            reports.push(BoxReport::Mark {
                mark,
                at: BoxTime { us },
            });
            let train = PulseTrain::new(mark).unwrap();
            edges.extend(train.edges().map(|(offset, rising)| {
                let since = (us + offset - 5_000_000) as f64;
                TriggerEdge {
                    // 300 ppm fast; every other rising edge 2 µs late.
                    t_us: 77_000 + (since * 1.0003).round() as u64 + 2 * (offset / 400 % 2),
                    channel: 6,
                    rising,
                }
            }));
        }
        (reports, edges)
    }

    #[test]
    fn missing_and_extra_pulses_are_counted_per_pulse() {
        let (reports, mut edges) = sent(6);
        let clean = wire(&reports, &edges, 6).unwrap();
        assert!(clean.trains.iter().all(|t| t.lost_pulses == 0), "{clean:?}");
        assert_eq!((clean.counts.doubled, clean.counts.spurious), (0, 0));
        assert_eq!(clean.trains[1].box_us, 5_040_000);
        // 0 and 2 µs alternately: a standard deviation of 1 µs, plus rounding to whole µs.
        let (jitter_us, n) = clean.jitter.unwrap();
        assert!(
            (0.9..1.3).contains(&jitter_us) && n == 6 * 32,
            "{jitter_us}"
        );
        // Both edges of one pulse in the second train, one of another in the third; one that was never sent.
        edges.remove(2 * 64 + 11);
        edges.drain(64 + 20..64 + 22);
        let at = edges[200].t_us + 31;
        edges.insert(
            201,
            TriggerEdge {
                t_us: at,
                channel: 6,
                rising: true,
            },
        );
        let worn = wire(&reports, &edges, 6).unwrap();
        let lost: Vec<u32> = worn.trains.iter().map(|t| t.lost_pulses).collect();
        assert_eq!(lost, [0, 1, 1, 0, 0, 0]);
        assert_eq!((worn.counts.doubled, worn.counts.spurious), (0, 1));
        // The train after the last reported one, as early as the box can send it.
        let (reports, mut edges) = sent(6);
        let next_us = 77_000 + ((5.0 * 40_000.0 + PulseTrain::DURATION_US as f64) * 1.0003) as u64;
        edges.push(TriggerEdge {
            t_us: next_us,
            channel: 6,
            rising: true,
        });
        let cut = wire(&reports, &edges, 6).unwrap();
        assert_eq!((cut.counts.doubled, cut.counts.spurious), (0, 0));
        assert!(wire(&reports, &edges, 0).is_err());
        assert!(wire(&[], &edges, 6).is_err());
    }
}

//! Owns the map from a session's time to the times that a camera stamped on its events.
//!
//! With an analysis it is the analysis' own map. Without one it is the least delay between the last event of a chunk and the chunk's
//! arrival, leg by leg: good to some milliseconds, which the page says.

use skinrig_analysis::LegStart;
use skinrig_analysis::result::{Analysis, ClockFit, Knot};
use skinrig_model::HostTime;
use skinrig_recorder::{ChunkMeta, LegRow};

/// Recorded camera times of one camera over session time.
#[derive(Debug, Clone)]
pub(crate) struct CameraTime {
    source: Source,
    /// Ends of all but the last leg, µs of session time, and the shift of each leg.
    legs: Vec<Leg>,
}

#[derive(Debug, Clone)]
enum Source {
    /// Aligned camera time over session time.
    Analysis { knots: Vec<Knot>, line: ClockFit },
    /// Camera time runs as session time does.
    Arrival,
}

#[derive(Debug, Clone, Copy)]
struct Leg {
    /// Start, µs of session time.
    from_us: f64,
    /// Recorded minus mapped camera time, µs.
    shift_us: f64,
}

impl CameraTime {
    /// The analysis' map of camera `k`; `None` if it found no clock.
    pub(crate) fn of_analysis(analysis: &Analysis, legs: &[LegStart], k: usize) -> Option<Self> {
        let line = analysis.clocks[k]?;
        let first = Leg {
            from_us: f64::NEG_INFINITY,
            shift_us: 0.0,
        };
        let further = legs.iter().map(|leg| Leg {
            from_us: leg.origin.0 as f64 * 1e-3,
            shift_us: -(leg.moved_us[k] as f64),
        });
        Some(Self {
            source: Source::Analysis {
                knots: analysis.alignment.camera_from_host[k].clone(),
                line,
            },
            legs: std::iter::once(first).chain(further).collect(),
        })
    }

    /// From the arrival of chunks; `None` without a chunk that has a time.
    pub(crate) fn of_arrivals(chunks: &[ChunkMeta], legs: &[LegRow]) -> Option<Self> {
        let mut found: Vec<Leg> = Vec::new();
        for (n, leg) in legs.iter().enumerate() {
            let end = legs
                .get(n + 1)
                .map_or(HostTime(i64::MAX), |next| next.origin);
            let of_leg = |c: &&ChunkMeta| leg.origin <= c.host_time && c.host_time < end;
            let delay = |c: &ChunkMeta| Some(c.host_time.0 as f64 * 1e-3 - c.facts.last_us? as f64);
            let least = chunks
                .iter()
                .filter(of_leg)
                .filter_map(delay)
                .reduce(f64::min);
            if let Some(least) = least {
                found.push(Leg {
                    from_us: leg.origin.0 as f64 * 1e-3,
                    shift_us: -least,
                });
            }
        }
        (!found.is_empty()).then_some(Self {
            source: Source::Arrival,
            legs: found,
        })
    }

    /// True if the analysis measured it.
    pub(crate) const fn is_measured(&self) -> bool {
        matches!(self.source, Source::Analysis { .. })
    }

    /// Recorded camera time at a session time, both µs; may be below zero.
    pub(crate) fn recorded_us(&self, host_us: f64) -> f64 {
        let at = self.legs.partition_point(|leg| leg.from_us <= host_us);
        let shift_us = self.legs[at.saturating_sub(1)].shift_us;
        let mapped = match &self.source {
            Source::Arrival => host_us,
            Source::Analysis { knots, line } if knots.len() < 2 => line.camera_us(host_us),
            Source::Analysis { knots, .. } => {
                let at = knots[1..knots.len() - 1].partition_point(|k| k.host_us <= host_us);
                let (a, b) = (knots[at], knots[at + 1]);
                let share = (host_us - a.host_us) / (b.host_us - a.host_us);
                a.camera_us + share * (b.camera_us - a.camera_us)
            }
        };
        mapped + shift_us
    }

    /// Interval of recorded camera time for `from_s..to_s` of session time, whole µs; `None` if the camera's clock had not begun.
    pub(crate) fn interval_us(&self, from_s: f64, to_s: f64) -> Option<(u64, u64)> {
        let [from, to] = [from_s, to_s].map(|t| self.recorded_us(t * 1e6).floor());
        // Casts saturate: a camera has no times below zero.
        (to >= 0.0).then_some((from.max(0.0) as u64, to as u64))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use skinrig_model::{CameraId, ChunkFacts};
    use skinrig_recorder::Codec;

    fn chunk(host_us: i64, last_us: u64) -> ChunkMeta {
        ChunkMeta {
            camera: CameraId::One,
            seq: 0,
            host_time: HostTime(host_us * 1000),
            lost_before: 0,
            lost_time: None,
            codec: Codec::None,
            raw_bytes: 0,
            stored_bytes: 0,
            raw_crc32: 0,
            facts: ChunkFacts {
                first_us: Some(last_us),
                last_us: Some(last_us),
                ..ChunkFacts::default()
            },
            restart_us: None,
        }
    }

    #[test]
    fn arrivals_give_the_least_delay_of_each_leg() {
        let leg = |number: u32, origin: i64| LegRow {
            number,
            began: skinrig_model::ResumeHeader {
                operator: String::new(),
                started_at: String::new(),
                host: String::new(),
                software: String::new(),
                command_line: String::new(),
            },
            origin: HostTime(origin * 1000),
            camera_origin_us: [0; 2],
            first_seq: [0; 2],
            devices_before: 0,
            preflight_before: 0,
            end: None,
            tree_sha256: None,
        };
        let chunks = [
            chunk(1_000, 400),
            chunk(2_000, 1_600),
            chunk(11_000, 10_900),
        ];
        let time = CameraTime::of_arrivals(&chunks, &[leg(1, 0), leg(2, 10_000)]).unwrap();
        assert!(!time.is_measured());
        assert_eq!(time.recorded_us(1_000.0), 600.0);
        assert_eq!(time.recorded_us(10_500.0), 10_400.0);
        assert_eq!(time.interval_us(0.0, 0.001), Some((0, 600)));
        assert_eq!(time.interval_us(0.0, 0.0001), None);
        assert!(CameraTime::of_arrivals(&[], &[leg(1, 0)]).is_none());
    }
}

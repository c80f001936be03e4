//! Trigger marks: which moment of which press a pulse train on the trigger line stands for.
//!
//! A mark is sent as a train of pulses that names itself, so that a lost or doubled pulse is seen and
//! never shifts the count: one *start* pulse, then [`PAYLOAD_BITS`] data pulses, most significant bit
//! first, then one parity pulse. Pulse `k` of a train rises `k *` [`PULSE_PERIOD_US`] after the start
//! pulse; its width tells its meaning. The instant of the mark is the rising edge of the start pulse.
//! All widths are far above the 500 ns minimum of the camera's trigger input.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::event::TriggerEdge;
use crate::id::PressId;
use crate::time::HostTime;

/// Width of the start pulse, µs.
pub const START_WIDTH_US: u64 = 300;
/// Width of a pulse that means 1, µs.
pub const ONE_WIDTH_US: u64 = 200;
/// Width of a pulse that means 0, µs.
pub const ZERO_WIDTH_US: u64 = 100;
/// Distance of two rising edges of a train, µs.
pub const PULSE_PERIOD_US: u64 = 400;
/// Data bits of a train: 3 for the kind, 17 for the press.
pub const PAYLOAD_BITS: u32 = 20;
/// Pulses of a train: start, data, parity.
pub const PULSES_PER_TRAIN: u64 = PAYLOAD_BITS as u64 + 2;
/// The kind code of a *sync* train, which names no press: its 17 bits are the box's running number of sync trains,
/// modulo 2^17. The box sends them by itself, so that clocks are tied together between presses too.
pub const SYNC_CODE: u32 = 6;
/// The largest press id that a mark can carry.
pub const MAX_MARKED_PRESS: u32 = (1 << 17) - 1;
/// How far a measured width or period may be off and still be read, µs.
pub const TOLERANCE_US: u64 = 40;

/// A moment of a press that can be marked on the trigger line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MarkKind {
    /// The downward motion begins.
    Approach,
    /// The tip reaches the surface.
    Contact,
    /// The tip settled at its depth.
    AtDepth,
    /// The upward motion begins.
    Retract,
    /// The tip left the surface.
    Release,
}

impl MarkKind {
    /// All kinds, in the order of a press.
    pub const ALL: [Self; 5] = [
        Self::Approach,
        Self::Contact,
        Self::AtDepth,
        Self::Retract,
        Self::Release,
    ];

    /// The code on the wire: 1..=5 (0 is never sent).
    #[must_use]
    pub const fn code(self) -> u32 {
        match self {
            Self::Approach => 1,
            Self::Contact => 2,
            Self::AtDepth => 3,
            Self::Retract => 4,
            Self::Release => 5,
        }
    }

    /// The name used in protocols and sessions.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Approach => "approach",
            Self::Contact => "contact",
            Self::AtDepth => "at_depth",
            Self::Retract => "retract",
            Self::Release => "release",
        }
    }

    /// The kind with this code.
    #[must_use]
    pub fn from_code(code: u32) -> Option<Self> {
        Self::ALL.into_iter().find(|k| k.code() == code)
    }
}

impl fmt::Display for MarkKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A mark: this moment of this press.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Mark {
    /// Which moment.
    pub kind: MarkKind,
    /// Of which press; at most [`MAX_MARKED_PRESS`].
    pub press: PressId,
}

/// A mark that the trigger box was told to send.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct SentMark {
    /// What was sent.
    pub mark: Mark,
    /// The rising edge of its start pulse on the host clock.
    pub t: HostTime,
    /// Half width of the interval in which that instant certainly lies, ns.
    pub uncertainty_ns: i64,
}

/// A mark as a train of pulses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PulseTrain {
    mark: Mark,
}

impl PulseTrain {
    /// The train of `mark`, or `None` when its press id does not fit.
    #[must_use]
    pub const fn new(mark: Mark) -> Option<Self> {
        if mark.press.0 > MAX_MARKED_PRESS {
            None
        } else {
            Some(Self { mark })
        }
    }

    /// (offset of the rising edge from the mark's instant, width) of each pulse, µs.
    pub fn pulses(self) -> impl Iterator<Item = (u64, u64)> {
        let payload = (self.mark.kind.code() << 17) | self.mark.press.0;
        let parity = payload.count_ones() % 2 == 1;
        let bit_width = |bit: bool| if bit { ONE_WIDTH_US } else { ZERO_WIDTH_US };
        (0..PULSES_PER_TRAIN).map(move |k| {
            let width = if k == 0 {
                START_WIDTH_US
            } else if k == PULSES_PER_TRAIN - 1 {
                bit_width(parity)
            } else {
                bit_width((payload >> (PAYLOAD_BITS as u64 - k)) & 1 == 1)
            };
            (k * PULSE_PERIOD_US, width)
        })
    }

    /// Duration of any train from its first rising to its last possible falling edge, µs.
    pub const DURATION_US: u64 = PULSES_PER_TRAIN * PULSE_PERIOD_US;
}

/// A mark found on a camera's trigger input.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct SeenMark {
    /// What the train said.
    pub mark: Mark,
    /// Rising edge of its start pulse on the camera's clock, µs.
    pub t_us: u64,
}

/// What [`decode_marks`] found on one channel.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct DecodedMarks {
    /// Complete trains with right parity, in time order.
    pub marks: Vec<SeenMark>,
    /// Edges that belong to no complete train: lost, doubled or foreign pulses.
    pub stray_edges: u64,
}

/// Finds the pulse trains among the edges of one channel, in time order.
///
/// Total: any edges give marks or strays. A train counts only when all its pulses are there with right
/// widths, distances and parity.
#[must_use]
pub fn decode_marks(edges: &[TriggerEdge]) -> DecodedMarks {
    let mut out = DecodedMarks::default();
    let mut i = 0;
    while i < edges.len() {
        match decode_train(&edges[i..]) {
            Some(seen) => {
                out.marks.push(seen);
                i += 2 * PULSES_PER_TRAIN as usize;
            }
            None => {
                out.stray_edges += 1;
                i += 1;
            }
        }
    }
    out
}

fn decode_train(edges: &[TriggerEdge]) -> Option<SeenMark> {
    let edges = edges.get(..2 * PULSES_PER_TRAIN as usize)?;
    let t0 = edges[0].t_us;
    let near = |found: u64, wanted: u64| found.abs_diff(wanted) <= TOLERANCE_US;
    let mut bits = 0u32;
    for (k, pulse) in edges.chunks_exact(2).enumerate() {
        let (rise, fall) = (pulse[0], pulse[1]);
        let offset = rise.t_us.checked_sub(t0)?;
        let width = fall.t_us.checked_sub(rise.t_us)?;
        if !rise.rising || fall.rising || !near(offset, k as u64 * PULSE_PERIOD_US) {
            return None;
        }
        if k == 0 {
            if !near(width, START_WIDTH_US) {
                return None;
            }
        } else if near(width, ONE_WIDTH_US) {
            bits = (bits << 1) | 1;
        } else if near(width, ZERO_WIDTH_US) {
            bits <<= 1;
        } else {
            return None;
        }
    }
    let (payload, parity) = (bits >> 1, bits & 1);
    if payload.count_ones() % 2 != parity {
        return None;
    }
    let kind = MarkKind::from_code(payload >> 17)?;
    let press = PressId(payload & MAX_MARKED_PRESS);
    Some(SeenMark {
        mark: Mark { kind, press },
        t_us: t0,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn edges(mark: Mark, t0: u64, jitter: &[i64]) -> Vec<TriggerEdge> {
        let mut out = Vec::new();
        for (k, (offset, width)) in PulseTrain::new(mark).unwrap().pulses().enumerate() {
            let at = (t0 + offset) as i64 + jitter[k % jitter.len()];
            out.push(TriggerEdge {
                t_us: at as u64,
                channel: 0,
                rising: true,
            });
            out.push(TriggerEdge {
                t_us: at as u64 + width,
                channel: 0,
                rising: false,
            });
        }
        out
    }

    proptest! {
        #[test]
        fn every_mark_survives_the_wire(code in 1u32..=5, press in 0..=MAX_MARKED_PRESS,
                                        t0 in 1000u64..1 << 40, jitter in prop::collection::vec(-15i64..15, 22)) {
            let mark = Mark { kind: MarkKind::from_code(code).unwrap(), press: PressId(press) };
            let seen = decode_marks(&edges(mark, t0, &jitter));
            prop_assert_eq!(seen.stray_edges, 0);
            prop_assert_eq!(seen.marks.len(), 1);
            prop_assert_eq!(seen.marks[0].mark, mark);
            prop_assert_eq!(seen.marks[0].t_us, (t0 as i64 + jitter[0]) as u64);
        }

        #[test]
        fn a_lost_edge_spoils_its_own_train_only(lost in 0usize..44) {
            let mark = |p| Mark { kind: MarkKind::Contact, press: PressId(p) };
            let mut all = edges(mark(7), 1_000, &[0]);
            all.remove(lost);
            all.extend(edges(mark(8), 100_000, &[0]));
            let seen = decode_marks(&all);
            prop_assert_eq!(seen.marks.len(), 1);
            prop_assert_eq!(seen.marks[0].mark, mark(8));
            prop_assert_eq!(seen.stray_edges, 43);
        }
    }

    #[test]
    fn a_press_id_that_does_not_fit_is_refused() {
        let mark = Mark {
            kind: MarkKind::Contact,
            press: PressId(MAX_MARKED_PRESS + 1),
        };
        assert_eq!(PulseTrain::new(mark), None);
    }
}

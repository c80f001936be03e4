//! Trigger trains: coded pulses on the trigger line that identify themselves.
//!
//! # Signal
//!
//! A train is 32 pulses ([`PULSES_PER_TRAIN`]). Pulse `k = 0..32` rises `k *` 400 µs (`PULSE_PERIOD_US`) after
//! the train's first rising edge; its width encodes its value:
//!
//! | pulse | width | meaning |
//! |---|---|---|
//! | 0 | 300 µs | start; its rising edge is the time of the train |
//! | 1..=3 | 100 µs for 0, 200 µs for 1 | kind, most significant bit first: 1..=5 a mark ([`MarkKind::code`]), 6 a sync train ([`SYNC_CODE`]); 0 and 7 are never sent |
//! | 4..=20 | same | 17 bits, most significant first: the press of a mark, or the running number of a sync train modulo 2^17 |
//! | 21..=31 | same | 11 check bits, most significant first: `check_bits` of the 20 data bits |
//!
//! Afterwards the line stays low until 34 periods ([`PulseTrain::DURATION_US`], 13.6 ms) have passed since the
//! first edge. All widths are far above the 500 ns minimum of the camera's trigger input.
//!
//! # Why these check bits
//!
//! The 31 bits are a word of the even-weight BCH(31, 21) code with generator
//! `(x + 1)(x^10 + x^9 + x^8 + x^6 + x^5 + x^3 + 1)`, the code of POCSAG paging (ITU-R M.584): any two words
//! differ in at least 6 bits. Check bits are XORed with `CHECK_MASK`, because the code is cyclic: without the
//! mask a train read one pulse late could be a word again; with it every such shift is at least 4 bits away from
//! all words. [`decode_marks`] states the resulting error rates.

mod decode;

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::id::PressId;
use crate::time::HostTime;

/// Width of the start pulse, µs.
pub(crate) const START_WIDTH_US: u64 = 300;
/// Width of a pulse for 1, µs.
pub(crate) const ONE_WIDTH_US: u64 = 200;
/// Width of a pulse for 0, µs.
pub(crate) const ZERO_WIDTH_US: u64 = 100;
/// Distance of two rising edges of a train, µs.
pub(crate) const PULSE_PERIOD_US: u64 = 400;
/// Data bits of a train: 3 for the kind, 17 for the press or the sync count.
pub(crate) const DATA_BITS: u32 = 20;
/// Check bits of a train.
pub(crate) const CHECK_BITS: u32 = 11;
/// Pulses of a train: start, data, check.
pub const PULSES_PER_TRAIN: u64 = 1 + (DATA_BITS + CHECK_BITS) as u64;
/// XORed into the check bits; chosen by trying all 2^11 masks for the largest distance of shifted trains from the code.
pub(crate) const CHECK_MASK: u32 = 0x7FD;
/// Generator of the code, x^11 + x^8 + x^7 + x^5 + x^4 + x^3 + x + 1.
const GENERATOR: u32 = 0x9BB;
/// Kind code of a *sync* train, which names no press: its 17 bits are the box's running number of sync trains,
/// modulo 2^17. The box sends them by itself, to align the clocks between presses too.
pub const SYNC_CODE: u32 = 6;
/// The largest press id that a mark can carry, and the largest count of a sync train.
pub const MAX_MARKED_PRESS: u32 = (1 << 17) - 1;
/// The last press that a mark can name.
pub const LAST_MARKED_PRESS: PressId = PressId::from_index(MAX_MARKED_PRESS);
/// Largest readable error of a measured width or period, µs.
pub(crate) const TOLERANCE_US: u64 = 40;

/// A moment of a press that can be marked on the trigger line.
#[derive(
    Debug,
    Clone,
    Copy,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    Hash,
    Serialize,
    Deserialize,
    skinrig_settings::Choice,
)]
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

/// A mark of one moment of one press.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Mark {
    /// Moment of the press.
    pub kind: MarkKind,
    /// The press; at most [`LAST_MARKED_PRESS`].
    pub press: PressId,
}

/// Mark that tests the trigger line before a run. Its number belongs to no press, because a plan has at most
/// [`MAX_MARKED_PRESS`] presses with smaller numbers.
pub const LOOPBACK: Mark = Mark {
    kind: MarkKind::Approach,
    press: LAST_MARKED_PRESS,
};

/// A mark sent by the trigger box.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct SentMark {
    /// The mark.
    pub mark: Mark,
    /// The rising edge of its start pulse on the host clock.
    pub t: HostTime,
    /// Half width of the interval that certainly contains that time, ns.
    pub uncertainty_ns: i64,
}

/// Content of a train.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Label {
    /// A moment of a press.
    Mark(Mark),
    /// Running number of a periodic train, modulo 2^17.
    Sync(u32),
}

impl Label {
    /// The 20 data bits, or `None` if the number does not fit.
    #[must_use]
    pub fn data(self) -> Option<u32> {
        let (code, number) = match self {
            Self::Mark(mark) => (mark.kind.code(), mark.press.index()),
            Self::Sync(count) => (SYNC_CODE, count),
        };
        (number <= MAX_MARKED_PRESS).then_some((code << 17) | number)
    }

    /// The label with these 20 data bits, or `None` for a kind that is never sent.
    #[must_use]
    pub fn from_data(data: u32) -> Option<Self> {
        let number = data & MAX_MARKED_PRESS;
        match data >> 17 {
            SYNC_CODE => Some(Self::Sync(number)),
            code => MarkKind::from_code(code).map(|kind| {
                Self::Mark(Mark {
                    kind,
                    press: PressId::from_index(number),
                })
            }),
        }
    }
}

/// The 11 check bits of 20 data bits: the remainder of `data * x^11` by the generator over GF(2), XORed with
/// [`CHECK_MASK`].
#[must_use]
pub(crate) const fn check_bits(data: u32) -> u32 {
    let mut rest = data << CHECK_BITS;
    let mut bit = DATA_BITS + CHECK_BITS;
    while bit > CHECK_BITS {
        bit -= 1;
        if (rest >> bit) & 1 == 1 {
            rest ^= GENERATOR << (bit - CHECK_BITS);
        }
    }
    rest ^ CHECK_MASK
}

/// A label as a train of pulses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PulseTrain {
    /// Data and check bits; the first one sent is the most significant.
    bits: u32,
}

impl PulseTrain {
    /// The train of `mark`, or `None` if its press number does not fit.
    #[must_use]
    pub fn new(mark: Mark) -> Option<Self> {
        Self::of(Label::Mark(mark))
    }

    /// The sync train with this running number, which wraps at 2^17.
    #[must_use]
    pub const fn sync(count: u32) -> Self {
        Self::with_data((SYNC_CODE << 17) | (count & MAX_MARKED_PRESS))
    }

    /// The train of `label`, or `None` if its number does not fit.
    #[must_use]
    pub fn of(label: Label) -> Option<Self> {
        label.data().map(Self::with_data)
    }

    const fn with_data(data: u32) -> Self {
        Self {
            bits: (data << CHECK_BITS) | check_bits(data),
        }
    }

    /// The 31 data and check bits; the first one sent is the most significant.
    #[must_use]
    pub const fn bits(self) -> u32 {
        self.bits
    }

    /// (offset of the rising edge from the train's time, width) of each pulse, µs.
    pub fn pulses(self) -> impl Iterator<Item = (u64, u64)> {
        (0..PULSES_PER_TRAIN).map(move |k| {
            let one = (self.bits >> (PULSES_PER_TRAIN - 1 - k)) & 1 == 1;
            let width = match (k, one) {
                (0, _) => START_WIDTH_US,
                (_, true) => ONE_WIDTH_US,
                (_, false) => ZERO_WIDTH_US,
            };
            (k * PULSE_PERIOD_US, width)
        })
    }

    /// (offset from the train's time in µs, true for rising) of each edge, in order.
    pub fn edges(self) -> impl Iterator<Item = (u64, bool)> {
        self.pulses()
            .flat_map(|(offset, width)| [(offset, true), (offset + width, false)])
    }

    /// Time that a train occupies the line, µs: its pulses and two idle periods.
    pub const DURATION_US: u64 = (PULSES_PER_TRAIN + 2) * PULSE_PERIOD_US;
}

/// A mark decoded from a camera's trigger input.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct DecodedMark {
    /// Decoded mark.
    pub mark: Mark,
    /// Rising edge of its start pulse on the camera's clock, µs.
    pub t_us: u64,
}

/// A sync train decoded from a camera's trigger input.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct DecodedSync {
    /// Running number, modulo 2^17.
    pub count: u32,
    /// Rising edge of its start pulse on the camera's clock, µs.
    pub t_us: u64,
}

pub use decode::{DecodedMarks, ReceivedTrain, decode_marks, read_trains};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_two_trains_differ_in_six_bits_at_least() {
        // The code is linear: the lightest word without the mask is the distance.
        let lightest = (1u32..1 << DATA_BITS)
            .map(|data| ((data << CHECK_BITS) | (check_bits(data) ^ CHECK_MASK)).count_ones())
            .min();
        assert_eq!(lightest, Some(6));
    }

    #[test]
    fn known_trains_have_these_pulses() {
        let widths = |train: PulseTrain| -> String {
            train
                .pulses()
                .map(|(_, width)| match width {
                    START_WIDTH_US => 'S',
                    ONE_WIDTH_US => '1',
                    _ => '0',
                })
                .collect()
        };
        let mark = |kind, press| {
            PulseTrain::new(Mark {
                kind,
                press: PressId::from_index(press),
            })
        };
        // Test vectors for other senders: S, 3 bits of kind, 17 of the number, 11 of check.
        assert_eq!(
            mark(MarkKind::Approach, 0).map(widths).as_deref(),
            Some("S0010000000000000000000001111001")
        );
        assert_eq!(
            mark(MarkKind::Contact, 7).map(widths).as_deref(),
            Some("S0100000000000000011110101101111")
        );
        assert_eq!(
            mark(MarkKind::Release, MAX_MARKED_PRESS)
                .map(widths)
                .as_deref(),
            Some("S1011111111111111111100111011000")
        );
        assert_eq!(
            widths(PulseTrain::sync(0)),
            "S1100000000000000000010110010011"
        );
        assert_eq!(
            widths(PulseTrain::sync(1)),
            "S1100000000000000000110000101000"
        );
        assert_eq!(PulseTrain::sync(1 << 17), PulseTrain::sync(0));
    }

    #[test]
    fn a_press_number_that_does_not_fit_is_rejected() {
        let mark = Mark {
            kind: MarkKind::Contact,
            press: PressId::from_index(MAX_MARKED_PRESS + 1),
        };
        assert_eq!(PulseTrain::new(mark), None);
    }
}

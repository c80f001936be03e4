//! Touch felt while a run records: what the controller gives an estimator outside it, and gets back.

use skinrig_device::OpenChunk;
use skinrig_model::{CameraId, HostTime, RawChunk, TouchDepth, TouchKind, TouchRegion};

/// Feels touches in the bytes of both cameras. The controller never waits for an answer that [`poll`](Self::poll) does not have,
/// and no limit or guard depends on one.
pub trait TouchSense {
    /// False if it takes no bytes and never answers.
    fn is_on(&self) -> bool {
        true
    }

    /// Starts to learn: the calibration presses have outcomes, and their records are durable. May block only on rigs whose time stands
    /// still meanwhile.
    fn learn(&mut self);

    /// The next bytes of a camera; each byte comes once, in order. `lost` bytes are missing before them.
    fn feed(&mut self, camera: CameraId, lost: u64, bytes: &[u8]);

    /// The next answer, if any; never blocks. `now` is the time of the run.
    fn poll(&mut self, now: HostTime) -> Option<SenseAnswer>;
}

/// An answer of a [`TouchSense`].
#[derive(Debug, Clone, PartialEq)]
pub enum SenseAnswer {
    /// It has learnt and reports touches from now on.
    Ready {
        /// Number of places learnt.
        places: usize,
        /// Whether positions have regions.
        has_regions: bool,
        /// Whether touches have depths.
        has_depths: bool,
        /// Whether they also have them away from these places.
        has_depths_elsewhere: bool,
    },
    /// It reports no touches, or no more, in this run.
    Off(SenseFault),
    /// Something was felt.
    Felt(SensedTouch),
}

/// Why no touches are reported.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SenseFault {
    /// The calibration presses are too few or cannot be analysed.
    #[error("learning from the calibration presses failed: {0}")]
    NotLearnt(String),
    /// The estimator failed.
    #[error("the estimator failed: {0}")]
    Failed(String),
}

/// A touch as the sense reports it; the run adds its own time and the attempt.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SensedTouch {
    /// Events up to this time are in it.
    pub until: HostTime,
    /// Standard deviation of that time, ns.
    pub until_sd_ns: i64,
    /// Kind of the report.
    pub kind: TouchKind,
    /// Position, mm.
    pub at_mm: Option<[f64; 2]>,
    /// Its 95 % region.
    pub region: Option<TouchRegion>,
    /// Depth that the touch has reached.
    pub depth: Option<TouchDepth>,
    /// Log likelihood ratio of an onset, nats.
    pub llr: Option<f64>,
}

impl SensedTouch {
    /// The start of a sense that has learnt.
    pub(crate) const fn started(now: HostTime) -> Self {
        Self {
            until: now,
            until_sd_ns: 0,
            kind: TouchKind::Started,
            at_mm: None,
            region: None,
            depth: None,
            llr: None,
        }
    }
}

/// For plans that feel no touches.
pub(crate) struct NoSense;

impl TouchSense for NoSense {
    fn is_on(&self) -> bool {
        false
    }

    fn learn(&mut self) {}

    fn feed(&mut self, _: CameraId, _: u64, _: &[u8]) {}

    fn poll(&mut self, _: HostTime) -> Option<SenseAnswer> {
        None
    }
}

/// Which bytes of a camera the sense has.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Fed {
    /// Number of the chunk being filled.
    seq: u64,
    /// Bytes of that chunk already fed.
    bytes: usize,
}

impl Fed {
    /// Position in the open chunk of the first byte not yet fed.
    pub(crate) const fn next(self) -> usize {
        self.bytes
    }

    /// Feeds the new bytes of the open chunk.
    pub(crate) fn open(&mut self, camera: CameraId, open: &OpenChunk, sense: &mut dyn TouchSense) {
        // A camera on its own thread may answer an earlier request: chunks in transit come first.
        let Some(known) = self.bytes.checked_sub(open.from) else {
            return;
        };
        if open.seq != self.seq || known >= open.bytes.len() {
            return;
        }
        let lost = if self.bytes == 0 { open.lost_before } else { 0 };
        sense.feed(camera, lost, &open.bytes[known..]);
        self.bytes = open.from + open.bytes.len();
    }

    /// Feeds the new bytes of a complete chunk.
    pub(crate) fn complete(&mut self, chunk: &RawChunk, sense: &mut dyn TouchSense) {
        let known = if chunk.seq == self.seq { self.bytes } else { 0 };
        let rest = chunk.bytes.get(known..).unwrap_or_default();
        let lost = if known == 0 { chunk.lost_before } else { 0 };
        if lost > 0 || !rest.is_empty() {
            sense.feed(chunk.camera, lost, rest);
        }
        // A gap may split the chunk: the bytes behind it were fed already.
        self.bytes = known.saturating_sub(chunk.bytes.len());
        self.seq = chunk.seq + 1;
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use skinrig_model::ChunkFacts;

    use super::*;

    #[derive(Default)]
    struct CollectingSense {
        bytes: Vec<u8>,
        lost: Vec<(usize, u64)>,
    }

    impl TouchSense for CollectingSense {
        fn learn(&mut self) {}

        fn feed(&mut self, _: CameraId, lost: u64, bytes: &[u8]) {
            if lost > 0 {
                self.lost.push((self.bytes.len(), lost));
            }
            self.bytes.extend_from_slice(bytes);
        }

        fn poll(&mut self, _: HostTime) -> Option<SenseAnswer> {
            None
        }
    }

    fn chunk(seq: u64, lost_before: u64, bytes: Vec<u8>) -> RawChunk {
        RawChunk {
            camera: CameraId::One,
            seq,
            host_time: HostTime::ZERO,
            lost_before,
            lost_from_us: None,
            bytes,
            facts: ChunkFacts::default(),
            triggers: Vec::new(),
        }
    }

    proptest! {
        /// Open chunks may be seen late, twice or not at all: every byte is fed once, and every loss at its place.
        #[test]
        fn every_byte_is_fed_once(
            lengths in prop::collection::vec((0usize..6, 0u64..3), 1..12),
            looks in prop::collection::vec((0usize..7, 0usize..7, 0u64..2), 0..40),
        ) {
            let mut value = 0u8;
            let mut chunks = Vec::new();
            for (seq, (words, lost)) in (0u64..).zip(lengths) {
                let bytes = (0..4 * words).map(|_| { value = value.wrapping_add(1); value }).collect();
                chunks.push(chunk(seq, lost, bytes));
            }
            let (mut fed, mut sense) = (Fed::default(), CollectingSense::default());
            let mut looks = looks.into_iter();
            for k in 0..chunks.len() {
                for _ in 0..3 {
                    let Some((words, from, behind)) = looks.next() else { break };
                    let seen = &chunks[k.saturating_sub(behind as usize)];
                    let end = (4 * words).min(seen.bytes.len());
                    let from = (4 * from).min(fed.next());
                    if let Some(open) = OpenChunk::of(seen.seq, seen.lost_before, &seen.bytes[..end], from) {
                        fed.open(CameraId::One, &open, &mut sense);
                    }
                }
                fed.complete(&chunks[k], &mut sense);
            }
            let all: Vec<u8> = chunks.iter().flat_map(|c| c.bytes.clone()).collect();
            prop_assert_eq!(sense.bytes, all);
            let mut at = 0;
            let mut lost = Vec::new();
            for c in &chunks {
                if c.lost_before > 0 {
                    lost.push((at, c.lost_before));
                }
                at += c.bytes.len();
            }
            prop_assert_eq!(sense.lost, lost);
        }
    }
}

//! Touch felt while a run records: what the controller gives an estimator outside it, and gets back.

use skinrig_device::OpenChunk;
use skinrig_model::{CameraId, HostTime, RawChunk, TouchKind, TouchRegion};

/// Feels touches in the bytes of both cameras. The controller never waits for an answer that [`poll`](Self::poll) does not have,
/// and no limit or guard depends on one.
pub trait TouchSense {
    /// Whether it wants bytes at all.
    fn is_on(&self) -> bool {
        true
    }

    /// Learning is due: the calibrating presses have outcomes, and their records are durable. One that blocks here is for rigs whose
    /// time stands still meanwhile.
    fn learn(&mut self);

    /// The next bytes of a camera; each byte comes once, in order. `lost` bytes are missing before them.
    fn feed(&mut self, camera: CameraId, lost: u64, bytes: &[u8]);

    /// The next answer, if any; never waits. `now` is the time of the run.
    fn poll(&mut self, now: HostTime) -> Option<SenseAnswer>;
}

/// An answer of a [`TouchSense`].
#[derive(Debug, Clone, PartialEq)]
pub enum SenseAnswer {
    /// It has learnt, and feels from now on.
    Ready {
        /// Number of places learnt.
        places: usize,
        /// Whether positions have regions.
        has_regions: bool,
    },
    /// It feels nothing in this run, or no more.
    Off(SenseFault),
    /// Something was felt.
    Felt(SensedTouch),
}

/// Why nothing is felt.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SenseFault {
    /// The presses teach too little, or cannot be analysed.
    #[error("learning from the calibration presses failed: {0}")]
    NotLearnt(String),
    /// The estimator failed.
    #[error("the estimator failed: {0}")]
    Failed(String),
}

/// Something felt, before the run knows it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SensedTouch {
    /// Events up to this time are in it.
    pub until: HostTime,
    /// Standard deviation of that time, ns.
    pub until_sd_ns: i64,
    /// What was felt.
    pub kind: TouchKind,
    /// Position, mm.
    pub at_mm: Option<[f64; 2]>,
    /// Its 95 % region.
    pub region: Option<TouchRegion>,
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
            llr: None,
        }
    }
}

/// No sense: for plans without one.
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
    /// The chunk being filled,
    seq: u64,
    /// and how many of its bytes were fed.
    bytes: usize,
}

impl Fed {
    /// Position from which bytes of the open chunk are wanted.
    pub(crate) const fn next(self) -> usize {
        self.bytes
    }

    /// Feeds what is new of the open chunk.
    pub(crate) fn open(&mut self, camera: CameraId, open: &OpenChunk, sense: &mut dyn TouchSense) {
        // A camera on its own thread answers an earlier request: chunks on their way come first.
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

    /// Feeds what is new of a complete chunk.
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
        /// Whatever was seen of open chunks, also late or twice, every byte comes once and every loss where it was.
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

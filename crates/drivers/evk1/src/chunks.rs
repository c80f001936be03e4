//! Converts received blocks to the chunks of a recording, with their facts.

use skinrig_formats::Scanner;
use skinrig_model::{CameraId, HostTime, RawChunk, StreamFormat};

use crate::inbox::{Block, WORD};
use crate::report::StreamReport;
use crate::time_base::{Gate, TimeBaseMonitor};

/// Converts blocks to chunks. It lives as long as the camera, so that chunk numbers and unwrapped time continue through stop and start.
#[derive(Debug)]
pub(crate) struct Chunker {
    camera: CameraId,
    seq: u64,
    scanner: Scanner,
    gate: Gate,
    after_loss: bool,
    watch: TimeBaseMonitor,
    /// Whether this stream has no time yet.
    fresh: bool,
    /// The first time of this stream.
    began_us: Option<u64>,
    last_us: u64,
    last_arrival: HostTime,
    max_step_us: Option<u64>,
}

impl Chunker {
    /// For a stream that has not started. A time base step above `max_step_us` counts as a loss of at least one word.
    #[must_use]
    pub fn new(camera: CameraId, max_step_us: Option<u64>) -> Self {
        Self {
            camera,
            seq: 0,
            scanner: Scanner::new(StreamFormat::Evt2),
            gate: Gate::AwaitTime,
            after_loss: false,
            watch: TimeBaseMonitor::default(),
            fresh: true,
            began_us: None,
            last_us: 0,
            last_arrival: HostTime(i64::MIN),
            max_step_us,
        }
    }

    /// Starts a stream. A slave's has no time until its master's clock arrives.
    pub fn start(&mut self, slave: bool) {
        self.gate = if slave {
            Gate::AwaitAdvance { standing: None }
        } else {
            Gate::AwaitTime
        };
        self.after_loss = false;
        self.fresh = true;
        self.began_us = None;
        self.watch.reset();
    }

    /// Latest time of this stream, µs.
    #[must_use]
    pub fn reached_us(&self) -> Option<u64> {
        (!self.fresh).then_some(self.last_us)
    }

    /// Handles an overflow that the camera reported at `at`. An unknown number of words was lost at an unknown place since camera time
    /// `good_us`, or since the start.
    pub(crate) fn overflowed(
        &mut self,
        at: HostTime,
        good_us: Option<u64>,
        report: &mut StreamReport,
        chunks: &mut Vec<RawChunk>,
    ) {
        report.overflow_gaps += 1;
        report.lost_bytes += WORD as u64;
        if self.gate == Gate::Open {
            self.gate = Gate::AwaitTime;
            self.after_loss = true;
        }
        self.watch.reset();
        let from_us = good_us.or(self.began_us);
        let arrived = at.max(self.last_arrival);
        self.hand_over(Vec::new(), arrived, WORD as u64, report, chunks);
        if let Some(chunk) = chunks.last_mut() {
            chunk.lost_from_us = from_us;
        }
    }

    /// Number of the next chunk; `None` while words have no valid times.
    pub(crate) fn open_seq(&self) -> Option<u64> {
        self.time_runs().then_some(self.seq)
    }

    /// Whether words have valid times.
    #[must_use]
    pub fn time_runs(&self) -> bool {
        self.gate == Gate::Open
    }

    /// Converts the next block: at most one chunk, plus one per gap in its time base.
    pub fn take(&mut self, block: Block, report: &mut StreamReport, chunks: &mut Vec<RawChunk>) {
        let Block {
            mut bytes,
            arrived,
            lost_before,
        } = block;
        let mut lost = 0;
        if let Some(loss) = lost_before {
            lost = loss.bytes;
            report.add_loss(loss);
            self.watch.reset();
            if self.gate == Gate::Open {
                self.gate = Gate::AwaitTime;
                self.after_loss = true;
            }
        }
        let held_back = self.gate.pass(&bytes);
        if held_back > 0 {
            bytes.drain(..held_back);
            if self.after_loss {
                lost += held_back as u64;
                report.lost_bytes += held_back as u64;
            } else {
                report.discarded_bytes += held_back as u64;
            }
        }
        if bytes.is_empty() && lost == 0 {
            return;
        }
        while let Some(most_us) = self.max_step_us
            && let Some(at) = self.watch.gap(&bytes, most_us)
        {
            let rest = bytes.split_off(at);
            let before = std::mem::replace(&mut bytes, rest);
            if !before.is_empty() || lost > 0 {
                self.hand_over(before, arrived, lost, report, chunks);
                lost = 0;
            }
            // The camera lost an unknown number of words: count at least one.
            lost += WORD as u64;
            report.lost_bytes += WORD as u64;
            report.time_gaps += 1;
            // The step is reported once; continue from its end.
            let step = &bytes[..WORD];
            self.watch.scan(step, arrived, |jump| report.add_jump(jump));
        }
        self.hand_over(bytes, arrived, lost, report, chunks);
    }

    fn hand_over(
        &mut self,
        bytes: Vec<u8>,
        arrived: HostTime,
        lost: u64,
        report: &mut StreamReport,
        chunks: &mut Vec<RawChunk>,
    ) {
        self.watch
            .scan(&bytes, arrived, |jump| report.add_jump(jump));
        self.scanner.lost(lost);
        let (facts, triggers) = self.scanner.push(&bytes);
        if let (Some(first), Some(last)) = (facts.first_us, facts.last_us) {
            if std::mem::replace(&mut self.fresh, false) && first < self.last_us {
                report.restarted = Some((self.last_us, first));
            }
            self.began_us.get_or_insert(first);
            self.last_us = last;
        }
        chunks.push(RawChunk {
            camera: self.camera,
            seq: self.seq,
            host_time: arrived,
            lost_before: lost,
            lost_from_us: None,
            bytes,
            facts,
            triggers,
        });
        self.last_arrival = arrived;
        self.seq += 1;
    }
}

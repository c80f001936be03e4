//! From blocks of arrived bytes to the chunks of a recording, with their facts.

use skinrig_formats::Scanner;
use skinrig_model::{CameraId, RawChunk, StreamFormat};

use crate::inbox::Block;
use crate::report::StreamReport;
use crate::time_base::{Gate, Watch};

/// Turns blocks into chunks; lives as long as the camera, so that chunk numbers and unwrapped time go on through stop
/// and start.
#[derive(Debug)]
pub struct Chunker {
    camera: CameraId,
    seq: u64,
    scanner: Scanner,
    gate: Gate,
    after_loss: bool,
    watch: Watch,
    /// Nothing of this stream has a time yet.
    fresh: bool,
    last_us: u64,
}

impl Chunker {
    /// A chunker of a stream that has not begun.
    #[must_use]
    pub fn new(camera: CameraId) -> Self {
        Self {
            camera,
            seq: 0,
            scanner: Scanner::new(StreamFormat::Evt2),
            gate: Gate::AwaitTime,
            after_loss: false,
            watch: Watch::default(),
            fresh: true,
            last_us: 0,
        }
    }

    /// A stream begins. That of a slave has no time until its master's clock arrives.
    pub fn start(&mut self, slave: bool) {
        self.gate = if slave {
            Gate::AwaitAdvance { standing: None }
        } else {
            Gate::AwaitTime
        };
        self.after_loss = false;
        self.fresh = true;
        self.watch.reset();
    }

    /// True once words carry a time that counts.
    #[must_use]
    pub fn time_runs(&self) -> bool {
        self.gate == Gate::Open
    }

    /// Takes the next block; at most one chunk comes out.
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
        self.watch
            .look(&bytes, arrived, |jump| report.add_jump(jump));
        let (facts, triggers) = self.scanner.push(&bytes);
        if let (Some(first), Some(last)) = (facts.first_us, facts.last_us) {
            if std::mem::replace(&mut self.fresh, false) && first < self.last_us {
                report.restarted = Some((self.last_us, first));
            }
            self.last_us = last;
        }
        chunks.push(RawChunk {
            camera: self.camera,
            seq: self.seq,
            host_time: arrived,
            lost_before: lost,
            bytes,
            facts,
            triggers,
        });
        self.seq += 1;
    }
}

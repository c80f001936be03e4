//! Output of the decoder: a small reused buffer of events, and the counts.

use skinrig_model::{CdEvent, Polarity, TriggerEdge};
use skinrig_simd::InstructionSet;

use super::clock::Step;
use super::sink::{EventSink, Monitoring};
use super::stats::{Geometry, StreamStats};

/// Events in the buffer: 16 KiB, which stays in the first-level cache together with its input.
pub(super) const BLOCK: usize = 1024;

#[derive(Debug, Clone)]
pub(super) struct Output {
    pub geometry: Geometry,
    /// Instructions of the loops that process plain words.
    pub instructions: InstructionSet,
    pub stats: StreamStats,
    /// Time of the last timed word.
    pub last_us: Option<u64>,
    /// Time of the first timed word since [`Self::begin_chunk`].
    pub chunk_first_us: Option<u64>,
    pub buffer: Box<[CdEvent; BLOCK]>,
    pub len: usize,
}

impl Output {
    pub(super) fn new(geometry: Geometry) -> Self {
        const NONE: CdEvent = CdEvent {
            t_us: 0,
            x: 0,
            y: 0,
            polarity: Polarity::Off,
        };
        Self {
            geometry,
            instructions: InstructionSet::best(),
            stats: StreamStats::default(),
            last_us: None,
            chunk_first_us: None,
            buffer: Box::new([NONE; BLOCK]),
            len: 0,
        }
    }

    /// Resets the start of the current chunk.
    pub(crate) fn begin_chunk(&mut self) {
        self.chunk_first_us = None;
    }

    /// Records the time of a timed word.
    #[inline]
    pub(super) fn timed(&mut self, t_us: u64) {
        self.last_us = Some(t_us);
        self.chunk_first_us.get_or_insert(t_us);
    }

    /// Delivers the buffered events.
    pub(super) fn flush(&mut self, sink: &mut impl EventSink) {
        if self.len > 0 {
            sink.on_cd(&self.buffer[..self.len]);
            self.len = 0;
        }
    }

    /// Adds one CD event, checked against the sensor.
    #[inline]
    pub(super) fn cd<const KEEP: bool>(&mut self, event: CdEvent, sink: &mut impl EventSink) {
        self.timed(event.t_us);
        if !self.geometry.contains(event.x, event.y) {
            self.stats.out_of_geometry += 1;
            return;
        }
        match event.polarity {
            Polarity::On => self.stats.cd_on += 1,
            Polarity::Off => self.stats.cd_off += 1,
        }
        if KEEP {
            if self.len == BLOCK {
                self.flush(sink);
            }
            self.buffer[self.len] = event;
            self.len += 1;
        }
    }

    /// Adds one trigger edge.
    pub(super) fn trigger(&mut self, edge: TriggerEdge, sink: &mut impl EventSink) {
        self.timed(edge.t_us);
        self.stats.triggers[usize::from(edge.channel & 31)] += 1;
        self.flush(sink);
        sink.on_trigger(edge);
    }

    /// Adds one complete monitoring message.
    pub(super) fn monitoring(&mut self, monitoring: Monitoring, sink: &mut impl EventSink) {
        self.flush(sink);
        sink.on_monitoring(monitoring);
    }

    /// Adds one time base word, which set the time to `now_us`, if known.
    pub(super) fn time_high(&mut self, step: Step, now_us: Option<u64>, sink: &mut impl EventSink) {
        self.stats.time_high += 1;
        if let Some(now_us) = now_us {
            self.timed(now_us);
        }
        match step {
            Step::Forward => {}
            Step::Wrap => self.stats.wraps += 1,
            Step::Jump(jump) => {
                self.stats.discontinuities += 1;
                self.flush(sink);
                sink.on_discontinuity(jump);
            }
        }
    }
}

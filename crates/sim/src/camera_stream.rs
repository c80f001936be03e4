//! State of a streaming simulated camera: encoding of events and edges, and bytes on their way to the host.

use std::collections::VecDeque;

use skinrig_device::CameraSettings;
use skinrig_formats::{Scanner, evt2};
use skinrig_model::{
    CameraId, CdEvent, HostTime, Polarity, RawChunk, SENSOR_HEIGHT, SENSOR_WIDTH, TriggerEdge,
};

use crate::drifting::DriftingClock;
use crate::faults::{STORM_PER_MS, STORM_PIXELS};
use crate::line::LineEdge;
use crate::line::TRIGGER_CHANNEL;
use crate::scene::{GRID_NS, PixelEvent, PixelModel, TipSample};

/// State that exists only while streaming.
pub(crate) struct StreamState {
    pub pixels: Option<Box<dyn PixelModel>>,
    /// Whether the events come from pixels, to which a region of interest applies.
    pub has_region: bool,
    pub encoder: evt2::Encoder,
    /// Trigger edges to encode, with the camera's time of each.
    pub edges: VecDeque<LineEdge>,
    pub settings: CameraSettings,
    pub events: Vec<PixelEvent>,
    pub fresh: Vec<u8>,
}

/// Bytes on their way to the host.
#[derive(Default)]
pub(crate) struct OutputQueue {
    pub seq: u64,
    pub bytes: Vec<u8>,
    /// Length of the previous chunk.
    pub last_len: usize,
    /// Arrival of the last of `bytes`.
    pub arrived: HostTime,
    /// Bytes lost since the last chunk.
    pub lost_before: u64,
    /// Bytes still to be lost.
    pub to_lose: u64,
    pub ready: VecDeque<RawChunk>,
}

impl StreamState {
    /// Simulates one grid step, with or without an event storm, and encodes its events and edges into `fresh`.
    pub(crate) fn step(
        &mut self,
        from: TipSample,
        to: TipSample,
        clock: DriftingClock,
        storm: bool,
    ) {
        self.events.clear();
        if let Some(pixels) = &mut self.pixels {
            pixels.advance(&[from, to], &mut self.events);
        }
        if storm {
            add_storm(from.t_ns, &mut self.events);
        }
        let set = &self.settings;
        let triggered = set.trigger_channels.contains(&TRIGGER_CHANNEL);
        for event in &self.events {
            while let Some(edge) = self.edges.front().copied()
                && edge.t_ns <= event.t_ns
            {
                self.edges.pop_front();
                encode_edge(&mut self.encoder, edge, triggered, clock, &mut self.fresh);
            }
            if set.roi.filter(|_| self.has_region).is_some_and(|r| {
                !(r.x..r.x + r.width).contains(&event.x)
                    || !(r.y..r.y + r.height).contains(&event.y)
            }) {
                continue;
            }
            let cd = CdEvent {
                t_us: clock.own_us(event.t_ns),
                x: event.x,
                y: event.y,
                polarity: event.polarity,
            };
            let written = self.encoder.cd(cd, &mut self.fresh);
            assert!(written.is_ok(), "pixel events out of order: {written:?}");
        }
        while let Some(edge) = self.edges.front().copied()
            && edge.t_ns < to.t_ns
        {
            self.edges.pop_front();
            encode_edge(&mut self.encoder, edge, triggered, clock, &mut self.fresh);
        }
        let reached = self
            .encoder
            .advance_to(clock.own_us(to.t_ns), &mut self.fresh);
        assert!(reached.is_ok(), "time ran backwards: {reached:?}");
    }
}

/// Adds one millisecond of an event storm from `from_ns` on.
fn add_storm(from_ns: i64, events: &mut Vec<PixelEvent>) {
    for pixel in 0..STORM_PIXELS {
        for n in 0..STORM_PER_MS {
            // Spread over the sensor and the millisecond with steps that are coprime to their ranges.
            events.push(PixelEvent {
                t_ns: from_ns + (n * GRID_NS / STORM_PER_MS + i64::from(pixel) * 997) % GRID_NS,
                x: pixel * 211 % SENSOR_WIDTH,
                y: pixel * 97 % SENSOR_HEIGHT,
                polarity: if n % 2 == 0 {
                    Polarity::On
                } else {
                    Polarity::Off
                },
            });
        }
    }
    events.sort_by_key(|event| event.t_ns);
}

fn encode_edge(
    encoder: &mut evt2::Encoder,
    edge: LineEdge,
    triggered: bool,
    clock: DriftingClock,
    out: &mut Vec<u8>,
) {
    if triggered {
        let edge = TriggerEdge {
            t_us: clock.own_us(edge.t_ns),
            channel: TRIGGER_CHANNEL,
            rising: edge.rising,
        };
        let written = encoder.trigger(edge, out);
        assert!(written.is_ok(), "trigger edges out of order: {written:?}");
    }
}

impl OutputQueue {
    /// Adds new bytes that arrived at `at`.
    pub(crate) fn take(
        &mut self,
        fresh: &mut Vec<u8>,
        at: HostTime,
        camera: CameraId,
        scanner: &mut Scanner,
        chunk_bytes: usize,
    ) {
        let dropped = usize::try_from(self.to_lose).map_or(fresh.len(), |n| n.min(fresh.len()));
        self.to_lose -= dropped as u64;
        self.lost_before += dropped as u64;
        let mut rest = &fresh[dropped..];
        self.arrived = at;
        while self.bytes.len() + rest.len() >= chunk_bytes {
            let (head, tail) = rest.split_at(chunk_bytes - self.bytes.len());
            self.bytes.extend_from_slice(head);
            rest = tail;
            self.close(camera, scanner);
        }
        if self.bytes.capacity() == 0 {
            // Reserve the size of the previous chunk: growing step by step costs more than copying the bytes.
            let like_last =
                (self.last_len + self.last_len / 8).clamp(1 << 12, chunk_bytes.max(1 << 12));
            self.bytes.reserve_exact(like_last);
        }
        self.bytes.extend_from_slice(rest);
        fresh.clear();
    }

    /// Closes the current chunk if it has content.
    pub(crate) fn close(&mut self, camera: CameraId, scanner: &mut Scanner) {
        if self.bytes.is_empty() && self.lost_before == 0 {
            return;
        }
        let bytes = std::mem::take(&mut self.bytes);
        self.last_len = bytes.len();
        scanner.lost(self.lost_before);
        let (facts, triggers) = scanner.push(&bytes);
        self.ready.push_back(RawChunk {
            camera,
            seq: self.seq,
            host_time: self.arrived,
            lost_before: std::mem::take(&mut self.lost_before),
            lost_from_us: None,
            bytes,
            facts,
            triggers,
        });
        self.seq += 1;
    }
}

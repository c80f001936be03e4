//! Generates the stream of one camera packet by packet while its time base runs.

use std::ops::Range;
use std::sync::Arc;
use std::time::Duration;

use skinrig_formats::evt2::{Encoder, TIME_HIGH_CADENCE_US};
use skinrig_model::{CdEvent, Polarity, SENSOR_HEIGHT, SENSOR_WIDTH, TriggerEdge};

use super::camera::{Evk1, Run};
use super::pattern::Scan;
use super::sensor::Gates;
use crate::config::Pacing;
use crate::content::Source;
use crate::random::Splitmix;
use crate::world::{Edge, now_ns};
use skinrig_sim::scene::PixelEvent;

/// Interval at which waits check whether the run has ended.
const MAX_WAIT: Duration = Duration::from_millis(5);

/// Delay of this program above which it is catching up, ns.
const LATE_NS: i64 = 2_000_000;
/// Delay above which it no longer waits for the host, ns.
const TOO_LATE_NS: i64 = 250_000_000;

/// Event interval of a hot pixel, ns.
const HOT_EVERY_NS: i64 = 1_000_000;

/// Input to which the trigger output loops back.
const LOOP_BACK: u8 = 6;

/// Streams until the camera is unplugged.
pub(crate) fn produce(camera: &Arc<Evk1>, mut source: Source) {
    let mut last = 0;
    while let Some(run) = camera.next_run(last) {
        last = run.number;
        Producer::new(camera, run, &mut source).stream();
    }
}

/// A run of the time base.
struct Producer<'a> {
    camera: &'a Evk1,
    source: &'a mut Source,
    run: Run,
    /// True time up to which the stream has been generated, ns.
    made_ns: i64,
    encoder: Encoder,
    /// Camera time up to which the stream has been generated, µs.
    reached_us: u64,
    /// True time at which the trigger output started, ns.
    pulses_from_ns: Option<i64>,
    /// Edges that jitter moved into the next packet.
    edges: Vec<Edge>,
    random: Splitmix,
    /// State of the pattern generator.
    scan: Scan,
    events: Vec<PixelEvent>,
}

impl<'a> Producer<'a> {
    fn new(camera: &'a Evk1, mut run: Run, source: &'a mut Source) -> Self {
        let from_ns = run.from_ns;
        let first_us = run.time.at(from_ns, &camera.sync_line);
        // Discard edges from before the start.
        camera.world.take_edges(&camera.config.serial, from_ns);
        source.start(&camera.world, from_ns);
        Self {
            camera,
            source,
            random: Splitmix(run.number),
            run,
            made_ns: from_ns,
            encoder: Encoder::new(first_us),
            reached_us: first_us,
            pulses_from_ns: None,
            edges: Vec::new(),
            scan: Scan::default(),
            events: Vec::new(),
        }
    }

    fn stream(&mut self) {
        let Evk1 {
            config,
            world,
            queues,
            ..
        } = self.camera;
        while let Some(before) = self.camera.gates(self.run.number) {
            let until_ns = self.made_ns + i64::from(before.packet_us) * 1_000;
            let due = match config.pacing {
                Pacing::RealTime => world.wait_until(until_ns, MAX_WAIT) && self.has_room(until_ns),
                Pacing::HostTime => queues.wait_for_room(config.fifo_bytes, MAX_WAIT),
            };
            // Register writes in the meantime affect this packet.
            if due && let Some(gates) = self.camera.gates(self.run.number) {
                self.packet(until_ns, &gates);
            }
        }
    }

    /// False while the host has to make room for packets that this program sends late: it catches up in a burst, which no camera makes.
    fn has_room(&self, until_ns: i64) -> bool {
        let Evk1 { config, queues, .. } = self.camera;
        let late_ns = now_ns() - until_ns;
        !(LATE_NS..TOO_LATE_NS).contains(&late_ns)
            || queues.wait_for_room(config.fifo_bytes / 2, MAX_WAIT)
    }

    /// Generates everything up to `until_ns` as one packet.
    fn packet(&mut self, until_ns: i64, gates: &Gates) {
        let line = &self.camera.sync_line;
        let end_us = self.run.time.at(until_ns, line);
        let (edges, late) = self.due_edges(until_ns, gates);
        let garbage = self.camera.garbage();
        let mut bytes: Vec<u8> = garbage.into_iter().flat_map(u32::to_le_bytes).collect();
        let dense = self.source.dense().filter(|_| {
            gates.pixels
                && gates.pattern.is_none()
                && gates.filter.is_none()
                && gates.roi.is_full()
                && !gates.no_off
        });
        let stands_still = end_us == self.reached_us;
        if let Some(dense) = dense
            && !stands_still
        {
            let mut edges = edges.iter().peekable();
            let mut slot_us = self.reached_us.next_multiple_of(TIME_HIGH_CADENCE_US);
            while slot_us < end_us {
                // Always in order, because slots are consecutive.
                let _ = self.encoder.advance_to(slot_us, &mut bytes);
                dense.slot(slot_us, &mut bytes);
                slot_us += TIME_HIGH_CADENCE_US;
                while let Some(edge) = edges.next_if(|e| e.t_us < slot_us) {
                    push_edge(&mut self.encoder, *edge, &mut bytes);
                }
            }
            for edge in edges {
                push_edge(&mut self.encoder, *edge, &mut bytes);
            }
        } else {
            self.pixel_events(until_ns, gates);
            if let Some(pattern) = &gates.pattern {
                self.events.clear();
                let span_us = end_us - self.reached_us;
                self.scan
                    .events(pattern, span_us, self.made_ns, until_ns, &mut self.events);
            }
            self.encode(until_ns, end_us, &edges, &mut bytes);
        }
        let triggers = edges.len() as u64;
        self.made_ns = until_ns;
        self.reached_us = end_us;
        let number = self.run.number;
        let short = gates.short_packets;
        self.camera.send(number, bytes, short, end_us, |counters| {
            counters.trigger_words += triggers;
            counters.late_edges += late;
        });
    }

    /// Events of the packet after the filters.
    fn pixel_events(&mut self, until_ns: i64, gates: &Gates) {
        self.events.clear();
        self.source
            .events(&self.camera.world, self.made_ns, until_ns, &mut self.events);
        hot_pixels(
            self.camera.hot_pixels(),
            self.made_ns..until_ns,
            &mut self.events,
        );
        if !gates.pixels {
            self.events.clear();
        }
        self.events
            .retain(|e| gates.roi.has(e.x, e.y) && !(gates.no_off && e.polarity == Polarity::Off));
        if let Some((events, period_us)) = gates.filter {
            let spans = u64::from(gates.packet_us) / u64::from(period_us);
            if (self.events.len() as u64) < u64::from(events) * spans.max(1) {
                self.events.clear();
            }
        }
    }

    /// Writes events and edges in order of time, and the time base up to the end of the packet.
    fn encode(&mut self, until_ns: i64, end_us: u64, edges: &[TriggerEdge], bytes: &mut Vec<u8>) {
        let line = &self.camera.sync_line;
        if end_us == self.reached_us {
            // A slave without a running master: words flow with a constant time (EVK1 reference, section 5).
            let words = (until_ns - self.made_ns) / (TIME_HIGH_CADENCE_US as i64 * 1_000);
            let high = 0x8000_0000 | (end_us >> 6) as u32 & 0x0fff_ffff;
            bytes.extend((0..words).flat_map(|_| high.to_le_bytes()));
        }
        let mut edges = edges.iter().peekable();
        for event in &self.events {
            let t_us = self.run.time.at(event.t_ns, line);
            while let Some(edge) = edges.next_if(|e| e.t_us <= t_us) {
                push_edge(&mut self.encoder, *edge, bytes);
            }
            let event = CdEvent {
                t_us,
                x: event.x,
                y: event.y,
                polarity: event.polarity,
            };
            let written = self.encoder.cd(event, bytes);
            assert!(written.is_ok(), "pixel events out of order: {written:?}");
        }
        for edge in edges {
            push_edge(&mut self.encoder, *edge, bytes);
        }
        // The last microsecond belongs to the next packet, which may contain events in it.
        let reached = self
            .encoder
            .advance_to(end_us.max(self.encoder.reached_us()), bytes);
        assert!(reached.is_ok(), "time ran backwards: {reached:?}");
    }

    /// Edges due before `until_ns`, and the number of late ones.
    fn due_edges(&mut self, until_ns: i64, gates: &Gates) -> (Vec<TriggerEdge>, u64) {
        let Evk1 {
            config,
            world,
            sync_line,
            ..
        } = self.camera;
        let delay_ns = i64::from(config.trigger_delay_ns);
        for mut edge in world.take_edges(&config.serial, until_ns - delay_ns) {
            // A late report from a slow source: the edge is from before the start.
            if edge.at_ns < self.run.from_ns {
                continue;
            }
            let jitter = self.random.below(u64::from(config.trigger_jitter_ns) + 1);
            edge.at_ns += delay_ns + jitter as i64;
            self.edges.push(edge);
        }
        self.loop_back(until_ns, gates);
        self.edges.sort_by_key(|e| e.at_ns);
        let due = self.edges.partition_point(|e| e.at_ns < until_ns);
        let mut late = 0;
        let mut observed = Vec::new();
        for edge in self.edges.drain(..due) {
            if edge.at_ns < self.made_ns {
                late += 1;
            }
            if gates.triggers >> edge.channel & 1 == 1 {
                let t_us = self.run.time.at(edge.at_ns.max(self.made_ns), sync_line);
                observed.push(TriggerEdge {
                    t_us,
                    channel: edge.channel,
                    rising: edge.rising,
                });
            }
        }
        (observed, late)
    }

    /// Edges of the camera's own trigger output, which return on input 6.
    fn loop_back(&mut self, until_ns: i64, gates: &Gates) {
        let Some((period_us, width_us)) = gates.pulses else {
            self.pulses_from_ns = None;
            return;
        };
        let from_ns = *self.pulses_from_ns.get_or_insert(self.made_ns);
        let (period_ns, width_ns) = (i64::from(period_us) * 1_000, i64::from(width_us) * 1_000);
        let mut rise_ns = from_ns + (self.made_ns - from_ns) / period_ns * period_ns;
        while rise_ns < until_ns {
            for (rising, at_ns) in [(true, rise_ns), (false, rise_ns + width_ns)] {
                if (self.made_ns..until_ns).contains(&at_ns) {
                    self.edges.push(Edge {
                        channel: LOOP_BACK,
                        rising,
                        at_ns,
                    });
                }
            }
            rise_ns += period_ns;
        }
    }
}

/// Adds the events of `pixels` that fire once a millisecond.
fn hot_pixels(pixels: u16, span_ns: Range<i64>, events: &mut Vec<PixelEvent>) {
    if pixels == 0 {
        return;
    }
    let mut t_ns = (span_ns.start + HOT_EVERY_NS - 1) / HOT_EVERY_NS * HOT_EVERY_NS;
    while t_ns < span_ns.end {
        // Spread over the sensor with steps that are coprime to its sides.
        events.extend((0..pixels).map(|n| PixelEvent {
            t_ns,
            x: (u32::from(n) * 211 % u32::from(SENSOR_WIDTH)) as u16,
            y: (u32::from(n) * 97 % u32::from(SENSOR_HEIGHT)) as u16,
            polarity: Polarity::On,
        }));
        t_ns += HOT_EVERY_NS;
    }
    events.sort_by_key(|e| e.t_ns);
}

fn push_edge(encoder: &mut Encoder, edge: TriggerEdge, bytes: &mut Vec<u8>) {
    // An edge behind the encoder's position in a dense slot keeps its place in the stream.
    let t_us = edge.t_us.max(encoder.reached_us());
    let written = encoder.trigger(TriggerEdge { t_us, ..edge }, bytes);
    assert!(
        written.is_ok(),
        "a trigger channel that does not exist: {written:?}"
    );
}

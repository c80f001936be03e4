//! The way of an event from its pixel to the output: dark pixels respond later, and rows are read one after the other.

use crate::scene::PixelEvent;

use super::config::OpticalConfig;
use super::noise::Noise;
use super::parts::{DarkLatency, Readout};

const NS_PER_US: i64 = 1_000;

/// Events on their way.
#[derive(Debug, Clone)]
pub(super) struct Output {
    latency: Option<DarkLatency>,
    arbiter: Option<Arbiter>,
    /// Events whose pixel has not responded yet.
    waiting: Vec<PixelEvent>,
    /// Events that were read, of a later step.
    late: Vec<PixelEvent>,
}

/// Rows and events read in the last microsecond with events.
#[derive(Debug, Clone)]
struct Arbiter {
    limits: Readout,
    now_us: i64,
    rows: Vec<u16>,
    events: u32,
}

impl Output {
    pub(super) fn new(config: &OpticalConfig) -> Self {
        let arbiter = |limits| Arbiter {
            limits,
            now_us: i64::MIN,
            rows: Vec::new(),
            events: 0,
        };
        Self {
            latency: config.parts.dark_latency,
            arbiter: config.parts.readout.map(arbiter),
            waiting: Vec::new(),
            late: Vec::new(),
        }
    }

    /// Replaces the events of a step, `out[begin..]`, by those that leave the sensor before its end, sorted by time.
    pub(super) fn pass(
        &mut self,
        noise: &Noise,
        until_ns: i64,
        begin: usize,
        out: &mut Vec<PixelEvent>,
    ) {
        let sort = |events: &mut [PixelEvent]| {
            events.sort_unstable_by_key(|e| (e.t_ns, e.y, e.x, e.polarity.bit()));
        };
        if let Some(latency) = self.latency {
            for mut event in out.drain(begin..) {
                let q = noise.brightness(event.x, event.y);
                let us = (latency.bright_us / q).min(latency.most_us) as i64;
                event.t_ns += us * NS_PER_US;
                self.waiting.push(event);
            }
            out.extend(self.waiting.extract_if(.., |e| e.t_ns < until_ns));
        }
        sort(&mut out[begin..]);
        let Some(arbiter) = &mut self.arbiter else {
            return;
        };
        let mut read = std::mem::take(&mut self.late);
        for mut event in out.drain(begin..) {
            event.t_ns = arbiter.read(event) * NS_PER_US;
            read.push(event);
        }
        // Times never decrease, so that what is late is at the end.
        let in_time = read.partition_point(|e| e.t_ns < until_ns);
        self.late = read.split_off(in_time);
        out.append(&mut read);
    }
}

impl Arbiter {
    /// The microsecond in which `event` is read; calls are in order of time.
    fn read(&mut self, event: PixelEvent) -> i64 {
        let asked_us = event.t_ns.div_euclid(NS_PER_US);
        if asked_us > self.now_us {
            self.next(asked_us);
        }
        let is_open = self.rows.contains(&event.y);
        let room = is_open || self.rows.len() < self.limits.rows_per_us as usize;
        if !room || self.events >= self.limits.events_per_us {
            self.next(self.now_us + 1);
        }
        if !self.rows.contains(&event.y) {
            self.rows.push(event.y);
        }
        self.events += 1;
        self.now_us
    }

    fn next(&mut self, us: i64) {
        self.now_us = us;
        self.rows.clear();
        self.events = 0;
    }
}

#[cfg(test)]
mod tests {
    use skinrig_model::Polarity;

    use super::*;

    #[test]
    fn rows_and_events_of_a_microsecond_are_limited_and_the_rest_waits() {
        let mut arbiter = Arbiter {
            limits: Readout {
                rows_per_us: 2,
                events_per_us: 3,
            },
            now_us: i64::MIN,
            rows: Vec::new(),
            events: 0,
        };
        let mut read = |us: i64, y: u16| {
            arbiter.read(PixelEvent {
                t_ns: us * NS_PER_US,
                x: 1,
                y,
                polarity: Polarity::On,
            })
        };
        // Two rows in the first microsecond, the third waits.
        assert_eq!([read(5, 1), read(5, 2), read(5, 3)], [5, 5, 6]);
        // Three events in the second one.
        assert_eq!([read(5, 3), read(5, 3), read(5, 3)], [6, 6, 7]);
        assert_eq!(read(6, 4), 7);
        assert_eq!(read(20, 4), 20);
    }
}

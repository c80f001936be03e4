//! Events of a press in one camera: on bins of columns and milliseconds, without those of hot pixels.

use std::collections::HashMap;

use skinrig_model::SENSOR_WIDTH;

/// Columns of a bin.
pub(super) const BIN_PX: usize = 4;
pub(super) const BINS: usize = SENSOR_WIDTH as usize / BIN_PX;
/// A pixel with this many events in the idle time before a press is hot.
const HOT: u32 = 3;
/// Idle bins are averaged over this many neighbours on either side.
const SMOOTH: usize = 3;
/// Least background of a bin, events/ms.
const LEAST_IDLE: f64 = 1e-5;

/// An event of a press.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TouchEvent {
    /// Time after the measured contact, ms.
    pub t_ms: f64,
    /// Column.
    pub x: u16,
    /// Row.
    pub y: u16,
}

/// Measured times of a press, ms after its contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TouchTimes {
    /// Start of the idle time before the press.
    pub idle_from_ms: f64,
    /// Start of the press window.
    pub from_ms: f64,
    /// Start of the rise.
    pub turn_ms: f64,
    /// End of the press window.
    pub to_ms: f64,
}

/// Events of a press in one camera.
#[derive(Debug, Clone, PartialEq)]
pub struct TouchSight {
    pub(super) times: TouchTimes,
    /// By time.
    pub(super) events: Vec<TouchEvent>,
    /// Events per ms in each bin of columns before the press.
    pub(super) idle: Vec<f64>,
}

impl TouchSight {
    /// From events in time order.
    #[must_use]
    pub fn new(times: TouchTimes, events: &[TouchEvent]) -> Self {
        let at = |ms: f64| events.partition_point(|e| e.t_ms < ms);
        let idle = &events[at(times.idle_from_ms)..at(times.from_ms)];
        let mut pixels: HashMap<(u16, u16), u32> = HashMap::new();
        for e in idle {
            *pixels.entry((e.x, e.y)).or_default() += 1;
        }
        let cool = |e: &&TouchEvent| pixels.get(&(e.x, e.y)).is_none_or(|n| *n < HOT);
        let mut counts = vec![0.0; BINS];
        for e in idle.iter().filter(cool) {
            counts[bin(e.x)] += 1.0;
        }
        let ms = (times.from_ms - times.idle_from_ms).max(1.0);
        let smooth = |k: usize| {
            let near = &counts[k.saturating_sub(SMOOTH)..(k + SMOOTH + 1).min(BINS)];
            (near.iter().sum::<f64>() / near.len() as f64 / ms).max(LEAST_IDLE)
        };
        Self {
            times,
            events: events[at(times.from_ms)..at(times.to_ms)]
                .iter()
                .filter(cool)
                .copied()
                .collect(),
            idle: (0..BINS).map(smooth).collect(),
        }
    }

    /// Length of the press window, ms.
    pub(super) fn length_ms(&self) -> f64 {
        self.times.to_ms - self.times.from_ms
    }

    /// Events of each bin above the background, at least 0.
    pub(super) fn net_columns(&self) -> Vec<f64> {
        let mut counts = vec![0.0; BINS];
        for e in &self.events {
            counts[bin(e.x)] += 1.0;
        }
        let ms = self.length_ms();
        for (n, idle) in counts.iter_mut().zip(&self.idle) {
            *n = (*n - idle * ms).max(0.0);
        }
        counts
    }
}

pub(super) fn bin(x: u16) -> usize {
    (usize::from(x) / BIN_PX).min(BINS - 1)
}

/// Column in the middle of a bin, px.
pub(super) fn column(bin: usize) -> f64 {
    (BIN_PX * bin) as f64 + (BIN_PX as f64 - 1.0) / 2.0
}

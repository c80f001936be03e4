//! The pixels of one camera: references, thresholds, refractory time.
//!
//! A pixel stores the light at its last event and emits the next one when the light has changed by its threshold (in
//! log intensity). Light is `1 + x c` (see the `dent` module), monotone in the dent's depth: therefore each
//! pixel stores the two values of `x` at which it emits next, each column the two depths, and no other pixel
//! is evaluated while the dent moves.

use std::ops::Range;

use skinrig_model::{Polarity, SENSOR_HEIGHT, SENSOR_WIDTH};

use crate::random::Stream;
use crate::scene::{GRID_NS, PixelEvent, SceneConfig};

use super::config::OpticalConfig;
use super::dent::Dent;

const NS_PER_US: i64 = 1_000;
const STEP_US: i64 = GRID_NS / NS_PER_US;
/// Lower limit on a pixel's threshold after mismatch, log intensity.
const LEAST_THRESHOLD: f64 = 0.01;
/// Contrasts below this are treated as zero.
const NO_CONTRAST: f64 = 1e-9;

/// Light during one grid step: the depth changes linearly from `from_mm` to `to_mm`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ramp {
    pub(super) t_ns: i64,
    pub(super) from_mm: f64,
    pub(super) to_mm: f64,
}

/// The light of a pixel during a step: `x` changes linearly from `from` to `to`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Change {
    pub(super) t_ns: i64,
    pub(super) from: f64,
    pub(super) to: f64,
}

impl Change {
    fn at_us(&self, us: i64) -> f64 {
        self.from + (self.to - self.from) * (us as f64 / STEP_US as f64)
    }
}

/// One pixel with the skin in its view.
#[derive(Debug, Clone, Copy)]
struct Pixel {
    /// Light at the last event, undisturbed = 1.
    reference: f64,
    /// Factors on the reference for an ON event, above 1, and an OFF event, below 1.
    on: f64,
    off: f64,
    /// It emits if `x` falls below `low` or rises above `high`. Infinite while it is held.
    low: f64,
    high: f64,
    /// In its refractory time; the reference is set when that ends.
    held: bool,
}

impl Pixel {
    fn hold(&mut self) {
        self.held = true;
        (self.low, self.high) = (f64::NEG_INFINITY, f64::INFINITY);
    }

    /// Computes the next `x` at which the pixel emits, for contrast `c`.
    fn set_next(&mut self, c: f64) {
        let (up, down) = (self.reference * self.on, self.reference * self.off);
        if c.abs() < NO_CONTRAST {
            // The light is 1 for every x: emit immediately or never.
            self.high = if up < 1.0 { -1.0 } else { f64::INFINITY };
            self.low = if down > 1.0 { 2.0 } else { f64::NEG_INFINITY };
        } else if c > 0.0 {
            (self.low, self.high) = ((down - 1.0) / c, (up - 1.0) / c);
        } else {
            (self.low, self.high) = ((up - 1.0) / c, (down - 1.0) / c);
        }
    }
}

/// All pixels of a camera.
#[derive(Debug, Clone)]
pub(super) struct Pixels {
    first_row: usize,
    rows: usize,
    /// Pixels with the skin in their view, column by column.
    skin: Vec<Pixel>,
    /// Time of the last event of every pixel of the sensor, row by row.
    last_ns: Vec<i64>,
    /// (column, row) of the held pixels.
    held: Vec<(u16, u16)>,
    /// Depths beyond which some pixel of the column emits.
    low_mm: Vec<f64>,
    high_mm: Vec<f64>,
    refractory_ns: i64,
    /// The dent is new: its pixels must be evaluated even if it does not move.
    fresh: bool,
}

impl Pixels {
    pub(super) fn new(scene: &SceneConfig, config: &OpticalConfig, random: &mut Stream) -> Self {
        let first_row = usize::from(scene.skin_rows.0);
        let end_row = (usize::from(scene.skin_rows.1) + 1).min(usize::from(SENSOR_HEIGHT));
        let rows = end_row.saturating_sub(first_row);
        let width = usize::from(SENSOR_WIDTH);
        let skin = (0..width * rows)
            .map(|_| {
                let mut threshold = |mean: f64| {
                    (mean + config.threshold_sigma * random.gauss()).max(LEAST_THRESHOLD)
                };
                let (on, off) = (
                    threshold(config.threshold_on),
                    threshold(config.threshold_off),
                );
                // The last event before the session left each pixel's reference anywhere between its
                // thresholds.
                let reference = libm::exp(0.5 * (random.unit() * (on + off) - on));
                Pixel {
                    reference,
                    on: libm::exp(on),
                    off: libm::exp(-off),
                    low: f64::NEG_INFINITY,
                    high: f64::INFINITY,
                    held: false,
                }
            })
            .collect();
        Self {
            first_row,
            rows,
            skin,
            last_ns: vec![i64::MIN; width * usize::from(SENSOR_HEIGHT)],
            held: Vec::new(),
            low_mm: vec![f64::NEG_INFINITY; width],
            high_mm: vec![f64::INFINITY; width],
            refractory_ns: i64::from(config.refractory_us) * NS_PER_US,
            fresh: false,
        }
    }

    /// A new dent: every pixel in its reach gets its next thresholds.
    pub(super) fn start_dent(&mut self, dent: &Dent) {
        self.fresh = true;
        for u in dent.columns.clone() {
            for v in dent.rows.clone() {
                let i = self.index(u, v);
                if !self.skin[i].held {
                    self.skin[i].set_next(dent.contrast(u, v));
                }
            }
            self.set_next_in_column(dent, u);
        }
    }

    /// Simulates one grid step with the given dent.
    pub(super) fn step(&mut self, dent: &Dent, ramp: Ramp, out: &mut Vec<PixelEvent>) {
        self.release_in_dent(dent, ramp, out);
        if ramp.from_mm == ramp.to_mm && !self.fresh {
            return;
        }
        self.fresh = false;
        for u in dent.columns.clone() {
            if ramp.to_mm > self.high_mm[u] || ramp.to_mm < self.low_mm[u] {
                let loss = loss_of(dent, ramp, u);
                for v in dent.rows.clone() {
                    let pixel = &self.skin[self.index(u, v)];
                    if loss.to > pixel.high || loss.to < pixel.low {
                        self.emit((u, v), dent.contrast(u, v), loss, 0, out);
                    }
                }
                self.set_next_in_column(dent, u);
            }
        }
    }

    /// Adds an event not caused by light. Returns false when the pixel is in its refractory time.
    pub(super) fn inject(&mut self, event: PixelEvent, out: &mut Vec<PixelEvent>) -> bool {
        let (u, v) = (usize::from(event.x), usize::from(event.y));
        let last = &mut self.last_ns[v * usize::from(SENSOR_WIDTH) + u];
        if event.t_ns < last.saturating_add(self.refractory_ns) {
            return false;
        }
        *last = event.t_ns;
        out.push(event);
        if (self.first_row..self.first_row + self.rows).contains(&v) {
            let i = self.index(u, v);
            if !self.skin[i].held {
                self.skin[i].hold();
                self.held.push((event.x, event.y));
            }
        }
        true
    }

    fn index(&self, u: usize, v: usize) -> usize {
        u * self.rows + v - self.first_row
    }

    /// Every pixel gets its next thresholds on the light itself: `x` is its change, the contrast 1.
    pub(super) fn start_by_light(&mut self) {
        for pixel in &mut self.skin {
            pixel.set_next(1.0);
        }
    }

    /// Rows with pixels of the skin.
    pub(super) const fn skin_rows(&self) -> Range<usize> {
        self.first_row..self.first_row + self.rows
    }

    /// Columns of the pixels in their refractory times.
    pub(super) fn held_columns(&self) -> impl Iterator<Item = usize> {
        self.held.iter().map(|(x, _)| usize::from(*x))
    }

    /// How far `x` of a pixel is from the next event; negative beyond it.
    pub(super) fn slack(&self, u: usize, v: usize, x: f64) -> f64 {
        let pixel = &self.skin[self.index(u, v)];
        (pixel.high - x).min(x - pixel.low)
    }

    fn release_in_dent(&mut self, dent: &Dent, ramp: Ramp, out: &mut Vec<PixelEvent>) {
        let see = |u, v| (loss_of(dent, ramp, u), dent.contrast(u, v));
        self.release(ramp.t_ns, see, |u, x| dent.depth_of_loss(u, x), out);
    }

    /// Pixels whose refractory time ends in the step from `t_ns` take the light at that time as their reference. `see` returns the
    /// change and contrast of a pixel, `bound` the bound of a column for an `x`.
    pub(super) fn release(
        &mut self,
        t_ns: i64,
        see: impl Fn(usize, usize) -> (Change, f64),
        bound: impl Fn(usize, f64) -> f64,
        out: &mut Vec<PixelEvent>,
    ) {
        let mut k = 0;
        while k < self.held.len() {
            let (x, y) = self.held[k];
            let (u, v) = (usize::from(x), usize::from(y));
            let end_ns =
                self.last_ns[v * usize::from(SENSOR_WIDTH) + u].saturating_add(self.refractory_ns);
            if end_ns >= t_ns + GRID_NS {
                k += 1;
                continue;
            }
            self.held.swap_remove(k);
            let (change, c) = see(u, v);
            let us = ((end_ns - t_ns) / NS_PER_US).max(0);
            let i = self.index(u, v);
            self.skin[i].held = false;
            self.skin[i].reference = 1.0 + change.at_us(us) * c;
            self.skin[i].set_next(c);
            // Emitting may hold the pixel again, at the list's end, until a later step.
            self.emit((u, v), c, change, us, out);
            let (low, high) = (self.skin[i].low, self.skin[i].high);
            self.low_mm[u] = self.low_mm[u].max(bound(u, low));
            self.high_mm[u] = self.high_mm[u].min(bound(u, high));
        }
    }

    /// Emits all events of one pixel of contrast `c` from `from_us` to the end of the step.
    pub(super) fn emit(
        &mut self,
        (u, v): (usize, usize),
        c: f64,
        change: Change,
        mut from_us: i64,
        out: &mut Vec<PixelEvent>,
    ) {
        let i = self.index(u, v);
        loop {
            let pixel = &mut self.skin[i];
            let (bound, rising) = if change.to > pixel.high {
                (pixel.high, true)
            } else if change.to < pixel.low {
                (pixel.low, false)
            } else {
                return;
            };
            let part = (bound - change.from) / (change.to - change.from);
            let us = if part > 0.0 {
                (part * STEP_US as f64) as i64
            } else {
                0
            };
            let us = us.clamp(from_us, STEP_US - 1);
            let t_ns = change.t_ns + us * NS_PER_US;
            out.push(PixelEvent {
                t_ns,
                x: u as u16,
                y: v as u16,
                polarity: Polarity::from_bit(rising == (c >= 0.0)),
            });
            self.last_ns[v * usize::from(SENSOR_WIDTH) + u] = t_ns;
            let end_us = us + self.refractory_ns / NS_PER_US;
            if end_us >= STEP_US {
                pixel.hold();
                self.held.push((u as u16, v as u16));
                return;
            }
            from_us = end_us;
            pixel.reference = 1.0 + change.at_us(end_us) * c;
            pixel.set_next(c);
        }
    }

    fn set_next_in_column(&mut self, dent: &Dent, u: usize) {
        let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
        if !dent.rows.is_empty() {
            for pixel in &self.skin[self.index(u, dent.rows.start)..self.index(u, dent.rows.end)] {
                low = low.max(pixel.low);
                high = high.min(pixel.high);
            }
        }
        self.low_mm[u] = dent.depth_of_loss(u, low);
        self.high_mm[u] = dent.depth_of_loss(u, high);
    }
}

fn loss_of(dent: &Dent, ramp: Ramp, u: usize) -> Change {
    Change {
        t_ns: ramp.t_ns,
        from: dent.lost(u, ramp.from_mm),
        to: dent.lost(u, ramp.to_mm),
    }
}

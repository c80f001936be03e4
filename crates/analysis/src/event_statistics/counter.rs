//! Counts the events of one camera and makes its statistics.

use skinrig_model::{CameraId, CdEvent, SENSOR_HEIGHT, SENSOR_WIDTH};

use super::presses::PressCounter;
use super::values::{Bin, EventStatistics, IntervalLaw, Ring};

const WIDTH: usize = SENSOR_WIDTH as usize;
/// Side of the cells in which neighbours are counted, px.
const CELL_PX: usize = 4;
const CELLS: [usize; 2] = [WIDTH / CELL_PX, SENSOR_HEIGHT as usize / CELL_PX];
/// An event supports one in a neighbouring cell for this long, µs.
const SUPPORT_US: u64 = 1_000;
/// Distances in cells for which the correlation is found, and one event in how many it is found for: each looks at 225 cells.
const RINGS: usize = 8;
const RING_EVERY: u64 = 16;
/// Counts of this time are compared for the dispersion, µs.
const DISPERSION_US: u64 = 10_000;
/// Intervals up to this are counted exactly for the floor, µs.
const EXACT_US: usize = 1 << 16;
/// Share of the intervals that may lie below the refractory floor: neighbouring events of hot pixels, repeated words.
const FLOOR_SHARE: f64 = 0.001;
/// Least number of intervals for a law.
const LEAST_INTERVALS: u64 = 100;
/// Bins of intervals per decade, and of events per pixel per octave.
const PER_DECADE: f64 = 10.0;
const PER_OCTAVE: f64 = 4.0;

/// Sums over the intervals in µs.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    n: u64,
    x: f64,
    inverse: f64,
    log: f64,
}

/// What happened so far.
#[derive(Debug)]
pub(super) struct Counter {
    events: u64,
    on: u64,
    equal: u64,
    supported: u64,
    first_us: u64,
    before_us: u64,
    /// Time of the last event of each pixel plus 1; 0: none.
    last_us: Vec<u64>,
    counts: Vec<u32>,
    cell_last_us: Vec<u64>,
    sums: Sums,
    zero: u64,
    exact: Vec<u64>,
    interval_bins: LogBins,
    rings: Rings,
    dispersion: Dispersion,
    presses: PressCounter,
}

/// Cells per ring that lie on the sensor, and those with an event.
#[derive(Debug, Clone, Copy, Default)]
struct Rings {
    cells: [u64; RINGS],
    active: [u64; RINGS],
}

/// Sums over the counts of steps of [`DISPERSION_US`].
#[derive(Debug, Clone, Copy, Default)]
struct Dispersion {
    step: u64,
    count: u64,
    steps: u64,
    sum: f64,
    squares: f64,
}

impl Dispersion {
    fn add(&mut self, since_us: u64) {
        let step = since_us / DISPERSION_US;
        // Late events count in the step under way.
        while self.step < step {
            self.close();
            // Steps without events add nothing to the sums.
            let empty = (step - self.step).saturating_sub(1);
            self.steps += empty;
            self.step += 1 + empty;
        }
        self.count += 1;
    }

    fn close(&mut self) {
        let count = std::mem::take(&mut self.count) as f64;
        self.steps += 1;
        self.sum += count;
        self.squares += count * count;
    }

    /// Of the complete steps; `None` of fewer than two, or without events.
    fn ratio(&self) -> Option<f64> {
        let n = self.steps as f64;
        let mean = self.sum / n;
        (self.steps > 1 && self.sum > 0.0)
            .then(|| (self.squares - n * mean * mean) / (n - 1.0) / mean)
    }
}

/// Counts on a logarithmic axis from 1 on.
#[derive(Debug)]
struct LogBins {
    /// Lower ends, to 2^64.
    edges: Vec<f64>,
    counts: Vec<u64>,
}

impl LogBins {
    /// So many bins from each power of `base` to the next.
    fn new(base: f64, per_power: f64) -> Self {
        let count = (64.0 * per_power / libm::log2(base)).ceil() as usize + 1;
        let edge = |k: usize| libm::pow(base, k as f64 / per_power);
        Self {
            edges: (0..count).map(edge).collect(),
            counts: vec![0; count],
        }
    }

    /// Adds a value, at least 1.
    fn add(&mut self, value: f64) {
        let above = self.edges.partition_point(|edge| *edge <= value);
        self.counts[above.max(1) - 1] += 1;
    }

    /// Up to the last with a value.
    fn bins(&self) -> Vec<Bin> {
        let end = self.counts.iter().rposition(|n| *n > 0);
        let ends = self.edges.windows(2).zip(&self.counts);
        ends.take(end.map_or(0, |k| k + 1))
            .map(|(ends, n)| Bin {
                from: ends[0],
                to: ends[1],
                n: *n,
            })
            .collect()
    }
}

impl Counter {
    pub(super) fn new(presses: &[(f64, f64)]) -> Self {
        let pixels = WIDTH * usize::from(SENSOR_HEIGHT);
        Self {
            events: 0,
            on: 0,
            equal: 0,
            supported: 0,
            first_us: 0,
            before_us: 0,
            last_us: vec![0; pixels],
            counts: vec![0; pixels],
            cell_last_us: vec![0; CELLS[0] * CELLS[1]],
            sums: Sums::default(),
            zero: 0,
            exact: vec![0; EXACT_US],
            interval_bins: LogBins::new(10.0, PER_DECADE),
            rings: Rings::default(),
            dispersion: Dispersion::default(),
            presses: PressCounter::new(presses),
        }
    }

    pub(super) fn add(&mut self, event: &CdEvent) {
        let (x, y) = (usize::from(event.x), usize::from(event.y));
        if x >= WIDTH || y >= usize::from(SENSOR_HEIGHT) {
            return;
        }
        if self.events == 0 {
            self.first_us = event.t_us;
        } else if event.t_us == self.before_us {
            self.equal += 1;
        }
        self.before_us = event.t_us;
        self.events += 1;
        self.on += u64::from(event.polarity.bit());
        self.supported += u64::from(self.is_supported(event));
        if self.events.is_multiple_of(RING_EVERY) {
            self.look_around(event);
        }
        self.dispersion
            .add(event.t_us.saturating_sub(self.first_us));
        self.presses.add(event);
        self.cell_last_us[y / CELL_PX * CELLS[0] + x / CELL_PX] = event.t_us + 1;
        let pixel = y * WIDTH + x;
        self.counts[pixel] = self.counts[pixel].saturating_add(1);
        let last_us = std::mem::replace(&mut self.last_us[pixel], event.t_us + 1);
        if last_us > 0 {
            self.interval((event.t_us + 1).saturating_sub(last_us));
        }
    }

    fn is_supported(&self, event: &CdEvent) -> bool {
        let around = |v: u16, cells: usize| {
            let cell = usize::from(v) / CELL_PX;
            cell.saturating_sub(1)..(cell + 2).min(cells)
        };
        around(event.y, CELLS[1]).any(|row| {
            around(event.x, CELLS[0]).any(|column| self.is_active(row, column, event.t_us))
        })
    }

    /// True if a cell had an event in the time before.
    fn is_active(&self, row: usize, column: usize, t_us: u64) -> bool {
        let last_us = self.cell_last_us[row * CELLS[0] + column];
        last_us > 0 && (t_us + 1).saturating_sub(last_us) < SUPPORT_US
    }

    fn look_around(&mut self, event: &CdEvent) {
        let own = [event.y, event.x].map(|v| usize::from(v) / CELL_PX);
        let from = own.map(|cell| cell.saturating_sub(RINGS - 1));
        for row in from[0]..(own[0] + RINGS).min(CELLS[1]) {
            for column in from[1]..(own[1] + RINGS).min(CELLS[0]) {
                let ring = row.abs_diff(own[0]).max(column.abs_diff(own[1]));
                self.rings.cells[ring] += 1;
                self.rings.active[ring] += u64::from(self.is_active(row, column, event.t_us));
            }
        }
    }

    fn interval(&mut self, us: u64) {
        if us == 0 {
            self.zero += 1;
            return;
        }
        let x = us as f64;
        self.sums.n += 1;
        self.sums.x += x;
        self.sums.inverse += 1.0 / x;
        self.sums.log += libm::log(x);
        self.interval_bins.add(x);
        if let Some(count) = usize::try_from(us).ok().and_then(|k| self.exact.get_mut(k)) {
            *count += 1;
        }
    }

    pub(super) fn statistics(&self, camera: CameraId) -> EventStatistics {
        let share = |part: u64| (self.events > 0).then(|| part as f64 / self.events as f64);
        let duration_s = (self.before_us.saturating_sub(self.first_us)) as f64 * 1e-6;
        let mut counts: Vec<u32> = self.counts.clone();
        counts.sort_unstable_by(|a, b| b.cmp(a));
        let hottest: u64 = counts[..counts.len() / 100]
            .iter()
            .map(|n| u64::from(*n))
            .sum();
        let active = counts.partition_point(|n| *n > 0);
        // Events of so many cells in a millisecond, Poisson.
        let by_chance = |cells: f64| {
            (duration_s > 0.0).then(|| {
                let per_cell_s = self.events as f64 / duration_s / (CELLS[0] * CELLS[1]) as f64;
                -libm::expm1(-cells * per_cell_s * SUPPORT_US as f64 * 1e-6)
            })
        };
        let mut pixels = LogBins::new(2.0, PER_OCTAVE);
        for events in &counts[..active] {
            pixels.add(f64::from(*events));
        }
        let rings = self.rings.cells.iter().zip(self.rings.active);
        let rings = rings.enumerate().filter(|(_, (cells, _))| **cells > 0);
        EventStatistics {
            camera,
            events: self.events,
            duration_s,
            on_share: share(self.on),
            equal_times: share(self.equal),
            supported: share(self.supported),
            supported_by_chance: by_chance(9.0),
            correlation: rings
                .map(|(ring, (cells, active))| Ring {
                    distance_px: (ring * CELL_PX) as f64,
                    active: active as f64 / *cells as f64,
                })
                .collect(),
            correlation_by_chance: by_chance(1.0),
            dispersion: self.dispersion.ratio(),
            active_pixels: active as f64 / counts.len() as f64,
            hottest_share: share(hottest),
            pixels: pixels.bins(),
            intervals: self.law(),
            interval_bins: self.interval_bins.bins(),
            polarity: self.presses.polarity(),
            course: self.presses.course(),
        }
    }

    /// Maximum likelihood of Tweedie (1957): mean and harmonic mean.
    fn law(&self) -> Option<IntervalLaw> {
        let Sums { n, x, inverse, log } = self.sums;
        let count = n as f64;
        let mean_us = x / count;
        let rest = inverse / count - 1.0 / mean_us;
        if n < LEAST_INTERVALS || rest <= 0.0 {
            return None;
        }
        let shape_us = 1.0 / rest;
        let tau = core::f64::consts::TAU;
        // At the estimates, the quadratic term is one half.
        let inverse_gaussian = 0.5 + 1.5 * log / count - 0.5 * libm::log(shape_us / tau);
        Some(IntervalLaw {
            n,
            zero: self.zero,
            floor_us: self.floor_us(),
            mean_us,
            shape_us,
            inverse_gaussian,
            exponential: 1.0 + libm::log(mean_us),
        })
    }

    fn floor_us(&self) -> Option<u32> {
        let rank = (FLOOR_SHARE * self.sums.n as f64) as u64;
        let mut below = 0;
        let floor = self.exact.iter().position(|n| {
            below += n;
            below > rank
        })?;
        u32::try_from(floor).ok()
    }
}

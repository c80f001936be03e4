//! Statistics of a camera's events that the field publishes: law of the intervals of a pixel, equal timestamps, refractory
//! floor, polarity, support by neighbours.

use serde::Serialize;
use skinrig_model::{CameraId, CdEvent, SENSOR_HEIGHT, SENSOR_WIDTH};

use crate::{EventSource, EventSourceError};

const WIDTH: usize = SENSOR_WIDTH as usize;
/// Side of the cells in which neighbours are counted, px.
const CELL_PX: usize = 4;
const CELLS: [usize; 2] = [WIDTH / CELL_PX, SENSOR_HEIGHT as usize / CELL_PX];
/// An event supports one in a neighbouring cell for this long, µs.
const SUPPORT_US: u64 = 1_000;
/// Intervals up to this are counted exactly for the floor, µs.
const EXACT_US: usize = 1 << 16;
/// Share of the intervals that may lie below the refractory floor: neighbouring events of hot pixels, repeated words.
const FLOOR_SHARE: f64 = 0.001;
/// Least number of intervals for a law.
const LEAST_INTERVALS: u64 = 100;

/// Statistics of one camera; `None` where the recording has too few events.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EventStatistics {
    /// The camera.
    pub camera: CameraId,
    /// Events.
    pub events: u64,
    /// From the first to the last, s.
    pub duration_s: f64,
    /// Share of ON events.
    pub on_share: Option<f64>,
    /// Share of events with the timestamp of the event before.
    pub equal_times: Option<f64>,
    /// Share of events with one in the same or a neighbouring cell of 4 px in the millisecond before.
    pub supported: Option<f64>,
    /// The same for events at random pixels at random times, of the same number.
    pub supported_by_chance: Option<f64>,
    /// Share of the sensor's pixels with an event.
    pub active_pixels: f64,
    /// Share of the events from the hundredth of the pixels that has most.
    pub hottest_share: Option<f64>,
    /// Law of the intervals.
    pub intervals: Option<IntervalLaw>,
}

/// Intervals between consecutive events of a pixel, all pixels together, fitted by maximum likelihood.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct IntervalLaw {
    /// Intervals above 0.
    pub n: u64,
    /// Intervals of 0 µs: a pixel twice in a microsecond.
    pub zero: u64,
    /// Interval below which one in a thousand lies, µs; `None` if it is above 65 ms.
    pub floor_us: Option<u32>,
    /// Mean, µs.
    pub mean_us: f64,
    /// Shape of the inverse Gaussian law, µs.
    pub shape_us: f64,
    /// Mean negative log-likelihood of the inverse Gaussian law, nats per interval.
    pub inverse_gaussian: f64,
    /// The same of the exponential law.
    pub exponential: f64,
}

/// Statistics of `camera` in one pass over its events.
///
/// # Errors
/// When the events cannot be read to the end.
pub fn event_statistics(
    source: &dyn EventSource,
    camera: CameraId,
) -> Result<EventStatistics, EventSourceError> {
    let mut counter = Counter::new();
    source.for_each_slice(camera, &mut |events| {
        for event in events {
            counter.add(event);
        }
    })?;
    Ok(counter.statistics(camera))
}

/// Sums over the intervals in µs.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    n: u64,
    x: f64,
    inverse: f64,
    log: f64,
}

#[derive(Debug)]
struct Counter {
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
}

impl Counter {
    fn new() -> Self {
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
        }
    }

    fn add(&mut self, event: &CdEvent) {
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
            around(event.x, CELLS[0]).any(|column| {
                let last_us = self.cell_last_us[row * CELLS[0] + column];
                last_us > 0 && (event.t_us + 1).saturating_sub(last_us) < SUPPORT_US
            })
        })
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
        if let Some(count) = usize::try_from(us).ok().and_then(|k| self.exact.get_mut(k)) {
            *count += 1;
        }
    }

    fn statistics(&self, camera: CameraId) -> EventStatistics {
        let share = |part: u64| (self.events > 0).then(|| part as f64 / self.events as f64);
        let duration_s = (self.before_us.saturating_sub(self.first_us)) as f64 * 1e-6;
        let mut counts: Vec<u32> = self.counts.clone();
        counts.sort_unstable_by(|a, b| b.cmp(a));
        let hottest: u64 = counts[..counts.len() / 100]
            .iter()
            .map(|n| u64::from(*n))
            .sum();
        let active = counts.partition_point(|n| *n > 0);
        // Events of nine cells in a millisecond, Poisson.
        let expected = (duration_s > 0.0).then(|| {
            let per_cell_s = self.events as f64 / duration_s / (CELLS[0] * CELLS[1]) as f64;
            -libm::expm1(-9.0 * per_cell_s * SUPPORT_US as f64 * 1e-6)
        });
        EventStatistics {
            camera,
            events: self.events,
            duration_s,
            on_share: share(self.on),
            equal_times: share(self.equal),
            supported: share(self.supported),
            supported_by_chance: expected,
            active_pixels: active as f64 / counts.len() as f64,
            hottest_share: share(hottest),
            intervals: self.law(),
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

#[cfg(test)]
mod tests {
    use rand_xoshiro::Xoshiro256PlusPlus;
    use rand_xoshiro::rand_core::{Rng, SeedableRng};
    use skinrig_model::Polarity;

    use super::*;

    struct Events(Vec<CdEvent>);

    impl EventSource for Events {
        fn for_each_slice(
            &self,
            _: CameraId,
            each: &mut dyn FnMut(&[CdEvent]),
        ) -> Result<(), EventSourceError> {
            self.0.chunks(7).for_each(each);
            Ok(())
        }
    }

    fn of(events: Vec<CdEvent>) -> EventStatistics {
        event_statistics(&Events(events), CameraId::One).unwrap()
    }

    fn event(t_us: u64, x: u16, y: u16, on: bool) -> CdEvent {
        CdEvent {
            t_us,
            x,
            y,
            polarity: Polarity::from_bit(on),
        }
    }

    /// Events of one pixel at intervals of at least `floor` µs, the rest of which `draw` makes from a uniform number.
    fn one_pixel(n: usize, draw: impl Fn([f64; 3]) -> f64) -> EventStatistics {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(5);
        let mut unit = || (random.next_u64() >> 11) as f64 * (0.5f64).powi(53);
        let mut t_us = 0;
        let events = (0..n).map(|_| {
            t_us += draw([unit(), unit(), unit()]).round().max(1.0) as u64;
            event(t_us, 3, 4, true)
        });
        of(events.collect())
    }

    #[test]
    fn an_exponential_and_an_inverse_gaussian_law_are_told_apart() {
        let exponential = one_pixel(20_000, |[u, ..]| -5_000.0 * libm::log(1.0 - u));
        let law = exponential.intervals.unwrap();
        assert!(law.exponential < law.inverse_gaussian, "{law:?}");
        assert!((law.mean_us / 5_000.0 - 1.0).abs() < 0.03, "{law:?}");
        // Michael, Schucany and Haas (1976): mean 5 ms, shape 2 ms.
        let (mean, shape) = (5_000.0, 2_000.0);
        let gaussian = one_pixel(20_000, |[u, v, pick]| {
            let z = libm::sqrt(-2.0 * libm::log(1.0 - u)) * libm::cos(core::f64::consts::TAU * v);
            let y = mean * z * z;
            let low = mean + mean / (2.0 * shape) * (y - libm::sqrt(4.0 * shape * y + y * y));
            if pick <= mean / (mean + low) {
                low
            } else {
                mean * mean / low
            }
        });
        let law = gaussian.intervals.unwrap();
        assert!(law.inverse_gaussian < law.exponential, "{law:?}");
        assert!((law.shape_us / shape - 1.0).abs() < 0.1, "{law:?}");
    }

    #[test]
    fn the_refractory_floor_is_found() {
        let found = one_pixel(20_000, |[u, ..]| 250.0 - 900.0 * libm::log(1.0 - u));
        let floor = found.intervals.unwrap().floor_us.unwrap();
        assert!((250..=252).contains(&floor), "{floor}");
    }

    #[test]
    fn equal_times_polarity_and_neighbours_are_counted() {
        let found = of(vec![
            event(10, 100, 100, true),
            event(10, 300, 100, false),
            event(500, 103, 101, true),
            event(5_000, 103, 101, true),
        ]);
        assert_eq!(found.events, 4);
        assert_eq!(found.equal_times, Some(0.25));
        assert_eq!(found.on_share, Some(0.75));
        assert_eq!(found.supported, Some(0.25));
        assert_eq!(found.intervals, None, "one interval is no law");
    }

    #[test]
    fn no_events_give_no_numbers() {
        let found = of(Vec::new());
        assert_eq!(
            (found.events, found.on_share, found.intervals),
            (0, None, None)
        );
        assert_eq!(found.supported_by_chance, None);
    }
}

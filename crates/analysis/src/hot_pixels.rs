//! Owns the events of each pixel between presses and during them, and which pixels are hot: they fire in idle time again and again, and no
//! more during presses.
//!
//! A few hot pixels, or a reflection that flickers, make clusters that no press made. The background that
//! [`Background`](crate::background::Background) assumes is uniform, so pixels far above it are found one by one and left out.

use skinrig_model::{AnalysisSettings, CdEvent, PressId, SENSOR_WIDTH};

use crate::crowded::{crowded, without_busiest};
use crate::pixels::PixelSet;
use crate::quiet_parts::{
    Fired, IdleTime, empty_run, missing_polarity, quiet_for_a_time, side_of, strip_of,
};
use crate::repeats::Repeats;
use crate::result::{HotPixels, QuietPart, ReadoutFault};
use crate::segment::Window;
use crate::stamp_steps::StampSteps;

/// Idle times in which a hot pixel fires, at least; and as a share of all.
const LEAST_SPANS: u32 = 4;
const LEAST_SHARE: f64 = 0.25;
/// Events of a hot pixel in idle time, at least: fewer are too few to tell it from one that fades after presses, and to matter.
const LEAST_EVENTS: u32 = 20;
/// Rate during presses of a hot pixel, at most, in idle rates: presses excite the others more.
const MOST_EXCITED: f64 = 2.0;

/// A span of camera time, half-open, µs.
#[derive(Debug, Clone, Copy)]
struct Span {
    from_us: u64,
    to_us: u64,
    /// Number of the idle time; `None` for a press window.
    idle: Option<u32>,
}

/// Events of a pixel.
#[derive(Debug, Clone, Copy, Default)]
struct Pixel {
    idle_events: u32,
    press_events: u32,
    /// Idle times in which it fired,
    spans: u32,
    /// and the number of the last one, from 1.
    last_span: u32,
}

/// Events per pixel of the crop, in the idle times and in the press windows of a camera.
pub(crate) struct PixelCounts {
    rows: (u16, u16),
    /// Disjoint, in order.
    spans: Vec<Span>,
    /// The span of the last event.
    at: usize,
    pixels: Vec<Pixel>,
    /// Pixels that fired, by number of the idle time.
    fired: Vec<Fired>,
    repeats: Repeats,
    stamps: StampSteps,
}

impl PixelCounts {
    /// No events yet; `windows` in order of their start.
    pub(crate) fn new(rows: (u16, u16), windows: &[Window]) -> Self {
        let mut spans: Vec<Span> = Vec::with_capacity(2 * windows.len());
        let mut end_us = 0;
        for (window, number) in windows.iter().zip(1..) {
            for (from_us, to_us, idle) in [
                (window.idle_start_us, window.start_us, Some(number)),
                (window.start_us, window.end_us, None),
            ] {
                let from_us = from_us.max(end_us);
                if from_us < to_us {
                    spans.push(Span {
                        from_us,
                        to_us,
                        idle,
                    });
                    end_us = to_us;
                }
            }
        }
        let height = usize::from(rows.1.saturating_sub(rows.0)) + 1;
        Self {
            rows,
            spans,
            at: 0,
            fired: vec![Fired::default(); windows.len()],
            repeats: Repeats::new(),
            stamps: StampSteps::default(),
            pixels: vec![Pixel::default(); height * usize::from(SENSOR_WIDTH)],
        }
    }

    /// Counts events, nearly in order of time; those outside the crop and the spans do not count.
    pub(crate) fn add(&mut self, events: &[CdEvent]) {
        for event in events {
            let inside = (self.rows.0..=self.rows.1).contains(&event.y) && event.x < SENSOR_WIDTH;
            if !inside {
                continue;
            }
            self.repeats.push(event);
            self.stamps.push(event.t_us);
            if !self.reach(event.t_us) {
                continue;
            }
            let index = usize::from(event.y - self.rows.0) * usize::from(SENSOR_WIDTH);
            let pixel = &mut self.pixels[index + usize::from(event.x)];
            match self.spans[self.at].idle {
                None => pixel.press_events = pixel.press_events.saturating_add(1),
                Some(number) => {
                    pixel.idle_events = pixel.idle_events.saturating_add(1);
                    if pixel.last_span != number {
                        pixel.last_span = number;
                        pixel.spans += 1;
                        let fired = &mut self.fired[number as usize - 1];
                        fired[strip_of(event.x)][side_of(event.polarity)] += 1;
                    }
                }
            }
        }
    }

    /// Moves to the span that holds this time; false if none does.
    fn reach(&mut self, t_us: u64) -> bool {
        let holds = |span: &Span| (span.from_us..span.to_us).contains(&t_us);
        if self.spans.get(self.at).is_some_and(holds) {
            return true;
        }
        self.at = self.spans.partition_point(|s| s.to_us <= t_us);
        self.spans.get(self.at).is_some_and(holds)
    }

    /// What the events of the crop tell of readout, driver and converter.
    pub(crate) fn readout_faults(&self) -> Vec<ReadoutFault> {
        let width = usize::from(SENSOR_WIDTH);
        let events = |pixel: &Pixel| u64::from(pixel.idle_events) + u64::from(pixel.press_events);
        let column = |x: usize| self.pixels[x..].iter().step_by(width).map(events);
        let columns: Vec<u64> = (0..width)
            .map(|x| without_busiest(column(x).collect()))
            .collect();
        let rows = self.pixels.chunks(width);
        let rows: Vec<u64> = rows
            .map(|row| without_busiest(row.iter().map(events).collect()))
            .collect();
        let column = crowded(&columns).map(|(x, times)| ReadoutFault::CrowdedColumn {
            column: x as u16,
            times,
        });
        let row = crowded(&rows).map(|(y, times)| ReadoutFault::CrowdedRow {
            row: self.rows.0 + y as u16,
            times,
        });
        let found = [self.repeats.found(), self.stamps.found(), column, row];
        found.into_iter().flatten().collect()
    }

    /// Parts of the picture that are quiet, during a part of the session or throughout. `press`: of each window.
    pub(crate) fn quiet(&self, press: impl Fn(usize) -> PressId) -> Vec<QuietPart> {
        let idle = self.spans.iter().filter_map(|span| {
            let window = span.idle? as usize - 1;
            Some(IdleTime {
                press: press(window),
                seconds: (span.to_us - span.from_us) as f64 * 1e-6,
                fired: self.fired[window],
            })
        });
        let idle: Vec<IdleTime> = idle.collect();
        let for_a_time = quiet_for_a_time(&idle);
        let width = usize::from(SENSOR_WIDTH);
        let (mut by_column, mut by_row) = (vec![0; width], vec![0; self.pixels.len() / width]);
        for (index, pixel) in self.pixels.iter().enumerate() {
            let events = u64::from(pixel.idle_events) + u64::from(pixel.press_events);
            by_column[index % width] += events;
            by_row[index / width] += events;
        }
        let span =
            |(first, last): (usize, usize), from: u16| (from + first as u16, from + last as u16);
        let throughout = |columns, rows, polarity| QuietPart {
            columns,
            rows,
            polarity,
            presses: None,
            share: 0.0,
        };
        let columns = empty_run(&by_column).map(|run| throughout(Some(span(run, 0)), None, None));
        let rows =
            empty_run(&by_row).map(|run| throughout(None, Some(span(run, self.rows.0)), None));
        let polarity = missing_polarity(&idle).map(|missing| throughout(None, None, Some(missing)));
        let throughout = columns.into_iter().chain(rows).chain(polarity);
        for_a_time.into_iter().chain(throughout).collect()
    }

    /// The hot pixels.
    pub(crate) fn hot(self, settings: &AnalysisSettings) -> HotPixels {
        let total_s = |idle: bool| {
            let spans = self.spans.iter().filter(|s| s.idle.is_some() == idle);
            spans.map(|s| (s.to_us - s.from_us) as f64).sum::<f64>() * 1e-6
        };
        let (idle_s, press_s) = (total_s(true), total_s(false));
        let idle_spans = self.spans.iter().filter(|s| s.idle.is_some()).count();
        let least_spans = LEAST_SPANS.max((LEAST_SHARE * idle_spans as f64).ceil() as u32);
        let all: u64 = self.pixels.iter().map(|p| u64::from(p.idle_events)).sum();
        let mut found = HotPixels {
            of: self.pixels.len() as u32,
            ..HotPixels::default()
        };
        if settings.hot_pixel_ratio <= 0.0 || idle_s <= 0.0 || press_s <= 0.0 {
            return found;
        }
        let counts = &mut self
            .pixels
            .iter()
            .map(|p| p.idle_events)
            .collect::<Vec<_>>()[..];
        let middle = counts.len() / 2;
        let median = f64::from(*counts.select_nth_unstable(middle).1);
        let pressed: u64 = self.pixels.iter().map(|p| u64::from(p.press_events)).sum();
        let (mut hot_events, mut hot_pressed) = (0, 0);
        for (index, pixel) in self.pixels.iter().enumerate() {
            let idle = f64::from(pixel.idle_events);
            let is_hot = pixel.spans >= least_spans
                && pixel.idle_events >= LEAST_EVENTS
                && idle >= settings.hot_pixel_ratio * median
                && f64::from(pixel.press_events) * idle_s <= MOST_EXCITED * idle * press_s;
            if is_hot {
                let (row, column) = (
                    index / usize::from(SENSOR_WIDTH),
                    index % usize::from(SENSOR_WIDTH),
                );
                found.pixels.push((column as u16, self.rows.0 + row as u16));
                found.highest_per_s = found.highest_per_s.max(idle / idle_s);
                hot_events += u64::from(pixel.idle_events);
                hot_pressed += u64::from(pixel.press_events);
            }
        }
        found.idle_share = hot_events as f64 / all.max(1) as f64;
        // A camera that sees nothing else in the press windows is blind, and the audit says so of the pixels that it has.
        let windows = self.spans.iter().filter(|s| s.idle.is_none()).count() as u64;
        if pressed - hot_pressed < windows {
            found.pixels.clear();
        }
        found
    }
}

/// Hot pixels of a camera as a set.
#[derive(Debug, Clone, Default)]
pub struct HotPixelMask {
    set: PixelSet,
    any: bool,
}

impl HotPixelMask {
    /// Of these pixels, which lie on the sensor.
    #[must_use]
    pub fn new(hot: &HotPixels) -> Self {
        let rows = hot
            .pixels
            .iter()
            .map(|(_, row)| usize::from(*row) + 1)
            .max();
        let mut set = PixelSet::new(rows.unwrap_or(0));
        for (column, row) in &hot.pixels {
            set.insert(usize::from(*row) * usize::from(SENSOR_WIDTH) + usize::from(*column));
        }
        Self {
            set,
            any: !hot.pixels.is_empty(),
        }
    }

    /// True without hot pixels.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        !self.any
    }

    /// True if an event on the sensor comes from a hot pixel.
    #[must_use]
    pub fn holds(&self, event: &CdEvent) -> bool {
        self.any
            && self
                .set
                .contains(usize::from(event.y) * usize::from(SENSOR_WIDTH) + usize::from(event.x))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use skinrig_model::Polarity;
    use skinrig_statistics::seeded;

    const ROWS: (u16, u16) = (185, 360);
    const PRESSES: u64 = 40;

    /// A press every 2 s: idle time for 0.5 s, then a window of 0.4 s.
    fn windows() -> Vec<Window> {
        let window = |row: u64| Window {
            row: row as usize,
            idle_start_us: 2_000_000 * row + 500_000,
            start_us: 2_000_000 * row + 1_000_000,
            end_us: 2_000_000 * row + 1_400_000,
        };
        (0..PRESSES).map(window).collect()
    }

    fn event(t_us: u64, x: u16, y: u16) -> CdEvent {
        CdEvent {
            t_us,
            x,
            y,
            polarity: Polarity::On,
        }
    }

    /// Events at this rate, from `from_us` on, of one pixel.
    fn steady(per_s: f64, (x, y): (u16, u16), seed: u64) -> Vec<CdEvent> {
        let mut rng = seeded::generator(7, seed);
        let mut t = 0.0;
        let mut events = Vec::new();
        while t < 2.0 * PRESSES as f64 {
            events.push(event((t * 1e6) as u64, x, y));
            let chance = 0.499 * (1.0 + seeded::signed_unit(&mut rng));
            t -= libm::log1p(-chance) / per_s;
        }
        events
    }

    fn hot(events: Vec<CdEvent>, ratio: f64) -> HotPixels {
        // Every press excites a pixel of its own.
        let presses = windows().into_iter().zip(0..);
        let presses = presses.flat_map(|(w, x)| (0..5).map(move |i| event(w.start_us + i, x, 190)));
        alone([events, presses.collect()].concat(), ratio)
    }

    fn alone(mut events: Vec<CdEvent>, ratio: f64) -> HotPixels {
        events.sort_by_key(|e| e.t_us);
        let mut counts = PixelCounts::new(ROWS, &windows());
        counts.add(&events);
        let settings = AnalysisSettings {
            hot_pixel_ratio: ratio,
            ..AnalysisSettings::default()
        };
        counts.hot(&settings)
    }

    #[test]
    fn pixels_that_fire_again_and_again_are_hot() {
        let places = [(320, 270), (0, 185), (639, 360)];
        let events = places
            .iter()
            .zip(0..)
            .flat_map(|(at, seed)| steady(5.0, *at, seed));
        let found = hot(events.collect(), 10.0);
        let mut expected = places;
        expected.sort_unstable_by_key(|(x, y)| (*y, *x));
        assert_eq!(found.pixels, expected);
        assert!((3.0..8.0).contains(&found.highest_per_s), "{found:?}");
        assert_eq!(found.idle_share, 1.0);
        assert_eq!(hot(steady(5.0, (320, 270), 0), 0.0).pixels, []);
    }

    #[test]
    fn a_pixel_that_presses_excite_is_not_hot() {
        // The skin relaxes after each press at this place: events in every idle time, and ten times as many in every window.
        let mut events = Vec::new();
        for window in windows() {
            events.extend((0..2).map(|i| event(window.idle_start_us + 1000 * i, 320, 270)));
            events.extend((0..16).map(|i| event(window.start_us + 1000 * i, 320, 270)));
        }
        assert_eq!(hot(events.clone(), 10.0).pixels, []);
        // Without the presses it is.
        events.retain(|e| e.t_us % 2_000_000 < 1_000_000);
        assert_eq!(hot(events, 10.0).pixels, [(320, 270)]);
    }

    #[test]
    fn a_disturbance_between_two_presses_and_a_dense_background_are_not_hot() {
        let once = (0..5000).map(|i| event(600_000 + i, 320, 270)).collect();
        assert_eq!(hot(once, 10.0).pixels, []);
        // Every pixel fires five times a second.
        let mut rng = seeded::generator(3, 0);
        let mut random = |n: u64| seeded::index(&mut rng, n as usize) as u64;
        let dense = (0..640 * 176 * 5 * 80 / 4).map(|_| {
            event(
                random(80_000_000),
                random(640) as u16,
                185 + random(176) as u16,
            )
        });
        assert_eq!(hot(dense.collect(), 10.0).pixels, []);
    }

    #[test]
    fn a_camera_with_nothing_else_has_no_hot_pixels() {
        assert_eq!(alone(steady(5.0, (320, 270), 0), 10.0).pixels, []);
        assert_eq!(hot(steady(5.0, (320, 270), 0), 10.0).pixels, [(320, 270)]);
    }

    #[test]
    fn a_mask_holds_its_pixels_and_no_others() {
        let mask = HotPixelMask::new(&HotPixels {
            pixels: vec![(639, 200), (0, 201)],
            ..HotPixels::default()
        });
        let held = |x, y| mask.holds(&event(0, x, y));
        assert!(held(639, 200) && held(0, 201));
        assert!(!held(638, 200) && !held(639, 201) && !held(0, 479) && !held(0, 200));
        assert!(
            !HotPixelMask::default().holds(&event(0, 0, 0)) && HotPixelMask::default().is_empty()
        );
    }
}

//! Collects what the phases of each press leave behind, while a camera's stream passes: events by polarity, and how much
//! each pixel has changed.

use skinrig_model::{CdEvent, Polarity};

use super::image::{Image, ImageSums, ReturnSums};
use super::phases::{IDLE, PHASES, PRESS, PhasePlan, RELEASE};

/// A pixel with this many events in the idle time of a press is hot: its events count in none of its phases.
const HOT: u8 = 3;

/// Events of one camera in the phases of one press.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PressPhases {
    /// Row of the press in the plan.
    pub row: usize,
    /// ON and OFF events of each phase, without hot pixels.
    pub events: [[u32; 2]; PHASES],
    /// Length of each phase, s.
    pub seconds: [f64; PHASES],
    /// Change of the image by the press and by the release.
    pub images: [ImageSums; 2],
    /// Change of the image that remains after the press.
    pub rest: ReturnSums,
}

/// Counts of a press that is in progress.
struct OpenPress {
    plan: PhasePlan,
    events: [[u32; 2]; PHASES],
    /// ON and OFF events of each pixel in the idle time, at most 255.
    idle: Vec<[u8; 2]>,
    /// ON minus OFF events of each pixel: by the press, by the release, and from the press to the end.
    pressed: Image,
    released: Image,
    total: Image,
}

impl OpenPress {
    fn new(plan: PhasePlan, rows: (u16, u16)) -> Self {
        let image = Image::new(rows);
        Self {
            plan,
            events: [[0; 2]; PHASES],
            idle: vec![[0; 2]; image.len()],
            pressed: image.clone(),
            released: image.clone(),
            total: image,
        }
    }

    fn restart(&mut self, plan: PhasePlan) {
        self.plan = plan;
        self.events = [[0; 2]; PHASES];
        self.idle.fill([0; 2]);
        self.pressed.clear();
        self.released.clear();
        self.total.clear();
    }

    fn add(&mut self, phase: usize, events: &[CdEvent]) {
        for event in events {
            let Some(pixel) = self.total.index(event.x, event.y) else {
                continue;
            };
            let on = event.polarity == Polarity::On;
            let idle = &mut self.idle[pixel];
            if phase == IDLE {
                let count = &mut idle[usize::from(!on)];
                *count = count.saturating_add(1);
                continue;
            }
            if idle[0].saturating_add(idle[1]) >= HOT {
                continue;
            }
            self.events[phase][usize::from(!on)] += 1;
            self.total.add(pixel, on);
            match phase {
                PRESS => self.pressed.add(pixel, on),
                RELEASE => self.released.add(pixel, on),
                _ => {}
            }
        }
    }

    fn finish(&mut self) -> PressPhases {
        let cool = self.idle.iter().filter(|i| i[0].saturating_add(i[1]) < HOT);
        for [on, off] in cool {
            self.events[IDLE][0] += u32::from(*on);
            self.events[IDLE][1] += u32::from(*off);
        }
        PressPhases {
            row: self.plan.row,
            events: self.events,
            seconds: std::array::from_fn(|phase| self.plan.seconds(phase)),
            images: [self.pressed.sums(), self.released.sums()],
            rest: self.total.along(&self.pressed),
        }
    }
}

/// Collects the phases of presses; those of different presses may overlap.
pub(crate) struct PhaseCollector {
    rows: (u16, u16),
    plans: Vec<PhasePlan>,
    /// Presses before this index have begun.
    next: usize,
    /// No event before this time will follow.
    passed_us: u64,
    open: Vec<OpenPress>,
    spare: Vec<OpenPress>,
    done: Vec<PressPhases>,
}

impl PhaseCollector {
    /// Collects events in `rows`, inclusive; the plans are sorted by their start.
    pub(crate) const fn new(plans: Vec<PhasePlan>, rows: (u16, u16)) -> Self {
        Self {
            rows,
            plans,
            next: 0,
            passed_us: 0,
            open: Vec::new(),
            spare: Vec::new(),
            done: Vec::new(),
        }
    }

    /// Processes the next events, in time order.
    pub(crate) fn take(&mut self, events: &[CdEvent]) {
        let Some(last) = events.last() else {
            return;
        };
        self.begin_until(last.t_us);
        let at = |t_us: u64| events.partition_point(|e| e.t_us < t_us);
        for press in &mut self.open {
            let ends = press.plan.ends_us.map(at);
            for phase in 0..PHASES {
                press.add(phase, &events[ends[phase]..ends[phase + 1]]);
            }
        }
    }

    /// Opens the presses that begin by `t_us`; those that have already passed are empty.
    fn begin_until(&mut self, t_us: u64) {
        while let Some(plan) = self.plans.get(self.next).filter(|p| p.ends_us[0] <= t_us) {
            self.next += 1;
            let mut press = match self.spare.pop() {
                Some(mut used) => {
                    used.restart(*plan);
                    used
                }
                None => OpenPress::new(*plan, self.rows),
            };
            if plan.ends_us[PHASES] <= self.passed_us {
                self.done.push(press.finish());
                self.spare.push(press);
            } else {
                self.open.push(press);
            }
        }
    }

    /// Declares that no event before `time_us` will follow.
    pub(crate) fn advance(&mut self, time_us: u64) {
        self.passed_us = time_us;
        let mut i = 0;
        while i < self.open.len() {
            if self.open[i].plan.ends_us[PHASES] > time_us {
                i += 1;
                continue;
            }
            let mut press = self.open.remove(i);
            self.done.push(press.finish());
            self.spare.push(press);
        }
    }

    /// The phases of all presses, by row.
    pub(crate) fn finish(mut self) -> Vec<PressPhases> {
        self.advance(u64::MAX);
        self.begin_until(u64::MAX);
        self.done.sort_unstable_by_key(|p| p.row);
        self.done
    }
}

#[cfg(test)]
mod tests {
    use skinrig_model::SENSOR_WIDTH;

    use super::*;

    fn event(t_us: u64, x: u16, on: bool) -> CdEvent {
        CdEvent {
            t_us,
            x,
            y: 200,
            polarity: Polarity::from_bit(on),
        }
    }

    fn plan(row: usize, from: u64) -> PhasePlan {
        let ends_us = [0, 100, 200, 300, 400, 500].map(|t| from + t);
        PhasePlan { row, ends_us }
    }

    fn collected(plans: Vec<PhasePlan>, events: &[CdEvent], slice: usize) -> Vec<PressPhases> {
        let mut collector = PhaseCollector::new(plans, (190, 210));
        for part in events.chunks(slice) {
            collector.take(part);
            collector.advance(part[0].t_us.saturating_sub(10));
        }
        collector.finish()
    }

    #[test]
    fn phases_are_counted_however_the_stream_is_cut() {
        // Two pixels turn on with the press, one turns off with the release; a hot pixel chatters throughout.
        let mut events = vec![
            event(120, 10, true),
            event(130, 10, true),
            event(150, 11, true),
        ];
        events.push(event(320, 10, false));
        events.push(event(450, 12, true));
        events.extend((0..50).map(|i| event(10 * i, 300, i % 2 == 0)));
        events.sort_by_key(|e| e.t_us);
        let whole = collected(vec![plan(7, 0), plan(8, 90)], &events, 1000);
        for slice in [1, 3, 7] {
            assert_eq!(
                collected(vec![plan(7, 0), plan(8, 90)], &events, slice),
                whole
            );
        }
        let first = &whole[0];
        assert_eq!(first.row, 7);
        assert_eq!(first.events, [[0, 0], [3, 0], [0, 0], [0, 1], [1, 0]]);
        assert_eq!((first.images[0].changed, first.images[1].changed), (3, 1));
        // Only the pixel with two events shows a change that counts; one of its events is left.
        assert_eq!(
            (first.rest.toward, first.rest.size, first.rest.pixels),
            (1, 2, 1)
        );
        assert_eq!(whole[1].row, 8);
    }

    #[test]
    fn a_press_without_events_is_empty() {
        let found = collected(vec![plan(0, 1_000)], &[event(5, 10, true)], 1);
        assert_eq!(found[0].events, [[0; 2]; PHASES]);
        assert_eq!(found[0].images[0], ImageSums::default());
        assert!((found[0].seconds[PRESS] - 1e-4).abs() < 1e-12);
    }

    #[test]
    fn events_off_the_rows_do_not_count() {
        let off = CdEvent {
            y: 189,
            ..event(150, SENSOR_WIDTH - 1, true)
        };
        assert_eq!(
            collected(vec![plan(0, 0)], &[off], 1)[0].events,
            [[0; 2]; PHASES]
        );
    }
}

//! A seeded recording of one repetition of the published experiment, at its event rates: 289 presses 3 + 1/289 s
//! apart, 7 M events per camera, four fifths of them in the rows of the skin, a sixth of those outside presses.
//!
//! Counts and densities follow a real-rate recording: 20 thousand events per period in the rows of the skin, half as many
//! different pixels, 800 events within 10 px of an event of a press, 3 % noise.

use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use skinrig_analysis::SessionInput;
use skinrig_model::{
    AnalysisSettings, CdEvent, MarkKind, Point2, Polarity, PressId, PressRole, PressTiming,
    RigGeometry, SkinOutline, StereoGeometry,
};
use skinrig_planted::{PlantedPress, mark, press as add, timing};

/// Presses of one repetition.
pub const PRESSES: u32 = 289;
/// Time from press to press, s.
pub const PERIOD_S: f64 = 868.0 / 289.0;
/// Events of one camera in one period.
pub(crate) const PERIOD_EVENTS: usize = 24_000;
/// Contact of the first press on the host's clock, s.
const FIRST_S: f64 = 15.0;
/// From contact to release, s.
pub const TOUCH_S: f64 = 0.55;
/// Start of the cameras' clocks before the host's, s.
const CLOCK_LEADS_S: [f64; 2] = [7.0, 5.3];
/// The rows that show the skin.
const SKIN_ROWS: (u16, u16) = (185, 360);

/// Random numbers and the pixels' sensitivities.
pub struct Random {
    rng: Xoshiro256PlusPlus,
    /// Sensitivity per pixel, 0..1: skin and sensor are uneven, so that some pixels fire repeatedly.
    gain: Vec<f32>,
}

impl Random {
    /// A generator with this seed.
    #[must_use]
    pub fn seeded(seed: u64) -> Self {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let gain = (0..640 * 480).map(|_| unit(&mut rng).powi(4) as f32);
        Self {
            gain: gain.collect(),
            rng,
        }
    }

    /// Uniform in 0..1.
    pub fn unit(&mut self) -> f64 {
        unit(&mut self.rng)
    }

    /// Approximately normal, at most 3.5 standard deviations.
    fn normal(&mut self) -> f64 {
        let sum: f64 = (0..4).map(|_| self.unit()).sum();
        (sum - 2.0) * 3f64.sqrt()
    }

    /// A pixel of a press at `column`: mostly at the two sides of the dent, some around it.
    pub fn touched(&mut self, column: f64) -> (u16, u16) {
        loop {
            let (x, y) = match self.unit() {
                p if p < 0.9 => {
                    let side = if p < 0.5 { -13.0 } else { 13.0 };
                    (
                        column + side + 8.0 * self.normal(),
                        272.0 + 19.0 * self.normal(),
                    )
                }
                _ => (column + 90.0 * self.normal(), 272.0 + 24.0 * self.normal()),
            };
            if let Some(pixel) = self.firing_pixel(x, y) {
                return pixel;
            }
        }
    }

    /// A pixel of the skin at rest.
    pub fn idle(&mut self) -> (u16, u16) {
        loop {
            let (low, high) = SKIN_ROWS;
            let y = f64::from(low) + f64::from(high + 1 - low) * self.unit();
            let x = 640.0 * self.unit();
            if let Some(pixel) = self.firing_pixel(x, y) {
                return pixel;
            }
        }
    }

    /// A pixel above or below the skin.
    fn elsewhere(&mut self) -> (u16, u16) {
        let x = (640.0 * self.unit()) as u16;
        let y = (303.0 * self.unit()) as u16;
        (
            x,
            if y < SKIN_ROWS.0 {
                y
            } else {
                y + SKIN_ROWS.1 + 1 - SKIN_ROWS.0
            },
        )
    }

    /// The pixel at a position, if it is in the rows of the skin and fires.
    fn firing_pixel(&mut self, x: f64, y: f64) -> Option<(u16, u16)> {
        let (low, high) = (f64::from(SKIN_ROWS.0), f64::from(SKIN_ROWS.1 + 1));
        if !(0.0..640.0).contains(&x) || !(low..high).contains(&y) {
            return None;
        }
        let (x, y) = (x as u16, y as u16);
        let gain = self.gain[usize::from(y) * 640 + usize::from(x)];
        (self.unit() < f64::from(gain)).then_some((x, y))
    }

    fn event(&mut self, t_s: f64, (x, y): (u16, u16)) -> CdEvent {
        CdEvent {
            t_us: (t_s * 1e6) as u64,
            x,
            y,
            polarity: Polarity::from_bit(self.unit() < 0.5),
        }
    }
}

fn unit(rng: &mut Xoshiro256PlusPlus) -> f64 {
    (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

/// Location and contact time of a press on the host's clock: the grid of the published experiment, 4 mm apart.
fn press(i: u32) -> (Point2, f64) {
    let (line, place) = (i / 17, i % 17);
    let place = if line % 2 == 0 { place } else { 16 - place };
    let at = Point2::new(
        -22.0 + 4.0 * f64::from(line),
        -30.0 + 4.0 * f64::from(place),
    );
    (at, FIRST_S + PERIOD_S * f64::from(i))
}

/// Session without its events: three sync presses and the grid, every other press calibrates. No
/// trigger marks, as in the published recordings, so that the clocks are aligned by event rates.
#[must_use]
pub fn input() -> SessionInput {
    let sync = (0..3).map(|i| {
        (
            PressRole::Sync,
            0,
            Point2::new(10.0, 2.0),
            10.0 + f64::from(i),
        )
    });
    let grid = (0..PRESSES).map(|i| {
        let (at, contact) = press(i);
        let role = if i % 2 == 0 {
            PressRole::Calibrate
        } else {
            PressRole::Score
        };
        (role, i, at, contact)
    });
    let mut input = skinrig_planted::session(
        RigGeometry {
            outline: SkinOutline::PAPER,
            nominal: StereoGeometry::PAPER,
            trigger_channel: None,
            trigger_delay_us: [0; 2],
        },
        AnalysisSettings::default(),
    );
    for (role, location, at, contact) in sync.chain(grid) {
        let touch = PlantedPress {
            timing: timing(contact, [0.1, 0.2, 0.3, TOUCH_S, 0.7]),
            ..PlantedPress::new(role, 0, location, at)
        };
        add(&mut input, touch);
    }
    input
}

/// The same with the trigger marks of a bench, as recorded by skinrig: the clocks are aligned without the events.
#[must_use]
pub fn marked_input() -> SessionInput {
    let mut input = input();
    input.rig.trigger_channel = Some(0);
    let timings: Vec<(PressId, PressTiming)> = input
        .outcomes
        .iter()
        .flatten()
        .filter_map(|o| Some((o.attempt.press, o.timing?)))
        .collect();
    for (press, timing) in timings {
        for (kind, t) in [
            (MarkKind::Contact, timing.contact),
            (MarkKind::Release, timing.release),
        ] {
            mark(&mut input, (kind, press), t, 500, |k| {
                (t.0 as f64 * 1e-3 + 1e6 * CLOCK_LEADS_S[k]).round() as u64
            });
        }
    }
    input
}

/// The events of both cameras, by time.
#[must_use]
pub fn events(input: &SessionInput) -> [Vec<CdEvent>; 2] {
    [0, 1].map(|k| {
        let mut random = Random::seeded(1 + k as u64);
        let camera = &StereoGeometry::PAPER.cameras[k];
        let mut events = Vec::new();
        for outcome in input.outcomes.iter().flatten() {
            let (Some(timing), Some(at)) = (outcome.timing, outcome.measured_at) else {
                continue;
            };
            let contact_s = timing.contact.0 as f64 * 1e-9 + CLOCK_LEADS_S[k];
            // The image of the dent is slightly off its location, so that there is an error to measure.
            let column = camera.column_of_point(at).unwrap_or(320.0) + 6.0 * random.normal();
            let place = outcome.attempt.press.index();
            let events_here = if place < 3 {
                PERIOD_EVENTS / 3
            } else {
                PERIOD_EVENTS
            };
            for _ in 0..events_here {
                let (after_s, pixel) = match random.unit() {
                    p if p < 0.18 => (PERIOD_S * random.unit(), random.elsewhere()),
                    p if p < 0.25 => (PERIOD_S * random.unit(), random.idle()),
                    // The skin relaxes slowly.
                    p if p < 0.40 => {
                        let after_s = TOUCH_S - 0.5 * libm::log(random.unit().max(0.02));
                        (after_s, random.touched(column))
                    }
                    _ => (TOUCH_S * random.unit(), random.touched(column)),
                };
                events.push(random.event(contact_s + after_s, pixel));
            }
        }
        events.sort_by_key(|e| e.t_us);
        events
    })
}

/// Pixels of the events of one press within one period: `count` of them.
pub fn press_pixels(count: usize) -> impl Iterator<Item = (u16, u16)> {
    let mut random = Random::seeded(7);
    (0..count).map(move |_| match random.unit() {
        p if p < 0.09 => random.idle(),
        _ => random.touched(310.0),
    })
}

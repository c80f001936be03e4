//! Small valid sessions of many rigs, drawn from a seed: geometry, path, repetitions, clocks, signal strength, noise.

use skinrig_analysis::SessionInput;
use skinrig_model::{
    AnalysisSettings, CalibrationModel, CdEvent, LensModel, MarkKind, Point2, Polarity, PressRole,
    RigGeometry, SkinOutline, StereoGeometry,
};
pub(crate) use skinrig_planted::Memory;
use skinrig_planted::{PlantedPress, mark, press, timing};

/// A session with its parameters.
pub(crate) struct Session {
    pub input: SessionInput,
    pub events: Memory,
}

/// SplitMix64.
pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed)
    }

    pub(crate) fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    pub(crate) fn within(&mut self, half: f64) -> f64 {
        half * (2.0 * self.unit() - 1.0)
    }

    /// Roughly normal, unit variance.
    pub(crate) fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.unit()).sum::<f64>() - 6.0
    }

    pub(crate) fn below(&mut self, n: usize) -> usize {
        (self.unit() * n as f64) as usize
    }
}

/// Modifications of a seeded session.
#[derive(Clone, Copy, Default)]
pub(crate) struct SessionOptions {
    /// Index of the rig (`None`: from the seed).
    pub rig: Option<usize>,
    /// Number of locations along y instead of a path (0: a path).
    pub line_of: usize,
    /// With a trigger line (`None`: from the seed).
    pub line: Option<bool>,
    /// Clock drift of camera 1, ppm (`None`: within ±50).
    pub drift_ppm: Option<f64>,
    /// Minimum number of locations.
    pub places: usize,
    /// Amplitude of an error of the skin that bends slowly over it, columns.
    pub bent_px: f64,
    /// The same of an error in waves of 13 cm, whose direction and phase depend on the seed, columns.
    pub wavy_px: f64,
    /// Share of the session after which camera 2 sees the next press of the path instead.
    pub early_from: Option<f64>,
    /// Number of repetitions (0: from the seed).
    pub repetitions: u32,
    /// Standard deviation of what the skin displaces the columns at each location, alike in every repetition, px.
    pub uneven_px: f64,
    /// Shift of camera 2's columns in the second repetition, px.
    pub move_px: f64,
    /// Camera 2 sees the press this many rows later, so that every window has a burst, of another press.
    pub rows_late: usize,
    /// Camera 2 sends no events after this share of the session.
    pub dark_from: Option<f64>,
    /// Neither camera sends events after this share of the session.
    pub end_at: Option<f64>,
}

/// Camera positions of the rigs; each camera aims at the skin's centre.
const RIGS: [[(f64, f64); 2]; 4] = [
    [(45.0, -38.0), (45.0, 42.0)],
    [(52.0, -46.0), (50.0, 50.0)],
    [(-32.0, -36.0), (48.0, -40.0)],
    [(62.0, -20.0), (20.0, 58.0)],
];

fn camera(at: (f64, f64), skew_deg: f64, w: f64) -> skinrig_model::CameraModel {
    skinrig_model::CameraModel {
        position: Point2::new(at.0, at.1),
        aim: SkinOutline::PAPER.centre,
        skew_deg,
        lens: LensModel::Exponential {
            half_fov_deg: 60.0,
            w,
        },
    }
}

/// A meander of `n` x `n` locations, or as many on two circles, about the skin's centre.
fn path(random: &mut Random, least: usize) -> Vec<Point2> {
    let kinds = [3usize, 4, 5];
    let n = kinds[random.below(3)];
    let side = (least as f64).sqrt().ceil() as usize;
    let n = if n * n < least { side.max(5) } else { n };
    let c = SkinOutline::PAPER.centre;
    if random.below(4) == 0 && least < 20 {
        let on = |i: usize| {
            let angle = std::f64::consts::TAU * i as f64 / 8.0;
            let radius = if i < 8 { 22.0 } else { 11.0 };
            Point2::new(
                c.x_mm - 6.0 + radius * libm::cos(angle),
                c.y_mm + radius * libm::sin(angle),
            )
        };
        return (0..16).map(on).collect();
    }
    let pitch = 44.0 / (n - 1) as f64;
    let at = |i: usize| {
        let (row, step) = (i / n, i % n);
        let step = if row % 2 == 0 { step } else { n - 1 - step };
        Point2::new(
            c.x_mm - 28.0 + pitch * row as f64,
            c.y_mm - 22.0 + pitch * step as f64,
        )
    };
    (0..n * n).map(at).collect()
}

/// The valid session of this seed.
pub(crate) fn sound(seed: u64) -> Session {
    session(seed, SessionOptions::default())
}

/// The session of this seed with modifications.
pub(crate) fn session(seed: u64, wishes: SessionOptions) -> Session {
    let mut random = Random::new(seed);
    let drawn = random.below(4);
    let at = RIGS[wishes.rig.unwrap_or(drawn)];
    let nominal = StereoGeometry {
        cameras: at.map(|p| camera(p, 0.0, 0.0)),
    };
    let truth = StereoGeometry {
        cameras: at.map(|p| {
            let place = (p.0 + random.within(1.5), p.1 + random.within(1.5));
            camera(place, random.within(1.5), random.within(0.08))
        }),
    };
    let path = match wishes.line_of {
        0 => path(&mut random, wishes.places),
        n => (0..n)
            .map(|i| Point2::new(-12.0, -16.0 + 4.0 * i as f64))
            .collect(),
    };
    let drawn = 2 + random.below(2) as u32;
    let repetitions = if wishes.repetitions > 0 {
        wishes.repetitions
    } else {
        drawn
    };
    let line = wishes.line.unwrap_or(random.below(3) > 0);
    let strength = [60, 120, 200][random.below(3)];
    let miss = [0.0, 0.03, 0.08][random.below(3)];
    let period_s = 1.1 + 0.8 * random.unit();
    let idle_per_s = [50.0, 200.0, 500.0][random.below(3)];
    let hot = random.below(3) == 0;
    let clocks = [0, 1].map(|k| {
        let drift = wishes.drift_ppm.filter(|_| k == 0);
        let drawn = random.within(50.0);
        (4e6 + 1e7 * random.unit(), drift.unwrap_or(drawn))
    });
    let camera_us = |k: usize, host_s: f64| {
        let (offset, ppm): (f64, f64) = clocks[k];
        offset + host_s * 1e6 * (1.0 + ppm * 1e-6)
    };

    let mut planned: Vec<(PressRole, u32, u32, Point2, f64)> = (0..3)
        .map(|i| {
            (
                PressRole::Sync,
                0,
                0,
                SkinOutline::PAPER.centre,
                1.0 + f64::from(i),
            )
        })
        .collect();
    let mut begin_s = 6.0;
    for repetition in 0..repetitions {
        let role = if repetition == 0 {
            PressRole::Calibrate
        } else {
            PressRole::Score
        };
        for (place, at) in path.iter().enumerate() {
            planned.push((role, repetition, place as u32, *at, begin_s));
            begin_s += period_s;
        }
        begin_s += 1.0;
    }
    let end_s = begin_s + 1.0;
    let mut input = skinrig_planted::session(
        RigGeometry {
            outline: SkinOutline::PAPER,
            nominal,
            trigger_channel: line.then_some(0),
            trigger_delay_us: [0; 2],
        },
        AnalysisSettings {
            bootstrap_resamples: 0,
            calibration: CalibrationModel::None,
            study_presses: 0,
            ..AnalysisSettings::default()
        },
    );
    let mut uneven = Random::new(!seed);
    let uneven: Vec<[f64; 2]> = path
        .iter()
        .map(|_| [0, 1].map(|_| wishes.uneven_px * uneven.normal()))
        .collect();
    let mut events = [Vec::new(), Vec::new()];
    for (role, repetition, location, at, contact) in planned {
        let touch = touch(
            PlantedPress::new(role, repetition, location, at),
            contact,
            &mut random,
        );
        let id = press(&mut input, touch);
        if line {
            for (kind, t) in [
                (MarkKind::Contact, touch.timing.contact),
                (MarkKind::Release, touch.timing.release),
            ] {
                mark(&mut input, (kind, id), t, 500, |k| {
                    (camera_us(k, t.as_secs_f64()) + 5.0 * random.unit()).round() as u64
                });
            }
        }
        for (k, events) in events.iter_mut().enumerate() {
            let at = if k == 1 && role != PressRole::Sync {
                let early = wishes.early_from.is_some_and(|s| contact > s * end_s);
                path[(location as usize + wishes.rows_late + usize::from(early)) % path.len()]
            } else {
                at
            };
            let bent =
                wishes.bent_px * libm::sin(0.09 * at.x_mm + k as f64) * libm::cos(0.07 * at.y_mm);
            let wave = wave(seed, k, at);
            let Some(u) = truth.cameras[k].column_of_point(at) else {
                continue;
            };
            let late = |share: Option<f64>| share.is_some_and(|s| contact > s * end_s);
            if late(wishes.end_at) || (k == 1 && late(wishes.dark_from)) {
                continue;
            }
            let moved = if k == 1 && repetition == 1 {
                wishes.move_px
            } else {
                0.0
            };
            let missed = role != PressRole::Sync && random.unit() < miss;
            let skin = uneven[location as usize][k];
            let bent = bent + wishes.wavy_px * wave;
            let centre = u + moved + skin + bent + 3.0 * random.normal();
            for n in 0..if missed { 0 } else { strength } {
                let after = if 3 * n < 2 * strength {
                    0.1 * random.unit()
                } else {
                    0.3 + 0.15 * random.unit()
                };
                events.push(CdEvent {
                    t_us: camera_us(k, contact + after) as u64,
                    x: (centre + 8.0 * random.normal()).clamp(0.0, 639.0) as u16,
                    y: (270.0 + 6.0 * random.normal()) as u16,
                    polarity: Polarity::from_bit(n % 3 == 0),
                });
            }
        }
    }
    for (k, events) in events.iter_mut().enumerate() {
        let dark = (k == 1).then_some(wishes.dark_from).flatten();
        let until_s = end_s * dark.or(wishes.end_at).unwrap_or(1.0);
        let mut noise = |per_s: f64, at: Option<(u16, u16)>| {
            for _ in 0..(per_s * until_s) as usize {
                let drawn = (
                    (640.0 * random.unit()) as u16,
                    (480.0 * random.unit()) as u16,
                );
                let (x, y) = at.unwrap_or(drawn);
                events.push(CdEvent {
                    t_us: camera_us(k, until_s * random.unit()) as u64,
                    x,
                    y,
                    polarity: Polarity::from_bit(random.unit() < 0.5),
                });
            }
        };
        noise(idle_per_s, None);
        if hot {
            noise(15.0, Some((400, 250)));
        }
        skinrig_planted::sort(events);
    }
    Session {
        input,
        events: Memory {
            events,
            slice: 4096,
        },
    }
}

/// Height of a wave across the skin as a camera sees it, -1 to 1.
fn wave(seed: u64, camera: usize, at: Point2) -> f64 {
    let seed = seed as f64;
    let along_mm = at.x_mm * libm::sin(seed) + at.y_mm * libm::cos(seed);
    libm::sin(0.05 * along_mm + 1.7 * seed + 3.0 * camera as f64 * libm::sin(3.1 * seed))
}

/// The executed press: slightly late, slightly off its location.
fn touch(planned: PlantedPress, contact: f64, random: &mut Random) -> PlantedPress {
    let late = 0.005 * random.unit();
    let at = planned.at;
    PlantedPress {
        timing: timing(
            contact,
            [0.1, 0.1 + late, 0.3 + late, 0.45 + late, 0.6 + late],
        ),
        measured_at: Point2::new(
            at.x_mm + 0.02 * random.normal(),
            at.y_mm + 0.02 * random.normal(),
        ),
        measured_depth_mm: Some(2.0 + 0.02 * random.normal()),
        ..planned
    }
}

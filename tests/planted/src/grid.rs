//! A session of 25 locations in two repetitions: its plan, clocks, geometry and events.

use skinrig_analysis::SessionInput;
use skinrig_model::{
    AnalysisSettings, CdEvent, HostTime, MarkKind, Point2, Polarity, PressRole, RigGeometry,
    SkinOutline, StereoGeometry,
};

use crate::{Memory, PlantedPress, mark, press, timing};

/// Parameters of the true geometry, of model `full`.
pub const PLANTED: [f64; 8] = [43.0, -33.0, 47.5, 38.0, -1.2, 0.4, -0.11, 0.03];
/// Camera clocks: offset (µs) and drift (ppm).
pub const CLOCKS: [(f64, f64); 2] = [(4.2e6, 28.0), (17_592_186_044_416.0, -35.0)];

/// Seeded generator.
pub struct Random(pub u64);

impl Random {
    /// Uniform in [0, 1).
    pub fn unit(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
    /// Roughly normal, unit variance.
    pub fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.unit()).sum::<f64>() - 6.0
    }
}

/// Time of a camera's clock at a host time.
#[must_use]
pub fn camera_us(camera: usize, host_s: f64) -> f64 {
    let (offset, ppm) = CLOCKS[camera];
    offset + host_s * 1e6 * (1.0 + ppm * 1e-6)
}

/// Three sync presses, then 25 places in two repetitions: the first calibrates, the second scores.
#[must_use]
pub fn plan() -> Vec<(PressRole, u32, u32, Point2, f64)> {
    let centre = Point2::new(10.0, 2.0);
    let mut out: Vec<_> = (0..3)
        .map(|i| (PressRole::Sync, 0, 0, centre, 2.0 + f64::from(i)))
        .collect();
    for i in 0..50u32 {
        let place = i % 25;
        let at = Point2::new(
            -14.0 + 11.0 * f64::from(place / 5),
            -20.0 + 11.0 * f64::from(place % 5),
        );
        let role = if i < 25 {
            PressRole::Calibrate
        } else {
            PressRole::Score
        };
        out.push((role, i / 25, place, at, 7.0 + 1.75 * f64::from(i)));
    }
    out
}

/// What the cameras see of a press.
#[derive(Debug, Clone, Copy)]
pub struct Shape {
    /// Events per press and camera.
    pub events: u32,
    /// Standard deviation of the columns and rows of its events, px.
    pub spread_px: (f64, f64),
    /// Shift of the columns from contact to release, px.
    pub drift_px: f64,
    /// Background events per camera.
    pub background: u32,
}

impl Shape {
    /// 600 events, 8 by 6 px.
    pub const USUAL: Self = Self {
        events: 600,
        spread_px: (8.0, 6.0),
        drift_px: 0.0,
        background: 10_000,
    };

    /// A shape drawn by a seed.
    #[must_use]
    pub fn drawn(seed: u64) -> Self {
        let mut random = Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let mut between = |low: f64, high: f64| low + (high - low) * random.unit();
        // The first draws of nearby seeds are alike.
        (0..8).for_each(|_| _ = between(0.0, 1.0));
        Self {
            events: between(300.0, 1500.0) as u32,
            spread_px: (between(4.0, 16.0), between(4.0, 12.0)),
            drift_px: between(-6.0, 6.0),
            background: between(2_000.0, 30_000.0) as u32,
        }
    }
}

/// The session and its events, of the usual shape.
#[must_use]
pub fn session() -> (SessionInput, Memory) {
    session_of(7, &Shape::USUAL)
}

/// The session and its events: presses of this shape, and background.
///
/// # Panics
/// Never: all locations are in view of both cameras.
#[must_use]
pub fn session_of(seed: u64, shape: &Shape) -> (SessionInput, Memory) {
    let mut random = Random(seed);
    let planted = StereoGeometry::paper_like(PLANTED);
    let mut input = crate::session(
        RigGeometry {
            outline: SkinOutline::PAPER,
            nominal: StereoGeometry::PAPER,
            trigger_channel: Some(0),
            trigger_delay_us: [0; 2],
        },
        AnalysisSettings {
            bootstrap_resamples: 200,
            ..AnalysisSettings::default()
        },
    );
    let mut events = [Vec::new(), Vec::new()];
    for (role, repetition, location, at, contact) in plan() {
        let touch = PlantedPress {
            timing: timing(contact, [0.1, 0.1, 0.3, 0.45, 0.6]),
            ..PlantedPress::new(role, repetition, location, at)
        };
        let id = press(&mut input, touch);
        for (kind, t) in [
            (MarkKind::Contact, contact),
            (MarkKind::Release, contact + 0.45),
        ] {
            let sent = HostTime::from_secs_f64(t);
            mark(&mut input, (kind, id), sent, 500, |k| {
                camera_us(k, t).round() as u64
            });
        }
        for (k, events) in events.iter_mut().enumerate() {
            let u = planted.cameras[k]
                .column_of_point(at)
                .expect("all locations are in view");
            for n in 0..shape.events {
                let after = if 3 * n < 2 * shape.events {
                    0.1 * random.unit()
                } else {
                    0.3 + 0.15 * random.unit()
                };
                let u = u + shape.drift_px * after / 0.45;
                let x = (u + shape.spread_px.0 * random.normal()).round();
                let y = (270.0 + shape.spread_px.1 * random.normal()).round();
                events.push(CdEvent {
                    t_us: camera_us(k, contact + after) as u64,
                    x: x.clamp(0.0, 639.0) as u16,
                    y: y as u16,
                    polarity: Polarity::from_bit(n % 3 == 0),
                });
            }
        }
    }
    for (k, events) in events.iter_mut().enumerate() {
        for _ in 0..shape.background {
            let t = camera_us(k, 97.0 * random.unit());
            let (x, y) = (640.0 * random.unit(), 480.0 * random.unit());
            let polarity = Polarity::from_bit(random.unit() < 0.5);
            events.push(CdEvent {
                t_us: t as u64,
                x: x as u16,
                y: y as u16,
                polarity,
            });
        }
        crate::sort(events);
        // Out of order by a few µs, as a row-wise readout is.
        for i in (0..events.len() - 1).step_by(5) {
            if events[i + 1].t_us - events[i].t_us < 20 {
                events.swap(i, i + 1);
            }
        }
    }
    (
        input,
        Memory {
            events,
            slice: 1000,
        },
    )
}

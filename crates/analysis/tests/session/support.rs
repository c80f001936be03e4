//! A planted session: its plan, its clocks, its geometry and its events.

use skinrig_analysis::{EventSource, SessionInput};
use skinrig_model::{
    AnalysisSettings, AttemptId, CameraId, CdEvent, HostTime, Mark, MarkKind, PlannedPress, Point2,
    Polarity, PressId, PressOutcome, PressRole, PressTiming, PressVerdict, PulseTrain, RigGeometry,
    SentMark, SkinOutline, StereoGeometry, TriggerEdge,
};

pub const PLANTED: [f64; 8] = [43.0, -33.0, 47.5, 38.0, -1.2, 0.4, -0.11, 0.03];
/// Camera clocks: offset (µs) and drift (ppm).
pub const CLOCKS: [(f64, f64); 2] = [(4.2e6, 28.0), (17_592_186_044_416.0, -35.0)];

pub struct Memory {
    pub events: [Vec<CdEvent>; 2],
    pub slice: usize,
}

impl EventSource for Memory {
    fn for_each_slice(
        &self,
        camera: CameraId,
        each: &mut dyn FnMut(&[CdEvent]),
    ) -> Result<(), String> {
        self.events[camera.index()]
            .chunks(self.slice)
            .for_each(each);
        Ok(())
    }
}

pub struct Random(pub u64);

impl Random {
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

pub fn camera_us(camera: usize, host_s: f64) -> f64 {
    let (offset, ppm) = CLOCKS[camera];
    offset + host_s * 1e6 * (1.0 + ppm * 1e-6)
}

/// Three sync presses, then 25 places in two repetitions: the first calibrates, the second scores.
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

pub fn session() -> (SessionInput, Memory) {
    let h = HostTime::from_secs_f64;
    let mut random = Random(7);
    let planted = StereoGeometry::paper_like(PLANTED);
    let mut input = SessionInput {
        planned: Vec::new(),
        outcomes: Vec::new(),
        earlier: Vec::new(),
        edges: [Vec::new(), Vec::new()],
        marks: Vec::new(),
        gaps: [Vec::new(), Vec::new()],
        box_reports: Vec::new(),
        pose_interval_us: None,
        crossing_se_us: None,
        legs: Vec::new(),
        rig: RigGeometry {
            outline: SkinOutline::PAPER,
            nominal: StereoGeometry::PAPER,
            trigger_channel: Some(0),
        },
        settings: AnalysisSettings {
            bootstrap_resamples: 200,
            ..AnalysisSettings::default()
        },
    };
    let mut events = [Vec::new(), Vec::new()];
    for (i, (role, repetition, location, at, contact)) in plan().into_iter().enumerate() {
        let id = PressId(i as u32);
        input.planned.push(PlannedPress {
            id,
            role,
            repetition,
            location,
            at,
            depth_mm: 2.0,
        });
        let timing = PressTiming {
            approach: h(contact - 0.1),
            contact: h(contact),
            at_depth: h(contact + 0.1),
            retract: h(contact + 0.3),
            release: h(contact + 0.45),
            clear: h(contact + 0.6),
        };
        input.outcomes.push(Some(PressOutcome {
            attempt: AttemptId {
                press: id,
                number: 1,
            },
            verdict: PressVerdict::Valid,
            timing: Some(timing),
            measured_at: Some(at),
            measured_depth_mm: Some(2.0),
            touched_mm: None,
            peak_force_n: None,
            scheduled: false,
        }));
        for (kind, t) in [
            (MarkKind::Contact, contact),
            (MarkKind::Release, contact + 0.45),
        ] {
            let mark = Mark { kind, press: id };
            input.marks.push(SentMark {
                mark,
                t: h(t),
                uncertainty_ns: 500,
            });
            for (k, edges) in input.edges.iter_mut().enumerate() {
                for (rise, width) in PulseTrain::new(mark).unwrap().pulses() {
                    for (after, rising) in [(rise, true), (rise + width, false)] {
                        let t_us = camera_us(k, t).round() as u64 + after;
                        edges.push(TriggerEdge {
                            t_us,
                            channel: 0,
                            rising,
                        });
                    }
                }
            }
        }
        for (k, events) in events.iter_mut().enumerate() {
            let u = planted.cameras[k].column_of_point(at).unwrap();
            for n in 0..600 {
                let after = if n < 400 {
                    0.1 * random.unit()
                } else {
                    0.3 + 0.15 * random.unit()
                };
                let x = (u + 8.0 * random.normal()).round().clamp(0.0, 639.0);
                let y = (270.0 + 6.0 * random.normal()).round();
                events.push(CdEvent {
                    t_us: camera_us(k, contact + after) as u64,
                    x: x as u16,
                    y: y as u16,
                    polarity: Polarity::from_bit(n % 3 == 0),
                });
            }
        }
    }
    for (k, events) in events.iter_mut().enumerate() {
        for _ in 0..10_000 {
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
        events.sort_by_key(|e| e.t_us);
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

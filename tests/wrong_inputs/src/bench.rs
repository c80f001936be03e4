//! Owns small recordings: presses, camera streams, and the accompanying documents.

use skinrig_analysis::SessionInput;
use skinrig_model::{
    CalibrationModel, CameraModel, CdEvent, LensModel, MarkKind, Point2, Polarity, PressRole,
    RigGeometry, SENSOR_HEIGHT, SENSOR_WIDTH, SkinOutline, StereoGeometry,
};
use skinrig_planted::{Memory, PlantedPress, mark, press};
use skinrig_protocol::Schedule;

/// SplitMix64.
#[derive(Debug, Clone)]
pub struct Random(u64);

impl Random {
    /// From a seed.
    #[must_use]
    pub const fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// Uniform in 0..1.
    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform within `half` of 0.
    pub fn within(&mut self, half: f64) -> f64 {
        half * (2.0 * self.unit() - 1.0)
    }

    /// Roughly normal, unit variance.
    pub fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.unit()).sum::<f64>() - 6.0
    }
}

/// An executed press.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExecutedPress {
    /// Position, skin frame.
    pub at: Point2,
    /// Contact, s on the host clock.
    pub contact_s: f64,
}

/// Orientation of a camera's image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Picture {
    /// As projected by the lens.
    Upright,
    /// Columns mirrored.
    Mirrored,
    /// Rotated by 180 degrees.
    UpsideDown,
    /// Rotated by 90 degrees.
    OnItsSide,
}

/// Sync presses in the schedule.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sync {
    /// Number of presses.
    pub count: u32,
    /// Interval, s.
    pub interval_s: f64,
    /// Pause before the path, s.
    pub pause_s: f64,
}

/// Schedule of a recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Timetable {
    /// Sync presses.
    pub sync: Sync,
    /// Period of the presses, s.
    pub period_s: f64,
    /// Rows of the table.
    pub presses: u32,
    /// Rows used, from the first.
    pub used: u32,
    /// Repetitions.
    pub repetitions: u32,
    /// Pause between repetitions, s.
    pub pause_s: f64,
}

/// Times of the paper's press relative to contact, s: approach (before), at depth, retract, release, clear.
pub(crate) const MOMENTS_S: [f64; 5] = [0.175, 0.175, 0.325, 0.55, 0.725];
/// Contact of the first press of a recording, s after time 0 of its schedule.
pub(crate) const FIRST_CONTACT_S: f64 = MOMENTS_S[0];
/// Columns and rows of the path.
const LINES: usize = 5;
const LINE: usize = 5;

/// What was executed, and what the documents claim.
#[derive(Debug, Clone)]
pub struct Bench {
    /// Seed of the noise.
    pub seed: u64,
    /// Executed presses in time order, sync presses first.
    pub pressed: Vec<ExecutedPress>,
    /// True cameras.
    pub cameras: StereoGeometry,
    /// Camera time at host time 0, µs, and drift, ppm.
    pub clocks: [(f64, f64); 2],
    /// Source camera of each stream.
    pub feeds: [usize; 2],
    /// Orientation of each stream's image.
    pub pictures: [Picture; 2],
    /// Host times between which a stream is silent, s.
    pub silent_s: [Vec<(f64, f64)>; 2],
    /// Background, events per second and camera, all rows.
    pub noise_per_s: f64,
    /// From this time on the columns of camera 2 are shifted by this many px.
    pub nudged: Option<(f64, f64)>,

    /// Schedule.
    pub timetable: Timetable,
    /// Table of positions, read as mm in the skin frame.
    pub table: Vec<Point2>,
    /// Rig description.
    pub rig: RigGeometry,
    /// Rows of the crop.
    pub crop: Option<[(u16, u16); 2]>,
    /// True if the analysis chooses the camera model, which is the default.
    pub chosen_model: bool,
    /// A robot session with a trigger line instead of an import: measured positions, and a plan.
    pub robot: Option<Robot>,
}

/// Additional properties of a robot session.
#[derive(Debug, Clone, Default)]
pub struct Robot {
    /// The plan, if it differs from the measurement.
    pub planned: Option<Vec<Point2>>,
    /// True if the marks of each camera arrive at the other one.
    pub wires_crossed: bool,
    /// Share of the session after which no mark arrives.
    pub line_cut: Option<f64>,
}

fn camera(at: (f64, f64), skew_deg: f64, w: f64) -> CameraModel {
    CameraModel {
        position: Point2::new(at.0, at.1),
        aim: SkinOutline::PAPER.centre,
        skew_deg,
        lens: LensModel::Exponential {
            half_fov_deg: 60.0,
            w,
        },
    }
}

/// Camera positions near the published ones.
const DRAWN: [(f64, f64); 2] = [(45.0, -38.0), (45.0, 44.0)];

impl Bench {
    /// A faultless recording of two repetitions of a meander with 25 locations and three sync presses, with its documents.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self::of(
            seed,
            Timetable {
                sync: Sync {
                    count: 3,
                    interval_s: 1.0,
                    pause_s: 3.0,
                },
                period_s: 2.0,
                presses: (LINES * LINE) as u32,
                used: (LINES * LINE) as u32,
                repetitions: 2,
                pause_s: 3.0,
            },
            path(),
        )
    }

    /// Same with another schedule and path.
    #[must_use]
    pub fn of(seed: u64, timetable: Timetable, path: Vec<Point2>) -> Self {
        let mut random = Random::new(seed ^ 0x5eed);
        let cameras = StereoGeometry {
            cameras: DRAWN.map(|p| {
                let place = (p.0 + random.within(2.5), p.1 + random.within(2.5));
                camera(place, random.within(1.5), random.within(0.08))
            }),
        };
        let clocks = [0, 1].map(|_| (4e6 + 1e7 * random.unit(), random.within(40.0)));
        Self {
            seed,
            pressed: timetable.pressed(&path),
            cameras,
            clocks,
            feeds: [0, 1],
            pictures: [Picture::Upright; 2],
            silent_s: [Vec::new(), Vec::new()],
            noise_per_s: 300.0,
            nudged: None,
            timetable,
            table: path,
            rig: RigGeometry {
                outline: SkinOutline::PAPER,
                nominal: StereoGeometry {
                    cameras: DRAWN.map(|p| camera(p, 0.0, 0.0)),
                },
                trigger_channel: None,
                trigger_delay_us: [0; 2],
            },
            crop: None,
            chosen_model: false,
            robot: None,
        }
    }

    /// A faultless robot session with a trigger line.
    #[must_use]
    pub fn robot(seed: u64) -> Self {
        let mut bench = Self::new(seed);
        bench.rig.trigger_channel = Some(0);
        bench.robot = Some(Robot::default());
        bench
    }

    /// End of the recording, s on the host clock.
    #[must_use]
    pub fn end_s(&self) -> f64 {
        self.pressed.last().map_or(0.0, |p| p.contact_s) + 3.0
    }

    /// Time of camera `k` at a host time, µs.
    #[must_use]
    pub fn camera_us(&self, k: usize, host_s: f64) -> f64 {
        let (offset, ppm) = self.clocks[k];
        offset + host_s * 1e6 * (1.0 + ppm * 1e-6)
    }

    /// Host time, s, at a time of camera `k`, µs.
    #[must_use]
    pub fn host_s(&self, k: usize, camera_us: f64) -> f64 {
        let (offset, ppm) = self.clocks[k];
        (camera_us - offset) * 1e-6 / (1.0 + ppm * 1e-6)
    }

    /// Events of both streams.
    #[must_use]
    pub fn events(&self) -> Memory {
        Memory {
            events: [0, 1].map(|k| self.stream(k)),
            slice: 4096,
        }
    }

    /// A stream comes from one camera, on that camera's clock.
    fn stream(&self, k: usize) -> Vec<CdEvent> {
        let camera = self.feeds[k];
        let mut random = Random::new(self.seed ^ (0xca3e_u64 << camera));
        let model = &self.cameras.cameras[camera];
        let mut all: Vec<(f64, f64, f64, bool)> = Vec::new();
        for pressed in &self.pressed {
            let Some(u) = model.column_of_point(pressed.at) else {
                continue;
            };
            let nudge = self
                .nudged
                .filter(|(from, _)| camera == 1 && pressed.contact_s >= *from)
                .map_or(0.0, |(_, px)| px);
            // Errors of a skin are correlated between neighbouring locations, with a small random part.
            let bias = 5.0 * libm::sin(pressed.at.x_mm / 11.0 + 2.0 * camera as f64)
                + 4.0 * libm::sin(pressed.at.y_mm / 9.0);
            let centre = u + bias + nudge + 3.0 * random.normal();
            for n in 0..120 {
                let on = n % 3 != 0;
                let (from, to) = if on {
                    (0.0, MOMENTS_S[1])
                } else {
                    (MOMENTS_S[2], MOMENTS_S[3])
                };
                let t = pressed.contact_s + from + (to - from) * random.unit();
                let row = 270.0 + 8.0 * random.normal();
                all.push((t, centre + 8.0 * random.normal(), row, on));
            }
        }
        let from_s = -1.5;
        let length_s = self.end_s() - from_s;
        for _ in 0..(self.noise_per_s * length_s) as usize {
            let t = from_s + length_s * random.unit();
            let (u, v) = (640.0 * random.unit(), 480.0 * random.unit());
            all.push((t, u, v, random.unit() < 0.5));
        }
        let recorded = |t: f64| !self.silent_s[k].iter().any(|(a, b)| (*a..*b).contains(&t));
        let mut events: Vec<CdEvent> = all
            .into_iter()
            .filter(|e| recorded(e.0))
            .map(|(t, u, v, on)| {
                let (u, v) = turned(self.pictures[k], u, v);
                CdEvent {
                    t_us: self.camera_us(camera, t) as u64,
                    x: u.clamp(0.0, f64::from(SENSOR_WIDTH - 1)) as u16,
                    y: v.clamp(0.0, f64::from(SENSOR_HEIGHT - 1)) as u16,
                    polarity: Polarity::from_bit(on),
                }
            })
            .collect();
        events.sort_by_key(|e| e.t_us);
        events
    }

    /// Input of the analysis besides the events.
    ///
    /// # Errors
    /// Why the schedule or the table is rejected.
    pub fn input(&self) -> Result<SessionInput, String> {
        let schedule = Schedule::parse("case", self.schedule().as_bytes(), &[])
            .map_err(|found| found.render(false))?;
        let (planned, times) = schedule.planned(&self.table).map_err(|e| e.to_string())?;
        let mut settings = schedule.analysis.clone();
        settings.bootstrap_resamples = 200;
        // Choosing a model takes most of the time and does not affect these cases.
        if !self.chosen_model {
            settings.calibration = CalibrationModel::PositionsSkews;
        }
        settings.study_presses = 0;
        let mut input = skinrig_planted::session(self.rig, settings);
        let mut random = Random::new(self.seed ^ 0x0b07);
        for (row, (plan, time)) in planned.iter().zip(&times).enumerate() {
            let mut touch = PlantedPress::new(
                plan.role,
                plan.repetition.index(),
                plan.location.index(),
                plan.at,
            );
            touch.timing = schedule.phases.at(*time);
            touch.scheduled = self.robot.is_none();
            if let Some(robot) = &self.robot {
                if plan.role != PressRole::Sync {
                    let places = robot.planned.as_ref().unwrap_or(&self.table);
                    touch.at = places[plan.location.index() as usize];
                }
                touch.measured_at = Point2::new(
                    plan.at.x_mm + 0.02 * random.normal(),
                    plan.at.y_mm + 0.02 * random.normal(),
                );
            }
            let id = press(&mut input, touch);
            if !schedule.is_used(plan)
                && let Some(outcome) = &mut input.outcomes[row]
            {
                outcome.verdict =
                    skinrig_model::PressVerdict::Excluded(skinrig_model::ExcludedReason::NotUsed {
                        presses_used: "others".to_owned(),
                    });
            }
            if let Some(robot) = &self.robot {
                self.marks(&mut input, robot, id, touch, &mut random);
            }
        }
        Ok(input)
    }

    fn marks(
        &self,
        input: &mut SessionInput,
        robot: &Robot,
        id: skinrig_model::PressId,
        touch: PlantedPress,
        random: &mut Random,
    ) {
        let cut_s = robot.line_cut.unwrap_or(2.0) * self.end_s();
        for (kind, t) in [
            (MarkKind::Contact, touch.timing.contact),
            (MarkKind::Release, touch.timing.release),
        ] {
            let host_s = t.as_secs_f64();
            mark(input, (kind, id), t, 500, |k| {
                let k = if robot.wires_crossed { 1 - k } else { k };
                let camera = self.feeds[k];
                (self.camera_us(camera, host_s) + 5.0 * random.unit()).round() as u64
            });
            if host_s > cut_s {
                for edges in &mut input.edges {
                    let none = edges.len();
                    edges.truncate(none.saturating_sub(64));
                }
            }
        }
    }

    /// The schedule as file content.
    #[must_use]
    pub fn schedule(&self) -> String {
        let t = &self.timetable;
        let evaluation = if t.repetitions > 1 {
            format!(
                "{{repetitions: {{calibrate: [1], score: [2-{}]}}}}",
                t.repetitions
            )
        } else {
            "{alternate: {calibrate_every: 2}}".to_owned()
        };
        let [before, at_depth, retract, release, clear] = MOMENTS_S;
        let place = |p: Point2| format!("[{} mm, {} mm]", p.x_mm, p.y_mm);
        let [one, two] = self.rig.nominal.cameras;
        let crop = self.crop.map_or_else(String::new, |[a, b]| {
            format!(
                "\nanalysis: {{crop: {{camera1: [{} px, {} px], camera2: [{} px, {} px]}}}}",
                a.0, a.1, b.0, b.1
            )
        });
        let centre = self.rig.outline.centre;
        // Time 0 of a schedule is the start of the first approach.
        format!(
            "skinrig_schedule: 1\nname: case\noperator: tests\nprototype: {{id: none}}\n\
             sync: {{count: {}, interval: {} s, pause_after: {} s, at: {}}}\nperiod: {} s\n\
             presses_per_repetition: {}\npresses_used: {}\nrepetitions: {}\npause_between_repetitions: {} s\ndepth: 2 mm\n\
             phases: {{approach: 0 ms, contact: {} s, at_depth: {} s, retract: {} s, release: {} s, clear: {} s}}\n\
             csv: {{unit: mm, skip_blank_rows: true}}\nevaluation: {evaluation}\n\
             rig:\n  outline: paper\n  camera1: {{position: {}, half_field_of_view: 60 deg}}\n  \
             camera2: {{position: {}, half_field_of_view: 60 deg}}{crop}\n",
            t.sync.count,
            t.sync.interval_s,
            t.sync.pause_s,
            place(centre),
            t.period_s,
            t.presses,
            t.used,
            t.repetitions,
            t.pause_s,
            before,
            before + at_depth,
            before + retract,
            before + release,
            before + clear,
            place(one.position),
            place(two.position),
        )
    }

    /// The press in progress at a host time, if any.
    #[must_use]
    pub(crate) fn pressed_at(&self, host_s: f64) -> Option<Point2> {
        let near = self.pressed.iter().min_by(|a, b| {
            let off = |p: &ExecutedPress| (p.contact_s - host_s).abs();
            off(a).total_cmp(&off(b))
        })?;
        ((near.contact_s - host_s).abs() < 0.45).then_some(near.at)
    }
}

impl Timetable {
    /// Presses of this schedule along a path.
    #[must_use]
    pub fn pressed(&self, path: &[Point2]) -> Vec<ExecutedPress> {
        let sync = (0..self.sync.count).map(|k| ExecutedPress {
            at: SkinOutline::PAPER.centre,
            contact_s: FIRST_CONTACT_S + f64::from(k) * self.sync.interval_s,
        });
        let mut all: Vec<ExecutedPress> = sync.collect();
        let first = FIRST_CONTACT_S
            + f64::from(self.sync.count.saturating_sub(1)) * self.sync.interval_s
            + if self.sync.count > 0 {
                self.sync.pause_s
            } else {
                0.0
            };
        let repetition_s = f64::from(self.presses) * self.period_s + self.pause_s;
        for repetition in 0..self.repetitions {
            for (i, at) in path.iter().enumerate() {
                all.push(ExecutedPress {
                    at: *at,
                    contact_s: first
                        + f64::from(repetition) * repetition_s
                        + i as f64 * self.period_s,
                });
            }
        }
        all
    }
}

/// A meander over the part of the skin that both cameras see.
#[must_use]
pub fn path() -> Vec<Point2> {
    meander(LINES, LINE, 10.0)
}

/// A meander of lines along y with this pitch, mm.
#[must_use]
pub fn meander(lines: usize, line: usize, pitch_mm: f64) -> Vec<Point2> {
    let at = |i: usize| {
        let (row, step) = (i / line, i % line);
        let step = if row % 2 == 0 { step } else { line - 1 - step };
        Point2::new(
            -22.0 + pitch_mm * row as f64,
            2.0 + pitch_mm * (step as f64 - 0.5 * (line - 1) as f64),
        )
    };
    (0..lines * line).map(at).collect()
}

fn turned(picture: Picture, u: f64, v: f64) -> (f64, f64) {
    let (width, height) = (f64::from(SENSOR_WIDTH), f64::from(SENSOR_HEIGHT));
    match picture {
        Picture::Upright => (u, v),
        Picture::Mirrored => (width - 1.0 - u, v),
        Picture::UpsideDown => (width - 1.0 - u, height - 1.0 - v),
        Picture::OnItsSide => (v * width / height, u * height / width),
    }
}

//! Simulates a session with one planted cause: plan, clocks and events of the geometric level,
//! without devices.

use skinrig_analysis::{Analysis, SessionInput, analyze};
use skinrig_compare::{Session, SessionFacts, Subject};
use skinrig_model::{
    AnalysisSettings, CalibrationModel, CameraId, CdEvent, HostTime, MarkKind, Point2, Point3,
    PressRole, PressTiming, RigGeometry, SimLevel, Skin, StereoGeometry,
};
use skinrig_planted::{Memory, PlantedPress, mark, press};
use skinrig_sim::SimConfig;
use skinrig_sim::geometric::GeometricModel;
use skinrig_sim::scene::{GRID_NS, PixelModel, TipSample};

/// Period of the presses, ms.
const PERIOD_MS: i64 = 1_400;
/// Start of the first press, ms. The tip moves down for 100 ms, stays for 100 ms and moves up for
/// 100 ms.
const FIRST_MS: i64 = 600;
const SIDE: u32 = 5;
const DEPTH_MM: f64 = 2.0;

/// Planted defect of a skin, its cameras or its robot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum PlantedCause {
    /// Nothing.
    Nothing,
    /// Camera 1 was moved after the calibration: along x (mm) and rotated (degrees).
    Camera(f64, f64),
    /// Factor on the events per mm of travel.
    Signal(f64),
    /// Factor on the background events.
    Noise(f64),
    /// Standard deviation of the halo about the tip, mm.
    Spread(f64),
    /// Standard deviation of the robot's position about the measured one, per axis, mm.
    Robot(f64),
    /// The analysis uses one in this many events.
    Settings(u32),
}

/// Seeded, approximately normal numbers.
pub(crate) struct NoiseSource(pub u64);

impl NoiseSource {
    fn unit(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.unit()).sum::<f64>() - 6.0
    }
}

/// A simulated session that can be analysed repeatedly.
pub(crate) struct SimulatedSession {
    input: SessionInput,
    events: Memory,
    facts: SessionFacts,
}

/// Records a session: one calibration repetition, two scored ones.
pub(crate) fn record(seed: u64, plant: PlantedCause) -> SimulatedSession {
    let mut config = SimConfig::new(seed, SimLevel::Geometric);
    let g = &mut config.geometric;
    // Half of the published events with a shorter decay: faster, and with less carry-over between presses.
    g.relax_s = 0.2;
    for rate in [
        &mut g.press_per_mm,
        &mut g.release_per_mm,
        &mut g.relax_per_mm,
    ] {
        *rate /= 2.0;
        if let PlantedCause::Signal(times) = plant {
            *rate *= times;
        }
    }
    g.dead_share = 0.0;
    match plant {
        PlantedCause::Noise(times) => g.background_hz *= times,
        PlantedCause::Spread(halo_mm) => g.halo_mm = halo_mm,
        _ => {}
    }
    let truth = config.true_geometry();
    let mut moved = truth;
    if let PlantedCause::Camera(mm, deg) = plant {
        moved.cameras[0].position.x_mm += mm;
        moved.cameras[0].skew_deg += deg;
    }
    let mut noise = NoiseSource(seed ^ 0x5eed);
    let mut input = input(&config, plant);
    let mut pressed = Vec::new();
    for i in 0..3 * SIDE * SIDE {
        let place = i % (SIDE * SIDE);
        let at = Point2::new(
            -14.0 + 11.0 * f64::from(place / SIDE),
            -20.0 + 11.0 * f64::from(place % SIDE),
        );
        // The robot reaches its target except for an unmeasured scatter.
        let scatter = if let PlantedCause::Robot(mm) = plant {
            mm
        } else {
            0.0
        };
        let measured = Point2::new(
            at.x_mm + 0.02 * noise.normal() + scatter * noise.normal(),
            at.y_mm + 0.02 * noise.normal() + scatter * noise.normal(),
        );
        pressed.push(at);
        add(&mut input, i, at, measured);
    }
    let events = [0, 1].map(|k| events(&config, [&truth, &moved], &pressed, k));
    SimulatedSession {
        input,
        events: Memory {
            events,
            slice: usize::MAX,
        },
        facts: SessionFacts {
            file: format!("{seed}.session.sqlite"),
            session_id: format!("{seed:032x}"),
            prototype: format!("{plant:?}"),
            rig_kind: "simulated".into(),
            origin: Some("simulated".into()),
            rig_name: "simulated (geometric)".into(),
            ..SessionFacts::default()
        },
    }
}

impl SimulatedSession {
    /// Analyses the session as a skin, with its own settings or another thinning.
    pub(crate) fn skin(&self, letter: char, thinning: Option<u32>) -> Subject {
        let mut input = self.input.clone();
        input.settings.thinning = thinning.unwrap_or(input.settings.thinning);
        let analysis: Analysis = analyze(&input, &self.events).unwrap();
        let session = Session {
            facts: self.facts.clone(),
            analysis,
        };
        Subject {
            letter,
            name: self.facts.prototype.clone(),
            sessions: vec![session],
        }
    }
}

fn input(config: &SimConfig, plant: PlantedCause) -> SessionInput {
    let rig = RigGeometry {
        outline: config.outline,
        nominal: config.nominal,
        trigger_channel: Some(0),
        trigger_delay_us: [0; 2],
    };
    let settings = AnalysisSettings {
        bootstrap_resamples: 2,
        study_presses: 0,
        calibration: CalibrationModel::Full,
        thinning: if let PlantedCause::Settings(n) = plant {
            n
        } else {
            1
        },
        // Planted noise shall matter: the analysis keeps it out of the clusters otherwise.
        background_margin: 0.0,
        ..AnalysisSettings::default()
    };
    skinrig_planted::session(rig, settings)
}

fn contact_ms(press: u32) -> i64 {
    FIRST_MS + i64::from(press) * PERIOD_MS
}

fn add(input: &mut SessionInput, number: u32, at: Point2, measured: Point2) {
    let (repetition, location) = (number / (SIDE * SIDE), number % (SIDE * SIDE));
    let role = if repetition == 0 {
        PressRole::Calibrate
    } else {
        PressRole::Score
    };
    let t = |ms: i64| HostTime((contact_ms(number) + ms) * 1_000_000);
    let timing = PressTiming {
        approach: t(-50),
        contact: t(0),
        at_depth: t(100),
        retract: t(200),
        release: t(300),
        clear: t(350),
    };
    let touch = PlantedPress {
        depth_mm: DEPTH_MM,
        timing,
        measured_at: measured,
        measured_depth_mm: Some(DEPTH_MM),
        ..PlantedPress::new(role, repetition, location, at)
    };
    let id = press(input, touch);
    for (kind, t) in [
        (MarkKind::Contact, timing.contact),
        (MarkKind::Release, timing.release),
    ] {
        mark(input, (kind, id), t, 500, |_| (t.0 / 1_000) as u64);
    }
}

/// Events of camera `k`, before and after the camera moved.
fn events(
    config: &SimConfig,
    geometry: [&StereoGeometry; 2],
    pressed: &[Point2],
    k: usize,
) -> Vec<CdEvent> {
    let mut scene = config.scene(CameraId::ALL[k]);
    let model = |scene: &_| GeometricModel::new(scene, &config.geometric);
    scene.camera = geometry[0].cameras[k];
    let mut pixels = model(&scene);
    let moved_at = (SIDE * SIDE) as usize;
    let mut out = Vec::new();
    for (i, at) in pressed.iter().enumerate() {
        if i == moved_at && geometry[0] != geometry[1] {
            scene.camera = geometry[1].cameras[k];
            pixels = model(&scene);
        }
        let from = contact_ms(i as u32) - FIRST_MS.min(PERIOD_MS - 400);
        let tips: Vec<TipSample> = (from..from + PERIOD_MS)
            .map(|ms| {
                let after = (ms - contact_ms(i as u32)) as f64;
                let down =
                    (after / 100.0).clamp(0.0, 1.0) - ((after - 200.0) / 100.0).clamp(0.0, 1.0);
                let z = if (0.0..=300.0).contains(&after) {
                    -DEPTH_MM * down
                } else {
                    2.0
                };
                let position: Point3<Skin> = Point3::new(at.x_mm, at.y_mm, z);
                TipSample {
                    t_ns: ms * GRID_NS,
                    position,
                }
            })
            .collect();
        pixels.advance(&tips, &mut out);
    }
    let mut events: Vec<CdEvent> = out
        .iter()
        .map(|e| CdEvent {
            t_us: (e.t_ns / 1_000) as u64,
            x: e.x,
            y: e.y,
            polarity: e.polarity,
        })
        .collect();
    events.sort_by_key(|e| e.t_us);
    events
}

//! Figures of the scene `paper` beside the published ones, and what each of its parts changes.
//!
//! Presses as in `protocols/paper.yaml`, in memory: the robot moves exactly, and the clocks are true.

use skinrig_analysis::{Analysis, SessionInput, analyze};
use skinrig_model::published;
use skinrig_model::{
    AnalysisSettings, CalibrationModel, CameraId, CdEvent, CentroidRule, HostTime, Locator,
    MarkKind, Point2, Point3, PressRole, RigGeometry, ScenePart, SimLevel, ThresholdRule,
    WindowAnchor,
};
use skinrig_planted::{Memory, PlantedPress, mark, press, timing};
use skinrig_sim::SimConfig;
use skinrig_sim::optical::{OpticalModel, PARAMETERS, Parameter, Parts};
use skinrig_sim::scene::{GRID_NS, PixelModel, TipSample};

const PERIOD_MS: f64 = 868e3 / 289.0;
/// Contact after the start of a press's period, ms.
const CONTACT_MS: f64 = 1_200.0;
const DEPTH_MM: f64 = 2.0;
const SPEED_MM_S: f64 = 20.0;
/// From contact to release, ms: the paper's 0.55 s.
const TOUCH_MS: f64 = 550.0;
const MOVE_MS: f64 = 1e3 * DEPTH_MM / SPEED_MM_S;
const HEIGHT_MM: f64 = 3.0;

/// A location of the published meander.
fn location(k: usize) -> Point2 {
    let (line, row) = (k / 17, k % 17);
    let row = if line.is_multiple_of(2) {
        row
    } else {
        16 - row
    };
    Point2::new(-22.0 + 4.0 * line as f64, -30.0 + 4.0 * row as f64)
}

/// Height of the tip `ms` after contact, mm.
fn height_mm(ms: f64) -> f64 {
    let down = -ms * SPEED_MM_S / 1e3;
    let up = (ms - TOUCH_MS) * SPEED_MM_S / 1e3;
    down.max(up).clamp(-DEPTH_MM, HEIGHT_MM)
}

/// A session of the scene with these parts.
struct Scene {
    input: SessionInput,
    events: Memory,
    /// Events per second, both cameras, all rows, in the last 0.4 s before the tip approaches.
    idle_all_rows_per_s: f64,
}

impl Scene {
    fn simulate(seed: u64, parts: &[ScenePart], repetitions: usize, locations: usize) -> Self {
        let mut config = SimConfig::new(seed, SimLevel::Optical);
        config.optical.parts = Parts::of_paper(parts);
        let rig = RigGeometry {
            outline: config.outline,
            nominal: config.nominal,
            trigger_channel: Some(0),
            trigger_delay_us: [0; 2],
        };
        let settings = AnalysisSettings {
            locator: Locator::Geometry,
            calibration: CalibrationModel::Full,
            ..AnalysisSettings::default()
        };
        let mut input = skinrig_planted::session(rig, settings);
        let mut tips = Vec::new();
        let start = |k: usize| (k as f64 * PERIOD_MS) as i64;
        let presses = repetitions * locations;
        for k in 0..presses {
            let at = location(k % locations);
            tips.extend((start(k)..start(k + 1)).map(|ms| TipSample {
                t_ns: ms * GRID_NS,
                position: Point3::new(
                    at.x_mm,
                    at.y_mm,
                    height_mm((ms - start(k)) as f64 - CONTACT_MS),
                ),
            }));
            plant(&mut input, k, locations, start(k) as f64 + CONTACT_MS);
        }
        let events = std::thread::scope(|scope| {
            let camera = |id| {
                let (scene, optical, tips) = (config.scene(id), config.optical, &tips);
                scope.spawn(move || {
                    let mut model = OpticalModel::with_config(&scene, optical, 1).expect("valid");
                    let mut events = Vec::new();
                    model.advance(tips, &mut events);
                    events
                })
            };
            CameraId::ALL
                .map(camera)
                .map(|thread| thread.join().expect("events"))
        });
        let idle = |t_ns: &i64| {
            let k = (*t_ns as f64 / 1e6 / PERIOD_MS) as usize;
            (600.0..1_000.0).contains(&(*t_ns as f64 / 1e6 - start(k) as f64))
        };
        let idle_events = events.iter().flatten().filter(|e| idle(&e.t_ns)).count();
        let cd = |e: &skinrig_sim::scene::PixelEvent| CdEvent {
            t_us: (e.t_ns / 1_000) as u64,
            x: e.x,
            y: e.y,
            polarity: e.polarity,
        };
        Self {
            input,
            events: Memory {
                events: events.map(|all| all.iter().map(cd).collect()),
                slice: 100_000,
            },
            idle_all_rows_per_s: idle_events as f64 / (0.4 * presses as f64),
        }
    }

    fn analyze(&self, settings: AnalysisSettings) -> Analysis {
        let input = SessionInput {
            settings,
            ..self.input.clone()
        };
        analyze(&input, &self.events).expect("an analysis")
    }

    /// The published choices: all clustered events of a whole period; DBSCAN off when events are reduced.
    fn as_published(&self) -> Analysis {
        let mut settings = self.input.settings.clone();
        settings.window_anchor = WindowAnchor::Middle;
        settings.window_before_ms = PERIOD_MS / 2.0;
        settings.window_after_ms = PERIOD_MS / 2.0;
        settings.centroid = CentroidRule::AllClusters;
        settings.cluster_threshold = ThresholdRule::Fixed;
        settings.min_cluster_events = 0;
        settings.min_response_sigma = 0.0;
        settings.reduction.max_power = 10;
        settings.reduction.min_samples = 1;
        self.analyze(settings)
    }
}

fn plant(input: &mut SessionInput, k: usize, locations: usize, contact_ms: f64) {
    let (repetition, place) = (k / locations, k % locations);
    let role = match repetition {
        0 => PressRole::Calibrate,
        _ => PressRole::Score,
    };
    let durations = [
        150.0,
        MOVE_MS,
        TOUCH_MS - MOVE_MS,
        TOUCH_MS,
        TOUCH_MS + 150.0,
    ];
    let touch = PlantedPress {
        timing: timing(contact_ms / 1e3, durations.map(|ms| ms / 1e3)),
        ..PlantedPress::new(role, repetition as u32, place as u32, location(place))
    };
    let id = press(input, touch);
    for (kind, ms) in [
        (MarkKind::Contact, contact_ms),
        (MarkKind::Release, contact_ms + TOUCH_MS),
    ] {
        let sent = HostTime::from_secs_f64(ms / 1e3);
        mark(input, (kind, id), sent, 500, |_| (ms * 1e3).round() as u64);
    }
}

/// How a figure relates to the published one.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    /// Constants were chosen for it.
    Fitted,
    Predicted,
}
use Kind::{Fitted, Predicted};

struct Figure {
    name: &'static str,
    kind: Kind,
    found: Option<f64>,
    published: f64,
    /// Stated interval about the published figure.
    within: [f64; 2],
}

fn figure(
    name: &'static str,
    kind: Kind,
    found: Option<f64>,
    published: f64,
    within: f64,
) -> Figure {
    Figure {
        name,
        kind,
        found,
        published,
        within: [published * (1.0 - within), published * (1.0 + within)],
    }
}

/// Every figure; fitted ones have to be within 10 % (shares: 2 %), predicted ones within 25 % (shares: 5 %).
fn figures(scene: &Scene) -> Vec<Figure> {
    let located = scene.analyze(scene.input.settings.clone());
    let published = scene.as_published();
    let rates = located.bit_rates.as_ref().expect("rates");
    let latency = located.latency.as_ref().expect("latency");
    let reduced = latency.reduced.as_ref().expect("reduced latency");
    let reduction = published.reduction.as_ref().expect("reduction");
    let last = reduction.curves[0].rows.last().expect("rows");
    assert_eq!(last.factor, 1024);
    let idle = published::BITS_PER_EVENT / 8.0 * scene.idle_all_rows_per_s;
    // Both RMSEs are printed: 4.66 mm, and 5.31 mm as the sum of x and y.
    let mut rmse = figure(
        "RMSE, mm",
        Fitted,
        published.scored.rmse_mm.value,
        published::RMSE_MM,
        0.1,
    );
    rmse.within[1] = 1.1 * libm::hypot(published::RMSE_X_MM, published::RMSE_Y_MM);
    vec![
        figure(
            "data rate of presses, B/s",
            Fitted,
            rates.press_bytes_per_s.value,
            published::BYTES_PER_S.0,
            0.1,
        ),
        figure(
            "data rate between presses, all rows, B/s",
            Fitted,
            Some(idle),
            published::BYTES_PER_S.1,
            0.1,
        ),
        rmse,
        figure(
            "RMSE along x, mm",
            Predicted,
            published.scored.rmse_x_mm.value,
            published::RMSE_X_MM,
            0.25,
        ),
        figure(
            "RMSE along y, mm",
            Predicted,
            published.scored.rmse_y_mm.value,
            published::RMSE_Y_MM,
            0.25,
        ),
        figure(
            "std between repetitions, mm",
            Fitted,
            published.scored.repeat_std_mm.value,
            published::REPEAT_STD_MM,
            0.1,
        ),
        figure(
            "share located",
            Fitted,
            located.scored.located_rate.value,
            published::LOCATED_RATE,
            0.02,
        ),
        figure(
            "RMSE at 1/1024, mm",
            Fitted,
            last.rmse_mm.value,
            published::RMSE_1024_MM,
            0.1,
        ),
        figure(
            "pass rate at 1/1024",
            Predicted,
            last.pass_rate.value,
            published::PASS_RATE.1,
            0.05,
        ),
        figure(
            "width of the detections, ms",
            Predicted,
            latency.width_ms.value,
            published::LATENCY_WIDTH_MS.0,
            0.25,
        ),
        figure(
            "share detected",
            Predicted,
            latency.detected_rate.value,
            published::DETECTED_RATE.0,
            0.05,
        ),
        figure(
            "false alarms per second",
            Predicted,
            latency.false_alarms_per_s.value,
            published::FALSE_ALARMS_PER_S.0,
            0.25,
        ),
        figure(
            "width at 1/1024, ms",
            Predicted,
            reduced.width_ms.value,
            published::LATENCY_WIDTH_MS.1,
            0.25,
        ),
        figure(
            "share detected at 1/1024",
            Predicted,
            reduced.detected_rate.value,
            published::DETECTED_RATE.1,
            0.05,
        ),
        figure(
            "false alarms per second at 1/1024",
            Predicted,
            reduced.false_alarms_per_s.value,
            published::FALSE_ALARMS_PER_S.1,
            0.25,
        ),
    ]
}

fn digits(value: f64) -> String {
    match value.abs() {
        v if v >= 1e4 => format!("{:.1}k", value / 1e3),
        v if v >= 100.0 => format!("{value:.0}"),
        v if v >= 10.0 => format!("{value:.1}"),
        _ => format!("{value:.2}"),
    }
}

const REPETITIONS: usize = 3;
const LOCATIONS: usize = 250;
/// Each seed is another skin with other cameras.
const SEEDS: [u64; 3] = [1, 2, 3];

#[test]
#[ignore = "minutes: SKINRIG_CI_LONG=1 .ci/run, or cargo test -p skinrig-tests --test system paper_scene -- --ignored --nocapture"]
fn paper_scene_beside_the_published_figures() {
    println!("source of each constant:");
    for parameter in PARAMETERS {
        let Parameter { part, name, source } = parameter;
        println!("  {}.{name}: {source:?}", part.name());
    }
    let found = SEEDS.map(|seed| {
        figures(&Scene::simulate(
            seed,
            &ScenePart::ALL,
            REPETITIONS,
            LOCATIONS,
        ))
    });
    println!("figure | kind | mean of three skins (each) | published | stated interval | within");
    let mut outside = Vec::new();
    for (k, f) in found[0].iter().enumerate() {
        let each = [0, 1, 2].map(|skin| found[skin][k].found.expect("a figure"));
        let mean = each.iter().sum::<f64>() / 3.0;
        let [low, high] = f.within;
        let is_within = low <= mean && mean <= high;
        if !is_within {
            outside.push(f.name);
        }
        println!(
            "{} | {:?} | {} ({}) | {} | {} to {} | {}",
            f.name,
            f.kind,
            digits(mean),
            each.map(digits).join(", "),
            digits(f.published),
            digits(low),
            digits(high),
            if is_within { "yes" } else { "NO" },
        );
    }
    // protocols/paper.md lists these.
    assert_eq!(outside, OUTSIDE);
}

/// Figures outside their stated interval.
const OUTSIDE: [&str; 6] = [
    "RMSE at 1/1024, mm",
    "pass rate at 1/1024",
    "false alarms per second",
    "width at 1/1024, ms",
    "share detected at 1/1024",
    "false alarms per second at 1/1024",
];

#[test]
#[ignore = "minutes: SKINRIG_CI_LONG=1 .ci/run, or cargo test -p skinrig-tests --test system paper_scene -- --ignored --nocapture"]
fn paper_scene_without_each_part() {
    let mut without = vec![None];
    without.extend(ScenePart::ALL.map(Some));
    let (mut whole, mut same) = (Vec::new(), Vec::new());
    for part in without {
        let parts = ScenePart::ALL.into_iter().filter(|p| Some(*p) != part);
        let parts: Vec<ScenePart> = parts.collect();
        let found = figures(&Scene::simulate(SEEDS[0], &parts, REPETITIONS, LOCATIONS));
        if part.is_none() {
            println!(
                "without | {}",
                found.iter().map(|f| f.name).collect::<Vec<_>>().join(" | ")
            );
        }
        let row: Vec<String> = found
            .iter()
            .map(|f| f.found.map_or_else(|| "-".to_owned(), digits))
            .collect();
        println!(
            "{} | {}",
            part.map_or("nothing", ScenePart::name),
            row.join(" | ")
        );
        match part {
            None => whole = row,
            Some(part) if row == whole => same.push(part),
            Some(_) => {}
        }
    }
    // protocols/paper.md says so: at these rates no row waits.
    assert!(
        same.iter().all(|part| *part == ScenePart::Readout),
        "{same:?}"
    );
}

#[test]
fn paper_scene_has_the_published_data_rates() {
    let scene = Scene::simulate(SEEDS[0], &ScenePart::ALL, 1, 17);
    // The first line is the farthest from the cameras: fewer events than the mean press.
    let all: usize = scene.events.events.iter().map(Vec::len).sum();
    let per_s = all as f64 / (17.0 * PERIOD_MS / 1e3);
    assert!((8e3..16e3).contains(&per_s), "{per_s} events per second");
    let idle = published::BITS_PER_EVENT / 8.0 * scene.idle_all_rows_per_s;
    assert!(
        (idle / published::BYTES_PER_S.1 - 1.0).abs() < 0.15,
        "{idle} B/s"
    );
}

//! Analysis: DBSCAN per press against the definition on the same events, and a whole analysis per event.
#![expect(clippy::print_stdout, reason = "a bench prints its table")]

use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use skinrig_analysis::calibrate::calibrate;
use skinrig_analysis::clock::{PressSpan, fit_rates};
use skinrig_analysis::dbscan::Dbscan;
use skinrig_analysis::grid::PixelGrid;
use skinrig_analysis::metrics::{Exclusions, metrics};
use skinrig_analysis::rates::RateHistogram;
use skinrig_analysis::sets::{CalibrationSet, ScoreSet};
use skinrig_analysis::triangulate::locate;
use skinrig_analysis::{EventSource, SessionInput, analyze};
use skinrig_bench::Table;
use skinrig_model::{
    AnalysisSettings, AttemptId, CalibrationModel, CameraId, CdEvent, HostTime, PlannedPress,
    Point2, Polarity, PressId, PressOutcome, PressRole, PressTiming, PressVerdict, RigGeometry,
    SkinOutline, StereoGeometry,
};

/// Events of a dense press: the median of a real-rate recording is 17.8 thousand, the largest 39 thousand.
const PRESS_EVENTS: usize = 20_000;
/// Presses of one repetition of the published experiment, at the published mean event rate.
const PRESSES: u32 = 289;
const EVENTS_PER_S: f64 = 6_600.0;

fn main() {
    clustering();
    whole();
}

struct Random(Xoshiro256PlusPlus);

impl Random {
    fn unit(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.unit()).sum::<f64>() - 6.0
    }

    /// A pixel of a press: most in a column-shaped blob, some scattered.
    fn pixel(&mut self, column: f64) -> (u16, u16) {
        let (x, y) = if self.unit() < 0.85 {
            (column + 30.0 * self.normal(), 272.0 + 25.0 * self.normal())
        } else {
            (640.0 * self.unit(), 480.0 * self.unit())
        };
        (x.clamp(0.0, 639.0) as u16, y.clamp(185.0, 360.0) as u16)
    }
}

fn random() -> Random {
    Random(Xoshiro256PlusPlus::seed_from_u64(1))
}

fn clustering() {
    let mut random = random();
    let events: Vec<(u16, u16)> = (0..PRESS_EVENTS).map(|_| random.pixel(310.0)).collect();
    let mut grid = PixelGrid::new((185, 360));
    let mut dbscan = Dbscan::new(10.0, 10);
    let mut table = Table::new(
        "DBSCAN of one press (20,000 events, eps 10 px, min 10)",
        "kev",
        "one core; counting the events included. Baseline: the definition, every pair of events compared (core and \
         noise only, no clusters)",
    );
    table.row(
        "pixel counts (this crate)",
        PRESS_EVENTS as f64 / 1e3,
        || {
            grid.clear();
            for &(u, v) in &events {
                grid.add(u, v);
            }
            std::hint::black_box(dbscan.run(&grid).len());
        },
    );
    table.baseline("all pairs", PRESS_EVENTS as f64 / 1e3, || {
        let near = |a: &(u16, u16), b: &(u16, u16)| {
            let (dx, dy) = (
                i32::from(a.0) - i32::from(b.0),
                i32::from(a.1) - i32::from(b.1),
            );
            dx * dx + dy * dy <= 100
        };
        let core = |a: &&(u16, u16)| events.iter().filter(|b| near(a, b)).count() >= 10;
        std::hint::black_box(events.iter().filter(core).count());
    });
    println!("{}", table.run(3));
}

struct Memory([Vec<CdEvent>; 2]);

impl EventSource for Memory {
    fn for_each_slice(
        &self,
        camera: CameraId,
        each: &mut dyn FnMut(&[CdEvent]),
    ) -> Result<(), String> {
        self.0[camera.index()].chunks(8192).for_each(each);
        Ok(())
    }
}

fn whole() {
    let (input, source) = session();
    let events: f64 = source.0.iter().map(|e| e.len() as f64 / 1e6).sum();
    let mut counts = vec![0u32; 640 * 480];
    let mut table = Table::new(
        "analysis of one repetition (289 presses, two cameras, no trigger marks)",
        "Mev",
        "two cores, events in memory: two passes, clock fit from event rates, DBSCAN, calibration, 2000 bootstrap \
         samples. Baseline: counting the same events per pixel, nothing else",
    );
    table.row("whole analysis", events, || {
        std::hint::black_box(analyze(&input, &source).map(|a| a.counts).ok());
    });
    table.baseline("count per pixel", events, || {
        for e in source.0.iter().flatten() {
            counts[usize::from(e.y) * 640 + usize::from(e.x)] += 1;
        }
        std::hint::black_box(&counts);
    });
    println!("{}", table.run(3));

    let Ok(done) = analyze(&input, &source) else {
        return;
    };
    let set = CalibrationSet::from_presses(&done.presses);
    let scores = ScoreSet::from_presses(&done.presses, &input.outcomes);
    let mut rates = RateHistogram::new(10_000);
    source.0[0].iter().for_each(|e| rates.add(e.t_us));
    let spans: Vec<PressSpan> = done
        .presses
        .iter()
        .filter_map(|p| p.timing)
        .map(|t| PressSpan {
            contact_us: t.contact.0 as f64 * 1e-3,
            release_us: t.release.0 as f64 * 1e-3,
        })
        .collect();
    let start = StereoGeometry::paper_like([45.0, -35.0, 45.0, 46.0, 0.0, 0.0, 0.0, 0.0]);
    let mut table = Table::new(
        "parts of the analysis of one repetition",
        "call",
        "calibration: 8 parameters, 145 presses, 10 starts. Metrics: 144 presses, 2000 bootstrap samples, both cores. \
         Baseline: intersecting the rays of all presses once",
    );
    table.row("clock fit from event rates", 1.0, || {
        std::hint::black_box(fit_rates(&rates, &spans).is_ok());
    });
    table.row("calibration", 1.0, || {
        std::hint::black_box(calibrate(&set, &start, CalibrationModel::Full, 1));
    });
    table.row("metrics", 1.0, || {
        let outline = &SkinOutline::PAPER;
        std::hint::black_box(metrics(&scores, Exclusions::Applied, outline, 5.0, 2000, 1));
    });
    table.baseline("triangulation", 1.0, || {
        for press in &done.presses {
            let columns = press.views.map(|v| v.and_then(|v| v.centroid_u));
            std::hint::black_box(locate(&done.geometry, &SkinOutline::PAPER, columns));
        }
    });
    println!("{}", table.run(3));
}

fn session() -> (SessionInput, Memory) {
    let h = HostTime::from_secs_f64;
    let mut random = random();
    let mut input = SessionInput {
        planned: Vec::new(),
        outcomes: Vec::new(),
        edges: [Vec::new(), Vec::new()],
        marks: Vec::new(),
        gaps: [Vec::new(), Vec::new()],
        pose_interval_us: None,
        rig: RigGeometry {
            outline: SkinOutline::PAPER,
            nominal: StereoGeometry::PAPER,
            trigger_channel: None,
        },
        settings: AnalysisSettings::default(),
    };
    let mut events = [Vec::new(), Vec::new()];
    for i in 0..PRESSES + 3 {
        let id = PressId(i);
        let place = i.saturating_sub(3);
        let (role, contact) = match i {
            0..3 => (PressRole::Sync, 10.0 + f64::from(i)),
            _ if i % 2 == 0 => (PressRole::Calibrate, 15.0 + 3.003 * f64::from(place)),
            _ => (PressRole::Score, 15.0 + 3.003 * f64::from(place)),
        };
        let at = Point2::new(
            -22.0 + 4.0 * f64::from(place / 17),
            -30.0 + 4.0 * f64::from(place % 17),
        );
        input.planned.push(PlannedPress {
            id,
            role,
            repetition: 0,
            location: place,
            at,
            depth_mm: 2.0,
        });
        input.outcomes.push(Some(PressOutcome {
            attempt: AttemptId {
                press: id,
                number: 1,
            },
            verdict: PressVerdict::Valid,
            timing: Some(PressTiming {
                approach: h(contact - 0.1),
                contact: h(contact),
                at_depth: h(contact + 0.2),
                retract: h(contact + 0.3),
                release: h(contact + 0.55),
                clear: h(contact + 0.7),
            }),
            measured_at: Some(at),
            measured_depth_mm: Some(2.0),
            peak_force_n: None,
            scheduled: false,
        }));
        for (k, events) in events.iter_mut().enumerate() {
            let camera = &StereoGeometry::PAPER.cameras[k];
            let column = camera.column_of_point(at).unwrap_or(320.0);
            let push = |random: &mut Random, after: f64, events: &mut Vec<CdEvent>| {
                let (x, y) = random.pixel(column);
                events.push(CdEvent {
                    t_us: (1e6 * (contact + after + 7.0)) as u64,
                    x,
                    y,
                    polarity: Polarity::from_bit(random.unit() < 0.5),
                });
            };
            for _ in 0..(EVENTS_PER_S * 3.0) as usize {
                let after = match random.unit() {
                    p if p < 0.6 => 0.55 * random.unit(),
                    _ => 3.0 * random.unit(),
                };
                push(&mut random, after, events);
            }
        }
    }
    events.iter_mut().for_each(|e| e.sort_by_key(|e| e.t_us));
    (input, Memory(events))
}

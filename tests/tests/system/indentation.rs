//! Depth and force estimated on optically simulated skins: errors at unseen places, coverage of intervals, return to zero.

use skinrig_analysis::result::{Analysis, Quantity};
use skinrig_analysis::{SessionInput, analyze};
use skinrig_model::{
    AnalysisSettings, CameraId, CdEvent, HostTime, MarkKind, Point2, Point3, PressRole,
    RigGeometry, SimLevel,
};
use skinrig_planted::{Memory, PlantedPress, mark, press, timing};
use skinrig_sim::SimConfig;
use skinrig_sim::optical::OpticalModel;
use skinrig_sim::scene::{GRID_NS, PixelModel, TipSample};
use skinrig_statistics::seeded;

/// Force per depth in the simulator, N/mm.
const STIFFNESS: f64 = 0.6;
const PERIOD_S: f64 = 4.0;
const HOLD_S: f64 = 0.3;

/// A simulated session: `locations` scattered places, every depth at each; calibration first, then as many scored presses
/// at the same places.
struct Sweep {
    seed: u64,
    locations: usize,
    depths_mm: Vec<f64>,
}

struct Touch {
    role: PressRole,
    repetition: u32,
    location: usize,
    at: [f64; 2],
    depth_mm: f64,
    speed_mm_s: f64,
    contact_s: f64,
}

impl Sweep {
    fn touches(&self) -> Vec<Touch> {
        let mut rng = seeded::generator(self.seed, 45);
        let mut unit = move || seeded::signed_unit(&mut rng);
        let mut places: Vec<[f64; 2]> = Vec::new();
        let mut spacing = 200.0 / (self.locations as f64).sqrt();
        while places.len() < self.locations {
            let place = [10.0 + 35.0 * unit(), 2.0 + 35.0 * unit()];
            spacing *= 0.999;
            let apart = |p: &[f64; 2]| libm::hypot(p[0] - place[0], p[1] - place[1]) > spacing;
            if places.iter().all(apart) {
                places.push(place);
            }
        }
        let mut touches = Vec::new();
        for (repetition, role) in [PressRole::Calibrate, PressRole::Score]
            .into_iter()
            .enumerate()
        {
            let first = touches.len();
            for (location, at) in places.iter().enumerate() {
                for depth_mm in &self.depths_mm {
                    let speed_mm_s = 20.0 + 5.0 * unit();
                    let at = at.map(|v| v + 0.02 * unit());
                    let depth_mm = depth_mm + 0.02 * unit();
                    touches.push(Touch {
                        role,
                        repetition: repetition as u32,
                        location,
                        at,
                        depth_mm,
                        speed_mm_s,
                        contact_s: 0.0,
                    });
                }
            }
            for i in (first + 1..touches.len()).rev() {
                let other = ((unit() + 1.0) / 2.0 * (i - first + 1) as f64) as usize;
                touches.swap(i, first + other.min(i - first));
            }
        }
        for (i, touch) in touches.iter_mut().enumerate() {
            touch.contact_s = 2.0 + PERIOD_S * i as f64;
        }
        touches
    }

    fn session(&self) -> (SessionInput, Memory) {
        let config = SimConfig::new(self.seed, SimLevel::Optical);
        let touches = self.touches();
        let mut input = skinrig_planted::session(
            RigGeometry {
                outline: config.outline,
                nominal: config.nominal,
                trigger_channel: Some(0),
                trigger_delay_us: [0; 2],
            },
            AnalysisSettings {
                bootstrap_resamples: 200,
                study_presses: 1,
                ..AnalysisSettings::default()
            },
        );
        for touch in &touches {
            plant(&mut input, touch);
        }
        let tips = tips(&touches);
        let [one, two] = std::thread::scope(|scope| {
            CameraId::ALL
                .map(|id| {
                    let (config, tips) = (&config, &tips);
                    scope.spawn(move || events(config, id, tips))
                })
                .map(|camera| camera.join().expect("a camera"))
        });
        let memory = Memory {
            events: [one, two],
            slice: 4096,
        };
        (input, memory)
    }

    fn analysis(&self) -> Analysis {
        let (input, events) = self.session();
        analyze(&input, &events).expect("an analysis")
    }
}

fn plant(input: &mut SessionInput, touch: &Touch) {
    let moving = touch.depth_mm / touch.speed_mm_s;
    let depth_index = (touch.depth_mm * 2.0).round() / 2.0;
    let at = Point2::new(touch.at[0], touch.at[1]);
    let release = 2.0 * moving + HOLD_S;
    let planted = PlantedPress {
        depth_mm: depth_index,
        timing: timing(
            touch.contact_s,
            [0.3, moving, moving + HOLD_S, release, release + 0.2],
        ),
        measured_depth_mm: Some(touch.depth_mm),
        ..PlantedPress::new(touch.role, touch.repetition, touch.location as u32, at)
    };
    let id = press(input, planted);
    input.hold_forces_n.push(Some(STIFFNESS * touch.depth_mm));
    for (kind, after) in [(MarkKind::Contact, 0.0), (MarkKind::Release, release)] {
        let t = touch.contact_s + after;
        mark(input, (kind, id), HostTime::from_secs_f64(t), 500, |_| {
            (t * 1e6).round() as u64
        });
    }
}

/// The path of the tip at 1 kHz.
fn tips(touches: &[Touch]) -> Vec<TipSample> {
    let mut tips = Vec::new();
    for touch in touches {
        let (down, speed) = (touch.contact_s, touch.speed_mm_s);
        let moving = touch.depth_mm / speed;
        let end = ((down + PERIOD_S - 1.0) * 1e3) as usize;
        while tips.len() < end {
            let t = tips.len() as f64 * 1e-3;
            let z = (speed * (down - t))
                .max(-touch.depth_mm)
                .max(speed * (t - down - 2.0 * moving - HOLD_S))
                .min(10.0);
            tips.push(TipSample {
                t_ns: tips.len() as i64 * GRID_NS,
                position: Point3::new(touch.at[0], touch.at[1], z),
            });
        }
    }
    tips
}

fn events(config: &SimConfig, id: CameraId, tips: &[TipSample]) -> Vec<CdEvent> {
    let rows = AnalysisSettings::default().crop_v[id.index()];
    let mut model = OpticalModel::new(&config.scene(id));
    let (mut all, mut some) = (Vec::new(), Vec::new());
    let mut from = 0;
    while from + 1 < tips.len() {
        let to = (from + 1000).min(tips.len() - 1);
        some.clear();
        model.advance(&tips[from..=to], &mut some);
        let inside = some.iter().filter(|e| rows.0 <= e.y && e.y <= rows.1);
        all.extend(inside.map(|e| CdEvent {
            t_us: (e.t_ns / 1000) as u64,
            x: e.x,
            y: e.y,
            polarity: e.polarity,
        }));
        from = to;
    }
    all
}

fn value(estimate: skinrig_analysis::result::Estimate) -> f64 {
    estimate.value.unwrap_or(f64::NAN)
}

fn line(name: &str, q: &Quantity) -> String {
    let of = |e: &skinrig_analysis::result::QuantityErrors| {
        format!(
            "rmse {:.3} bias {:+.3} relative {:.1} % covered {:.3}",
            value(e.rmse),
            value(e.bias),
            value(e.relative_percent),
            value(e.covered)
        )
    };
    let depths = q.depths.iter();
    let by_depth: Vec<String> = depths
        .map(|d| {
            let (known, unseen) = (value(d.scored.rmse), value(d.left_out.rmse));
            format!("{}: {known:.3}/{unseen:.3}", d.depth_mm)
        })
        .collect();
    let (known, unseen) = (of(&q.scored), of(&q.left_out));
    format!(
        "{name} known {known} | unseen {unseen} | {}",
        by_depth.join(" ")
    )
}

#[test]
fn a_small_sweep_is_learnt_and_says_how_sure_it_is() {
    let sweep = Sweep {
        seed: 3,
        locations: 9,
        depths_mm: vec![1.0, 2.0, 3.0],
    };
    let analysis = sweep.analysis();
    let found = analysis.indentation.expect("depths vary");
    let depth = found.depth.expect("a depth");
    println!("{}", line("depth", &depth));
    assert!(depth.taught_by >= 18, "{}", depth.taught_by);
    assert!(value(depth.scored.rmse) < 0.35, "{}", line("depth", &depth));
    assert!(value(depth.left_out.covered) > 0.85);
    let force = found.force.expect("a force");
    // The simulated force is a multiple of the depth, so that its errors are.
    let ratio = value(force.scored.rmse) / value(depth.scored.rmse);
    assert!((ratio - STIFFNESS).abs() < 0.02, "{ratio}");
    let zero = found.zero.expect("a return to zero");
    println!("zero {zero:?}");
    assert!(zero.after_s > 1.0);
}

#[test]
fn a_single_depth_is_not_estimated() {
    let sweep = Sweep {
        seed: 3,
        locations: 4,
        depths_mm: vec![2.0],
    };
    let (mut input, events) = sweep.session();
    input.planned.iter_mut().for_each(|p| p.depth_mm = 2.0);
    let analysis = analyze(&input, &events).expect("an analysis");
    assert_eq!(analysis.indentation, None);
}

#[test]
#[ignore = "minutes: SKINRIG_CI_LONG=1 .ci/run, or cargo test -p skinrig-tests indentation -- --ignored --nocapture (figures of ADR 45)"]
fn sweeps_of_several_seeds() {
    let number = |name: &str, default: usize| {
        std::env::var(name).map_or(default, |v| v.parse().expect("a number"))
    };
    let locations = number("SKINRIG_LOCATIONS", 24);
    let (mut inside, mut presses) = ([0.0; 2], [0.0; 2]);
    for seed in 1..=number("SKINRIG_SEEDS", 4) as u64 {
        let sweep = Sweep {
            seed,
            locations,
            depths_mm: vec![0.5, 1.0, 1.5, 2.0, 2.5, 3.0],
        };
        let found = sweep.analysis().indentation.expect("depths vary");
        let depth = found.depth.expect("a depth");
        println!("{seed}: {}", line("depth", &depth));
        println!("{seed}: {}", line("force", &found.force.expect("a force")));
        println!("{seed}: zero {:?}", found.zero);
        for (i, errors) in [depth.scored, depth.left_out].into_iter().enumerate() {
            inside[i] += value(errors.covered) * f64::from(errors.covered.n);
            presses[i] += f64::from(errors.covered.n);
        }
    }
    let shares = [0, 1].map(|i| inside[i] / presses[i]);
    println!("covered {shares:?} of {presses:?}");
    assert!(
        shares.iter().all(|s| (0.9..=0.99).contains(s)),
        "{shares:?}"
    );
}

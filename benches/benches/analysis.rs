//! Analysis: DBSCAN per press against the definition on the same events, and a whole analysis per event.
#![expect(clippy::print_stdout, reason = "a bench prints its table")]

use skinrig_analysis::analyze;
use skinrig_analysis::calibrate::{calibrate, choose};
use skinrig_analysis::clock::{PressSpan, align_by_rates, fit_rates};
use skinrig_analysis::dbscan::Dbscan;
use skinrig_analysis::grid::PixelGrid;
use skinrig_analysis::locator::FittedLocator;
use skinrig_analysis::metrics::{Exclusions, metrics};
use skinrig_analysis::press_events::Retention;
use skinrig_analysis::rates::RateHistogram;
use skinrig_analysis::sets::{CalibrationSet, ScoreSet};
use skinrig_analysis::triangulate::locate;
use skinrig_analysis::{analyze_with_events, reduction};
use skinrig_bench::files::{Files, Memory};
use skinrig_bench::memory::{peak_mb, reset_peak};
use skinrig_bench::{Table, recording};
use skinrig_model::{CalibrationModel, PressRole, SkinOutline, StereoGeometry};
use skinrig_simd::InstructionSet;

/// Events of a dense press: one period of a recording at a realistic rate.
const PRESS_EVENTS: usize = 20_000;

fn main() {
    // Before anything else allocates memory.
    memory();
    clustering();
    sizes();
    whole();
    calibrations();
    reductions();
}

fn clustering() {
    let events: Vec<(u16, u16)> = recording::press_pixels(PRESS_EVENTS).collect();
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
        || cluster(&mut dbscan, &mut grid, &events),
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
    let mut table = Table::new(
        "the same by instruction set, without counting the events",
        "kev",
        "one core",
    );
    for (k, set) in InstructionSet::available().into_iter().enumerate() {
        let mut dbscan = Dbscan::new(10.0, 10).with_instructions(set);
        let grid = grid.clone();
        let work = move || {
            std::hint::black_box(dbscan.run(&grid).len());
        };
        let units = PRESS_EVENTS as f64 / 1e3;
        match k {
            0 => table.baseline(set.name(), units, work),
            _ => table.row(set.name(), units, work),
        };
    }
    println!("{}", table.run(200));
}

fn cluster(dbscan: &mut Dbscan, grid: &mut PixelGrid, events: &[(u16, u16)]) {
    grid.clear();
    for &(u, v) in events {
        grid.add(u, v);
    }
    std::hint::black_box(dbscan.run(grid).len());
}

/// Presses of a thousand to ten million events.
const SIZES: [usize; 5] = [1_000, 10_000, 100_000, 1_000_000, 10_000_000];

/// Resident memory while presses of growing size are counted and clustered.
fn memory() {
    let mut pixels = vec![(0, 0); 8192];
    println!("\nDBSCAN of one press by its size: peak resident memory of the process");
    for size in SIZES {
        reset_peak();
        let (mut dbscan, mut grid) = (Dbscan::new(10.0, 10), PixelGrid::new((185, 360)));
        let mut events = recording::press_pixels(size);
        loop {
            pixels.clear();
            pixels.extend(events.by_ref().take(8192));
            if pixels.is_empty() {
                break;
            }
            for &(u, v) in &pixels {
                grid.add(u, v);
            }
        }
        std::hint::black_box(dbscan.run(&grid).len());
        let peak = peak_mb().map_or("unknown".into(), |mb| format!("{mb:.1} MB"));
        println!("  {size:>10} events  {peak}");
    }
}

fn sizes() {
    let events: Vec<(u16, u16)> = recording::press_pixels(SIZES[4]).collect();
    let mut table = Table::new(
        "DBSCAN of one press by its size",
        "Mev",
        "one core, events in memory, counting included",
    );
    for size in SIZES {
        let events = &events[..size];
        let (mut dbscan, mut grid) = (Dbscan::new(10.0, 10), PixelGrid::new((185, 360)));
        table.row(&format!("{size} events"), size as f64 / 1e6, move || {
            cluster(&mut dbscan, &mut grid, events);
        });
    }
    println!("{}", table.run(5));
}

fn whole() {
    let mut input = recording::input();
    input.settings.study_presses = 0;
    let source = Memory(recording::events(&input));
    let folder = tempfile::tempdir().expect("a temporary folder");
    let files = Files::write(folder.path(), &source.0).expect("room for two files");
    let events: f64 = source.0.iter().map(|e| e.len() as f64 / 1e6).sum();
    let mut counts = vec![0u32; 640 * 480];
    let mut table = Table::new(
        "analysis of one repetition (289 presses, two cameras, no trigger marks)",
        "Mev",
        "two cores: one reading, clock fit from event rates, DBSCAN, calibration, 2000 bootstrap \
         samples. Baseline: counting the same events per pixel, nothing else",
    );
    table.row("events in memory", events, || {
        std::hint::black_box(analyze(&input, &source).map(|a| a.counts).ok());
    });
    table.row("events in two HDF5 files", events, || {
        std::hint::black_box(analyze(&input, &files).map(|a| a.counts).ok());
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
    let mut second = RateHistogram::new(10_000);
    source.0[1].iter().for_each(|e| second.add(e.t_us));
    let spans: Vec<PressSpan> = done
        .presses
        .iter()
        .filter_map(|p| Some((p.role, p.timing?)))
        .map(|(role, t)| PressSpan {
            sync: role == PressRole::Sync,
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
    table.row("clocks of both cameras from event rates", 1.0, || {
        let both = [Some(&rates), Some(&second)];
        std::hint::black_box(align_by_rates(both, &spans).evidence);
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

/// Presses in the published calibration.
const CALIBRATED: usize = 250;
/// Seeds of the multi-start that must agree.
const SEEDS: u64 = 10;

/// Calibration of 250 presses: every seed of the multi-start must reach the same optimum.
fn calibrations() {
    let mut input = recording::input();
    input.settings.study_presses = 0;
    input.settings.calibration = CalibrationModel::None;
    let grid = input
        .planned
        .iter_mut()
        .filter(|p| p.role != PressRole::Sync);
    for (i, planned) in grid.enumerate() {
        planned.role = if i < CALIBRATED {
            PressRole::Calibrate
        } else {
            PressRole::Score
        };
    }
    let source = Memory(recording::events(&input));
    let done = analyze(&input, &source).expect("a good recording");
    let set = CalibrationSet::from_presses(&done.presses);
    assert_eq!(set.sights().len(), CALIBRATED);
    let start = StereoGeometry::paper_like([45.0, -35.0, 45.0, 46.0, 0.0, 0.0, 0.0, 0.0]);
    let rmse_mm = |seed| {
        let found = calibrate(&set, &start, CalibrationModel::Full, seed);
        found.expect("enough presses").1.rmse_after_mm
    };
    let first = rmse_mm(1);
    for seed in 2..=SEEDS {
        let other = rmse_mm(seed);
        assert!(
            (other - first).abs() <= 1e-9,
            "{other} mm with seed {seed}, {first} mm with 1"
        );
    }
    let mut settings = input.settings.clone();
    settings.calibration = CalibrationModel::Auto;
    let method = format!(
        "wall time, both cores; {SEEDS} seeds gave the same RMSE to 1e-9 mm. Baseline: intersecting the rays of all \
         presses once"
    );
    let mut table = Table::new("calibration of 250 presses", "call", &method);
    table.row("8 parameters, 10 starts", 1.0, || {
        std::hint::black_box(calibrate(&set, &start, CalibrationModel::Full, 1));
    });
    table.row("all models, cross-validated, one chosen", 1.0, || {
        std::hint::black_box(choose(&set, &start, &settings));
    });
    table.baseline("triangulation", 1.0, || {
        for sight in set.sights() {
            let columns = sight.columns.map(Some);
            std::hint::black_box(locate(&start, &SkinOutline::PAPER, columns));
        }
    });
    println!("{}", table.run(5));
}

/// Data-reduction study on all presses, in windows of about 18,000 events per camera.
fn reductions() {
    let mut input = recording::input();
    let settings = &mut input.settings;
    settings.calibration = CalibrationModel::None;
    settings.window_before_ms = 100.0;
    settings.window_after_ms = 1500.0;
    // Keep the studies of the analysis itself small.
    (settings.reduction.seeds, settings.reduction.max_power) = (1, 1);
    for planned in &mut input.planned {
        if planned.role == PressRole::Calibrate {
            planned.role = PressRole::Score;
        }
    }
    let source = Memory(recording::events(&input));
    let (mut done, kept) =
        analyze_with_events(&input, &source, Retention::Scored).expect("a good recording");
    drop(source);
    (
        done.settings.reduction.seeds,
        done.settings.reduction.max_power,
    ) = (10, 10);
    let views = kept.presses.iter().flat_map(|p| &p.views);
    let events: usize = views.map(|v| v.press_events().len()).sum();
    let method = format!(
        "wall time, events in memory, both cores; factors 1, 2 .. 1024, 10 seeds, both kinds of thinning, intervals; \
         {} presses of {} events per camera on average. Baseline: clustering each press once in each camera, without \
         thinning",
        kept.presses.len(),
        events / (2 * kept.presses.len()),
    );
    let (mut dbscan, mut grid) = (Dbscan::new(10.0, 10), PixelGrid::new((185, 360)));
    let locator = FittedLocator::of(&done).expect("a locator");
    let mut table = Table::new("data reduction of one repetition", "study", &method);
    table.row("the whole study", 1.0, || {
        std::hint::black_box(reduction::study(&done, &locator, &kept));
    });
    table.baseline("each press once, one core", 1.0, || {
        for view in kept.presses.iter().flat_map(|p| &p.views) {
            grid.clear();
            for event in view.press_events() {
                grid.add(event.x(), event.y());
            }
            std::hint::black_box(dbscan.run(&grid).len());
        }
    });
    println!("{}", table.run(2));
}

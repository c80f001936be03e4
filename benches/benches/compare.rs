//! The analysis compared with Python: scikit-learn, the C++ `dbscan` package, numpy and scipy, and the choices of the public
//! analysis code. The scripts in `benches/compare` do the same work on the same files in the same run; the results must be
//! equal.
#![expect(clippy::print_stdout, reason = "a bench prints its table")]

use std::cell::RefCell;
use std::fs;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};
use skinrig_analysis::dbscan::{Dbscan, NOISE};
use skinrig_analysis::grid::PixelGrid;
use skinrig_analysis::latency;
use skinrig_analysis::press_events::Retention;
use skinrig_analysis::segment::windows;
use skinrig_analysis::{Analysis, SessionInput, analyze, analyze_with_events};
use skinrig_bench::files::Files;
use skinrig_bench::python::Python;
use skinrig_bench::{Table, recording};
use skinrig_model::{AnalysisSettings, CalibrationModel, CentroidRule, PressRole, PressTiming};

const ROWS: (u16, u16) = (185, 360);
const EPS_PX: f64 = 10.0;
const MIN_SAMPLES: u32 = 10;
/// Events of a dense press: one period of a recording at a realistic rate.
const PRESS_EVENTS: usize = 20_000;

fn main() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    // For manual use: `SKINRIG_BENCH_INPUTS=FOLDER` keeps the inputs of the scripts.
    let kept = std::env::var_os("SKINRIG_BENCH_INPUTS").map(PathBuf::from);
    let folder = kept.as_deref().unwrap_or(folder.path());
    fs::create_dir_all(folder).expect("a folder");
    match std::env::var("SKINRIG_BENCH_PART").as_deref() {
        Ok("clustering") => clustering(folder),
        Ok("repetition") => repetition(folder),
        Ok(part) => panic!("SKINRIG_BENCH_PART: clustering or repetition, not {part}"),
        Err(_) => {
            clustering(folder);
            repetition(folder);
            studies(folder);
        }
    }
}

fn start(script: &str, folder: &Path) -> Option<RefCell<Python>> {
    let script = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("compare")
        .join(script);
    let python = Python::start([script.as_os_str(), folder.as_os_str(), "--serve".as_ref()]);
    match &python {
        Some(python) => println!("{}", python.versions()),
        None => println!(
            "not measured: {} needs a Python with the packages of benches/compare/requirements.txt \
             (SKINRIG_BENCH_PYTHON names it)",
            script.display()
        ),
    }
    python.map(RefCell::new)
}

/// Wall-clock seconds of a task; panics unless both sides found the same.
fn seconds(python: &RefCell<Python>, task: &str) -> f64 {
    let answer = python.borrow_mut().query(task).expect("an answer");
    assert_eq!(answer["agrees"], true, "{task}: {answer}");
    answer["seconds"].as_f64().expect("seconds") / answer["share"].as_f64().unwrap_or(1.0)
}

fn clustering(folder: &Path) {
    let events: Vec<(u16, u16)> = recording::press_pixels(PRESS_EVENTS).collect();
    let mut grid = PixelGrid::new(ROWS);
    let mut dbscan = Dbscan::new(EPS_PX, MIN_SAMPLES);
    cluster(&mut dbscan, &mut grid, &events);
    write_press(folder, &events, &dbscan);
    let python = start("clustering.py", folder);

    let mut table = Table::new(
        "core, border and noise of one press (20,000 events, eps 10 px, min 10)",
        "kev",
        "events in memory, wall time, rounds in turn; each of the others found the same core and noise in every round. \
         Theirs in a process of its own, which waits while others are measured",
    );
    let kev = PRESS_EVENTS as f64 / 1e3;
    if let Some(python) = &python {
        table.baseline_timed("scikit-learn DBSCAN, events", kev, || {
            seconds(python, "sklearn_events")
        });
        for (what, task) in [
            ("scikit-learn DBSCAN, pixels with weights", "sklearn_pixels"),
            ("dbscan (C++), events", "cpp_events"),
            ("numpy, sums over discs by sums along rows", "pixel_grid"),
            ("scipy, sums over discs by FFT", "pixel_grid_fft"),
        ] {
            table.row_timed(what, kev, || seconds(python, task));
        }
    }
    table.ours("this crate", kev, || {
        cluster(&mut dbscan, &mut grid, &events);
    });
    println!("{}", table.run(7));
}

fn cluster(dbscan: &mut Dbscan, grid: &mut PixelGrid, events: &[(u16, u16)]) {
    grid.clear();
    for &(u, v) in events {
        grid.add(u, v);
    }
    std::hint::black_box(dbscan.run(grid).len());
}

/// Writes the events, and per event 0 for noise, 1 for border, 2 for core.
fn write_press(folder: &Path, events: &[(u16, u16)], dbscan: &Dbscan) {
    let mut classes = vec![0u8; 640 * 480];
    for (pixel, label) in dbscan.labels() {
        classes[pixel as usize] = u8::from(label != NOISE);
    }
    for pixel in dbscan.core_pixels() {
        classes[pixel as usize] = 2;
    }
    let class = |&(u, v): &(u16, u16)| classes[usize::from(v - ROWS.0) * 640 + usize::from(u)];
    let bytes: Vec<u8> = events
        .iter()
        .flat_map(|(u, v)| [u.to_le_bytes(), v.to_le_bytes()].concat())
        .collect();
    let classes: Vec<u8> = events.iter().map(class).collect();
    write(folder, "press.u16", &bytes);
    write(folder, "press.classes.u8", &classes);
    let settings = json!({"rows": ROWS, "eps_px": EPS_PX, "min_samples": MIN_SAMPLES});
    write(folder, "press.json", settings.to_string().as_bytes());
}

/// One repetition as in the public code: windows of a whole period, all clusters, all eight parameters.
fn repetition(folder: &Path) {
    let [mut input, mut unmarked] = [recording::marked_input(), recording::input()];
    let beside_ms = 1e3 * (recording::PERIOD_S - recording::TOUCH_S) / 2.0;
    input.settings = AnalysisSettings {
        window_before_ms: beside_ms,
        window_after_ms: beside_ms,
        centroid: CentroidRule::AllClusters,
        calibration: CalibrationModel::Full,
        min_response_sigma: 0.0,
        exclude_outside: false,
        study_presses: 0,
        ..AnalysisSettings::default()
    };
    unmarked.settings = input.settings.clone();
    let mut plain = input.clone();
    plain.settings.bootstrap_resamples = 0;
    let events = recording::events(&input);
    let mev: f64 = events.iter().map(|e| e.len() as f64 / 1e6).sum();
    for k in 1..=2 {
        let _ = fs::remove_file(folder.join(format!("camera{k}.hdf5")));
    }
    let files = Files::write(folder, &events).expect("room for two files");
    drop(events);
    let done = analyze(&input, &files).expect("a good recording");
    write(
        folder,
        "repetition.json",
        known_result(&input, &done).to_string().as_bytes(),
    );

    let python = [
        start("repetition.py", folder),
        start("published.py", folder),
    ];
    let mut table = Table::new(
        "one repetition: 289 presses, windows of a period, from two HDF5 files to the error in mm",
        "Mev",
        "wall time, rounds in turn, files in the page cache. This crate: two threads; clocks from trigger marks, \
         calibration from 10 starts, all models cross-validated, 2000 bootstrap samples; then the same without bootstrap, \
         which none of the others has; then without marks, so that the clocks are found from the event rates. Python: press windows given, calibration from 10 starts. \
         Public code's choices: one process, 12 of the 578 centroids, scaled; neither reading nor calibration. \
         Columns agree to 1e-9 px in every round",
    );
    if let [Some(assembled), Some(published)] = &python {
        table.baseline_timed("the public code's choices: clustering alone", mev, || {
            seconds(published, "clustering")
        });
        for (what, task) in [
            ("h5py, discs by FFT, scipy: one process", "one_process_fft"),
            ("h5py, discs by FFT: two processes", "two_processes_fft"),
            ("h5py, discs by sums, scipy: one process", "one_process"),
            ("h5py, discs by sums: two processes", "two_processes"),
        ] {
            table.row_timed(what, mev, || seconds(assembled, task));
        }
    }
    table.ours("this crate", mev, || {
        std::hint::black_box(analyze(&input, &files).map(|a| a.counts).ok());
    });
    table.row("this crate, no intervals", mev, || {
        std::hint::black_box(analyze(&plain, &files).map(|a| a.counts).ok());
    });
    table.row("this crate, finding the clocks as well", mev, || {
        std::hint::black_box(analyze(&unmarked, &files).map(|a| a.counts).ok());
    });
    println!("{}", table.run(15));
}

/// Detection latency of all presses of the repetition that [`repetition`] left in the folder.
fn studies(folder: &Path) {
    let mut input = recording::input();
    input.settings.calibration = CalibrationModel::None;
    for planned in &mut input.planned {
        if planned.role == PressRole::Calibrate {
            planned.role = PressRole::Score;
        }
    }
    let (done, kept) = analyze_with_events(&input, &Files::at(folder), Retention::Scored)
        .expect("a good recording");
    let presses = f64::from(recording::PRESSES);
    let thresholds = f64::from(input.settings.latency.thresholds.count);
    let method = format!(
        "wall time, rounds in turn, events in memory. This crate: {} presses, both cameras, 20 thresholds, trials and \
         backgrounds, a second study on thinned events, intervals; two threads. Python: 24 presses, one camera, \
         one threshold, scaled to all presses and 20 thresholds",
        kept.presses.len()
    );
    let python = start("published.py", folder);
    let mut table = Table::new("detection latency of 289 presses", "press", &method);
    if let Some(python) = &python {
        table.baseline_timed("the public code's choices", presses, || {
            thresholds * seconds(python, "latency")
        });
    }
    table.ours("this crate", presses, || {
        std::hint::black_box(latency::study(&done, &kept));
    });
    println!("{}", table.run(3));
}

/// Input for the baseline, and the expected result.
fn known_result(input: &SessionInput, done: &Analysis) -> Value {
    let presses = || {
        let rows = done.presses.iter().enumerate();
        rows.filter(|(_, p)| p.role != PressRole::Sync)
    };
    let timings = || {
        let rows = input.outcomes.iter().enumerate();
        rows.filter_map(|(row, o)| Some((row, o.as_ref()?.timing?)))
            .collect::<Vec<(usize, PressTiming)>>()
    };
    let spans = [0, 1].map(|k| {
        let clock = done.clocks[k].expect("a clock");
        let mut spans = vec![(0, 0); done.presses.len()];
        for window in windows(
            timings().into_iter(),
            &input.earlier,
            &clock,
            &input.settings,
        ) {
            spans[window.row] = (window.start_us, window.end_us);
        }
        presses().map(|(row, _)| spans[row]).collect::<Vec<_>>()
    });
    let columns = [0, 1].map(|k| {
        presses()
            .map(|(_, p)| p.views[k].and_then(|v| v.centroid_u))
            .collect::<Vec<_>>()
    });
    let truth: Vec<[f64; 2]> = presses()
        .filter_map(|(_, p)| p.truth.map(|t| [t.x_mm, t.y_mm]))
        .collect();
    let calibrates: Vec<bool> = presses()
        .map(|(_, p)| p.role == PressRole::Calibrate)
        .collect();
    let start = done.calibration.as_ref().map(|c| c.start_values.clone());
    json!({
        "rows": input.settings.crop_v,
        "eps_px": EPS_PX,
        "min_samples": MIN_SAMPLES,
        "windows": spans,
        "columns": columns,
        "truth": truth,
        "calibrates": calibrates,
        "start": start,
        "rmse_mm": done.scored.rmse_mm.value,
    })
}

fn write(folder: &Path, name: &str, bytes: &[u8]) {
    fs::write(folder.join(name), bytes).expect("room for the inputs");
}

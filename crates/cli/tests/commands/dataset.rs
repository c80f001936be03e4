//! Synthetic recording in the published layout with known clocks: two containers, a CSV in metres, a schedule.

use std::path::{Path, PathBuf};

use skinrig_formats::hdf5::EventWriter;
use skinrig_model::{CameraId, CdEvent, Point2, Polarity};
use skinrig_protocol::Schedule;

use crate::support::{Lab, SeededRandom, text};

/// True camera time at the schedule's time 0, µs; the import must recover it.
pub(crate) const OFFSET_US: [f64; 2] = [7_312_000.0, 11_905_000.0];
/// Drift of each camera clock against the schedule's clock, ppm.
pub(crate) const DRIFT_PPM: [f64; 2] = [40.0, -25.0];
/// Presses of the path, without the three sync presses before them.
pub(crate) const PRESSES: usize = 12;

const PERIOD_S: f64 = 1.5;
const SYNC: usize = 3;
const SYNC_INTERVAL_S: f64 = 1.0;
const PAUSE_AFTER_SYNC_S: f64 = 3.0;
const CENTRE: Point2 = Point2::new(10.0, 2.0);

const SCHEDULE: &str = "\
skinrig_schedule: 1
name: made here
operator: tests
prototype: {id: no skin}
sync: {count: 3, interval: 1 s, pause_after: 3 s, at: [10 mm, 2 mm]}
period: 1.5 s
presses_per_repetition: 12
depth: 2 mm
phases: {approach: -450 ms, contact: -275 ms, at_depth: -100 ms, retract: 50 ms, release: 275 ms, clear: 450 ms}
csv: {unit: m, skip_blank_rows: true}
evaluation: {repetitions: {calibrate: [], score: [1]}}
rig:
  outline: paper
  camera1: {position: [45 mm, -35 mm], half_field_of_view: 60 deg}
  camera2: {position: [45 mm, 46 mm], half_field_of_view: 60 deg}
analysis: {calibration: none}
";

/// The files of one recording.
pub(crate) struct Dataset {
    pub cameras: [PathBuf; 2],
    pub presses: PathBuf,
    pub schedule: PathBuf,
}

/// Planned positions of the path.
pub(crate) fn positions() -> Vec<Point2> {
    (0..PRESSES)
        .map(|k| Point2::new(-10.0 + 10.0 * (k / 4) as f64, -14.0 + 9.0 * (k % 4) as f64))
        .collect()
}

impl Dataset {
    /// Writes the recording into `lab`.
    pub(crate) fn new(lab: &Lab) -> Self {
        let cameras = CameraId::ALL.map(|camera| {
            let path = lab.path(&format!("camera{}.hdf5", camera.number()));
            let mut writer = EventWriter::create(&path, 0).unwrap();
            writer.append(&events(camera)).unwrap();
            writer.finish().unwrap();
            path
        });
        let presses = lab.path("presses.csv");
        std::fs::write(&presses, csv(&positions())).unwrap();
        let schedule = lab.path("made.schedule.yaml");
        std::fs::write(&schedule, SCHEDULE).unwrap();
        Self {
            cameras,
            presses,
            schedule,
        }
    }

    /// Arguments of `import` for these files, with sessions in `folder`.
    pub(crate) fn arguments(&self, folder: &Path) -> Vec<String> {
        let words = [
            ("--camera1", &self.cameras[0]),
            ("--camera2", &self.cameras[1]),
            ("--presses", &self.presses),
            ("--schedule", &self.schedule),
            ("--sessions", &folder.to_path_buf()),
        ];
        let mut arguments = vec!["import".to_owned()];
        for (flag, path) in words {
            arguments.extend([flag.to_owned(), text(path)]);
        }
        arguments
    }
}

/// A CSV in metres whose last row is a single blank, like the published file.
pub(crate) fn csv(positions: &[Point2]) -> String {
    let mut text = String::from("x,y,z\n");
    for p in positions {
        text += &format!("{},{},0.0\n", p.x_mm / 1e3, p.y_mm / 1e3);
    }
    text + " ,,\n"
}

/// Press times and positions in order. Time 0 is the start of the first descent, 450 ms before its press time.
fn schedule() -> Vec<(f64, Point2)> {
    let sync = (0..SYNC).map(|k| (0.45 + SYNC_INTERVAL_S * k as f64, CENTRE));
    let first = 0.45 + SYNC_INTERVAL_S * (SYNC - 1) as f64 + PAUSE_AFTER_SYNC_S;
    let path = (positions().into_iter().enumerate()).map(|(k, p)| (first + PERIOD_S * k as f64, p));
    sync.chain(path).collect()
}

/// Events of `camera`: a burst while the tip descends, one of opposite polarity while it retracts, and background.
pub(crate) fn events(camera: CameraId) -> Vec<CdEvent> {
    let mut random = SeededRandom(1 + u64::from(camera.number()));
    let rig = Schedule::parse("made", SCHEDULE.as_bytes(), &[])
        .unwrap()
        .rig;
    let model = rig.nominal.cameras[camera.index()];
    let camera_us =
        |t_s: f64| OFFSET_US[camera.index()] + t_s * 1e6 * (1.0 + DRIFT_PPM[camera.index()] * 1e-6);
    let bell = |random: &mut SeededRandom| (0..6).map(|_| random.unit()).sum::<f64>() - 3.0;
    let mut events = Vec::new();
    let mut push = |t_s: f64, x: f64, y: f64, polarity| {
        events.push(CdEvent {
            t_us: camera_us(t_s).round() as u64,
            x: x.round().clamp(0.0, 639.0) as u16,
            y: y.round().clamp(0.0, 479.0) as u16,
            polarity,
        });
    };
    let schedule = schedule();
    for (press, at) in &schedule {
        let column = model.column_of_point(*at).unwrap();
        for (from, to, polarity) in [(-0.275, -0.1, Polarity::On), (0.05, 0.275, Polarity::Off)] {
            for _ in 0..400 {
                let t = press + from + (to - from) * random.unit();
                push(
                    t,
                    column + 4.0 * bell(&mut random),
                    270.0 + 15.0 * bell(&mut random),
                    polarity,
                );
            }
        }
    }
    // 1 s before the first press to 1 s after the last.
    let length = schedule.last().unwrap().0 + 2.0;
    for _ in 0..(300.0 * length) as usize {
        let t = length * random.unit() - 1.0;
        let polarity = Polarity::from_bit(random.below(2) == 1);
        push(t, 640.0 * random.unit(), 480.0 * random.unit(), polarity);
    }
    events.sort_by_key(|e| e.t_us);
    events
}

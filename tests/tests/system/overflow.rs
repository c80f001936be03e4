//! A camera drops events while the recorder is slow: the loss is counted, located in time, and invalidates the press.
//! Emulated.
#![cfg(target_os = "linux")]

use std::time::Duration;

use skinrig_device::RealClock;
use skinrig_emulated_camera::Evk1Config as Emulated;
use skinrig_emulated_camera::config::Content;
use skinrig_emulated_camera::harness::on_bus;
use skinrig_evk1::{Evk1, Evk1Config};
use skinrig_model::{CameraId, PressVerdict, Record, SimLevel};
use skinrig_recorder::{SessionReader, verify};
use skinrig_results::Rescan;
use skinrig_sim::{SimConfig, in_real_time, simulated_rig};
use skinrig_tests::{planned, record};

const SERIAL: &str = "00001621";
const PROTOCOL: &str = "
skinrig: 1
name: overflow
operator: tests
prototype: {id: none}
seed: 3
scene: {level: kinematic}
sync: {count: 2, interval: 1.5 s, at: [10 mm, 2 mm], pause_after: 1 s}
path:
  points: [[4 mm, 0 mm]]
depth: 1.5 mm
motion: {period: 2 s, hold: 300 ms}
limits:
  workspace: {min: [-40 mm, -48 mm, -4 mm], max: [60 mm, 52 mm, 30 mm]}
  max_depth: 3 mm
  max_speed: 100 mm/s
  max_force: 5 N
triggers: {marks: [contact]}
retakes: {per_press: 0}
evaluation: {calibrate: [], score: [1]}
analysis: {calibration: none}
";

#[test]
fn dropped_bytes_invalidate_the_press_and_are_reported() {
    let test = "overflow::dropped_bytes_invalidate_the_press_and_are_reported";
    // A packet of about 80 kB every millisecond; the FIFO and two transfers of 16 KiB take less than half of it.
    let camera = Emulated {
        fifo_bytes: 4 << 10,
        content: Content::Dense { mev_per_s: 20.0 },
        ..Emulated::new(SERIAL)
    };
    on_bus(test, vec![camera.into()], |remote| {
        let (protocol, plan) = planned(PROTOCOL.trim_start()).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("overflow.session.sqlite");
        let mut rig = in_real_time(simulated_rig(&SimConfig::new(3, SimLevel::Kinematic)));
        let clock = RealClock::start();
        let config = Evk1Config {
            transfers: 2,
            transfer_bytes: 16 << 10,
            ..Evk1Config::default()
        };
        let evk1 = Evk1::open_serial(SERIAL, CameraId::One, config, clock);
        rig.cameras[0] = Box::new(evk1.unwrap());
        let report = record(&protocol, &plan, rig, &path, |record, _| {
            if matches!(record, Record::Chunk(chunk) if chunk.camera == CameraId::One) {
                std::thread::sleep(Duration::from_millis(20)); // the slow disk
            }
        });
        let report = report.unwrap();
        assert_eq!(report.valid, 0, "{report:?}");
        assert!(remote.observe(SERIAL).unwrap().counters.dropped_bytes > 0);

        let reader = SessionReader::open(&path).unwrap();
        let mut attempts = 0;
        for (_, created) in reader.presses().unwrap() {
            for outcome in created.into_iter().filter_map(|a| a.outcome) {
                match outcome.verdict {
                    PressVerdict::Invalid(why) => {
                        attempts += 1;
                        assert!(why.to_string().contains("camera 1 lost"), "{why}");
                    }
                    PressVerdict::Missed(_) => {}
                    other => panic!("{other:?}"),
                }
            }
        }
        assert!(attempts > 0);
        let losses = reader.losses(CameraId::One).unwrap();
        let spans = losses.iter().filter_map(|l| l.time.span_us());
        assert!(spans.sum::<u64>() > 100_000, "{losses:?}");
        assert_eq!(reader.losses(CameraId::Two).unwrap(), []);
        let message = reader.notes().unwrap();
        let message = message.iter().find(|n| n.text.contains("overflow counter"));
        assert!(message.is_some_and(|n| n.text.starts_with("camera 1: ")));
        let verified = verify::<Rescan>(&path).unwrap();
        assert!(verified.is_sound(), "{:?}", verified.problems);
    });
}

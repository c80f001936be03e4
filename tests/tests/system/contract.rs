//! The device contract, applied to devices replayed from session files.
#![expect(clippy::unwrap_used, reason = "a test that cannot go on must fail")]

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use skinrig_device::contract::{self, IndenterContract};
use skinrig_device::{
    Clock, DeviceError, EventCamera, Indenter, IndenterCapabilities, MotionLimits, Rig, RobotSample,
};
use skinrig_model::{
    CameraId, DeviceIdentity, DeviceRole, HostDuration, HostTime, Mark, MotionCommand, Point3,
    PoseSample, Record, RigidTransform, Robot, RunEnd, Setting, SimLevel, Skin, StopReason,
};
use skinrig_recorder::{SessionReader, SessionWriter};
use skinrig_results::RigDocument;
use skinrig_sim::{SimConfig, simulated_rig};
use skinrig_tests::{header, planned, record};
use tempfile::TempDir;

const PROTOCOL: &str = "\
skinrig: 1
name: contract
operator: tests
prototype: {id: none}
seed: 3
scene: {level: geometric}
path: {points: [[10 mm, 2 mm], [-10 mm, 18 mm]]}
depth: 1 mm
motion: {period: 2.5 s}
limits: {workspace: {min: [-40 mm, -48 mm, -4 mm], max: [60 mm, 52 mm, 30 mm]}, max_depth: 3 mm, max_speed: 100 mm/s, max_force: 5 N}
triggers: {marks: [contact, retract]}
evaluation: {calibrate: [], score: [1]}
analysis: {calibration: none}
";

/// Chunks of about 0.1 s, so that the contract's short polls see some.
fn rig() -> Rig {
    let mut config = SimConfig::new(3, SimLevel::Geometric);
    config.camera_clock.chunk_bytes = 30_000;
    simulated_rig(&config)
}

/// A run of [`PROTOCOL`] as a session file.
fn session() -> (TempDir, PathBuf) {
    let lab = tempfile::tempdir().unwrap();
    let path = lab.path().join("contract.session.sqlite");
    let (protocol, plan) = planned(PROTOCOL).unwrap();
    let report = record(&protocol, &plan, rig(), &path, |_, _| {}).unwrap();
    assert_eq!(report.end, RunEnd::Completed, "{report:?}");
    (lab, path)
}

/// The session as a rig.
fn replayed(path: &Path) -> Rig {
    let header = SessionReader::open(path).unwrap().header().unwrap();
    let document: RigDocument = serde_json::from_str(&header.rig_json).unwrap();
    skinrig::rig::replayed(path, &header, &document)
        .map_err(|f| f.message)
        .unwrap()
}

#[test]
fn a_replayed_clock_keeps_the_contract() {
    let (_lab, path) = session();
    contract::clock(replayed(&path).clock.as_mut());
}

#[test]
fn replayed_cameras_keep_the_contract() {
    let (_lab, path) = session();
    for id in CameraId::ALL {
        let settings = rig().camera_settings;
        let mut split = || -> (Box<dyn EventCamera>, Box<dyn Clock>) {
            let rig = replayed(&path);
            let [one, two] = rig.cameras;
            (if id == CameraId::One { one } else { two }, rig.clock)
        };
        contract::event_camera(&mut split, &settings[id.index()]);
    }
}

#[test]
fn a_replayed_trigger_box_keeps_the_contract() {
    let (_lab, path) = session();
    let sent = SessionReader::open(&path).unwrap().marks_sent().unwrap();
    let marks: Vec<Mark> = sent.iter().map(|s| s.mark).collect();
    assert_eq!(marks.len(), 4);
    let mut split = || {
        let rig = replayed(&path);
        (rig.trigger_box.unwrap(), rig.clock)
    };
    contract::trigger_box(&mut split, &marks);
}

const OPTIONS: IndenterContract = IndenterContract {
    limits: MotionLimits {
        min_mm: [-80.0, -80.0, -60.0],
        max_mm: [80.0, 80.0, 60.0],
        max_speed_mm_s: 100.0,
        max_acceleration_mm_s2: 200.0,
        max_force_n: 8.0,
    },
    targets: [
        Point3::new(20.0, -10.0, 5.0),
        Point3::new(-20.0, 10.0, 15.0),
    ],
    outside: Point3::new(0.0, 81.0, 0.0),
    speed_mm_s: 80.0,
    tolerance_mm: 0.05,
    move_timeout: HostDuration::from_millis(1_500),
    rate_share: 0.9,
};

/// Records what the contract does with simulated robots, one session file per robot; then repeats the contract with robots
/// replayed from these files.
#[test]
fn a_replayed_robot_keeps_the_contract() {
    let lab = tempfile::tempdir().unwrap();
    let mut tapes: Vec<Arc<Mutex<Vec<Record>>>> = Vec::new();
    let mut simulated = || -> (Box<dyn Indenter>, Box<dyn Clock>) {
        let rig = rig();
        let clock = Shared(Arc::new(Mutex::new(rig.clock)));
        let records = Arc::default();
        tapes.push(Arc::clone(&records));
        let robot = RecordedRobot {
            robot: rig.indenter,
            records,
            clock: clock.clone(),
            skin_from_robot: rig.robot_from_skin.inverse(),
        };
        (Box::new(robot), Box::new(clock))
    };
    contract::indenter(&mut simulated, &OPTIONS);
    assert!(tapes.len() >= 3, "{}", tapes.len());

    let files: Vec<PathBuf> = (tapes.iter().enumerate())
        .map(|(n, records)| {
            let path = lab.path().join(format!("{n}.session.sqlite"));
            write(&path, &records.lock().unwrap());
            path
        })
        .collect();
    let mut next = files.iter();
    let mut replays = || -> (Box<dyn Indenter>, Box<dyn Clock>) {
        let rig = replayed(next.next().unwrap());
        (rig.indenter, rig.clock)
    };
    contract::indenter(&mut replays, &OPTIONS);
}

/// Writes a session with these records.
fn write(path: &Path, records: &[Record]) {
    let (protocol, plan) = planned(PROTOCOL).unwrap();
    let mut header = header(&protocol, &plan, &rig()).unwrap();
    header.presses.clear();
    let mut writer = SessionWriter::create(path).unwrap();
    writer.accept(Record::Started(Box::new(header))).unwrap();
    let mut last = HostTime::ZERO;
    for record in records {
        if let Record::Poses(poses) = record {
            last = poses.last().map_or(last, |p| p.t);
        }
        writer.accept(record.clone()).unwrap();
    }
    let end = RunEnd::Stopped(StopReason::Stop);
    writer.accept(Record::Ended { t: last, end }).unwrap();
    writer.finish().unwrap();
}

/// A clock with shared ownership.
#[derive(Clone)]
struct Shared(Arc<Mutex<Box<dyn Clock>>>);

impl Clock for Shared {
    fn now(&self) -> HostTime {
        self.0.lock().unwrap().now()
    }
    fn wait_until(&mut self, t: HostTime) {
        self.0.lock().unwrap().wait_until(t);
    }
}

/// A robot that records its commands and poses.
struct RecordedRobot {
    robot: Box<dyn Indenter>,
    records: Arc<Mutex<Vec<Record>>>,
    clock: Shared,
    skin_from_robot: RigidTransform<Skin, Robot>,
}

impl Indenter for RecordedRobot {
    fn identity(&self) -> DeviceIdentity {
        self.robot.identity()
    }

    fn capabilities(&self) -> IndenterCapabilities {
        self.robot.capabilities()
    }

    fn configure(&mut self, limits: &MotionLimits) -> Result<Vec<Setting>, DeviceError> {
        let settings = self.robot.configure(limits)?;
        self.records.lock().unwrap().push(Record::Device {
            role: DeviceRole::Indenter,
            identity: self.robot.identity(),
            settings: settings.clone(),
        });
        Ok(settings)
    }

    fn arm(&mut self) -> Result<(), DeviceError> {
        self.robot.arm()
    }

    fn command(&mut self, target: Point3<Robot>, speed_mm_s: f64) -> Result<(), DeviceError> {
        self.robot.command(target, speed_mm_s)?;
        self.records.lock().unwrap().push(Record::Command {
            t: self.clock.now(),
            command: MotionCommand {
                target: self.skin_from_robot.apply(target),
                speed_mm_s,
            },
        });
        Ok(())
    }

    fn poll(&mut self, samples: &mut Vec<RobotSample>) -> Result<(), DeviceError> {
        let before = samples.len();
        let answer = self.robot.poll(samples);
        let on_skin = |s: &RobotSample| PoseSample {
            t: s.t,
            commanded: self.skin_from_robot.apply(s.commanded),
            measured: self.skin_from_robot.apply(s.measured),
            force_n: s.force_n,
        };
        let poses: Vec<PoseSample> = samples[before..].iter().map(on_skin).collect();
        if !poses.is_empty() {
            self.records.lock().unwrap().push(Record::Poses(poses));
        }
        answer
    }

    fn hold(&mut self) -> Result<(), DeviceError> {
        self.robot.hold()
    }

    fn disarm(&mut self) -> Result<(), DeviceError> {
        self.robot.disarm()
    }
}

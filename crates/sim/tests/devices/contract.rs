//! Contract tests with simulated devices, and with replays of their recordings.

use std::sync::{Arc, Mutex};

use crate::common::{LIMITS, Log, with_log};
use skinrig_device::contract::{self, IndenterContract};
use skinrig_device::detached::Calls;
use skinrig_device::{
    Clock, DetachedBox, DetachedCamera, EventCamera, Indenter, Rig, Timeouts, TriggerBox,
};
use skinrig_model::{
    CameraId, HostDuration, HostTime, Mark, MarkKind, Point3, PressId, SimLevel, StreamFormat,
};
use skinrig_sim::replay::{RecordedRig, replayed_rig};
use skinrig_sim::{PacedClock, SimClock, SimConfig, simulated_rig};

const OPTIONS: IndenterContract = IndenterContract {
    limits: LIMITS,
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

fn replay_of(log: &Log) -> Rig {
    let rig = simulated_rig(&SimConfig::new(3, SimLevel::Kinematic));
    let known = RecordedRig {
        name: rig.name,
        robot_from_skin: rig.robot_from_skin,
        geometry: rig.geometry,
        stream_formats: [StreamFormat::Evt2; 2],
        camera_settings: rig.camera_settings,
        description_json: rig.description_json,
    };
    replayed_rig(known, Box::new(log.clone()))
}

/// Runs `suite` on recorded simulated rigs, then on replays of them in the same order.
fn both(mut suite: impl FnMut(&mut dyn FnMut() -> Rig)) {
    for level in [SimLevel::Kinematic, SimLevel::Geometric] {
        let logs: Arc<Mutex<Vec<Arc<Mutex<Log>>>>> = Arc::default();
        suite(&mut || {
            let (rig, log) = with_log(simulated_rig(&SimConfig::new(3, level)));
            logs.lock().unwrap().push(log);
            rig
        });
        let mut recorded = logs.lock().unwrap().clone().into_iter();
        suite(&mut || {
            let log = recorded.next().expect("as many replays as recordings");
            let log = log.lock().unwrap().clone();
            replay_of(&log)
        });
    }
}

#[test]
fn clocks_keep_the_contract() {
    contract::clock(&mut SimClock::new());
    contract::clock(&mut PacedClock::new(SimClock::new()));
    contract::clock(replay_of(&Log::default()).clock.as_mut());
}

#[test]
fn indenters_keep_the_contract() {
    both(|make| {
        let mut split = || -> (Box<dyn Indenter>, Box<dyn Clock>) {
            let rig = make();
            (rig.indenter, rig.clock)
        };
        contract::indenter(&mut split, &OPTIONS);
    });
}

#[test]
fn cameras_keep_the_contract() {
    for id in CameraId::ALL {
        both(|make| {
            let settings = simulated_rig(&SimConfig::new(3, SimLevel::Kinematic)).camera_settings;
            let mut split = || -> (Box<dyn EventCamera>, Box<dyn Clock>) {
                let rig = make();
                let [one, two] = rig.cameras;
                let camera = if id == CameraId::One { one } else { two };
                (camera, rig.clock)
            };
            contract::event_camera(&mut split, &settings[id.index()]);
        });
    }
}

#[test]
fn trigger_boxes_keep_the_contract() {
    let marks: Vec<Mark> = MarkKind::ALL
        .into_iter()
        .map(|kind| Mark {
            kind,
            press: PressId::from_index(17),
        })
        .collect();
    let marks = &marks;
    // A recording without any device has no trigger box; the recorded rig has one from its first mark.
    both(|make| {
        let mut split = || -> (Box<dyn TriggerBox>, Box<dyn Clock>) {
            let rig = make();
            (rig.trigger_box.expect("a trigger box"), rig.clock)
        };
        contract::trigger_box(&mut split, marks);
    });
}

/// A clock that advances once the device has replied.
#[derive(Clone)]
struct SettledClock {
    clock: Arc<Mutex<Box<dyn Clock>>>,
    calls: Arc<Mutex<Option<Calls>>>,
}

impl SettledClock {
    fn new(clock: Box<dyn Clock>) -> Self {
        Self {
            clock: Arc::new(Mutex::new(clock)),
            calls: Arc::default(),
        }
    }
}

impl Clock for SettledClock {
    fn now(&self) -> HostTime {
        self.clock.lock().unwrap().now()
    }
    fn wait_until(&mut self, t: HostTime) {
        let calls = self.calls.lock().unwrap().clone();
        while calls.as_ref().is_some_and(|c| c.pending_calls() > 0) {
            std::thread::yield_now();
        }
        self.clock.lock().unwrap().wait_until(t);
    }
}

fn sim() -> Rig {
    simulated_rig(&SimConfig::new(3, SimLevel::Geometric))
}

#[test]
fn detached_devices_keep_the_contract() {
    let settings = sim().camera_settings;
    for id in CameraId::ALL {
        let mut make = || -> (Box<dyn EventCamera>, Box<dyn Clock>) {
            let rig = sim();
            let clock = SettledClock::new(rig.clock);
            let [one, two] = rig.cameras;
            let camera = if id == CameraId::One { one } else { two };
            let camera = DetachedCamera::new(camera, Box::new(clock.clone()), Timeouts::BENCH);
            let camera = camera.expect("a thread");
            *clock.calls.lock().unwrap() = Some(camera.calls());
            (Box::new(camera), Box::new(clock))
        };
        contract::event_camera(&mut make, &settings[id.index()]);
    }
    let mark = |n| Mark {
        kind: MarkKind::Contact,
        press: PressId::from_index(n),
    };
    let mut make = || -> (Box<dyn TriggerBox>, Box<dyn Clock>) {
        let rig = sim();
        let clock = SettledClock::new(rig.clock);
        let device = rig.trigger_box.expect("a trigger box");
        let device = DetachedBox::new(device, Box::new(clock.clone()), Timeouts::BENCH);
        let device = device.expect("a thread");
        *clock.calls.lock().unwrap() = Some(device.calls());
        (Box::new(device), Box::new(clock))
    };
    contract::trigger_box(&mut make, &[mark(1), mark(2)]);
}

//! Devices on threads of their own whose calls block forever or for 10 s: the loop continues, the arm leaves the skin,
//! and the cause names the device.
//!
//! The rig's clock stands still until every device has answered or is held in a call, so that no result depends on thread
//! scheduling.

use std::sync::atomic::{AtomicI64, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::{self, ThreadId};

use skinrig_controller::{Run, RunFault, RunReport};
use skinrig_device::detached::Calls;
use skinrig_device::*;
use skinrig_model::*;
use skinrig_protocol::plan::{Plan, Step};
use skinrig_protocol::{Suspend, Threshold};

use crate::course::START;
use crate::mock::*;

/// How long a call blocks, ms.
const LONG_MS: i64 = 10_000;
/// Duration of a call that never returns, ms.
const FOREVER_MS: i64 = i64::MAX / MS;

const TIMEOUTS: Timeouts = Timeouts {
    running: HostDuration::from_millis(2_000),
    set_up: HostDuration::from_millis(3_000),
};

/// A device call that can block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Site {
    Send,
    Report,
    Notes,
    Configure,
    Start,
    Poll,
    Flush,
    Temperature,
    Stop,
}

impl Site {
    const ALL: [Self; 9] = [
        Self::Send,
        Self::Report,
        Self::Notes,
        Self::Configure,
        Self::Start,
        Self::Poll,
        Self::Flush,
        Self::Temperature,
        Self::Stop,
    ];

    const fn role(self) -> DeviceRole {
        match self {
            Self::Send | Self::Report | Self::Notes => DeviceRole::TriggerBox,
            _ => DeviceRole::Camera2,
        }
    }

    /// Whether a run makes this call while the tip is in contact.
    const fn in_contact(self) -> bool {
        !matches!(
            self,
            Self::Notes | Self::Configure | Self::Start | Self::Stop
        )
    }
}

/// Blocks one call of a device, once; in contact if a run makes it there.
#[derive(Clone)]
struct Blocking {
    world: Shared,
    role: DeviceRole,
    /// The call that blocks, and its duration, ms.
    site: Option<(Site, i64)>,
    /// Time at which the blocked call returns, ns; 0 if none is blocked.
    until: Arc<AtomicI64>,
    /// The thread of the control loop, which must not make the call.
    control: ThreadId,
}

impl Blocking {
    fn pass(&mut self, site: Site) {
        if thread::current().id() == self.control {
            let violation = format!("{site:?} of {} was called by the control loop", self.role);
            lock(&self.world).violations.push(violation);
        }
        let low = lock(&self.world).tip[2] < -1.0;
        let ours = |(s, _): &mut (Site, i64)| *s == site && (low || !site.in_contact());
        let Some((_, ms)) = self.site.take_if(ours) else {
            return;
        };
        if thread::current().id() == self.control {
            return; // already a violation; blocking here would hang the test
        }
        let until = lock(&self.world).t.saturating_add(ms.saturating_mul(MS));
        self.until.store(until, Ordering::Release);
        if ms == FOREVER_MS {
            loop {
                thread::park();
            }
        }
        while lock(&self.world).t < until {
            thread::yield_now();
        }
        self.until.store(0, Ordering::Release);
    }
}

struct BlockingCamera(MockCamera, Blocking);

impl EventCamera for BlockingCamera {
    fn camera(&self) -> CameraId {
        self.0.camera()
    }
    fn identity(&self) -> DeviceIdentity {
        self.0.identity()
    }
    fn capabilities(&self) -> CameraCapabilities {
        self.0.capabilities()
    }
    fn configure(&mut self, settings: &CameraSettings) -> Result<Vec<Setting>, DeviceError> {
        self.1.pass(Site::Configure);
        self.0.configure(settings)
    }
    fn start(&mut self) -> Result<(), DeviceError> {
        self.1.pass(Site::Start);
        self.0.start()
    }
    fn poll(&mut self, chunks: &mut Vec<RawChunk>) -> Result<(), DeviceError> {
        self.1.pass(Site::Poll);
        self.0.poll(chunks)
    }
    fn flush(&mut self, chunks: &mut Vec<RawChunk>) -> Result<(), DeviceError> {
        self.1.pass(Site::Flush);
        self.0.flush(chunks)
    }
    fn stop(&mut self, chunks: &mut Vec<RawChunk>) -> Result<(), DeviceError> {
        self.1.pass(Site::Stop);
        self.0.stop(chunks)
    }
    fn temperature_c(&mut self) -> Result<Option<f64>, DeviceError> {
        self.1.pass(Site::Temperature);
        self.0.temperature_c()
    }
}

struct BlockingBox(MockTriggerBox, Blocking);

impl TriggerBox for BlockingBox {
    fn identity(&self) -> DeviceIdentity {
        self.0.identity()
    }
    fn capabilities(&self) -> TriggerCapabilities {
        self.0.capabilities()
    }
    fn send(&mut self, mark: Mark) -> Result<SentMark, DeviceError> {
        self.1.pass(Site::Send);
        self.0.send(mark)
    }
    fn poll(&mut self, reports: &mut Vec<BoxReport>) -> Result<(), DeviceError> {
        self.1.pass(Site::Report);
        self.0.poll(reports)
    }
    fn take_notes(&mut self) -> Vec<String> {
        self.1.pass(Site::Notes);
        self.0.take_notes()
    }
}

/// Measures the longest time between polls of the armed robot.
struct WatchedIndenter(MockIndenter, Arc<AtomicI64>, i64);

impl Indenter for WatchedIndenter {
    fn identity(&self) -> DeviceIdentity {
        self.0.identity()
    }
    fn capabilities(&self) -> IndenterCapabilities {
        self.0.capabilities()
    }
    fn configure(&mut self, limits: &MotionLimits) -> Result<Vec<Setting>, DeviceError> {
        self.0.configure(limits)
    }
    fn arm(&mut self) -> Result<(), DeviceError> {
        self.2 = lock(&self.0.0).t;
        self.0.arm()
    }
    fn command(&mut self, target: Point3<Robot>, speed_mm_s: f64) -> Result<(), DeviceError> {
        self.0.command(target, speed_mm_s)
    }
    fn poll(&mut self, samples: &mut Vec<RobotSample>) -> Result<(), DeviceError> {
        let world = lock(&self.0.0);
        if world.armed {
            self.1.fetch_max(world.t - self.2, Ordering::AcqRel);
        }
        self.2 = world.t;
        drop(world);
        self.0.poll(samples)
    }
    fn hold(&mut self) -> Result<(), DeviceError> {
        self.0.hold()
    }
    fn disarm(&mut self) -> Result<(), DeviceError> {
        self.0.disarm()
    }
}

/// The calls of a device in progress, and the time until which one blocks, ns.
type HeldDevice = (Calls, Arc<AtomicI64>);

/// The rig's clock, which advances once every device has answered or is held in a call.
#[derive(Clone)]
struct SettledClock {
    world: Shared,
    devices: Arc<Mutex<Vec<HeldDevice>>>,
}

impl Clock for SettledClock {
    fn now(&self) -> HostTime {
        HostTime(lock(&self.world).t)
    }
    fn wait_until(&mut self, t: HostTime) {
        let now = self.now().0;
        let devices = self.devices.lock().map(|d| d.clone()).unwrap_or_default();
        for (calls, until) in devices {
            while calls.pending_calls() > 0 && now >= until.load(Ordering::Acquire) {
                thread::yield_now();
            }
        }
        MockClock(self.world.clone()).wait_until(t);
    }
}

/// Presses whose hold is long enough to detect a silent device in contact.
fn slow_plan() -> Plan {
    let mut plan = plan();
    for step in &mut plan.steps {
        if let Step::Press(p) = step {
            p.hold = HostDuration::from_millis(4_000);
            p.deadline = HostDuration::from_millis(6_000);
            p.start_after_begin = Some(HostDuration::from_millis(
                300 + 8_003 * i64::from(p.press.index()),
            ));
        }
    }
    // Reads temperatures, and flushes, in contact.
    let hot = Threshold {
        trip: 60.0,
        resume: 50.0,
        lasting: HostDuration::ZERO,
    };
    plan.suspend = Suspend {
        temperature: Some(hot),
        ..plan.suspend
    };
    plan
}

struct RunResult {
    report: RunReport,
    records: Vec<Record>,
    /// Longest time between polls of the armed robot, ns.
    gap_ns: i64,
    ever_armed: bool,
    violations: Vec<String>,
    ended_ms: i64,
}

fn run(site: Option<(Site, i64)>, detached: bool) -> RunResult {
    let plan = slow_plan();
    let world = World::shared(
        Faults {
            train_ms: 40,
            stiffness_n_mm: 1.0,
            hot_ms: Some(0..0),
            ..Faults::default()
        },
        START,
    );
    let clock = SettledClock {
        world: world.clone(),
        devices: Arc::default(),
    };
    let gap = Arc::new(AtomicI64::new(0));
    let mut rig = rig(&world);
    rig.clock = Box::new(clock.clone());
    rig.indenter = Box::new(WatchedIndenter(
        MockIndenter(world.clone()),
        Arc::clone(&gap),
        0,
    ));
    if detached {
        let blocking = |role: DeviceRole| Blocking {
            world: world.clone(),
            role,
            site: site.filter(|(s, _)| s.role() == role),
            until: Arc::default(),
            control: thread::current().id(),
        };
        let register = |calls: Calls, b: &Blocking| {
            let device = (calls, Arc::clone(&b.until));
            clock.devices.lock().expect("devices").push(device);
        };
        for camera in CameraId::ALL {
            let b = blocking(DeviceRole::of_camera(camera));
            let device = BlockingCamera(MockCamera(world.clone(), camera), b.clone());
            let device = DetachedCamera::new(Box::new(device), Box::new(clock.clone()), TIMEOUTS);
            let device = device.expect("a thread");
            register(device.calls(), &b);
            rig.cameras[camera.index()] = Box::new(device);
        }
        let b = blocking(DeviceRole::TriggerBox);
        let device = BlockingBox(MockTriggerBox(world.clone()), b.clone());
        let device = DetachedBox::new(Box::new(device), Box::new(clock.clone()), TIMEOUTS);
        let device = device.expect("a thread");
        register(device.calls(), &b);
        rig.trigger_box = Some(Box::new(device));
    }
    let mut sink = Sink::default();
    let control = lock(&world).control.clone();
    let report = Run::new(&plan, header(&plan), rig, &control, &mut sink).execute();
    let world = lock(&world);
    RunResult {
        report,
        records: sink.records,
        gap_ns: gap.load(Ordering::Acquire),
        ever_armed: world.ever_armed,
        violations: world.violations.clone(),
        ended_ms: world.t / MS,
    }
}

fn silent(error: &RunFault) -> Option<DeviceRole> {
    match error {
        RunFault::Device(DeviceError::Silent { role, .. }) => Some(*role),
        _ => None,
    }
}

#[test]
fn a_blocked_call_does_not_delay_the_loop() {
    for site in Site::ALL {
        for ms in [FOREVER_MS, LONG_MS] {
            let case = format!("{site:?} for {ms} ms");
            let result = run(Some((site, ms)), true);
            let report = &result.report;
            assert_eq!(result.violations, Vec::<String>::new(), "{case}");
            assert!(report.disarmed, "{case}: {report:?}");
            assert!(
                result.gap_ns <= 5 * MS,
                "{case}: {} ns without a look",
                result.gap_ns
            );
            match site {
                _ if site.in_contact() => {
                    let causes: Vec<_> = report.end.faults().iter().map(silent).collect();
                    assert_eq!(causes, [Some(site.role())], "{case}: {report:?}");
                    assert!(report.retracted, "{case}: {report:?}");
                    // In the first press: detected after 2 s of a hold of 4 s, and off the skin at once.
                    assert_eq!([report.valid, report.invalid], [0, 1], "{case}: {report:?}");
                    let block = result.ended_ms - TIMEOUTS.running.0 / MS;
                    assert!(block < 2_500, "{case}: ended at {} ms", result.ended_ms);
                }
                // The robot was never powered.
                Site::Configure | Site::Start => {
                    let causes: Vec<_> = report.end.faults().iter().map(silent).collect();
                    assert_eq!(causes, [Some(site.role())], "{case}: {report:?}");
                    assert!(!result.ever_armed, "{case}");
                }
                // The run has already ended.
                _ => {
                    assert_eq!(report.end, RunEnd::Completed, "{case}: {report:?}");
                    assert_eq!(report.valid, 3, "{case}: {report:?}");
                    let named = match site {
                        Site::Stop => report.problems.iter().any(|p| silent(&p.error) == Some(site.role())),
                        _ => result.records.iter().any(
                            |r| matches!(r, Record::Note { text, .. } if text.starts_with("trigger box: its losses are unknown")),
                        ),
                    };
                    assert!(named, "{case}: {report:?}");
                }
            }
        }
    }
}

/// Without faults, device threads do not change robot commands or marks: the same commands, marks and moments, at the same times
/// after the first command. (Device setup takes one more poll.)
#[test]
fn device_threads_change_no_command_and_no_mark() {
    let is_travel = |command: &MotionCommand| command.speed_mm_s == 100.0;
    let instants = |result: &RunResult| -> Vec<(i64, String)> {
        let mut all = Vec::new();
        for record in &result.records {
            match record {
                // The verdict on a press waits one more poll for the cameras, and so does the travel to the next one.
                Record::Command { command, .. } if is_travel(command) && !all.is_empty() => {}
                Record::Command { t, command } => all.push((t.0, format!("{command:?}"))),
                Record::MarkSent(sent) => all.push((sent.t.0, format!("{:?}", sent.mark))),
                Record::Outcome(o) => {
                    let timing = o.timing.expect("a valid press has moments");
                    for (moment, t) in [
                        ("contact", timing.contact),
                        ("at depth", timing.at_depth),
                        ("release", timing.release),
                        ("clear", timing.clear),
                    ] {
                        all.push((t.0, format!("{moment}: {}", o.attempt.press)));
                    }
                }
                _ => {}
            }
        }
        all.sort();
        let first = all.first().map_or(0, |(t, _)| *t);
        all.iter_mut().for_each(|(t, _)| *t -= first);
        all
    };
    let (inline, apart) = (run(None, false), run(None, true));
    assert_eq!(apart.violations, Vec::<String>::new());
    for result in [&inline, &apart] {
        assert_eq!(result.report.end, RunEnd::Completed, "{:?}", result.report);
        assert_eq!(result.report.valid, 3, "{:?}", result.report);
        assert_eq!(result.report.problems, Vec::new());
    }
    assert_eq!(instants(&apart), instants(&inline));
}

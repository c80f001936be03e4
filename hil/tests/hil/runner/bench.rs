//! A bench without devices, a manual clock, and checks with scripted findings.

use std::cell::{Cell, RefCell};
use std::collections::{BTreeMap, VecDeque};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};

use skinrig_device::{CameraSettings, Clock};
use skinrig_hil::bench::{Bench, CampaignRun, Devices, DrillResult, OnlineComparison, Problem};
use skinrig_hil::{Findings, NightObserver, SuiteRunner};
use skinrig_model::{CameraId, HostDuration, HostTime};
use skinrig_nightly::{GoldenSession, Night, NightExit, Verdict, Versions};
use skinrig_protocol::RigFile;
use skinrig_protocol::rig::Drill;
use skinrig_protocol::suite::{Check, Light, Suite};

const RIG: &str = include_str!("../../../rigs/emulated.yaml");

/// A clock that only the test advances.
#[derive(Clone, Default)]
pub(crate) struct ManualClock(Arc<AtomicI64>);

impl ManualClock {
    pub(crate) fn advance(&self, seconds: i64) {
        self.0.fetch_add(seconds * 1_000_000_000, Ordering::SeqCst);
    }
}

impl Clock for ManualClock {
    fn now(&self) -> HostTime {
        HostTime(self.0.load(Ordering::SeqCst))
    }

    fn wait_until(&mut self, t: HostTime) {
        self.0.fetch_max(t.0, Ordering::SeqCst);
    }
}

/// A bench without devices; counts how often it is closed.
pub(crate) struct DevicelessBench {
    rig: RigFile,
    pub closed: u32,
    pub stop: Cell<bool>,
    pub lost: Cell<bool>,
}

impl DevicelessBench {
    pub(crate) fn new() -> Self {
        let environment = |_: &str| Some("/nowhere".to_owned());
        Self {
            rig: RigFile::parse("emulated.yaml", RIG.as_bytes(), &environment).unwrap(),
            closed: 0,
            stop: Cell::new(false),
            lost: Cell::new(false),
        }
    }
}

impl Bench for DevicelessBench {
    fn rig(&self) -> &RigFile {
        &self.rig
    }
    fn devices(&mut self) -> &mut Devices {
        panic!("a bench without devices")
    }
    fn close(&mut self) {
        self.closed += 1;
    }
    fn camera_settings(&self, _: CameraId) -> Result<CameraSettings, Problem> {
        Ok(CameraSettings::default())
    }
    fn set_light(&mut self, _: Light) -> Result<bool, Problem> {
        Ok(false)
    }
    fn permits(&self, _: Drill) -> bool {
        true
    }
    fn watchdog_drill(&mut self) -> Result<DrillResult, Problem> {
        panic!("a bench without devices")
    }
    fn run_campaign(&mut self, _: &Path) -> Result<CampaignRun, Problem> {
        panic!("a bench without devices")
    }

    fn compare_online(&mut self, _: &GoldenSession) -> Result<OnlineComparison, Problem> {
        panic!("a bench without devices")
    }
    fn folder(&self) -> &Path {
        Path::new(".")
    }
    fn firmware(&self) -> Vec<(String, String)> {
        vec![("robot".to_owned(), "3.1".to_owned())]
    }
    fn stop_requested(&self) -> bool {
        self.stop.get() || self.lost.get()
    }
    fn lease_is_lost(&self) -> bool {
        self.lost.get()
    }
    fn timing_slack(&self) -> HostDuration {
        HostDuration::ZERO
    }
}

type Step = Box<dyn Fn(&mut Findings)>;

/// Scripted findings for each attempt. A check without a script has no findings.
#[derive(Default)]
pub(crate) struct Script(RefCell<BTreeMap<&'static str, VecDeque<Step>>>);

impl Script {
    pub(crate) fn attempt(
        self,
        check: &'static str,
        step: impl Fn(&mut Findings) + 'static,
    ) -> Self {
        let mut all = self.0.borrow_mut();
        all.entry(check).or_default().push_back(Box::new(step));
        drop(all);
        self
    }

    fn make(&self, check: &Check) -> Findings {
        let mut found = Findings::default();
        let step = self
            .0
            .borrow_mut()
            .get_mut(check.name)
            .and_then(VecDeque::pop_front);
        if let Some(step) = step {
            step(&mut found);
        }
        found
    }
}

/// Records the progress.
#[derive(Default)]
pub(crate) struct ProgressLog {
    pub started: Vec<(String, usize)>,
    pub published: Vec<(usize, bool)>,
}

impl NightObserver for ProgressLog {
    fn attempt_started(&mut self, _: &Night, check: &Check, attempt: usize) {
        self.started.push((check.name.to_owned(), attempt));
    }

    fn check_finished(&mut self, night: &Night) {
        self.published.push((night.checks.len(), night.finished));
    }
}

/// A suite with these checks and a budget in seconds.
pub(crate) fn suite(budget_s: u32, checks: &str) -> Suite {
    let text = format!(
        "skinrig_suite: 1\nname: scripted\nbudget: {budget_s} s\nrepeats: {{at_most: 2, must_pass: 2}}\nchecks:\n{checks}"
    );
    Suite::parse("suite.yaml", text.as_bytes()).unwrap_or_else(|e| panic!("{e}"))
}

/// Runs `suite` on `bench` with scripted findings.
pub(crate) fn night(
    suite: &Suite,
    script: &Script,
    clock: &ManualClock,
    bench: &mut DevicelessBench,
    progress: &mut ProgressLog,
) -> Night {
    let make = |check: &Check, _: &mut dyn Bench| script.make(check);
    let tonight = SuiteRunner {
        make: &make,
        ..SuiteRunner::new(suite, clock)
    };
    tonight.run(blank(), bench, progress)
}

/// As [`night`], with a new bench.
pub(crate) fn run_suite(suite: &Suite, script: &Script) -> Night {
    let (clock, mut bench) = (ManualClock::default(), DevicelessBench::new());
    night(
        suite,
        script,
        &clock,
        &mut bench,
        &mut ProgressLog::default(),
    )
}

pub(crate) fn blank() -> Night {
    Night {
        version: 1,
        id: "night".to_owned(),
        suite: "scripted".to_owned(),
        suite_sha256: String::new(),
        rig: "emulated".to_owned(),
        rig_kind: "emulated".to_owned(),
        rig_sha256: String::new(),
        versions: Versions::default(),
        started: "2026-11-20T02:00:00Z".to_owned(),
        took_s: 0.0,
        planned_s: 0.0,
        budget_s: 0.0,
        finished: false,
        ended_early: None,
        lease_note: None,
        notifications: Vec::new(),
        checks: Vec::new(),
        golden: None,
        verdict: Verdict::Fail,
        exit: NightExit::Fail,
    }
}

//! A bench without devices, a clock that is set, and checks that find what is written down for them.

use std::cell::{Cell, RefCell};
use std::collections::{BTreeMap, VecDeque};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};

use skinrig_device::{CameraSettings, Clock};
use skinrig_hil::bench::{Bench, Devices, Drilled, GoldenRun, Trouble};
use skinrig_hil::{Findings, Onlooker, Tonight};
use skinrig_model::{CameraId, HostDuration, HostTime};
use skinrig_nightly::{Night, NightExit, Verdict, Versions};
use skinrig_protocol::RigFile;
use skinrig_protocol::rig::Drill;
use skinrig_protocol::suite::{Check, Light, Suite};

const RIG: &str = include_str!("../../rigs/emulated.yaml");

/// Time that passes when a check says so.
#[derive(Clone, Default)]
pub struct Hands(Arc<AtomicI64>);

impl Hands {
    pub fn pass(&self, seconds: i64) {
        self.0.fetch_add(seconds * 1_000_000_000, Ordering::SeqCst);
    }
}

impl Clock for Hands {
    fn now(&self) -> HostTime {
        HostTime(self.0.load(Ordering::SeqCst))
    }

    fn wait_until(&mut self, t: HostTime) {
        self.0.fetch_max(t.0, Ordering::SeqCst);
    }
}

/// Counts how often it is closed; hands out nothing.
pub struct NoBench {
    rig: RigFile,
    pub closed: u32,
    pub stop: Cell<bool>,
    pub lost: Cell<bool>,
}

impl NoBench {
    pub fn new() -> Self {
        let environment = |_: &str| Some("/nowhere".to_owned());
        Self {
            rig: RigFile::parse("emulated.yaml", RIG.as_bytes(), &environment).unwrap(),
            closed: 0,
            stop: Cell::new(false),
            lost: Cell::new(false),
        }
    }
}

impl Bench for NoBench {
    fn rig(&self) -> &RigFile {
        &self.rig
    }
    fn devices(&mut self) -> &mut Devices {
        panic!("a bench without devices")
    }
    fn close(&mut self) {
        self.closed += 1;
    }
    fn camera_settings(&self, _: CameraId) -> Result<CameraSettings, Trouble> {
        Ok(CameraSettings::default())
    }
    fn light(&mut self, _: Light) -> Result<bool, Trouble> {
        Ok(false)
    }
    fn permits(&self, _: Drill) -> bool {
        true
    }
    fn watchdog_drill(&mut self) -> Result<Drilled, Trouble> {
        panic!("a bench without devices")
    }
    fn golden(&mut self, _: &Path) -> Result<GoldenRun, Trouble> {
        panic!("a bench without devices")
    }
    fn folder(&self) -> &Path {
        Path::new(".")
    }
    fn firmware(&self) -> Vec<(String, String)> {
        vec![("robot".to_owned(), "3.1".to_owned())]
    }
    fn stop_asked(&self) -> bool {
        self.stop.get() || self.lost.get()
    }
    fn lease_is_lost(&self) -> bool {
        self.lost.get()
    }
    fn patience(&self) -> HostDuration {
        HostDuration::ZERO
    }
}

type Step = Box<dyn Fn(&mut Findings)>;

/// What the checks find, attempt by attempt; a check of which nothing is written finds nothing.
#[derive(Default)]
pub struct Script(RefCell<BTreeMap<&'static str, VecDeque<Step>>>);

impl Script {
    pub fn then(self, check: &'static str, step: impl Fn(&mut Findings) + 'static) -> Self {
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

/// Keeps what it is shown.
#[derive(Default)]
pub struct Notes {
    pub begun: Vec<(String, usize)>,
    pub kept: Vec<(usize, bool)>,
}

impl Onlooker for Notes {
    fn begins(&mut self, _: &Night, check: &Check, attempt: usize) {
        self.begun.push((check.name.to_owned(), attempt));
    }

    fn made(&mut self, night: &Night) {
        self.kept.push((night.checks.len(), night.finished));
    }
}

/// A suite of these checks, within a budget of so many seconds.
pub fn suite(budget_s: u32, checks: &str) -> Suite {
    let text = format!(
        "skinrig_suite: 1\nname: scripted\nbudget: {budget_s} s\nrepeats: {{at_most: 2, must_pass: 2}}\nchecks:\n{checks}"
    );
    Suite::parse("suite.yaml", text.as_bytes()).unwrap_or_else(|e| panic!("{e}"))
}

/// A night of `suite` on `bench`, as the script tells it.
pub fn night(
    suite: &Suite,
    script: &Script,
    hands: &Hands,
    bench: &mut NoBench,
    notes: &mut Notes,
) -> Night {
    let make = |check: &Check, _: &mut dyn Bench| script.make(check);
    let tonight = Tonight {
        make: &make,
        ..Tonight::new(suite, hands)
    };
    tonight.run(blank(), bench, notes)
}

/// As [`night`], on a bench of its own.
pub fn plain(suite: &Suite, script: &Script) -> Night {
    let (hands, mut bench) = (Hands::default(), NoBench::new());
    night(suite, script, &hands, &mut bench, &mut Notes::default())
}

pub fn blank() -> Night {
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
        checks: Vec::new(),
        golden: None,
        verdict: Verdict::Fail,
        exit: NightExit::Fail,
    }
}

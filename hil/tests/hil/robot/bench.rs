//! A bench of simulated devices behind the `Bench` trait.

use std::cell::Cell;
use std::path::Path;
use std::rc::Rc;

use skinrig_device::CameraSettings;
use skinrig_hil::bench::{Bench, CampaignRun, Devices, DrillResult, OnlineComparison, Problem};
use skinrig_hil::{Findings, checks};
use skinrig_model::{CameraId, HostDuration, SimLevel};
use skinrig_nightly::{Evidence, EvidenceKind, GoldenSession};
use skinrig_protocol::RigFile;
use skinrig_protocol::rig::Drill;
use skinrig_protocol::suite::{Light, Suite};
use skinrig_sim::{Fault, SimConfig, simulated_rig};

const RIG: &str = include_str!("../../../rigs/emulated.yaml");

/// A bench that reopens its devices after a close and counts the openings.
pub(crate) struct SimBench {
    pub rig: RigFile,
    pub config: SimConfig,
    devices: Option<Devices>,
    pub opened: u32,
    pub drills: Vec<Drill>,
    pub drill_result: Option<DrillResult>,
    /// Polls of the stop signal before it fires; `None`: never.
    pub polls_until_stop: Rc<Cell<Option<u32>>>,
}

impl SimBench {
    pub(crate) fn new(faults: Vec<Fault>) -> Self {
        let environment = |_: &str| Some("/nowhere".to_owned());
        let rig = RigFile::parse("emulated.yaml", RIG.as_bytes(), &environment).unwrap();
        let mut config = SimConfig::new(1, SimLevel::Kinematic);
        config.robot_from_skin = rig.frame.robot_from_skin;
        config.workspace_mm = (rig.limits.workspace.min_mm, rig.limits.workspace.max_mm);
        config.faults = faults;
        Self {
            rig,
            config,
            devices: None,
            opened: 0,
            drills: vec![Drill::Watchdog, Drill::Stop],
            drill_result: None,
            polls_until_stop: Rc::default(),
        }
    }

    /// Runs the check `text`, for example `robot_state: {creep: {at_most: 1 mm}}`.
    pub(crate) fn run_check(&mut self, text: &str) -> Findings {
        let text = format!("skinrig_suite: 1\nname: one\nbudget: 1 h\nchecks:\n  {text}\n");
        let suite = Suite::parse("suite.yaml", text.as_bytes()).unwrap_or_else(|e| panic!("{e}"));
        let [check] = &suite.checks[..] else {
            panic!("one check");
        };
        checks::run(check, self)
    }
}

impl Bench for SimBench {
    fn rig(&self) -> &RigFile {
        &self.rig
    }

    fn devices(&mut self) -> &mut Devices {
        if self.devices.is_none() {
            self.opened += 1;
        }
        let config = &self.config;
        self.devices.get_or_insert_with(|| {
            let rig = simulated_rig(config);
            let [one, two] = rig.cameras;
            Devices {
                robot: Ok(rig.indenter),
                cameras: [Ok(one), Ok(two)],
                trigger_box: rig.trigger_box.map(Ok),
                clock: rig.clock,
            }
        })
    }

    fn close(&mut self) {
        self.devices = None;
    }

    fn camera_settings(&self, _: CameraId) -> Result<CameraSettings, Problem> {
        Ok(CameraSettings::default())
    }

    fn set_light(&mut self, _: Light) -> Result<bool, Problem> {
        Ok(false)
    }

    fn permits(&self, drill: Drill) -> bool {
        self.drills.contains(&drill)
    }

    fn watchdog_drill(&mut self) -> Result<DrillResult, Problem> {
        let why = || Evidence::new(EvidenceKind::Software, "robot", "no drill here");
        self.drill_result.clone().ok_or_else(|| Box::new(why()))
    }

    fn run_campaign(&mut self, _: &Path) -> Result<CampaignRun, Problem> {
        let why = Evidence::new(EvidenceKind::Absent, "robot", "no golden skin here");
        Err(Box::new(why))
    }

    fn compare_online(&mut self, _: &GoldenSession) -> Result<OnlineComparison, Problem> {
        panic!("no campaign here")
    }

    fn folder(&self) -> &Path {
        Path::new(".")
    }

    fn stop_signal(&self) -> Box<dyn Fn() -> bool> {
        let left = Rc::clone(&self.polls_until_stop);
        Box::new(move || {
            let was = left.get();
            left.set(was.map(|n| n.saturating_sub(1)));
            was == Some(0)
        })
    }

    fn timing_slack(&self) -> HostDuration {
        HostDuration::ZERO
    }
}

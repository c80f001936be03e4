//! A bench of simulated devices behind the `Bench` trait.

use std::path::{Path, PathBuf};

use skinrig_device::CameraSettings;
use skinrig_hil::bench::{Bench, CampaignRun, Devices, DrillResult, OnlineComparison, Problem};
use skinrig_hil::findings::Value;
use skinrig_hil::{Findings, checks};
use skinrig_model::{CameraId, HostDuration, SimLevel};
use skinrig_nightly::{Evidence, EvidenceKind, GoldenSession};
use skinrig_protocol::RigFile;
use skinrig_protocol::rig::Drill;
use skinrig_protocol::suite::{Light, Suite};
use skinrig_sim::drifting::DriftingClock;
use skinrig_sim::random::{Purpose, Stream};
use skinrig_sim::{Fault, SimConfig, simulated_rig};

const RIG: &str = include_str!("../../../rigs/emulated.yaml");

/// Simulated devices with the rig file of an emulated bench.
pub(crate) struct SimBench {
    pub config: SimConfig,
    pub rig: RigFile,
    pub devices: Option<Devices>,
    pub folder: PathBuf,
    /// Result of switching the lamps.
    pub lamps: Result<bool, Problem>,
    pub switched: Vec<Light>,
    /// Whether the stop signal is set.
    pub stop: bool,
}

impl SimBench {
    pub(crate) fn new(level: SimLevel, faults: Vec<Fault>) -> Self {
        let rig = RigFile::parse("emulated.yaml", RIG.as_bytes(), &|_| {
            Some("/nowhere".to_owned())
        });
        let mut config = SimConfig::new(1, level);
        config.faults = faults;
        Self {
            config,
            rig: rig.unwrap_or_else(|e| panic!("{e}")),
            devices: None,
            folder: std::env::temp_dir(),
            lamps: Ok(false),
            switched: Vec::new(),
            stop: false,
        }
    }

    /// Runs the check `text`.
    pub(crate) fn run_check(&mut self, text: &str) -> Findings {
        let text = format!("skinrig_suite: 1\nname: one\nbudget: 1 h\nchecks:\n  {text}\n");
        let suite = Suite::parse("suite.yaml", text.as_bytes()).unwrap_or_else(|e| panic!("{e}"));
        let found = checks::run(&suite.checks[0], self);
        for camera in self.devices().cameras.iter_mut().flatten() {
            assert!(
                camera.start().is_ok(),
                "a check stops the cameras that it started"
            );
            camera.stop(&mut Vec::new()).unwrap();
        }
        found
    }

    /// Rate of a camera's clock relative to the box's, ppm.
    pub(crate) fn drift_ppm(&self, camera: CameraId) -> f64 {
        let of = |purpose, index, origin_s, ppm| {
            let mut random = Stream::new(self.config.seed, purpose, index);
            DriftingClock::draw(origin_s, ppm, &mut random, 0).drift_ppb() as f64 * 1e-9
        };
        let (c, b) = (self.config.camera_clock, self.config.trigger_box);
        let index = camera.index() as u64;
        let camera = of(Purpose::CameraClock, index, c.max_origin_s, c.max_drift_ppm);
        let box_ = of(Purpose::TriggerBox, 1, b.max_origin_s, b.max_drift_ppm);
        ((1.0 + camera) / (1.0 + box_) - 1.0) * 1e6
    }
}

/// The value of `metric` on `subject`; panics unless there is exactly one.
pub(crate) fn value<'a>(found: &'a Findings, subject: &str, metric: &str) -> &'a Value {
    let is_it = |v: &&Value| v.subject == subject && v.metric == metric;
    let mut values = found.values.iter().filter(is_it);
    let first = values
        .next()
        .unwrap_or_else(|| panic!("expected {subject} {metric}, found {found:#?}"));
    assert!(
        values.next().is_none(),
        "expected one {subject} {metric}, found {found:#?}"
    );
    first
}

/// The measured number of `metric` on `subject`; panics if it was not measured.
pub(crate) fn number(found: &Findings, subject: &str, metric: &str) -> f64 {
    let value = value(found, subject, metric).value;
    value.unwrap_or_else(|| panic!("{subject} {metric} unmeasured in {found:#?}"))
}

/// Kind and subject of each piece of evidence.
pub(crate) fn kinds_and_subjects(found: &Findings) -> Vec<(EvidenceKind, &str)> {
    found
        .evidence
        .iter()
        .map(|e| (e.kind, e.subject.as_str()))
        .collect()
}

impl Bench for SimBench {
    fn rig(&self) -> &RigFile {
        &self.rig
    }

    fn devices(&mut self) -> &mut Devices {
        self.devices.get_or_insert_with(|| {
            let rig = simulated_rig(&self.config);
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

    fn camera_settings(&self, _camera: CameraId) -> Result<CameraSettings, Problem> {
        Ok(CameraSettings {
            trigger_channels: vec![0],
            ..CameraSettings::default()
        })
    }

    fn set_light(&mut self, light: Light) -> Result<bool, Problem> {
        self.switched.push(light);
        self.lamps.clone()
    }

    fn permits(&self, _drill: Drill) -> bool {
        false
    }

    fn watchdog_drill(&mut self) -> Result<DrillResult, Problem> {
        Err(Box::new(Evidence::new(
            EvidenceKind::Software,
            "robot",
            "not here",
        )))
    }

    fn run_campaign(&mut self, _protocol: &Path) -> Result<CampaignRun, Problem> {
        Err(Box::new(Evidence::new(
            EvidenceKind::Software,
            "skin",
            "not here",
        )))
    }

    fn compare_online(&mut self, _: &GoldenSession) -> Result<OnlineComparison, Problem> {
        panic!("no campaign here")
    }

    fn stop_signal(&self) -> Box<dyn Fn() -> bool> {
        let stop = self.stop;
        Box::new(move || stop)
    }

    fn folder(&self) -> &Path {
        &self.folder
    }

    fn timing_slack(&self) -> HostDuration {
        HostDuration::ZERO
    }
}

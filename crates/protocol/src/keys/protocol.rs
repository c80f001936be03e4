//! Keys of a protocol as a whole.

use skinrig_model::AnalysisSettings;
use skinrig_settings::Settings;

use super::camera::Cameras;
use super::evaluation::Evaluation;
use super::frame::{Frame, SyncKeys};
use super::motion::{LimitKeys, MotionKeys, Triggers};
use super::path::{Order, Path, Repetitions};
use super::ranges::{DEPTH_MM, VERSION};
use super::scene::SceneKeys;
use crate::design::CalibrateAt;
use crate::faults::{self, PlantedFault};
use crate::online::OnlineKeys;
use crate::protocol::Prototype;
use crate::retakes::Retakes;
use crate::stop::StopKeys;
use crate::surface::Surface;
use crate::surface_check::SurfaceCheck;
use crate::suspend::Suspend;

/// A skinrig protocol: where, how deep and how often to press the skin, and the role of each press.
#[derive(Settings)]
#[settings(name = "protocol", parts = ProtocolParts, exactly_one("depth", "depths"))]
pub(crate) struct ProtocolKeys {
    /// Version of the protocol language: 1.
    #[setting(min = VERSION, max = VERSION)]
    pub skinrig: u32,
    /// Short name of the experiment.
    pub name: String,
    /// Purpose of the experiment, in a few sentences.
    pub description: Option<String>,
    /// Operator. Stored with the session.
    pub operator: String,
    /// The skin under test. Stored with the session.
    pub prototype: Prototype,
    /// Seed of everything random in the run that has no seed of its own. Stored with the session.
    #[setting(default = "1")]
    pub seed: u64,
    /// The simulated rig: what it must be good for, and how it differs from the published one. A real bench ignores it.
    #[setting(default)]
    pub scene: SceneKeys,
    /// The skin in its own frame: mm, z out of the surface, z = 0 at the touched surface.
    #[setting(default)]
    pub frame: Frame,
    /// Presses before everything else that let camera clocks be aligned without triggers.
    pub sync: Option<SyncKeys>,
    /// The locations that are pressed: exactly one kind of path.
    pub path: Path,
    /// How often the whole path is run, and what happens between.
    #[setting(default)]
    pub repetitions: Repetitions,
    /// In which order the presses of a repetition come.
    #[setting(default = "listed")]
    pub order: Order,
    /// Indentation depth of every press, below the touched surface.
    #[setting(range = DEPTH_MM, example = "1 mm")]
    pub depth_mm: Option<f64>,
    /// Several indentation depths: each repetition runs the whole path once per depth, in this order.
    #[setting(range = DEPTH_MM, items = 1..=1000)]
    pub depths_mm: Option<Vec<f64>>,
    /// How the robot moves.
    #[setting(default)]
    pub motion: MotionKeys,
    /// Safety limits. Checked for every segment of motion before a device is opened, and enforced during the run.
    pub limits: LimitKeys,
    /// How presses find the surface; absent: as set in the rig file, otherwise at z = 0 of the frame.
    pub press: Option<Surface>,
    /// Touches the surface at some points before the first press, and ends the run if it is not where the frame puts it; no check
    /// when absent.
    pub surface_check: Option<SurfaceCheck>,
    /// Immediate retakes of presses whose data were lost or that were too late.
    #[setting(default)]
    pub retakes: Retakes,
    /// Conditions that suspend the run until a disturbance is over.
    #[setting(default)]
    pub suspend: Suspend,
    /// The trigger line to the cameras.
    #[setting(default)]
    pub triggers: Triggers,
    /// Which repetitions calibrate the camera geometry and which are scored. Presses that calibrate never score.
    pub evaluation: Evaluation,
    /// Which locations of the path calibrating repetitions press; all when absent.
    pub calibrate_at: Option<CalibrateAt>,
    /// When the campaign ends by itself, before all its repetitions; never when absent.
    pub stop: Option<StopKeys>,
    /// Touch felt while the session is recorded; nothing is felt when absent.
    pub online: Option<OnlineKeys>,
    /// Settings of the analysis that follows the run.
    #[setting(default)]
    pub analysis: AnalysisSettings,
    /// Settings written to the cameras before the run and read back.
    #[setting(default)]
    pub cameras: Cameras,
    /// Injected faults, each KIND@WHEN such as camera1-stalled@hold:3 (docs/reference/runs.md). Simulated rig only.
    #[setting(shape = faults::SHAPE, read = faults::faults)]
    pub faults: Option<Vec<PlantedFault>>,
}

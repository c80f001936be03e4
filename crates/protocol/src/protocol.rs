//! A parsed and validated protocol.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Serialize;
use skinrig_model::{
    AnalysisSettings, CameraModel, HostDuration, MarkKind, Point2, Point3, PressRole, SceneNeed,
    ScenePart, SimLevel, Skin, level_bias::Tolerance,
};

use skinrig_settings::{Location, Settings};

use crate::area::Surroundings;
use crate::faults::PlantedFault;
use crate::online::Online;
use crate::plan::RunLimits;
use crate::retakes::Retakes;
use crate::stop::DeclaredStop;
use crate::surface::Surface;
use crate::surface_check::SurfaceCheck;
use crate::suspend::Suspend;

/// Reads a file that a protocol names. The path is the protocol's folder joined with the name in the protocol.
pub(crate) type Loader<'a> = &'a dyn Fn(&Path) -> std::io::Result<Vec<u8>>;

/// A protocol that was read and checked. Lengths in mm, skin frame.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Protocol {
    /// The file's name as given to [`Protocol::parse`].
    pub file_name: String,
    /// The text as the user wrote it, byte for byte.
    pub text: String,
    /// Lower-case hex SHA-256 of the text.
    pub sha256: String,
    /// Values overridden on the command line, in order, as `key=value`.
    pub overrides: Vec<String>,
    /// Short name of the experiment.
    pub name: String,
    /// Purpose of the experiment.
    pub description: Option<String>,
    /// The operator.
    pub operator: String,
    /// The skin under test.
    pub prototype: Prototype,
    /// Default seed of everything random.
    pub seed: u64,
    /// Requirements for a simulated rig.
    pub scene: Scene,
    /// The skin's outline and keep-outs.
    pub surroundings: Surroundings,
    /// Presses before everything else.
    pub sync: Option<Sync>,
    /// Every location of the path, in order.
    pub locations: Vec<Point2>,
    /// The kind of path as typed: `meander`, `circles`, `points`, `csv` or `random`.
    pub path_kind: &'static str,
    /// Role of each repetition; at least one.
    pub roles: Vec<PressRole>,
    /// Indices of the locations that calibrating repetitions press, in order; `None`: all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub calibrate_at: Option<Vec<usize>>,
    /// Whether to return above the first location before the pause between repetitions.
    pub return_to_start: bool,
    /// Pause between repetitions.
    pub pause_between: HostDuration,
    /// Seed of the order; `None`: as listed.
    pub shuffle_seed: Option<u64>,
    /// Indentation depths, at least one, mm.
    pub depths_mm: Vec<f64>,
    /// How the robot moves.
    pub motion: Motion,
    /// Limits of the run.
    pub limits: RunLimits,
    /// Limits on retakes of a press.
    pub retakes: Retakes,
    /// Number of consecutive invalid presses that ends the run; 0: no limit.
    pub max_consecutive_invalid: u32,
    /// Surface check before the first press.
    pub surface_check: Option<SurfaceCheck>,
    /// Conditions that suspend the run.
    pub suspend: Suspend,
    /// When the campaign ends by itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stop: Option<DeclaredStop>,
    /// How touches are felt while the session is recorded.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub online: Option<Online>,
    /// Injected faults; none in a real protocol.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub faults: Vec<PlantedFault>,
    /// Moments that emit a mark on the trigger line.
    pub marks: Vec<MarkKind>,
    /// How presses find the surface; `None`: as set in the rig file, otherwise at z = 0.
    pub surface: Option<Surface>,
    /// Settings of the analysis.
    pub analysis: AnalysisSettings,
    /// Settings of camera 1 and camera 2.
    pub cameras: [CameraRequest; 2],
    /// Locations of the keys that a plan can violate.
    #[serde(skip)]
    pub(crate) key_places: BTreeMap<&'static str, Location>,
}

/// The skin under test.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Settings)]
pub struct Prototype {
    /// Identifier of the prototype as written on it.
    pub id: String,
    /// Material, thickness and other details.
    pub description: Option<String>,
    /// The indenter's tip.
    pub tip: Option<String>,
}

/// A simulated rig.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Scene {
    /// The level to simulate: the named one, or the cheapest that satisfies the needs and tolerances.
    pub level: SimLevel,
    /// The requirements from the protocol.
    pub needs: Vec<SceneNeed>,
    /// How far the level may be from the optical one.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub tolerances: Vec<Tolerance>,
    /// True if the protocol sets the level explicitly.
    pub level_is_named: bool,
    /// Physics added to the optical level.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub parts: Vec<ScenePart>,
    /// The skin, if it differs from the published one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub skin: Option<SimulatedSkin>,
    /// Random events of the pixels, relative to the model's, 0.01 to 100.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise: Option<f64>,
    /// The session that the scene was fitted to.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub twin_of: Option<String>,
    /// Camera 1 and camera 2 as drawn, if they are not at the published positions.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cameras: Option<[CameraModel; 2]>,
}

/// Properties of a simulated skin. Defaults and sources: the optical model's constants.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SimulatedSkin {
    /// Thickness, mm, 0.5 to 50.
    pub thickness_mm: f64,
    /// Length over which guided light fades to 1/e, mm, 5 to 10,000.
    pub attenuation_length_mm: f64,
    /// Part of a press's effect that follows slowly, 0 to 1.
    pub creep_share: f64,
    /// Time constant of that part, up to 60 s.
    pub creep_time: HostDuration,
    /// Brightness of a dent's flanks, relative to a matt white flank, 0.1 to 10.
    pub flank_brightness: f64,
    /// Light that a dent takes away, relative to the published skin, 0.01 to 100.
    pub light_loss: f64,
    /// Standard deviation of the dent's position from press to press, per axis, mm; `None`: that of the scene's parts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub press_scatter_mm: Option<f64>,
    /// Standard deviation of the dent's depth as a share of it; `None`: that of the scene's parts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub depth_scatter: Option<f64>,
    /// Share of the presses that dent the skin little; `None`: that of the scene's parts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub weak_presses: Option<f64>,
    /// Distance of the pod's centre from the lens, mm, up to 2.9; `None`: that of the scene's parts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pod_offset_mm: Option<f64>,
}

/// Presses before everything else.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Sync {
    /// How many.
    pub count: u32,
    /// Period from start to start, s.
    pub interval_s: f64,
    /// Where.
    pub at: Point2,
    /// Pause after the last one.
    pub pause_after: HostDuration,
    /// How deep, mm.
    pub depth_mm: f64,
}

/// A speed, or the time that a motion takes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Pace {
    /// mm/s.
    Speed(f64),
    /// s.
    Time(f64),
}

impl Pace {
    /// The speed over `distance_mm`, mm/s.
    #[must_use]
    pub fn speed_mm_s(self, distance_mm: f64) -> f64 {
        match self {
            Self::Speed(v) => v,
            Self::Time(s) => distance_mm / s,
        }
    }
}

/// How the robot moves.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Motion {
    /// From clearance height to the surface.
    pub approach: Pace,
    /// From the surface to depth.
    pub indent: Pace,
    /// Time at depth after settling.
    pub hold: HostDuration,
    /// From depth to clearance height.
    pub retract: Pace,
    /// Lateral motion, mm/s.
    pub travel_mm_s: f64,
    /// Period from the start of one press to the next, s; `None`: as fast as possible.
    pub period_s: Option<f64>,
    /// Position of the tip before the run.
    pub home: Point3<Skin>,
}

/// Settings of one camera; missing ones keep the device's default.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct CameraRequest {
    /// Bias values by name, in the device's own unit.
    pub biases: BTreeMap<String, i64>,
    /// Pixels that stay on: first column, first row, columns, rows.
    pub roi: Option<[u16; 4]>,
}

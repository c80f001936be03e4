//! A protocol: what the user asked for, typed and checked.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Serialize;
use skinrig_model::{
    AnalysisSettings, HostDuration, MarkKind, Point2, Point3, PressRole, SceneNeed, SimLevel, Skin,
};

use skinrig_settings::{Location, Settings};

use crate::area::Surroundings;
use crate::faults::PlantedFault;
use crate::plan::RunLimits;
use crate::retakes::Retakes;
use crate::surface::Surface;
use crate::surface_check::SurfaceCheck;
use crate::suspend::Suspend;

/// Reads a file that a protocol names. The path is the protocol's folder joined with the name in the protocol.
pub type Loader<'a> = &'a dyn Fn(&Path) -> std::io::Result<Vec<u8>>;

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
    /// What it is for.
    pub description: Option<String>,
    /// Who runs it.
    pub operator: String,
    /// Which skin is pressed.
    pub prototype: Prototype,
    /// Seed of everything random that has no seed of its own.
    pub seed: u64,
    /// What a simulated rig must be good for.
    pub scene: Scene,
    /// The skin's outline and what must not be touched.
    pub surroundings: Surroundings,
    /// Presses before everything else.
    pub sync: Option<Sync>,
    /// Every location of the path, in order.
    pub locations: Vec<Point2>,
    /// The kind of path as typed: `meander`, `circles`, `points`, `csv` or `random`.
    pub path_kind: &'static str,
    /// What each repetition is for; its length is the number of repetitions, at least 1.
    pub roles: Vec<PressRole>,
    /// Go back above the first location before the pause between repetitions.
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
    /// How often a press may be taken again.
    pub retakes: Retakes,
    /// So many invalid presses in a row end the run; 0: no limit.
    pub max_consecutive_invalid: u32,
    /// Where the surface is touched before the first press.
    pub surface_check: Option<SurfaceCheck>,
    /// When the run waits by itself.
    pub suspend: Suspend,
    /// Faults made on purpose; none in a real protocol.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub faults: Vec<PlantedFault>,
    /// Moments that emit a mark on the trigger line.
    pub marks: Vec<MarkKind>,
    /// How presses find the surface; `None`: as the rig says, at z = 0 when it says nothing.
    pub surface: Option<Surface>,
    /// Settings of the analysis.
    pub analysis: AnalysisSettings,
    /// Settings of camera 1 and camera 2.
    pub cameras: [CameraRequest; 2],
    /// Where the keys stand that a plan may break.
    #[serde(skip)]
    pub(crate) key_places: BTreeMap<&'static str, Location>,
}

/// Which skin is pressed.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Settings)]
pub struct Prototype {
    /// Identifier of the prototype as written on it.
    pub id: String,
    /// Material, thickness, anything worth keeping.
    pub description: Option<String>,
    /// The indenter's tip.
    pub tip: Option<String>,
}

/// What a simulated rig must be good for.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Scene {
    /// The level to simulate: the named one, or the cheapest that satisfies the needs.
    pub level: SimLevel,
    /// The needs as given.
    pub needs: Vec<SceneNeed>,
    /// True when the protocol names the level outright.
    pub level_is_named: bool,
}

/// Presses before everything else.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Sync {
    /// How many.
    pub count: u32,
    /// From begin to begin, s.
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
    /// From begin of a press to begin of the next, s; `None`: as fast as possible.
    pub period_s: Option<f64>,
    /// Where the tip waits before the run.
    pub home: Point3<Skin>,
}

/// Settings of one camera; everything absent keeps the device's default.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct CameraRequest {
    /// Bias values by name, in the device's own unit.
    pub biases: BTreeMap<String, i64>,
    /// Pixels that stay on: first column, first row, columns, rows.
    pub roi: Option<[u16; 4]>,
}

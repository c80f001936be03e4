//! Keys of motion, limits and triggers.

use skinrig_model::{HostDuration, MarkKind, Point3, Skin};
use skinrig_settings::{Collector, Dimension, Field, Setting, Settings, Shape, Value};

use super::ranges::{DEPTH_MM, POSITIVE_LENGTH_MM, POSITIVE_SPAN_S, SPAN_S, SPEED_MM_S};
use crate::plan::TripReaction;
use crate::protocol::Pace;

/// How the robot moves. A pace is a speed, or the time that the motion takes.
#[derive(Settings)]
#[settings(name = "motion", parts = MotionParts)]
pub(crate) struct MotionKeys {
    /// Height above the surface at which lateral motion is allowed.
    #[setting(default = "5 mm", range = POSITIVE_LENGTH_MM)]
    pub clearance_mm: f64,
    /// From clearance height to the surface: speed or time.
    #[setting(default = "40 mm/s", value = Pace::Speed(40.0))]
    pub approach: Pace,
    /// From the surface to depth: speed or time.
    #[setting(default = "20 mm/s", value = Pace::Speed(20.0))]
    pub indent: Pace,
    /// Time at depth after settling.
    #[setting(default = "150 ms", range = SPAN_S)]
    pub hold: HostDuration,
    /// From depth to clearance height: speed or time.
    #[setting(default = "20 mm/s", value = Pace::Speed(20.0))]
    pub retract: Pace,
    /// Lateral motion at clearance height.
    #[setting(default = "60 mm/s", range = SPEED_MM_S)]
    pub travel_mm_s: f64,
    /// Time from the start of one press to the start of the next; as fast as possible when absent. The paper: `868 s / 289`.
    #[setting(range = POSITIVE_SPAN_S)]
    pub period_s: Option<f64>,
    /// When a pose counts as settled.
    #[setting(default)]
    pub settle: SettleCriterion,
    /// Where the tip waits before the run; above the centre of the outline at clearance height when absent.
    pub home: Option<Point3<Skin>>,
}

/// Condition for a settled pose.
#[derive(Settings)]
#[settings(name = "settle")]
pub(crate) struct SettleCriterion {
    /// Largest distance from the target.
    #[setting(default = "0.05 mm", above = 0.0, max = 10.0)]
    pub tolerance_mm: f64,
    /// How long the pose must stay that close.
    #[setting(default = "20 ms", range = SPAN_S)]
    pub time: HostDuration,
}

impl Setting for Pace {
    const SHAPE: Shape = Shape::Quantity(&[Dimension::Speed, Dimension::Time], SPEED_MM_S);

    fn from_field(field: &Field, _: &mut Collector) -> Option<Self> {
        match field.value {
            Value::Quantity(s, Dimension::Time) => Some(Self::Time(s)),
            Value::Quantity(mm_s, _) => Some(Self::Speed(mm_s)),
            _ => None,
        }
    }

    fn text(&self) -> String {
        match self {
            Self::Speed(mm_s) => format!("{mm_s} mm/s"),
            Self::Time(s) => format!("{s} s"),
        }
    }
}

/// Safety limits.
#[derive(Settings)]
#[settings(name = "limits", parts = LimitParts)]
pub(crate) struct LimitKeys {
    /// The box that the tip never leaves, skin frame.
    pub workspace: Workspace,
    /// Deepest indentation.
    #[setting(range = DEPTH_MM)]
    pub max_depth_mm: f64,
    /// Fastest motion.
    #[setting(range = SPEED_MM_S)]
    pub max_speed_mm_s: f64,
    /// A measured force above this ends the run. At most 12 N, what the Omega.3 can exert.
    #[setting(above = 0.0, max = 12.0)]
    pub max_force_n: f64,
    /// Largest acceleration of the robot's set point; absent: that of the robot's setup.
    #[setting(above = 0.0, max = 10_000.0)]
    pub max_acceleration_mm_s2: Option<f64>,
    /// This many consecutive invalid presses end the run, because they suggest a fault that more presses cannot fix. 0: no limit.
    #[setting(default = "5", max = 100_000)]
    pub max_consecutive_invalid: u32,
    /// Reaction of the robot to an exceeded limit.
    #[setting(default = "retract")]
    pub on_trip: TripReaction,
}

/// A box in the skin frame.
#[derive(Settings)]
#[settings(finish = Self::not_empty)]
pub(crate) struct Workspace {
    /// Lowest x, y and z.
    #[setting(example = "[-50 mm, -60 mm, -5 mm]")]
    pub min: Point3<Skin>,
    /// Highest x, y and z.
    #[setting(example = "[70 mm, 60 mm, 40 mm]")]
    pub max: Point3<Skin>,
}

impl Workspace {
    fn not_empty(self, field: &Field, out: &mut Collector) -> Option<Self> {
        for (axis, low, high) in [
            ("x", self.min.x_mm, self.max.x_mm),
            ("y", self.min.y_mm, self.max.y_mm),
            ("z", self.min.z_mm, self.max.z_mm),
        ] {
            if low >= high {
                out.error(field.span, field.path.as_str(), "the workspace is empty")
                    .expected(format!("`min` smaller than `max` in {axis}"))
                    .found(format!("{low} mm and {high} mm"));
            }
        }
        Some(self)
    }
}

/// The trigger line to the cameras.
#[derive(Settings)]
#[settings(finish = Self::each_once)]
pub(crate) struct Triggers {
    /// Moments of a press that emit a coded pulse.
    #[setting(default = "[contact, retract]", value = vec![MarkKind::Contact, MarkKind::Retract], items = 0..=5)]
    pub marks: Vec<MarkKind>,
}

impl Triggers {
    fn each_once(mut self, field: &Field, out: &mut Collector) -> Option<Self> {
        for (i, (mark, item)) in self.marks.iter().zip(field.at("marks").items()).enumerate() {
            if self.marks.iter().take(i).any(|earlier| earlier == mark) {
                out.error(item.span, item.path.as_str(), "the mark is given twice")
                    .expected("each mark once")
                    .found(format!("`{}`", mark.name()));
            }
        }
        self.marks.sort_unstable();
        Some(self)
    }
}

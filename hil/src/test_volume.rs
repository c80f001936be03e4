//! The volume in which a check may move the arm, verified against the rig file before any motion.

use skinrig_model::{Point2, Point3, RigidTransform, Robot, Skin};
use skinrig_nightly::{Evidence, EvidenceKind};
use skinrig_protocol::rig::{BenchLimits, RigFile, RigKind};

use crate::bench::Problem;

/// Height above which the tip may move sideways, mm.
pub(crate) const CLEARANCE_MM: f64 = 5.0;
/// Lowest height of motion in free air, mm.
const AIR_HEIGHT_MM: f64 = 10.0;
/// Height range of the points in free air, mm.
const HEIGHT_RANGE_MM: f64 = 8.0;
/// Distance of the outer points from the centre along x and y, mm.
const POINT_OFFSET_MM: f64 = 8.0;
/// Margin around the points for the paths between them and for the final rise, mm.
pub(crate) const MARGIN_MM: f64 = 5.0;
/// Distance of the press points from the origin of a frame without a touch-off, mm.
const ORIGIN_OFFSET_MM: f64 = 5.0;

/// The volume in which checks move the tip.
#[derive(Debug, Clone)]
pub struct TestVolume {
    /// Motion limits of the rig file.
    pub limits: BenchLimits,
    /// Pose of the skin.
    pub robot_from_skin: RigidTransform<Robot, Skin>,
    /// Centroid of the touch-off points; the frame's origin without a touch-off. Skin frame, mm.
    pub centre: Point2,
    /// Points to press: the touch-off points, moved toward the centre by the size of the tip. Skin frame, mm.
    pub press_points: Vec<Point2>,
}

impl TestVolume {
    /// Derives the volume from a rig file. `today` is in days since 1970-01-01, UTC.
    ///
    /// # Errors
    /// When the frame is too old, or the workspace does not contain the volume.
    pub(crate) fn from_rig(rig: &RigFile, today: i64) -> Result<Self, Problem> {
        let age_days = today - rig.frame.date.days_since_1970();
        let most_h = rig.preflight.touch_off_max_age.as_secs_f64() / 3600.0;
        // Tolerate a day in either direction, as preflight does: a date has no hour, and time zones differ.
        let recent = (-1..=(most_h / 24.0).ceil() as i64).contains(&age_days);
        if rig.kind == RigKind::Bench && !recent {
            let found = rig.frame.date;
            let what = format!("frame: expected measured at most {most_h:.0} h ago, found {found}");
            return Err(motion_refused(
                what,
                "touch off the skin again with `skinrig jog`, and paste the printed block into the rig file",
            ));
        }
        let (centre, press_points) = press_points(rig);
        let volume = Self {
            limits: rig.limits,
            robot_from_skin: rig.frame.robot_from_skin,
            centre,
            press_points,
        };
        let corners = volume.corners();
        let outside = corners.iter().find(|p| !volume.contains(**p));
        outside.map_or(Ok(volume.clone()), |p| {
            let [x, y, z] = p.to_array();
            Err(motion_refused(
                format!(
                    "workspace: expected space above the skin's centre, {:.0} mm around it and {AIR_HEIGHT_MM:.0} to {:.0} mm high, \
                    found the skin-frame point ({x:.0}, {y:.0}, {z:.0}) mm outside",
                    POINT_OFFSET_MM + MARGIN_MM,
                    AIR_HEIGHT_MM + HEIGHT_RANGE_MM + MARGIN_MM
                ),
                "widen `limits.workspace` of the rig file if the arm has that space, or skip the check",
            ))
        })
    }

    /// Five points in free air: the centre and four around it, alternately low and high.
    #[must_use]
    pub(crate) fn air_points(&self) -> [Point3<Skin>; 5] {
        let Point2 { x_mm: x, y_mm: y } = self.centre;
        let (low, high) = (AIR_HEIGHT_MM, AIR_HEIGHT_MM + HEIGHT_RANGE_MM);
        [
            Point3::new(x, y, (low + high) / 2.0),
            Point3::new(x + POINT_OFFSET_MM, y, low),
            Point3::new(x, y + POINT_OFFSET_MM, high),
            Point3::new(x - POINT_OFFSET_MM, y, low),
            Point3::new(x, y - POINT_OFFSET_MM, high),
        ]
    }

    /// Height of the top of the volume, mm.
    #[must_use]
    pub fn top_mm(&self) -> f64 {
        AIR_HEIGHT_MM + HEIGHT_RANGE_MM + MARGIN_MM
    }

    /// Whether a point lies in the robot's workspace.
    #[must_use]
    pub fn contains(&self, at: Point3<Skin>) -> bool {
        let position = self.robot_from_skin.apply(at).to_array();
        self.limits.workspace.contains(position)
    }

    /// Bounding box of the workspace in the skin frame: smallest and largest coordinates, mm.
    #[must_use]
    pub(crate) fn workspace_bounds(&self) -> ([f64; 3], [f64; 3]) {
        let skin_from_robot = self.robot_from_skin.inverse();
        let (mut least, mut most) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        let workspace = &self.limits.workspace;
        for corner in corners(workspace.min_mm, workspace.max_mm) {
            let [x, y, z] = corner;
            let at = skin_from_robot.apply(Point3::new(x, y, z)).to_array();
            for i in 0..3 {
                least[i] = least[i].min(at[i]);
                most[i] = most[i].max(at[i]);
            }
        }
        (least, most)
    }

    /// Corners of the volume in free air.
    fn corners(&self) -> [Point3<Skin>; 8] {
        let Point2 { x_mm: x, y_mm: y } = self.centre;
        let aside = POINT_OFFSET_MM + MARGIN_MM;
        let (least, most) = (
            [x - aside, y - aside, AIR_HEIGHT_MM - MARGIN_MM],
            [x + aside, y + aside, self.top_mm()],
        );
        corners(least, most).map(|[x, y, z]| Point3::new(x, y, z))
    }
}

/// Centre and press points of the skin.
fn press_points(rig: &RigFile) -> (Point2, Vec<Point2>) {
    let Some(touch_off) = &rig.frame.touch_off else {
        let around = [(0.0, 0.0), (ORIGIN_OFFSET_MM, 0.0), (0.0, ORIGIN_OFFSET_MM)];
        let press_points = around.map(|(x, y)| Point2::new(x, y));
        return (press_points[0], press_points.to_vec());
    };
    let n = touch_off.points.len() as f64;
    let sum = |of: fn(&Point2) -> f64| -> f64 {
        touch_off.points.iter().map(|p| of(&p.skin.plane())).sum()
    };
    let centre = Point2::new(sum(|p| p.x_mm) / n, sum(|p| p.y_mm) / n);
    let move_inward = |p: Point2| {
        let radius_mm = p.distance_mm(centre);
        let scale = (1.0 - rig.tip.size_mm / radius_mm).max(0.0);
        Point2::new(
            centre.x_mm + scale * (p.x_mm - centre.x_mm),
            centre.y_mm + scale * (p.y_mm - centre.y_mm),
        )
    };
    let press_points = touch_off.points.iter().map(|p| move_inward(p.skin.plane()));
    (centre, press_points.collect())
}

fn corners(least: [f64; 3], most: [f64; 3]) -> [[f64; 3]; 8] {
    std::array::from_fn(|n| {
        std::array::from_fn(|axis| {
            if n >> axis & 1 == 0 {
                least[axis]
            } else {
                most[axis]
            }
        })
    })
}

/// Evidence that the rig file does not allow a motion.
pub(crate) fn motion_refused(what: String, next: &str) -> Problem {
    Box::new(Evidence::new(EvidenceKind::Refused, "robot", what).next(next))
}

//! Where a check may move the arm: points above the skin, held against the rig file before anything moves.

use skinrig_model::{Point2, Point3, RigidTransform, Robot, Skin};
use skinrig_nightly::{Evidence, EvidenceKind};
use skinrig_protocol::rig::{BenchLimits, RigFile, RigKind};

use crate::bench::Trouble;

/// Above this height the tip may move sideways, mm.
pub(crate) const CLEARANCE_MM: f64 = 5.0;
/// What is done in free air is done at this height and above, mm.
const AIR_MM: f64 = 10.0;
/// The points in free air lie within this height, mm.
const SPREAD_MM: f64 = 8.0;
/// And so far from the middle, mm, along x and y.
const ASIDE_MM: f64 = 8.0;
/// Room that is kept around them, mm: for the ways to them, and for the rise at the end.
pub(crate) const AROUND_MM: f64 = 5.0;
/// From the origin of a frame that was given to the places that are pressed around it, mm.
const NEAR_ORIGIN_MM: f64 = 5.0;

/// What a rig file says about where the tip may go.
#[derive(Debug, Clone)]
pub struct Room {
    /// What the bench bears.
    pub limits: BenchLimits,
    /// Where the skin lies.
    pub robot_from_skin: RigidTransform<Robot, Skin>,
    /// The middle of what was touched; the origin of a frame that was given.
    pub middle: Point2,
    /// Where the skin may be pressed: inside what was touched, by the size of the tip.
    pub presses: Vec<Point2>,
}

impl Room {
    /// Of this rig file. `today` is in days since 1970-01-01, UTC.
    ///
    /// # Errors
    /// When the frame is too old to be moved in, or there is no room above the skin.
    pub fn of(rig: &RigFile, today: i64) -> Result<Self, Trouble> {
        let age_days = today - rig.frame.date.days_since_1970();
        let most_h = rig.preflight.touch_off_max_age.as_secs_f64() / 3600.0;
        // As before a run: a date has no hour, and one of tomorrow may be another time zone's today.
        let recent = (-1..=(most_h / 24.0).ceil() as i64).contains(&age_days);
        if rig.kind == RigKind::Bench && !recent {
            let found = rig.frame.date;
            let what = format!("frame: expected measured at most {most_h:.0} h ago, found {found}");
            return Err(refused(
                what,
                "touch the skin again with `skinrig jog`, and put the block that it prints into the rig file",
            ));
        }
        let (middle, presses) = places(rig);
        let room = Self {
            limits: rig.limits,
            robot_from_skin: rig.frame.robot_from_skin,
            middle,
            presses,
        };
        let corners = room.corners();
        let outside = corners.iter().find(|p| !room.contains(**p));
        outside.map_or(Ok(room.clone()), |p| {
            let [x, y, z] = p.to_array();
            Err(refused(
                format!(
                    "workspace: expected room above the skin's middle, {:.0} mm around it and {AIR_MM:.0} to {:.0} mm high, \
                     found ({x:.0}, {y:.0}, {z:.0}) mm of the skin outside",
                    ASIDE_MM + AROUND_MM,
                    AIR_MM + SPREAD_MM + AROUND_MM
                ),
                "widen `limits.workspace` of the rig file if the arm has that room, or skip the check",
            ))
        })
    }

    /// Five points in free air: the middle, and four around it, high and low in turn.
    #[must_use]
    pub fn air(&self) -> [Point3<Skin>; 5] {
        let Point2 { x_mm: x, y_mm: y } = self.middle;
        let (low, high) = (AIR_MM, AIR_MM + SPREAD_MM);
        [
            Point3::new(x, y, (low + high) / 2.0),
            Point3::new(x + ASIDE_MM, y, low),
            Point3::new(x, y + ASIDE_MM, high),
            Point3::new(x - ASIDE_MM, y, low),
            Point3::new(x, y - ASIDE_MM, high),
        ]
    }

    /// Height above which there is no room any more, mm.
    #[must_use]
    pub fn top_mm(&self) -> f64 {
        AIR_MM + SPREAD_MM + AROUND_MM
    }

    /// Whether the robot may be there.
    #[must_use]
    pub fn contains(&self, at: Point3<Skin>) -> bool {
        let place = self.robot_from_skin.apply(at).to_array();
        self.limits.workspace.contains(place)
    }

    /// The smallest box of the skin's frame that holds the workspace: smallest and largest coordinates, mm.
    #[must_use]
    pub fn around(&self) -> ([f64; 3], [f64; 3]) {
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

    /// Of the room in free air that checks take.
    fn corners(&self) -> [Point3<Skin>; 8] {
        let Point2 { x_mm: x, y_mm: y } = self.middle;
        let aside = ASIDE_MM + AROUND_MM;
        let (least, most) = (
            [x - aside, y - aside, AIR_MM - AROUND_MM],
            [x + aside, y + aside, self.top_mm()],
        );
        corners(least, most).map(|[x, y, z]| Point3::new(x, y, z))
    }
}

/// The middle, and where the skin may be pressed.
fn places(rig: &RigFile) -> (Point2, Vec<Point2>) {
    let Some(touched) = &rig.frame.touch_off else {
        let around = [(0.0, 0.0), (NEAR_ORIGIN_MM, 0.0), (0.0, NEAR_ORIGIN_MM)];
        let presses = around.map(|(x, y)| Point2::new(x, y));
        return (presses[0], presses.to_vec());
    };
    let n = touched.points.len() as f64;
    let sum = |of: fn(&Point2) -> f64| -> f64 {
        touched.points.iter().map(|p| of(&p.skin.plane())).sum()
    };
    let middle = Point2::new(sum(|p| p.x_mm) / n, sum(|p| p.y_mm) / n);
    let inside = |p: Point2| {
        let away_mm = p.distance_mm(middle);
        let share = (1.0 - rig.tip.size_mm / away_mm).max(0.0);
        Point2::new(
            middle.x_mm + share * (p.x_mm - middle.x_mm),
            middle.y_mm + share * (p.y_mm - middle.y_mm),
        )
    };
    let presses = touched.points.iter().map(|p| inside(p.skin.plane()));
    (middle, presses.collect())
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

/// The rig file does not allow it.
pub(crate) fn refused(what: String, next: &str) -> Trouble {
    Box::new(Evidence::new(EvidenceKind::Refused, "robot", what).next(next))
}

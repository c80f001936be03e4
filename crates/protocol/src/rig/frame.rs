//! The pose of the skin: stated, or fitted to touched points.

use serde::Serialize;
use skinrig_model::{Point3, RigidTransform, Robot, Skin};
use skinrig_settings::{Collector, Field, Settings, ValueRange};

use super::date::Date;
use super::fit;

/// Coordinates of the robot and of the skin, mm.
pub(super) const COORDINATE: ValueRange = ValueRange::between(-1000.0, 1000.0);
const TURN: ValueRange = ValueRange::between(-180.0, 180.0);
/// Touched points must spread at least this far from a line, mm: a slip of 0.3 mm in one of them then tilts the
/// skin by no more than 2 degrees.
const LEAST_SPREAD_MM: f64 = 10.0;
/// The skin's normal must be within this angle of the robot's z axis, along which the force is measured.
const MOST_TILT_DEG: f64 = 45.0;

/// Pose of the skin in the robot's frame, and its source.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Frame {
    /// The transform.
    pub robot_from_skin: RigidTransform<Robot, Skin>,
    /// When it was measured.
    pub date: Date,
    /// Touched points of the fit; `None` if the pose was stated.
    pub touch_off: Option<TouchOff>,
}

/// Touched points and the quality of their fit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TouchOff {
    /// At least three.
    pub points: Vec<TouchedPoint>,
    /// Root mean square of the points' distances from the fit, mm.
    pub rms_mm: f64,
    /// Largest of them, mm.
    pub worst_mm: f64,
    /// Largest allowed, mm.
    pub max_residual_mm: f64,
}

/// A touched point.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TouchedPoint {
    /// Name for messages.
    pub name: String,
    /// Position on the skin.
    pub skin: Point3<Skin>,
    /// Measured position of the tip.
    pub robot: Point3<Robot>,
    /// Distance of the tip from the fitted point, mm.
    pub residual_mm: f64,
}

/// Pose of the skin in the robot's frame. Skin: z out of the surface, z = 0 at the surface. Robot: z away from the sample
/// (`robot.axes`).
#[derive(Settings)]
#[settings(
    name = "rig_frame",
    exactly_one("given", "touch_off"),
    builds(Frame, FrameKeys::frame)
)]
struct FrameKeys {
    /// Pose of the skin, measured by other means.
    given: Option<GivenFrameKeys>,
    /// Points that were touched with the tip: `skinrig jog` prints this block.
    touch_off: Option<TouchOffKeys>,
}

/// Robot = Rz(yaw) Ry(pitch) Rx(roll) skin + origin.
#[derive(Settings)]
#[settings(name = "given_frame")]
struct GivenFrameKeys {
    /// The skin's origin in the robot's frame.
    #[setting(range = COORDINATE, example = "[0 mm, 0 mm, -20 mm]")]
    origin_mm: [f64; 3],
    /// Rotation about the robot's z, applied last.
    #[setting(default = "0 deg", range = TURN)]
    yaw_deg: f64,
    /// Rotation about y.
    #[setting(default = "0 deg", range = TURN)]
    pitch_deg: f64,
    /// Rotation about x, applied first.
    #[setting(default = "0 deg", range = TURN)]
    roll_deg: f64,
    /// Date of the measurement: year-month-day, for example `2026-11-20`.
    #[setting(example = "2026-11-20")]
    date: Date,
}

/// Points whose skin coordinates are known and whose robot coordinates were measured by touching them.
#[derive(Settings)]
#[settings(name = "touch_off")]
struct TouchOffKeys {
    /// Date of the touches: year-month-day, for example `2026-11-20`.
    #[setting(example = "2026-11-20")]
    date: Date,
    /// At least three points that do not lie on one line; four or more reveal slips better.
    #[setting(items = 3..=1000, example = THREE_POINTS)]
    points: Vec<TouchedKeys>,
    /// Largest distance of a point from the rigid fit.
    #[setting(default = "0.3 mm", above = 0, max = 10)]
    max_residual_mm: f64,
}

const THREE_POINTS: &str = "[{skin: [0 mm, 0 mm, 0 mm], robot: [0 mm, 0 mm, -20 mm]}, \
     {skin: [40 mm, 0 mm, 0 mm], robot: [40 mm, 0 mm, -20 mm]}, \
     {skin: [0 mm, 40 mm, 0 mm], robot: [0 mm, 40 mm, -20 mm]}]";

/// One touched point.
#[derive(Settings)]
#[settings(name = "touched_point")]
struct TouchedKeys {
    /// Name for messages.
    name: Option<String>,
    /// Position on the skin.
    #[setting(range = COORDINATE)]
    skin_mm: [f64; 3],
    /// Position of the robot's tip at the touch.
    #[setting(range = COORDINATE)]
    robot_mm: [f64; 3],
}

impl FrameKeys {
    fn frame(self, field: &Field, out: &mut Collector) -> Option<Frame> {
        let frame = match (self.given, self.touch_off) {
            (Some(given), None) => given.frame(),
            (None, Some(touched)) => touched.frame(field.at("touch_off"), out)?,
            (None, None) | (Some(_), Some(_)) => return None, // reported by `exactly_one`
        };
        let up = frame.robot_from_skin.rotation[2][2].clamp(-1.0, 1.0);
        let tilt = libm::acos(up).to_degrees();
        if tilt > MOST_TILT_DEG {
            let help = if tilt > 135.0 {
                "the skin would face down: check whether the points are mirrored or x and y are swapped"
            } else {
                "mount the skin facing up: the force is measured along the robot's z axis"
            };
            out.error(field.span, field.path.as_str(), "the skin does not face up")
                .expected(format!(
                    "the skin's normal within {MOST_TILT_DEG} deg of the robot's z axis"
                ))
                .found(format!("{tilt:.1} deg"))
                .help(help);
            return None;
        }
        Some(frame)
    }
}

impl GivenFrameKeys {
    fn frame(self) -> Frame {
        Frame {
            robot_from_skin: rotated(self.yaw_deg, self.pitch_deg, self.roll_deg, self.origin_mm),
            date: self.date,
            touch_off: None,
        }
    }
}

impl TouchOffKeys {
    fn frame(self, field: &Field, out: &mut Collector) -> Option<Frame> {
        let list = field.at("points");
        let pairs: Vec<(Point3<Skin>, Point3<Robot>)> = self
            .points
            .iter()
            .map(|p| (point(p.skin_mm), point(p.robot_mm)))
            .collect();
        let skin = self.points.iter().map(|p| p.skin_mm).collect::<Vec<_>>();
        let robot = self.points.iter().map(|p| p.robot_mm).collect();
        for (key, points) in [("skin", skin), ("robot", robot)] {
            let spread = fit::off_line_mm(&points);
            if spread.is_nan() || spread < LEAST_SPREAD_MM {
                let message = "the points lie on one line, or nearly";
                out.error(list.span, list.path.as_str(), message)
                    .expected(format!(
                        "points at least {LEAST_SPREAD_MM} mm off their common line, `{key}` coordinates"
                    ))
                    .found(format!("{spread:.3} mm"))
                    .help("touch points near three or four corners of the skin");
                return None;
            }
        }
        let robot_from_skin = fit::rigid(&pairs)?;
        let points: Vec<TouchedPoint> = (1..)
            .zip(self.points)
            .zip(pairs)
            .map(|((n, keys), (skin, robot)): ((u32, _), _)| TouchedPoint {
                name: keys.name.unwrap_or_else(|| format!("point {n}")),
                skin,
                robot,
                residual_mm: robot_from_skin.apply(skin).distance_mm(robot),
            })
            .collect();
        let squares: f64 = points.iter().map(|p| p.residual_mm.powi(2)).sum();
        let touched = TouchOff {
            rms_mm: (squares / points.len() as f64).sqrt(),
            worst_mm: points.iter().map(|p| p.residual_mm).fold(0.0, f64::max),
            max_residual_mm: self.max_residual_mm,
            points,
        };
        touched.fits(list, out).then_some(Frame {
            robot_from_skin,
            date: self.date,
            touch_off: Some(touched),
        })
    }
}

impl TouchOff {
    /// Checks that every point is close enough to the fit; `list` is the mapping of the points.
    fn fits(&self, list: &Field, out: &mut Collector) -> bool {
        let worst = self
            .points
            .iter()
            .zip(list.items())
            .max_by(|a, b| a.0.residual_mm.total_cmp(&b.0.residual_mm));
        let Some((point, item)) = worst.filter(|_| self.worst_mm > self.max_residual_mm) else {
            return true;
        };
        let message = "the points do not fit a rigid motion";
        out.error(item.span, list.path.as_str(), message)
            .expected(format!(
                "every point within {} mm of the fit, `max_residual`",
                self.max_residual_mm
            ))
            .found(format!(
                "`{}` {:.3} mm away, all points {:.3} mm root mean square",
                point.name, self.worst_mm, self.rms_mm
            ))
            .help("touch the points again, this one first; check its skin coordinates");
        false
    }
}

fn point<F>([x_mm, y_mm, z_mm]: [f64; 3]) -> Point3<F> {
    Point3::new(x_mm, y_mm, z_mm)
}

/// The transform with this translation (mm) and R = Rz(yaw) Ry(pitch) Rx(roll), degrees.
pub(super) fn rotated(
    yaw: f64,
    pitch: f64,
    roll: f64,
    shift_mm: [f64; 3],
) -> RigidTransform<Robot, Skin> {
    let of = |degrees: f64| libm::sincos(degrees.to_radians());
    let ((sa, ca), (sb, cb), (sc, cc)) = (of(yaw), of(pitch), of(roll));
    RigidTransform::new(
        [
            [ca * cb, ca * sb * sc - sa * cc, ca * sb * cc + sa * sc],
            [sa * cb, sa * sb * sc + ca * cc, sa * sb * cc - ca * sc],
            [-sb, cb * sc, cb * cc],
        ],
        shift_mm,
    )
}

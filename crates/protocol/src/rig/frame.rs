//! Where the skin lies: given, or fitted to touched points.

use skinrig_model::{Point3, RigidTransform, Robot, Skin};

use super::{Date, Frame, TouchOff, TouchedPoint, fit};
use crate::shape::{Field, Keys};
use skinrig_settings::Collector;

/// Touched points must spread at least this far from a line, mm: a slip of 0.3 mm in one of them then tilts the
/// skin by no more than 2 degrees.
const LEAST_SPREAD_MM: f64 = 10.0;
/// The skin's normal must be within this angle of the robot's z axis, along which the force is measured.
const MOST_TILT_DEG: f64 = 45.0;

pub(super) fn frame(f: &Field, out: &mut Collector) -> Option<Frame> {
    let frame = match (f.get("given"), f.get("touch_off")) {
        (Some(given), None) => given_frame(given, out),
        (None, Some(touched)) => touch_off(touched, out),
        _ => None, // told by the table
    }?;
    let up = frame.robot_from_skin.rotation[2][2].clamp(-1.0, 1.0);
    let tilt = up.acos().to_degrees();
    if tilt > MOST_TILT_DEG {
        let help = if tilt > 135.0 {
            "the skin would face down: are the points mirrored, or x and y exchanged?"
        } else {
            "mount the skin facing up: the force is measured along the robot's z axis"
        };
        out.error(f.span, f.path.as_str(), "the skin does not face up")
            .expected(format!(
                "the skin's normal within {MOST_TILT_DEG} deg of the robot's z axis"
            ))
            .found(format!("{tilt:.1} deg"))
            .help(help);
        return None;
    }
    Some(frame)
}

/// The transform with this translation (mm) and R = Rz(yaw) Ry(pitch) Rx(roll), degrees.
pub(super) fn turned(
    yaw: f64,
    pitch: f64,
    roll: f64,
    shift_mm: [f64; 3],
) -> RigidTransform<Robot, Skin> {
    let of = |degrees: f64| degrees.to_radians().sin_cos();
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

fn date(f: &Field, out: &mut Collector) -> Option<Date> {
    let (field, text) = (f.get("date")?, f.text("date")?);
    let date = Date::parse(&text);
    if date.is_none() {
        out.error(field.span, field.path.as_str(), "not a date")
            .expected("year-month-day such as `2026-11-20`")
            .found(format!("`{text}`"));
    }
    date
}

fn given_frame(f: &Field, out: &mut Collector) -> Option<Frame> {
    let date = date(f, out);
    Some(Frame {
        robot_from_skin: turned(
            f.quantity("yaw")?,
            f.quantity("pitch")?,
            f.quantity("roll")?,
            f.get("origin")?.triple()?,
        ),
        date: date?,
        touch_off: None,
    })
}

fn touch_off(f: &Field, out: &mut Collector) -> Option<Frame> {
    let date = date(f, out);
    let list = f.get("points")?;
    let pairs: Vec<(Point3<Skin>, Point3<Robot>)> = list
        .items()
        .iter()
        .map(|item| {
            let place = |key| item.get(key)?.triple();
            let ([a, b, c], [x, y, z]) = (place("skin")?, place("robot")?);
            Some((Point3::new(a, b, c), Point3::new(x, y, z)))
        })
        .collect::<Option<_>>()?;
    for (what, points) in [
        (
            "skin",
            pairs.iter().map(|p| p.0.to_array()).collect::<Vec<_>>(),
        ),
        ("robot", pairs.iter().map(|p| p.1.to_array()).collect()),
    ] {
        let spread = fit::off_line_mm(&points);
        if spread.is_nan() || spread < LEAST_SPREAD_MM {
            out.error(
                list.span,
                list.path.as_str(),
                "the points lie on one line, or nearly",
            )
            .expected(format!(
                "points at least {LEAST_SPREAD_MM} mm off their common line, `{what}` coordinates"
            ))
            .found(format!("{spread:.3} mm"))
            .help("touch points near three or four corners of the skin");
            return None;
        }
    }
    let robot_from_skin = fit::rigid(&pairs)?;
    let max_residual_mm = f.quantity("max_residual")?;
    let points: Vec<TouchedPoint> = (1..)
        .zip(list.items())
        .zip(&pairs)
        .map(|((n, item), (skin, robot)): ((u32, _), _)| TouchedPoint {
            name: item.text("name").unwrap_or_else(|| format!("point {n}")),
            skin: *skin,
            robot: *robot,
            residual_mm: robot_from_skin.apply(*skin).distance_mm(*robot),
        })
        .collect();
    let squares: f64 = points.iter().map(|p| p.residual_mm.powi(2)).sum();
    let touched = TouchOff {
        rms_mm: (squares / points.len() as f64).sqrt(),
        worst_mm: points.iter().map(|p| p.residual_mm).fold(0.0, f64::max),
        max_residual_mm,
        points,
    };
    if touched.worst_mm > max_residual_mm {
        let worst = touched
            .points
            .iter()
            .zip(list.items())
            .max_by(|a, b| a.0.residual_mm.total_cmp(&b.0.residual_mm));
        let (name, span) = worst.map_or(("", list.span), |(p, item)| (&p.name, item.span));
        out.error(
            span,
            list.path.as_str(),
            "the points do not fit a rigid motion",
        )
        .expected(format!(
            "every point within {max_residual_mm} mm of the fit, `max_residual`"
        ))
        .found(format!(
            "`{name}` {:.3} mm away, all points {:.3} mm root mean square",
            touched.worst_mm, touched.rms_mm
        ))
        .help("touch the points again, this one first; check its skin coordinates");
        return None;
    }
    Some(Frame {
        robot_from_skin,
        date: date?,
        touch_off: Some(touched),
    })
}

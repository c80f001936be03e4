//! Robot, tip and limits of a bench, each from its own keys.

use super::build::Places;
use super::{BenchLimits, RobotSetup, Tip};
use crate::shape::{Field, Keys};
use skinrig_settings::Collector;

/// One step of the controller's watchdog, s.
const WATCHDOG_STEP_S: f64 = 125e-6;

pub(super) fn tip(f: &Field, out: &mut Collector) -> Option<Tip> {
    let shape = f.word("shape")?;
    let (right, wrong) = match shape {
        "cube" => ("side", "diameter"),
        _ => ("diameter", "side"),
    };
    if let Some(other) = f.get(wrong) {
        out.error(
            other.span,
            other.path.as_str(),
            "the size does not fit the shape",
        )
        .expected(format!("`{right}` for a {shape}"))
        .found(format!("`{wrong}`"));
        return None;
    }
    Some(Tip {
        shape,
        size_mm: f.quantity(right)?,
        mass_kg: f.quantity("mass"),
    })
}

pub(super) fn limits(f: &Field, out: &mut Collector) -> Option<BenchLimits> {
    let workspace = f.get("workspace")?;
    let (min, max) = (
        workspace.get("min")?.triple()?,
        workspace.get("max")?.triple()?,
    );
    for ((axis, low), high) in ["x", "y", "z"].iter().zip(min).zip(max) {
        if low >= high {
            out.error(
                workspace.span,
                workspace.path.as_str(),
                "the workspace is empty",
            )
            .expected(format!("`min` smaller than `max` in {axis}"))
            .found(format!("{low} mm and {high} mm"));
        }
    }
    Some(BenchLimits {
        workspace_min_mm: min,
        workspace_max_mm: max,
        max_speed_mm_s: f.quantity("max_speed")?,
        max_force_n: f.quantity("max_force")?,
        max_lead_mm: f.quantity("max_lead")?,
        max_depth_mm: f.quantity("max_depth")?,
    })
}

pub(super) fn robot(
    f: &Field,
    max_force_n: Option<f64>,
    places: &Places<'_>,
    out: &mut Collector,
) -> Option<RobotSetup> {
    let library = f.get("library").map(|l| places.path(l, out));
    let watchdog = f.get("watchdog").and_then(|w| watchdog(w, out));
    let (auto_init, sample_is_off) = (f.flag("auto_init"), f.flag("sample_is_off"));
    if (auto_init, sample_is_off) == (Some(true), Some(false)) {
        let span = f.get("auto_init").map_or(f.span, |a| a.span);
        out.error(
            span,
            "robot.auto_init",
            "the arm would sweep through the sample",
        )
        .expected("`sample_is_off: true` beside it")
        .found("`sample_is_off: false`")
        .help("take the sample off and say so, or initialise the arm by hand and write `auto_init: false`");
    }
    let axes = f.get("axes").and_then(|a| axes(a, out));
    let force = f.get("motor_force")?;
    if let (Some(limit), Some(per_ratio), Some(gravity), Some(least)) = (
        max_force_n,
        force.quantity("per_ratio"),
        force.number("gravity_ratio"),
        force.number("least_ratio"),
    ) {
        let strongest = (1.0 - gravity) * per_ratio;
        let sinking = gravity + limit / per_ratio < least;
        if strongest < limit || sinking {
            let (expected, found) = if sinking {
                (
                    format!(
                        "a limit of more than {:.3} N: below, the arm sinks",
                        (least - gravity) * per_ratio
                    ),
                    format!("{limit} N, `limits.max_force`"),
                )
            } else {
                (
                    format!("at least {limit} N, `limits.max_force`"),
                    format!("{strongest:.3} N with all of the motors' torque"),
                )
            };
            out.error(
                force.span,
                force.path.as_str(),
                "the force limit cannot be set",
            )
            .expected(expected)
            .found(found);
        }
    }
    Some(RobotSetup {
        model: f.word("model")?,
        serial: f.count("serial").and_then(|n| u16::try_from(n).ok())?,
        firmware: f.text("firmware"),
        library: library.map_or(Some(None), |l| l.map(Some))?,
        library_version: f.text("library_version"),
        device_angle_deg: f.quantity("device_angle")?,
        effector_mass_kg: f.quantity("effector_mass"),
        watchdog_steps: watchdog?,
        velocity_threshold: f.count("velocity_threshold"),
        auto_init: auto_init?,
        sample_is_off: sample_is_off?,
        needs_redundant_encoders: f.word("redundant_encoders")? == "required",
        axes: axes?,
        force_per_ratio_n: force.quantity("per_ratio")?,
        gravity_ratio: force.number("gravity_ratio")?,
        least_ratio: force.number("least_ratio")?,
        reports_sample_force: force.word("reported")? == "by_sample",
        integral_gain: f.number("integral_gain")?,
        proportional_gain: f.number("proportional_gain"),
        derivative_gain: f.number("derivative_gain"),
        acceleration_mm_s2: f.quantity("acceleration")?,
        jerk_mm_s3: f.quantity("jerk")?,
        supervisor: f.flag("supervisor")?,
    })
}

fn watchdog(f: &Field, out: &mut Collector) -> Option<u8> {
    let steps = f.as_quantity()? / WATCHDOG_STEP_S;
    if (steps - steps.round()).abs() > 1e-6 {
        let near = |n: f64| format!("{} us", n * 125.0);
        out.error(f.span, f.path.as_str(), "between two steps of the watchdog")
            .expected("a multiple of 125 us")
            .found(format!("{:.3} us", steps * 125.0))
            .help(format!(
                "write `{}` or `{}`",
                near(steps.floor().max(1.0)),
                near(steps.ceil())
            ));
        return None;
    }
    Some(steps.round() as u8) // 1 to 255 by the key's range
}

/// Three different axes, right-handed.
fn axes(f: &Field, out: &mut Collector) -> Option<[&'static str; 3]> {
    let [x, y, z] = f.items() else { return None };
    let axes = [x.as_word()?, y.as_word()?, z.as_word()?];
    let mut m = [[0.0f64; 3]; 3];
    for (row, axis) in m.iter_mut().zip(axes) {
        let column = match axis.trim_start_matches(['+', '-']) {
            "x" => 0,
            "y" => 1,
            _ => 2,
        };
        row[column] = if axis.starts_with('-') { -1.0 } else { 1.0 };
    }
    let [a, b, c] = m;
    let determinant = a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0])
        + a[2] * (b[0] * c[1] - b[1] * c[0]);
    if determinant < 0.5 {
        out.error(f.span, f.path.as_str(), "the axes are not right-handed")
            .expected(
                "three different axes, z = x cross y, such as `[+x, +y, +z]` or `[+y, -x, +z]`",
            )
            .found(format!("[{}]", axes.join(", ")));
        return None;
    }
    Some(axes)
}

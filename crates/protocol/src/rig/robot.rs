//! Robot, tip and limits of a bench, each from its own keys.

use super::build::Places;
use super::{BenchLimits, RobotSetup, Tip};
use crate::diagnostic::Collector;
use crate::shape::Field;

/// One step of the controller's watchdog, s.
const WATCHDOG_STEP_S: f64 = 125e-6;
/// The most that an omega.3 can exert, N; a motor ratio of 1.
const MOST_FORCE_N: f64 = 12.0;

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
    let calibration = match f.get("motor_ratio_calibration") {
        Some(list) => calibration(list, out),
        None => Some(Vec::new()),
    };
    let ratio = f.get("motor_ratio");
    if let (Some(field), Some(calibration), Some(limit)) = (ratio, &calibration, max_force_n) {
        check_ratio(field, calibration, limit, out);
    }
    Some(RobotSetup {
        model: f.word("model")?,
        serial: f.text("serial")?,
        firmware: f.text("firmware"),
        library: library.map_or(Some(None), |l| l.map(Some))?,
        library_version: f.text("library_version"),
        device_angle_deg: f.quantity("device_angle")?,
        effector_mass_kg: f.quantity("effector_mass"),
        watchdog_steps: watchdog?,
        velocity_threshold: f.count("velocity_threshold"),
        auto_init: auto_init?,
        sample_is_off: sample_is_off?,
        motor_ratio: f.number("motor_ratio")?,
        motor_ratio_calibration: calibration?,
        integral_gain: f.number("integral_gain")?,
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

fn calibration(list: &Field, out: &mut Collector) -> Option<Vec<(f64, f64)>> {
    let pairs: Vec<(f64, f64)> = list
        .items()
        .iter()
        .map(|item| Some((item.number("ratio")?, item.quantity("force")?)))
        .collect::<Option<_>>()?;
    for (pair, item) in pairs.windows(2).zip(list.items().iter().skip(1)) {
        if let [(ratio, force), (next_ratio, next_force)] = pair
            && (next_ratio <= ratio || next_force < force)
        {
            out.error(item.span, item.path.as_str(), "the table does not rise")
                .expected(format!(
                    "a ratio above {ratio} and a force of at least {force} N"
                ))
                .found(format!("{next_ratio} and {next_force} N"));
            return None;
        }
    }
    Some(pairs)
}

/// The largest force that a motor ratio allows must be within the bench's limit: by the calibration where there is
/// one, else by the nominal 12 N at a ratio of 1 (pose dependent: a calibration is better).
fn check_ratio(field: &Field, calibration: &[(f64, f64)], limit_n: f64, out: &mut Collector) {
    let crate::shape::Value::Number(ratio) = field.value else {
        return;
    };
    let force_n = match calibration.iter().find(|(r, _)| *r >= ratio) {
        // The next larger ratio that was measured bounds the force.
        Some((_, force)) => *force,
        None => match calibration.last() {
            Some((largest, _)) => {
                out.error(field.span, field.path.as_str(), "beyond the calibration")
                    .expected(format!("at most {largest}, the largest ratio measured"))
                    .found(ratio.to_string());
                return;
            }
            None => MOST_FORCE_N * ratio,
        },
    };
    if force_n > limit_n {
        out.error(
            field.span,
            field.path.as_str(),
            "the motors could press harder than the bench bears",
        )
        .expected(format!("at most {limit_n} N, `limits.max_force`"))
        .found(format!("{force_n:.2} N"))
        .help("lower the ratio, measure `motor_ratio_calibration` on a scale, or raise the limit");
    }
}

//! Checks common to all indenters: limits against capabilities, commands against limits.

use skinrig_model::{DeviceRole, Point3, Robot, Setting};

use crate::{DeviceError, IndenterCapabilities, MotionLimits};

/// A [`DeviceError::Refused`] of the indenter `serial`.
pub fn refused(serial: &str, expected: String, found: String) -> DeviceError {
    DeviceError::Refused {
        role: DeviceRole::Indenter,
        serial: serial.to_owned(),
        expected,
        found,
    }
}

/// A [`DeviceError::State`] of the indenter `serial`.
pub fn wrong_state(serial: &str, expected: &str, found: &str) -> DeviceError {
    DeviceError::State {
        role: DeviceRole::Indenter,
        serial: serial.to_owned(),
        expected: expected.to_owned(),
        found: found.to_owned(),
    }
}

/// Checks `limits` against the device's capabilities.
///
/// # Errors
/// [`DeviceError::Refused`] for limits that are wider, empty or not finite.
pub fn check_limits(
    serial: &str,
    can: &IndenterCapabilities,
    limits: &MotionLimits,
) -> Result<(), DeviceError> {
    for axis in 0..3 {
        let (low, high) = (can.workspace_min_mm[axis], can.workspace_max_mm[axis]);
        let (min, max) = (limits.min_mm[axis], limits.max_mm[axis]);
        // NaN fails every comparison and is therefore rejected.
        if !(low <= min && min < max && max <= high) {
            return Err(refused(
                serial,
                format!("limits of axis {axis} within {low:.3}..={high:.3} mm"),
                format!("{min:.3}..={max:.3} mm"),
            ));
        }
    }
    for (name, value, most) in [
        ("max_speed_mm_s", limits.max_speed_mm_s, can.max_speed_mm_s),
        (
            "max_acceleration_mm_s2",
            limits.max_acceleration_mm_s2,
            can.max_acceleration_mm_s2,
        ),
        ("max_force_n", limits.max_force_n, can.max_force_n),
    ] {
        if !(value > 0.0 && value <= most) {
            return Err(refused(
                serial,
                format!("{name} above 0 and at most {most}"),
                value.to_string(),
            ));
        }
    }
    Ok(())
}

/// Checks a motion command against `limits`.
///
/// # Errors
/// [`DeviceError::Refused`] outside the limits or not finite.
pub fn check_command(
    serial: &str,
    limits: &MotionLimits,
    target: Point3<Robot>,
    speed_mm_s: f64,
) -> Result<(), DeviceError> {
    for (axis, value) in target.to_array().into_iter().enumerate() {
        let (min, max) = (limits.min_mm[axis], limits.max_mm[axis]);
        if !(min..=max).contains(&value) {
            return Err(refused(
                serial,
                format!("coordinate {axis} of the target within {min:.3}..={max:.3} mm"),
                format!("{value:.3} mm"),
            ));
        }
    }
    if !(speed_mm_s > 0.0 && speed_mm_s <= limits.max_speed_mm_s) {
        return Err(refused(
            serial,
            format!("a speed above 0 and at most {} mm/s", limits.max_speed_mm_s),
            format!("{speed_mm_s} mm/s"),
        ));
    }
    Ok(())
}

/// Formats a point as `(x, y, z)` with three decimals.
#[must_use]
pub fn millimetres([x, y, z]: [f64; 3]) -> String {
    format!("({x:.3}, {y:.3}, {z:.3})")
}

/// Formats limits as settings that read back as requested.
#[must_use]
pub fn settings(limits: &MotionLimits) -> Vec<Setting> {
    let all = [
        ("min_mm", millimetres(limits.min_mm)),
        ("max_mm", millimetres(limits.max_mm)),
        ("max_speed_mm_s", limits.max_speed_mm_s.to_string()),
        (
            "max_acceleration_mm_s2",
            limits.max_acceleration_mm_s2.to_string(),
        ),
        ("max_force_n", limits.max_force_n.to_string()),
    ];
    all.into_iter()
        .map(|(name, value)| Setting {
            name: name.to_owned(),
            requested: value.clone(),
            read_back: value,
        })
        .collect()
}

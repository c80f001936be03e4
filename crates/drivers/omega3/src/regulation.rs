//! Settings of the vendor's position regulation, written and read back. They are written after every start, because it is not
//! documented whether a start resets them.

use skinrig_device::MotionLimits;
use skinrig_drd_abi::{DeviceId, ErrorCode};
use skinrig_model::Setting;

use crate::config::OmegaConfig;
use crate::open::{
    SettingError, agrees, arm_watchdog, format_read_back, has_no_watchdog, set_and_read_back,
};
use crate::sdk::{CallError, Generator, GeneratorLimits, Quantity, Sdk};

/// Writes the gains, the motor ratio that limits the force, and the limits of both trajectory generators.
pub(crate) fn apply(
    sdk: &dyn Sdk,
    id: DeviceId,
    config: &OmegaConfig,
    limits: &MotionLimits,
) -> Result<Vec<Setting>, SettingError> {
    let mut settings = Vec::new();
    let ratio = config.envelope.ratio_of(limits.max_force_n);
    settings.extend(set_and_read_back(sdk, id, Quantity::MotorRatio, ratio)?);
    for (quantity, gain) in [
        (Quantity::GainP, config.gains.p),
        (Quantity::GainI, config.gains.i),
        (Quantity::GainD, config.gains.d),
    ] {
        if let Some(gain) = gain {
            settings.extend(set_and_read_back(sdk, id, quantity, gain)?);
        } else if let Some(Ok(found)) = sdk.get(id, quantity) {
            settings.push(Setting {
                name: quantity.name().to_owned(),
                requested: "as found".to_owned(),
                read_back: found.to_string(),
            });
        }
    }
    let m = &config.motion;
    let metres = 1e-3 * m.filter_headroom;
    let limits = GeneratorLimits {
        acceleration_m_s2: limits.max_acceleration_mm_s2 * metres,
        speed_m_s: limits.max_speed_mm_s * metres,
        jerk_m_s3: m.jerk_mm_s3 * metres,
    };
    for generator in [Generator::Move, Generator::Track] {
        settings.extend(set_generator_limits(sdk, id, generator, limits)?);
    }
    Ok(settings)
}

/// Writes generator limits. Each number becomes a separate setting, so that later comparisons work on numbers.
fn set_generator_limits(
    sdk: &dyn Sdk,
    id: DeviceId,
    generator: Generator,
    limits: GeneratorLimits,
) -> Result<[Setting; 3], SettingError> {
    sdk.set_generator_limits(id, generator, limits)
        .map_err(SettingError::Call)?;
    let found = sdk
        .generator_limits(id, generator)
        .map_err(SettingError::Call)?;
    let same = agrees(limits.acceleration_m_s2, found.acceleration_m_s2)
        && agrees(limits.speed_m_s, found.speed_m_s)
        && agrees(limits.jerk_m_s3, found.jerk_m_s3);
    if !same {
        return Err(SettingError::Mismatch {
            name: generator.name(),
            expected: limits.to_string(),
            found: found.to_string(),
        });
    }
    let setting = |quantity: &str, requested: f64, found: f64| Setting {
        name: format!("{}_{quantity}", generator.name()),
        requested: requested.to_string(),
        read_back: format_read_back(requested, found),
    };
    Ok([
        setting(
            "acceleration_m_s2",
            limits.acceleration_m_s2,
            found.acceleration_m_s2,
        ),
        setting("speed_m_s", limits.speed_m_s, found.speed_m_s),
        setting("jerk_m_s3", limits.jerk_m_s3, found.jerk_m_s3),
    ])
}

/// Starts the regulation at the current position, writes its settings and the watchdog, and switches position control and the track
/// filter on. Returns the values read back.
pub(crate) fn start(
    sdk: &dyn Sdk,
    id: DeviceId,
    config: &OmegaConfig,
    limits: &MotionLimits,
) -> Result<Vec<Setting>, SettingError> {
    sdk.start(id).map_err(SettingError::Call)?;
    let mut settings = apply(sdk, id, config, limits)?;
    match arm_watchdog(sdk, id, config) {
        Ok(setting) => settings.push(setting),
        // Accepted when the robot was opened.
        Err(SettingError::Call(e)) if has_no_watchdog(&e) && config.supervisor.is_some() => {}
        Err(e) => return Err(e),
    }
    sdk.regulate_position(id).map_err(SettingError::Call)?;
    sdk.enable_filter(id).map_err(SettingError::Call)?;
    if sdk.is_filtering(id) {
        return Ok(settings);
    }
    Err(SettingError::Mismatch {
        name: "track_filter",
        expected: "on".to_owned(),
        found: "off".to_owned(),
    })
}

/// Whether the library accepts a setting only while the regulation runs; arming then checks it.
pub(crate) const fn needs_regulation(error: &CallError) -> bool {
    matches!(error.code, ErrorCode::NO_REGULATION)
}

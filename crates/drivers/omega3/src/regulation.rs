//! The settings of the vendor's position regulation, written and read back. Whether a start resets them is not
//! documented, so they are written after every start.

use skinrig_device::MotionLimits;
use skinrig_drd_abi::{DeviceId, ErrorCode};
use skinrig_model::Setting;

use crate::config::OmegaConfig;
use crate::open::{NotSet, agrees, arm_watchdog, has_no_watchdog, set_and_read_back, told};
use crate::sdk::{CallError, Generator, Pace, Quantity, Sdk};

/// Writes gains, the motor ratio that caps the force, and the limits of both trajectory generators.
pub(crate) fn apply(
    sdk: &dyn Sdk,
    id: DeviceId,
    config: &OmegaConfig,
    limits: &MotionLimits,
) -> Result<Vec<Setting>, NotSet> {
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
    let pace = Pace {
        acceleration_m_s2: limits.max_acceleration_mm_s2 * metres,
        speed_m_s: limits.max_speed_mm_s * metres,
        jerk_m_s3: m.jerk_mm_s3 * metres,
    };
    for generator in [Generator::Move, Generator::Track] {
        settings.extend(set_pace(sdk, id, generator, pace)?);
    }
    Ok(settings)
}

/// One setting for each number: what is compared later is a number and not a sentence.
fn set_pace(
    sdk: &dyn Sdk,
    id: DeviceId,
    generator: Generator,
    pace: Pace,
) -> Result<[Setting; 3], NotSet> {
    sdk.set_pace(id, generator, pace).map_err(NotSet::Call)?;
    let found = sdk.pace(id, generator).map_err(NotSet::Call)?;
    let same = agrees(pace.acceleration_m_s2, found.acceleration_m_s2)
        && agrees(pace.speed_m_s, found.speed_m_s)
        && agrees(pace.jerk_m_s3, found.jerk_m_s3);
    if !same {
        return Err(NotSet::Differs {
            name: generator.name(),
            expected: pace.to_string(),
            found: found.to_string(),
        });
    }
    let setting = |quantity: &str, wanted: f64, found: f64| Setting {
        name: format!("{}_{quantity}", generator.name()),
        requested: wanted.to_string(),
        read_back: told(wanted, found),
    };
    Ok([
        setting(
            "acceleration_m_s2",
            pace.acceleration_m_s2,
            found.acceleration_m_s2,
        ),
        setting("speed_m_s", pace.speed_m_s, found.speed_m_s),
        setting("jerk_m_s3", pace.jerk_m_s3, found.jerk_m_s3),
    ])
}

/// Starts the regulation, which holds where the arm is, writes its settings and the watchdog's, and turns position
/// control and the track filter on. Gives what read back.
pub(crate) fn start(
    sdk: &dyn Sdk,
    id: DeviceId,
    config: &OmegaConfig,
    limits: &MotionLimits,
) -> Result<Vec<Setting>, NotSet> {
    sdk.start(id).map_err(NotSet::Call)?;
    let mut settings = apply(sdk, id, config, limits)?;
    match arm_watchdog(sdk, id, config) {
        Ok(setting) => settings.push(setting),
        // Opening accepted that.
        Err(NotSet::Call(e)) if has_no_watchdog(&e) && config.supervisor.is_some() => {}
        Err(e) => return Err(e),
    }
    sdk.regulate_position(id).map_err(NotSet::Call)?;
    sdk.enable_filter(id).map_err(NotSet::Call)?;
    if sdk.is_filtering(id) {
        return Ok(settings);
    }
    Err(NotSet::Differs {
        name: "track_filter",
        expected: "on".to_owned(),
        found: "off".to_owned(),
    })
}

/// True when the library takes a setting only while the regulation runs: it is then checked at arming.
pub(crate) const fn needs_regulation(error: &CallError) -> bool {
    matches!(error.code, ErrorCode::NO_REGULATION)
}

//! Cameras other than the EVK1, in builds that support them (feature `evk4`).

use skinrig_device::{EventCamera, RealClock};
use skinrig_model::CameraId;
use skinrig_protocol::rig::CameraSetup;

use crate::exit::Failure;

/// Command for a build that supports them.
#[cfg(any(test, not(feature = "evk4")))]
const BUILD: &str = "cargo build --release -p skinrig --features evk4";

/// The camera of `setup`.
///
/// # Errors
/// [`Failure::input`]: this build does not support the camera.
#[cfg(not(feature = "evk4"))]
pub(crate) fn open(
    setup: &CameraSetup,
    camera: CameraId,
    _clock: RealClock,
) -> Result<Box<dyn EventCamera>, Failure> {
    Err(Failure::input(format!(
        "{camera}: expected `model: evk1`, found `{}`, which this build does not support\n  next: build with `{BUILD}`",
        setup.model
    )))
}

/// The camera of `setup`.
///
/// # Errors
/// [`Failure::input`] for a model without a driver; [`Failure::rig`] when no such camera is connected.
#[cfg(feature = "evk4")]
pub(crate) fn open(
    setup: &CameraSetup,
    camera: CameraId,
    clock: RealClock,
) -> Result<Box<dyn EventCamera>, Failure> {
    use skinrig_evk4::{CameraState, Evt3Camera, Model, Neuromorphic};

    let Some(model) = Model::of_word(setup.model.name()) else {
        return Err(Failure::input(format!(
            "{camera}: no driver for `model: {}`",
            setup.model
        )));
    };
    let found = skinrig_evk4::enumerate(&evk1_places())
        .map_err(|e| Failure::rig(format!("{camera}: cannot list USB devices: {e}")))?;
    let matches_setup = |state: &CameraState| match state {
        CameraState::Ready(of, serial) => *of == model && *serial == setup.serial,
        _ => false,
    };
    if !found.iter().any(|f| matches_setup(&f.state)) {
        return Err(Failure::rig(format!(
            "{camera}: expected a {} with serial number {}, found none that is free\n  \
             next: `skinrig devices` shows what is connected",
            model.name(),
            setup.serial
        )));
    }
    let link = Neuromorphic::new(model, &setup.serial);
    Ok(Box::new(Evt3Camera::new(
        model,
        Box::new(link),
        &setup.serial,
        camera,
        Box::new(clock),
    )))
}

/// Bus and address of each EVK1 that can be opened; other drivers ignore those.
#[cfg(feature = "evk4")]
#[must_use]
pub(crate) fn evk1_places() -> Vec<(u8, u8)> {
    let found = skinrig_evk1::enumerate().unwrap_or_default();
    let ready =
        |f: &&skinrig_evk1::FoundDevice| matches!(f.state, skinrig_evk1::CameraState::Ready(_));
    found.iter().filter(ready).map(|f| f.address).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_build_command_names_a_feature_that_exists() {
        let manifest = include_str!("../../Cargo.toml");
        let feature = BUILD.rsplit(' ').next().unwrap_or_default();
        assert!(manifest.contains(&format!("\n{feature} = [")), "{feature}");
    }
}

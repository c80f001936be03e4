//! The thread that owns the library, when a call does not come back.

use std::sync::Arc;
use std::time::Duration;

use skinrig_device::{DeviceError, Indenter, MotionLimits, RealClock};

use skinrig_model::Setting;

use super::scripted::Scripted;
use crate::config::SupervisorCommand;
use crate::supervisor::Supervisor;
use crate::{Omega, OmegaConfig, OmegaError};

const LIMITS: MotionLimits = MotionLimits {
    min_mm: [0.0, -10.0, 0.0],
    max_mm: [40.0, 10.0, 30.0],
    max_speed_mm_s: 20.0,
    max_acceleration_mm_s2: 200.0,
    max_force_n: 4.0,
};

fn open(sdk: &Arc<Scripted>) -> Result<Omega, OmegaError> {
    let mut config = OmegaConfig::default();
    config.trips.tare = Duration::from_millis(20);
    config.patience.reply = Duration::from_millis(300);
    config.patience.brake_retry = Duration::from_millis(1);
    config.patience.open = Duration::from_millis(500);
    let path = "scripted".into();
    Omega::with_sdk(sdk.clone(), config, path, "scripted", RealClock::start())
}

#[test]
fn a_call_that_never_returns_is_given_up_and_the_arm_braked_from_elsewhere() {
    let sdk = Arc::new(Scripted::default());
    let mut omega = open(&sdk).unwrap();
    omega.configure(&LIMITS).unwrap();
    omega.arm().unwrap();
    sdk.with(|s| s.hangs = Some("dhdGetForce"));
    // Heard until the thread comes to that call.
    let error = loop {
        if let Err(error) = omega.hold() {
            break error;
        }
    };
    assert!(matches!(error, DeviceError::Lost { .. }), "{error}");
    let text = error.to_string();
    for word in ["did not return", "braked from another thread"] {
        assert!(text.contains(word), "{word} is not in {text}");
    }
    assert!(!sdk.with(|s| s.live));
    // Every later request fails at once, and says the same.
    assert_eq!(omega.arm(), Err(error));
    sdk.with(|s| s.hangs = None);
}

#[test]
fn what_the_operator_is_told_is_recorded() {
    let sdk = Arc::new(Scripted::default());
    sdk.with(|s| s.live = true);
    let settings = open(&sdk).unwrap().configure(&LIMITS).unwrap();
    let told = settings.iter().filter(|s| s.name == "remark");
    assert!(
        told.clone().any(|s| s.read_back.contains("were live")),
        "{settings:?}"
    );
    assert!(told.clone().all(|s| s.requested == Setting::AS_FOUND));
}

#[test]
#[cfg(unix)]
fn a_supervisor_that_does_not_hear_its_goodbye_is_ended() {
    let deaf = SupervisorCommand {
        program: "sh".into(),
        arguments: vec!["-c".to_owned(), "echo ready; exec sleep 3600".to_owned()],
    };
    let mut supervisor = Supervisor::start(
        &deaf,
        "scripted".as_ref(),
        Some(77),
        Duration::from_secs(30),
    )
    .unwrap();
    supervisor.check().unwrap();
    // A wait without an end would be the hang of this test.
    supervisor.dismiss();
}

#[test]
fn an_open_that_never_returns_is_given_up() {
    let sdk = Arc::new(Scripted::default());
    sdk.with(|s| s.hangs = Some("dhdGetStatus"));
    let error = open(&sdk).err().unwrap();
    assert!(matches!(error, OmegaError::Late { .. }), "{error}");
    sdk.with(|s| s.hangs = None);
}

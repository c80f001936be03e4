//! The thread that owns the library, with calls that do not return.

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
    config.timeouts.reply = Duration::from_millis(300);
    config.timeouts.brake_retry = Duration::from_millis(1);
    config.timeouts.open = Duration::from_millis(500);
    let path = "scripted".into();
    Omega::with_sdk(sdk.clone(), config, path, "scripted", RealClock::start())
}

#[test]
fn a_hanging_call_times_out_and_the_arm_is_braked_from_another_thread() {
    let sdk = Arc::new(Scripted::default());
    let mut omega = open(&sdk).unwrap();
    omega.configure(&LIMITS).unwrap();
    omega.arm().unwrap();
    sdk.with(|s| s.hanging_call = Some("dhdGetForce"));
    // Requests are accepted until the thread reaches that call.
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
    // Every later request fails immediately with the same error.
    assert_eq!(omega.arm(), Err(error));
    sdk.with(|s| s.hanging_call = None);
}

#[test]
fn remarks_are_recorded_as_settings() {
    let sdk = Arc::new(Scripted::default());
    sdk.with(|s| s.live = true);
    let settings = open(&sdk).unwrap().configure(&LIMITS).unwrap();
    let remarks = settings.iter().filter(|s| s.name == "remark");
    assert!(
        remarks.clone().any(|s| s.read_back.contains("were live")),
        "{settings:?}"
    );
    assert!(remarks.clone().all(|s| s.requested == Setting::AS_FOUND));
}

#[test]
#[cfg(unix)]
fn a_supervisor_that_ignores_its_goodbye_is_killed() {
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
    // An endless wait would hang this test.
    supervisor.dismiss();
}

#[test]
fn a_hanging_open_times_out() {
    let sdk = Arc::new(Scripted::default());
    sdk.with(|s| s.hanging_call = Some("dhdGetStatus"));
    let error = open(&sdk).err().unwrap();
    assert!(matches!(error, OmegaError::TimedOut { .. }), "{error}");
    sdk.with(|s| s.hanging_call = None);
}

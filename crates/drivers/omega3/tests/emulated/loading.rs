//! Loading the library.

use emulated_libdrd::ArmConfig;
use skinrig_device::{Indenter, RealClock};
use skinrig_omega3::enumerate;
use skinrig_omega3::load::{LoadError, load};
use skinrig_omega3::{Omega, OmegaConfig, OmegaError, Remark};

use crate::support::*;

#[test]
fn the_identity_includes_library_version_and_file() {
    let arm = arm();
    let omega = open(&arm);
    let identity = omega.identity();
    assert_eq!(identity.serial, "1234");
    for word in ["SDK 3.17.5", arm.library().to_str().expect("UTF-8 path")] {
        assert!(identity.firmware.contains(word), "{identity:?}");
    }
    // The only remark is about redundant encoders, whose report is ambiguous.
    let remarks = omega.remarks();
    assert_eq!(remarks, [Remark::NoRedundantEncoders]);
}

#[test]
fn an_old_sdk_is_rejected_and_an_outdated_one_gets_a_remark() {
    for sdk in [[3, 7, 0], [3, 5, 1]] {
        let arm = arm_like(&ArmConfig {
            sdk,
            ..ArmConfig::default()
        });
        let error = load(Some(&arm.library())).expect_err("the SDK is too old");
        assert!(matches!(error, LoadError::TooOld { .. }), "{error}");
        let text = error.to_string();
        let version = format!("found {}.{}.{}", sdk[0], sdk[1], sdk[2]);
        assert!(text.contains("3.7.1") && text.contains(&version), "{text}");
        let journal = arm.journal().expect("journal");
        let calls: Vec<_> = journal.entries.iter().map(|e| e.call.as_str()).collect();
        assert_eq!(calls, ["dhdGetSDKVersion"], "nothing else was called");
    }
    let arm = arm_like(&ArmConfig {
        sdk: [3, 7, 1],
        ..ArmConfig::default()
    });
    let omega = open(&arm);
    assert!(
        omega
            .remarks()
            .iter()
            .any(|r| matches!(r, Remark::Library(advice) if advice.contains("3.10")))
    );
}

#[test]
fn a_missing_library_is_a_clear_error() {
    let directory = tempfile::tempdir().expect("temporary directory");
    let path = directory.path().join("libdrd.so");
    let config = OmegaConfig {
        library: Some(path.clone()),
        ..OmegaConfig::default()
    };
    match Omega::open(config, RealClock::start()) {
        Err(OmegaError::Load(LoadError::Absent(attempts))) => {
            assert_eq!(attempts.len(), 1);
            assert_eq!(attempts[0].path, path);
        }
        other => panic!("{:?}", other.map(|o| o.identity())),
    }
}

#[test]
fn devices_are_listed_without_touching_a_motor() {
    let arm = arm();
    let loaded = load(Some(&arm.library())).expect("library loads");
    let all = enumerate::list(&loaded.library).expect("device list");
    assert_eq!(all.len(), 1);
    assert_eq!(all[0].to_string(), "omega.3, serial 1234: free");
    let journal = arm.journal().expect("journal");
    for forbidden in ["drdStart", "dhdEnableForce", "dhdSetBrakes", "drdAutoInit"] {
        assert_eq!(journal.first(forbidden), None);
    }
}

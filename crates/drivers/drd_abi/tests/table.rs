//! The table compared with the interface, and resolution in libraries of other versions.

use std::collections::BTreeSet;
use std::ffi::{CStr, c_void};
use std::ptr::NonNull;

use skinrig_drd_abi::{
    ErrorCode, ForceOffCause, Functions, NEVER_USED, Requirement, SYMBOLS, SdkVersion, StatusField,
    StatusVector,
};

/// Stand-in for a function; resolving never calls it.
fn stand_in() -> NonNull<c_void> {
    NonNull::dangling()
}

#[test]
fn names_are_unique_and_exclude_forbidden_functions() {
    let names: BTreeSet<&str> = SYMBOLS.iter().map(|s| s.name).collect();
    assert_eq!(names.len(), SYMBOLS.len());
    assert!(
        names
            .iter()
            .all(|n| n.starts_with("dhd") || n.starts_with("drd"))
    );
    for (name, why) in NEVER_USED {
        assert!(
            !names.contains(name),
            "{name} is in the table, although it {why}"
        );
    }
}

#[test]
fn device_calls_end_with_a_signed_id_and_return_no_rust_bool() {
    for symbol in SYMBOLS {
        let (arguments, result) = symbol.signature.rsplit_once("->").unwrap();
        assert!(
            !result.contains("bool"),
            "{}: {}",
            symbol.name,
            symbol.signature
        );
        let of_the_process = [
            "dhdErrorGetLast",
            "dhdErrorGetStr",
            "dhdGetSDKVersion",
            "dhdGetSDKVersionStr",
            "dhdGetTime",
            "dhdGetDeviceCount",
            "dhdGetAvailableCount",
            "drdOpen",
            "dhdEnableExpertMode",
            "dhdDisableExpertMode",
        ];
        let last = arguments
            .trim()
            .trim_end_matches(')')
            .rsplit([':', '('])
            .next()
            .unwrap();
        assert_eq!(
            last.trim() == "i8",
            !of_the_process.contains(&symbol.name),
            "{}: {}",
            symbol.name,
            symbol.signature
        );
    }
}

#[test]
fn all_missing_functions_are_reported_together_and_optional_ones_may_be_absent() {
    let lacks = ["drdStop", "dhdGetStatus"];
    let lookup = |name: &'static CStr| (!lacks.contains(&name.to_str().unwrap())).then(stand_in);
    // SAFETY: nothing is called through the result.
    let missing = unsafe { Functions::resolve(lookup) }.unwrap_err();
    assert_eq!(missing.0, lacks);
    assert_eq!(
        missing.to_string(),
        "the library lacks drdStop, dhdGetStatus"
    );

    let required = |name: &'static CStr| {
        let symbol = SYMBOLS
            .iter()
            .find(|s| s.name == name.to_str().unwrap())
            .unwrap();
        (symbol.need == Requirement::Required).then(stand_in)
    };
    // SAFETY: nothing is called through the result.
    let functions = unsafe { Functions::resolve(required) }.unwrap();
    assert!(functions.dhdSetMaxForce.is_none());
}

#[test]
fn versions_compare_number_by_number() {
    assert!(SdkVersion::new(3, 7, 0) < SdkVersion::OLDEST);
    assert!(SdkVersion::new(3, 5, 1) < SdkVersion::OLDEST);
    assert!(SdkVersion::new(3, 17, 5) > SdkVersion::ADVISED);
    assert_eq!(SdkVersion::OLDEST.to_string(), "3.7.1");
}

#[test]
fn missing_words_of_a_short_status_vector_are_none() {
    let mut status = StatusVector::new();
    let written = [1, 1, 1, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, -1, 3];
    // SAFETY: the vector takes `STATUS_CAPACITY` words, more than these 15.
    unsafe { std::ptr::copy_nonoverlapping(written.as_ptr(), status.as_mut_ptr(), written.len()) };
    assert!(status.is(StatusField::Force) && !status.is(StatusField::Brake));
    assert_eq!(status.get(StatusField::Redundancy), Some(-1));
    assert_eq!(status.force_off_cause(), Some(ForceOffCause::Watchdog));
    assert_eq!(status.get(StatusField::Locks), None);
    assert_eq!(status.words(), written);
}

#[test]
fn codes_have_the_numbers_of_the_headers() {
    let codes: Vec<i32> = ErrorCode::ALL.iter().map(|c| c.0).collect();
    assert_eq!(codes, (0..=22).collect::<Vec<_>>());
    assert_eq!(ErrorCode::NO_REGULATION.0, 22);
    assert_eq!(
        ErrorCode::DEVICE_IN_USE.to_string(),
        "another process uses the device (code 20 DEVICE_IN_USE)"
    );
    assert_eq!(
        ErrorCode(77).to_string(),
        "an error code unknown to this driver (code 77)"
    );
}

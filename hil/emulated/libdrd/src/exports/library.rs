//! Errors, version, time, expert mode.

use std::ffi::{CString, c_char};
use std::sync::OnceLock;

use skinrig_drd_abi::{ErrorCode, SdkVersion};

use super::outcome::{fill, run};
use crate::host;
use crate::time::now_ns;

/// Version reported without an arm.
const SDK: [i32; 3] = [3, 17, 5];

fn sdk() -> [i32; 3] {
    host::link().map_or(SDK, |l| l.sdk)
}

#[unsafe(no_mangle)]
pub extern "system" fn dhdErrorGetLast() -> i32 {
    run("dhdErrorGetLast", &[], 0, || Ok(host::last_error()))
}

#[unsafe(no_mangle)]
pub extern "system" fn dhdErrorGetStr(code: i32) -> *const c_char {
    static TEXTS: OnceLock<Vec<CString>> = OnceLock::new();
    let texts = TEXTS.get_or_init(|| {
        let known = ErrorCode::ALL.iter().map(|c| c.meaning());
        known
            .chain(["unknown"])
            .filter_map(|text| CString::new(text).ok())
            .collect()
    });
    let index = usize::try_from(code).unwrap_or(usize::MAX);
    texts
        .get(index)
        .or(texts.last())
        .map_or(std::ptr::null(), |text| text.as_ptr())
}

#[unsafe(no_mangle)]
pub unsafe extern "system" fn dhdGetSDKVersion(
    major: *mut i32,
    minor: *mut i32,
    release: *mut i32,
    revision: *mut i32,
) {
    run("dhdGetSDKVersion", &[], f64::NAN, || {
        let [first, second, third] = sdk();
        // SAFETY: the caller passes NULL or places for one number each.
        unsafe { fill([major, minor, release, revision], [first, second, third, 0]) }?;
        Ok(f64::NAN)
    });
}

#[unsafe(no_mangle)]
pub extern "system" fn dhdGetSDKVersionStr() -> *const c_char {
    static TEXT: OnceLock<CString> = OnceLock::new();
    let [major, minor, release] = sdk();
    let text =
        || CString::new(SdkVersion::new(major, minor, release).to_string()).unwrap_or_default();
    TEXT.get_or_init(text).as_ptr()
}

#[unsafe(no_mangle)]
pub extern "system" fn dhdGetTime() -> f64 {
    #[expect(clippy::cast_precision_loss, reason = "seconds of a clock")]
    let seconds = now_ns() as f64 * 1e-9;
    run("dhdGetTime", &[], -1.0, || Ok(seconds))
}

#[unsafe(no_mangle)]
pub extern "system" fn dhdEnableExpertMode() -> i32 {
    host::set_expert(true);
    run("dhdEnableExpertMode", &[], -1, || Ok(0))
}

#[unsafe(no_mangle)]
pub extern "system" fn dhdDisableExpertMode() -> i32 {
    host::set_expert(false);
    run("dhdDisableExpertMode", &[], -1, || Ok(0))
}

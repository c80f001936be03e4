//! Runs calls: converts results, sets the thread's error and writes the journal.

use skinrig_drd_abi::ErrorCode;

use crate::host;
use crate::journal::began;

/// Result of a call, or an error for the calling thread.
pub(super) type Outcome<T> = Result<T, ErrorCode>;

/// Runs a call, sets the thread's error and writes the journal. Returns `failed` on failure.
pub(super) fn run<T: Copy + Into<f64>>(
    name: &str,
    arguments: &[f64],
    failed: T,
    body: impl FnOnce() -> Outcome<T>,
) -> T {
    let began_ns = began();
    let result = body().unwrap_or_else(|code| {
        host::set_error(code);
        failed
    });
    host::journal(began_ns, name, arguments, result.into());
    result
}

/// Runs a call that returns a C++ `bool`.
pub(super) fn run_bool(name: &str, body: impl FnOnce() -> Outcome<bool>) -> u8 {
    // In C++ every byte except 0 is true; a caller that uses a Rust bool must not work by accident.
    let truth = if host::link().is_some_and(|l| l.odd_bools) {
        0x5a
    } else {
        1
    };
    run(name, &[], 0, || Ok(if body()? { truth } else { 0 }))
}

/// Runs a call that only forwards to the firmware.
pub(super) fn run_call(name: &str, arguments: &[f64], id: i8, call: crate::wire::Call) -> i32 {
    run(name, arguments, -1, || host::call(id, call).map(|_| 0))
}

/// Writes values to output pointers.
///
/// # Safety
/// Each pointer is NULL or valid for one value.
pub(super) unsafe fn fill<T: Copy, const N: usize>(
    places: [*mut T; N],
    values: [T; N],
) -> Outcome<()> {
    if places.iter().any(|p| p.is_null()) {
        return Err(ErrorCode::NULL_ARGUMENT);
    }
    for (place, value) in places.into_iter().zip(values) {
        // SAFETY: not NULL, hence valid for one value by this function's contract.
        unsafe { place.write(value) };
    }
    Ok(())
}

/// A fixed number of values of a reply.
pub(super) fn values<const N: usize>(reply: Vec<f64>) -> Outcome<[f64; N]> {
    reply.try_into().map_err(|_| ErrorCode::UNDOCUMENTED)
}

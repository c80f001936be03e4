//! What a call comes to, and how it is written down.

use skinrig_drd_abi::ErrorCode;

use crate::host;
use crate::journal::began;

/// What a call comes to: a result, or an error of the calling thread.
pub(super) type Outcome<T> = Result<T, ErrorCode>;

/// Runs a call: keeps its error for the thread and writes it to the journal. A failure gives `failed`.
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
    // To C++ every byte but 0 is true; a caller that takes it for a Rust bool must not get away with it.
    let truth = if host::link().is_some_and(|l| l.odd_bools) {
        0x5a
    } else {
        1
    };
    run(name, &[], 0, || Ok(if body()? { truth } else { 0 }))
}

/// Runs a call that only makes the firmware do something.
pub(super) fn run_call(name: &str, arguments: &[f64], id: i8, call: crate::wire::Call) -> i32 {
    run(name, arguments, -1, || host::call(id, call).map(|_| 0))
}

/// Writes the values to the places.
///
/// # Safety
/// Each place is NULL or good for one value.
pub(super) unsafe fn fill<T: Copy, const N: usize>(
    places: [*mut T; N],
    values: [T; N],
) -> Outcome<()> {
    if places.iter().any(|p| p.is_null()) {
        return Err(ErrorCode::NULL_ARGUMENT);
    }
    for (place, value) in places.into_iter().zip(values) {
        // SAFETY: not NULL, hence good for one value by this function's contract.
        unsafe { place.write(value) };
    }
    Ok(())
}

/// So many values of a reply.
pub(super) fn values<const N: usize>(reply: Vec<f64>) -> Outcome<[f64; N]> {
    reply.try_into().map_err(|_| ErrorCode::UNDOCUMENTED)
}

//! Owns the contacts of a path in an even rhythm, for the tests of laws about times.

/// Three sync presses 1 s apart, a pause, then `n` presses every 2 s; s.
pub(super) fn path(n: u32) -> Vec<f64> {
    let sync = (0..3).map(f64::from);
    sync.chain((0..n).map(|i| 6.0 + 2.0 * f64::from(i)))
        .collect()
}

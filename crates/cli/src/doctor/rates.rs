//! Rates that several checks relate their figures to.

/// Most that a camera sends, bytes/s: 50 Mev/s of 4 bytes.
pub(super) const CAMERA_B_S: f64 = 200e6;

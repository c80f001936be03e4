//! Ranges that several languages share.

use skinrig_settings::ValueRange;

/// The version of the protocol and schedule languages that this crate reads.
pub(crate) const VERSION: u32 = 1;
/// The most locations of a path: a typing error must not fill the memory.
pub(crate) const MOST_POINTS: u32 = 100_000;
/// A length that may be zero, mm.
pub(crate) const LENGTH_MM: ValueRange = ValueRange::from_zero(1000.0);
/// The smallest length, mm, and speed, mm/s: a tenth of what the robot resolves (omega.3, a reseller's figure: < 0.01 mm). Anything smaller
/// is a typing error.
const SMALLEST: f64 = 1e-3;
/// A length, mm.
pub(crate) const POSITIVE_LENGTH_MM: ValueRange = ValueRange::between(SMALLEST, 1000.0);
/// An indentation depth, mm.
pub(crate) const DEPTH_MM: ValueRange = ValueRange::above_zero(50.0);
/// A speed, mm/s.
pub(crate) const SPEED_MM_S: ValueRange = ValueRange::between(SMALLEST, 1000.0);
/// A time of up to a day that may be zero, s.
pub(crate) const SPAN_S: ValueRange = ValueRange::from_zero(86_400.0);
/// A time of up to a day, s.
pub(crate) const POSITIVE_SPAN_S: ValueRange = ValueRange::above_zero(86_400.0);

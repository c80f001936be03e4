//! How much later than its contact a press may burst: not at all, unless its tip goes in slowly.
//!
//! A burst is found where the counts rise most. A fast tip makes them rise at its contact. A slow one makes them rise when it has
//! gone deep enough, or not before it leaves; when, depends on how well the camera sees the place.

use super::observed_press::ObservedPress;
use super::statistics::median;

/// A tip that takes longer from its contact to its depth is slow, s: the paper's takes 0.1 to 0.2 s for 2 mm (20 mm/s), and its bursts
/// come within 0.15 s.
const SLOW_S: f64 = 0.25;

/// Latest burst after the contact, s, beyond what holds for fast presses: 0 if most presses are fast, else the time until the tip
/// leaves the surface.
pub(super) fn burst_delay_s(presses_seen: &[ObservedPress<'_>]) -> f64 {
    let timings = || presses_seen.iter().filter_map(|t| t.timing);
    let goes_in = timings().map(|t| (t.at_depth - t.contact).as_secs_f64());
    let lasts = timings().map(|t| (t.release - t.contact).as_secs_f64());
    match (median(goes_in.collect()), median(lasts.collect())) {
        (Some(goes_in), Some(lasts)) if goes_in > SLOW_S => lasts,
        _ => 0.0,
    }
}

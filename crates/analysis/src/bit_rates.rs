//! Data rates during presses and while idle.

use skinrig_model::{PressRole, Verdict};

use crate::over_locations::rate_over_locations;
use crate::result::{Analysis, BitRates, Estimate, PressResult, PressView};

/// Mean data rates of both cameras together over the counting scored presses: in the press window, and in the idle time
/// before it where both cameras have some. `None` if both cameras saw none of them.
#[must_use]
pub fn bit_rates(analysis: &Analysis) -> Option<BitRates> {
    let settings = &analysis.settings;
    let presses: Vec<(&PressResult, [PressView; 2])> = analysis
        .presses
        .iter()
        .filter(|p| p.role == PressRole::Score && p.verdict == Verdict::Valid)
        .filter_map(|p| Some((p, [p.views[0]?, p.views[1]?])))
        .collect();
    if presses.is_empty() {
        return None;
    }
    let estimate = |rates: &[(u32, f64)]| {
        rate_over_locations(rates, settings.bootstrap_resamples, settings.seed)
    };
    let press: Vec<(u32, f64)> = presses
        .iter()
        .map(|(p, views)| (p.location.index(), views.iter().map(|v| v.rate_per_s).sum()))
        .collect();
    let idle: Vec<(u32, f64)> = presses
        .iter()
        .filter_map(|(p, views)| Some((p.location.index(), idle_rate_per_s(views)?)))
        .collect();
    let press_events_per_s = estimate(&press);
    let idle_events_per_s = estimate(&idle);
    let length_s = |p: &PressResult| Some(p.timing?.release.0 - p.timing?.contact.0);
    let lengths: Vec<(u32, f64)> = presses
        .iter()
        .filter_map(|(p, _)| Some((p.location.index(), length_s(p)? as f64 * 1e-9)))
        .collect();
    Some(BitRates {
        bits_per_event: settings.bits_per_event,
        press_bytes_per_s: in_bytes(&press_events_per_s, settings.bits_per_event),
        idle_bytes_per_s: in_bytes(&idle_events_per_s, settings.bits_per_event),
        press_events_per_s,
        idle_events_per_s,
        press_s: estimate(&lengths),
    })
}

/// Events per second of both cameras in the idle time before a press; `None` if one of them has none.
fn idle_rate_per_s(views: &[PressView; 2]) -> Option<f64> {
    let known = views.iter().all(|v| v.idle_s > 0.0);
    known.then(|| views.iter().map(|v| v.idle_rate_per_s).sum())
}

/// Converts events per second to bytes per second.
pub(crate) fn in_bytes(events_per_s: &Estimate, bits_per_event: f64) -> Estimate {
    let bytes = |rate: Option<f64>| rate.map(|r| r * bits_per_event / 8.0);
    Estimate {
        value: bytes(events_per_s.value),
        low: bytes(events_per_s.low),
        high: bytes(events_per_s.high),
        n: events_per_s.n,
    }
}

//! Numbers in the texts of warnings.

use skinrig_model::PressId;

use super::Estimate;

/// `press 4, press 20`.
pub(super) fn listed(presses: &[PressId]) -> String {
    let names: Vec<String> = presses.iter().map(ToString::to_string).collect();
    names.join(", ")
}

/// Share of the crop in brackets; empty if it rounds to nothing.
pub(super) fn share_of_crop(pixels: u32, of: u32) -> String {
    let percent = 100.0 * f64::from(pixels) / f64::from(of);
    if percent < 0.005 {
        String::new()
    } else {
        format!(" ({percent:.2} % of the crop)")
    }
}

/// An estimate with its interval.
pub(super) fn in_words(rmse: &Estimate) -> String {
    match (rmse.value, rmse.low, rmse.high) {
        (Some(value), Some(low), Some(high)) => format!("{value:.2} mm [{low:.2}, {high:.2}]"),
        (Some(value), ..) => format!("{value:.2} mm"),
        _ => "none".to_owned(),
    }
}

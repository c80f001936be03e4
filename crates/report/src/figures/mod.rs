//! Owns the figures: one function each, from an analysis to a labelled SVG with title and description.

mod activity;
mod centroids;
mod clocks;
mod correlation;
mod errors;
mod histogram;
mod indentation;
mod latency_course;
mod latency_onsets;
mod latency_roc;
mod map;
mod models;
mod motion;
mod origin;
mod pictures;
mod raster;
mod rates;
mod reduction;
mod reliability;
mod residuals;
mod skin;
mod threshold;
pub(crate) mod tradeoff;

pub use crate::plot::Figure;
pub use activity::activity;
pub(crate) use centroids::centroid_tracks;
pub use clocks::clock_residuals;
pub use correlation::correlation;
pub(crate) use errors::error_distribution;
pub(crate) use errors::error_scatter;
pub use indentation::indentation;
pub(crate) use latency_course::latency_course;
pub(crate) use latency_onsets::latency_onsets;
pub(crate) use latency_roc::latency_roc;
pub(crate) use map::repeat_map;
pub(crate) use map::skin_map;
pub use models::models;
pub use motion::pose_course;
pub(crate) use motion::pose_presses;
pub(crate) use pictures::press_pictures;
pub use rates::event_rates;
pub(crate) use rates::press_rates;
pub use reduction::reduction;
pub use reliability::reliability;
pub use residuals::residuals;
pub use threshold::threshold;

use crate::input::ReportInput;

/// All figures in page order. Optional figures without data are left out.
#[must_use]
pub fn all(input: &ReportInput<'_>) -> Vec<Figure> {
    let mut figures = vec![
        skin_map(input),
        event_rates(input),
        error_distribution(input),
        error_scatter(input),
        centroid_tracks(input),
        repeat_map(input),
    ];
    let optional = [
        press_rates,
        press_pictures,
        activity,
        models,
        correlation,
        residuals,
        reliability,
        indentation,
        threshold,
        reduction,
        latency_course,
        latency_roc,
        latency_onsets,
        clock_residuals,
        pose_course,
        pose_presses,
        speed_accuracy,
    ];
    figures.extend(optional.into_iter().filter_map(|draw| draw(input)));
    figures
}

/// Error against cost, if a tradeoff was measured on the session.
#[must_use]
pub(crate) fn speed_accuracy(input: &ReportInput<'_>) -> Option<Figure> {
    let result = input.tradeoff.as_ref()?.as_ref().ok()?;
    let rig = "CPU times depend on the machine.";
    Some(tradeoff::fronts(result, rig, &origin::foot(input)))
}

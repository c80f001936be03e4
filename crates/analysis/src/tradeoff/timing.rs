//! CPU time of locating a press.

use skinrig_model::{CameraId, PressRole};

use super::replay::{Filter, Replay, after};
use crate::estimators::PressEstimator;
use crate::locator::{CameraFeatures, FittedLocator};
use crate::metrics::quantile;
use crate::press_events::{PackedEvent, RetainedPress};
use crate::segment::Window;
use skinrig_model::{AnalysisSettings, SkinOutline};

/// Maximum number of timed presses.
const MAX_PRESSES: usize = 24;

/// One way of locating, ready for timing.
pub(crate) struct Candidate {
    pub settings: AnalysisSettings,
    pub locator: FittedLocator,
}

/// Median, lowest and highest time of a press over the repeats, µs.
pub(super) struct Time {
    pub median_us: f64,
    pub range_us: (f64, f64),
}

/// Input of the timed part: one press in one camera.
#[derive(Default)]
struct PreparedView {
    events: Vec<PackedEvent>,
    /// Start of the window after that of the view, µs.
    from_us: u32,
    core_threshold: u32,
}

/// Times each candidate `repeats` times after one warm-up run. Within a repeat every candidate runs once, so that a slow
/// moment of the machine affects all. The stopwatch returns CPU seconds of this thread.
///
/// The timed part is what a computer at the skin would do with the events that reach it: counting, the estimate in both
/// cameras, the location. Events dropped before (thinning, rows, time window) cost nothing here.
pub(super) fn run(
    replay: &Replay<'_>,
    outline: &SkinOutline,
    candidates: &[Candidate],
    repeats: u32,
    stopwatch: &mut dyn FnMut() -> f64,
) -> (Vec<Time>, u32) {
    let scored: Vec<&RetainedPress> = replay.presses(PressRole::Score).collect();
    let count = scored.len().min(MAX_PRESSES);
    let presses: Vec<&RetainedPress> = (0..count)
        .map(|i| scored[i * scored.len() / count])
        .collect();
    let mut times = vec![Vec::with_capacity(repeats as usize); candidates.len()];
    for repeat in 0..=repeats {
        for (candidate, times) in candidates.iter().zip(&mut times) {
            let prepared = prepare(replay, &presses, &candidate.settings);
            let mut estimators = CameraId::ALL.map(|camera| {
                let rows = candidate.settings.crop_v[camera.index()];
                PressEstimator::new(&candidate.settings, rows)
            });
            let begun = stopwatch();
            for views in &prepared {
                let found = [0, 1].map(|k| {
                    let view = &views[k];
                    estimators[k].estimate(&view.events, view.from_us, view.core_threshold)
                });
                let cameras = found.each_ref().map(CameraFeatures::from);
                std::hint::black_box(candidate.locator.outcome(outline, cameras));
            }
            let spent_s = stopwatch() - begun;
            if repeat > 0 {
                times.push(spent_s * 1e6 / count.max(1) as f64);
            }
        }
    }
    let summary = |mut times: Vec<f64>| Time {
        median_us: quantile(&mut times, 0.5).unwrap_or(0.0),
        range_us: (
            quantile(&mut times, 0.0).unwrap_or(0.0),
            quantile(&mut times, 1.0).unwrap_or(0.0),
        ),
    };
    (times.into_iter().map(summary).collect(), count as u32)
}

fn prepare(
    replay: &Replay<'_>,
    presses: &[&RetainedPress],
    settings: &AnalysisSettings,
) -> Vec<[PreparedView; 2]> {
    let windows = CameraId::ALL.map(|camera| replay.windows_by_row(camera, settings));
    let filters = CameraId::ALL.map(|camera| Filter::new(camera, settings));
    let of = |press: &RetainedPress, k: usize, window: Option<Window>| {
        let Some(window) = window else {
            return PreparedView::default();
        };
        let view = &press.views[k];
        let mut events = Vec::new();
        filters[k].window(view, &window, &mut events);
        let idle = filters[k].idle(view, &window);
        PreparedView {
            events,
            from_us: after(view, window.start_us),
            core_threshold: window.core_threshold(settings, CameraId::ALL[k], idle),
        }
    };
    presses
        .iter()
        .map(|press| [0, 1].map(|k| of(press, k, windows[k][press.row])))
        .collect()
}

//! Replays the retained presses under other settings.

use skinrig_model::{AnalysisSettings, CameraId, PressOutcome, PressRole, SkinOutline};

use super::choice::Region;
use super::winner::PressErrors;
use crate::camera_pass::{by_row, lost_rows};
use crate::estimators::{PressEstimator, Thinning};
use crate::input::SessionInput;
use crate::locate_presses::{CameraObservations, LocatedPresses, locate_presses};
use crate::locator::Effort;
use crate::metrics::{Exclusions, metrics, penalised};
use crate::press_events::{EventView, PackedEvent, RetainedPress, RetainedPresses};
use crate::press_spans::timings;
use crate::press_view::{EventCounts, press_view};
use crate::result::{Analysis, ClockFit, Metrics, PenalisedRmse, PressView};
use crate::segment::{Window, windows};
use crate::sets::ScoreSet;
use crate::tie::UntimedPress;
use crate::untimed;

/// A session whose presses can be located in many ways.
pub(crate) struct Replay<'a> {
    input: &'a SessionInput,
    retained: &'a RetainedPresses,
    clocks: [ClockFit; 2],
    /// Participating rows of the plan.
    rows: Vec<usize>,
    /// For all rows of the plan: why a camera's clock does not time them.
    untimed: [Vec<Option<UntimedPress>>; 2],
}

/// Result of one way of locating.
pub(super) struct Outcome {
    pub metrics: Metrics,
    pub penalised: PenalisedRmse,
    /// Errors of the presses in the metrics.
    pub errors: PressErrors,
    pub located: LocatedPresses,
    /// Events of both cameras in the window, mean over the retained scored presses.
    pub events_per_press: f64,
    /// Time from contact to the end of the window, ms, mean over the same presses.
    pub delay_ms: f64,
}

impl<'a> Replay<'a> {
    /// `None` if no scored press was retained or a camera has no clock. Presses with measured times that were not retained
    /// do not participate; if there are any, presses without times do not either.
    pub(super) fn new(
        input: &'a SessionInput,
        analysis: &Analysis,
        retained: &'a RetainedPresses,
    ) -> Option<Self> {
        let [Some(one), Some(two)] = analysis.clocks else {
            return None;
        };
        let is_kept = |row: usize| {
            retained
                .presses
                .binary_search_by_key(&row, |k| k.row)
                .is_ok()
        };
        let timed = |row: usize| {
            input.outcomes[row]
                .as_ref()
                .is_some_and(|o| o.timing.is_some())
        };
        let used = |row: &usize| input.planned[*row].role != PressRole::Sync;
        let all: Vec<usize> = (0..input.planned.len()).filter(used).collect();
        let whole = all.iter().all(|row| is_kept(*row) || !timed(*row));
        let rows: Vec<usize> = all
            .into_iter()
            .filter(|row| whole || is_kept(*row))
            .collect();
        let scored = |k: &RetainedPress| input.planned[k.row].role == PressRole::Score;
        retained.presses.iter().any(scored).then_some(Self {
            input,
            retained,
            clocks: [one, two],
            rows,
            untimed: untimed::of_session(input),
        })
    }

    /// Outline of the skin.
    pub(super) const fn outline(&self) -> &'a SkinOutline {
        &self.input.rig.outline
    }

    /// Participating presses of this role, and the number of attempted ones in the plan.
    pub(super) fn counts(&self, role: PressRole) -> (u32, u32) {
        let of = |row: &usize| self.input.planned[*row].role == role;
        let attempted = |row: &usize| of(row) && self.input.outcomes[*row].is_some();
        let all = (0..self.input.planned.len()).filter(attempted).count();
        (
            self.rows.iter().filter(|r| attempted(r)).count() as u32,
            all as u32,
        )
    }

    /// Retained presses of a role.
    pub(super) fn presses(&self, role: PressRole) -> impl Iterator<Item = &'a RetainedPress> {
        let input = self.input;
        self.retained
            .presses
            .iter()
            .filter(move |k| input.planned[k.row].role == role)
    }

    fn windows(&self, camera: CameraId, settings: &AnalysisSettings) -> Vec<Window> {
        let clock = &self.clocks[camera.index()];
        windows(timings(self.input), &self.input.earlier, clock, settings)
    }

    /// Windows of the rows that have one.
    pub(crate) fn windows_by_row(
        &self,
        camera: CameraId,
        settings: &AnalysisSettings,
    ) -> Vec<Option<Window>> {
        let mut out = vec![None; self.input.planned.len()];
        for window in self.windows(camera, settings) {
            out[window.row] = Some(window);
        }
        out
    }

    /// Mean length of a scored press's window, s.
    pub(super) fn press_s(&self, settings: &AnalysisSettings) -> f64 {
        let windows = self.windows_by_row(CameraId::One, settings);
        let lengths: Vec<f64> = self
            .presses(PressRole::Score)
            .filter_map(|p| Some(windows[p.row]?.length_s()))
            .collect();
        // An empty window contains no events.
        (lengths.iter().sum::<f64>() / lengths.len().max(1) as f64).max(1e-6)
    }

    /// Locates and evaluates all presses under `settings`.
    pub(super) fn run(&self, settings: &AnalysisSettings) -> Outcome {
        let n = self.input.planned.len();
        let mut views: [Vec<Option<PressView>>; 2] = [Vec::new(), Vec::new()];
        let mut lost = [Vec::new(), Vec::new()];
        let mut delays = Vec::new();
        for camera in CameraId::ALL {
            let k = camera.index();
            let list = self.windows(camera, settings);
            lost[k] = lost_rows(n, &list, &self.input.gaps[k]);
            let by_rows = self.windows_by_row(camera, settings);
            views[k] = by_row(n, self.views(camera, settings, &by_rows));
            if camera == CameraId::One {
                let ends = self.presses(PressRole::Score).filter_map(|press| {
                    let view = &press.views[0];
                    let end_us = by_rows[press.row]?.end_us;
                    Some((end_us as f64 - view.start_us as f64 - view.contact_us) * 1e-3)
                });
                delays = ends.collect();
            }
        }
        let events = self.presses(PressRole::Score).map(|press| {
            let of = |k: usize| views[k][press.row].map_or(0, |v| v.events);
            f64::from(of(0)) + f64::from(of(1))
        });
        let count = delays.len().max(1) as f64;
        let (events_per_press, delay_ms) = (
            events.sum::<f64>() / count,
            delays.iter().sum::<f64>() / count,
        );
        let input = self.part(settings);
        let views = views.map(|of| self.of_rows(&of));
        let lost = lost.map(|of| self.of_rows(&of));
        let untimed = [0, 1].map(|k| self.of_rows(&self.untimed[k]));
        let observations = [0, 1].map(|k| CameraObservations {
            has_clock: true,
            views: &views[k],
            data_lost: &lost[k],
            untimed: &untimed[k],
        });
        let located = locate_presses(&input, observations, Effort::Positions, &mut Vec::new());
        let scores = ScoreSet::from_presses(&located.presses, &input.outcomes);
        let counting = scores.presses().iter().filter(|p| p.valid);
        let errors = counting
            .filter_map(|p| {
                let (_, [x, y]) = p.found?;
                Some((p.location, libm::hypot(x, y)))
            })
            .collect();
        Outcome {
            errors,
            metrics: metrics(
                &scores,
                Exclusions::Applied,
                &input.rig.outline,
                settings.within_mm,
                settings.bootstrap_resamples,
                settings.seed,
            ),
            penalised: penalised(
                &scores,
                settings.failure_penalty_mm,
                settings.bootstrap_resamples,
                settings.seed,
            ),
            located,
            events_per_press,
            delay_ms,
        }
    }

    /// Selects the entries of participating rows.
    fn of_rows<T: Copy>(&self, all: &[T]) -> Vec<T> {
        self.rows.iter().map(|row| all[*row]).collect()
    }

    /// Participating rows as a session of their own.
    fn part(&self, settings: &AnalysisSettings) -> SessionInput {
        let outcome = |row: &usize| -> Option<PressOutcome> { self.input.outcomes[*row].clone() };
        SessionInput {
            planned: self
                .rows
                .iter()
                .map(|row| self.input.planned[*row])
                .collect(),
            outcomes: self.rows.iter().map(outcome).collect(),
            settings: settings.clone(),
            ..self.input.clone()
        }
    }

    fn views(
        &self,
        camera: CameraId,
        settings: &AnalysisSettings,
        windows: &[Option<Window>],
    ) -> Vec<(usize, PressView)> {
        let k = camera.index();
        let filter = Filter::new(camera, settings);
        let mut estimator = PressEstimator::new(settings, settings.crop_v[k]);
        let mut events = Vec::new();
        let mut out = Vec::new();
        for press in &self.retained.presses {
            let Some(window) = windows[press.row] else {
                continue;
            };
            let view = &press.views[k];
            filter.window(view, &window, &mut events);
            let idle = filter.idle(view, &window);
            let core_threshold = window.core_threshold(settings, camera, idle);
            let tally = EventCounts {
                events: events.len() as u32,
                on: events.iter().filter(|e| e.is_on()).count() as u32,
                idle,
                width_u: None,
                core_threshold: Some(core_threshold),
            };
            let from_us = after(view, window.start_us);
            let sighting = estimator.estimate(&events, from_us, core_threshold);
            out.push((press.row, press_view(&window, tally, &sighting)));
        }
        out
    }

    /// Whether calibration presses were retained.
    pub(crate) fn calibrates(&self) -> bool {
        self.presses(PressRole::Calibrate).next().is_some()
    }

    /// Rows of a region per camera: the adjacent ones with most of the events that the calibration presses add to the idle
    /// rate; ties go to the first. `None` for a part of them without calibration presses.
    pub(crate) fn region_rows(
        &self,
        settings: &AnalysisSettings,
        region: Region,
    ) -> Option<[(u16, u16); 2]> {
        let parts = match region {
            Region::Full => return Some(settings.crop_v),
            Region::Half => 2,
            Region::Quarter => 4,
        };
        let rows_of = |camera: CameraId| {
            let (first, last) = settings.crop_v[camera.index()];
            let mut rows = vec![0.0; usize::from(last - first) + 1];
            let windows = self.windows_by_row(camera, settings);
            for press in self.presses(PressRole::Calibrate) {
                let Some(window) = windows[press.row] else {
                    continue;
                };
                let view = &press.views[camera.index()];
                let [idle, start, end] =
                    [window.idle_start_us, window.start_us, window.end_us].map(|t| after(view, t));
                for event in view.between(start, end) {
                    rows[usize::from(event.y() - first)] += 1.0;
                }
                let share = window.length_s() / window.idle_s();
                for event in view
                    .between(idle, start)
                    .iter()
                    .filter(|_| share.is_finite())
                {
                    rows[usize::from(event.y() - first)] -= share;
                }
            }
            let height = rows.len().div_ceil(parts);
            let mut best = (f64::NEG_INFINITY, 0);
            for (from, part) in rows.windows(height).enumerate() {
                let sum: f64 = part.iter().sum();
                if sum > best.0 {
                    best = (sum, from);
                }
            }
            (first + best.1 as u16, first + (best.1 + height) as u16 - 1)
        };
        self.calibrates().then(|| CameraId::ALL.map(rows_of))
    }
}

/// Converts a time of the camera's clock to time in a view, µs.
pub(super) fn after(view: &EventView, camera_us: u64) -> u32 {
    u32::try_from(camera_us.saturating_sub(view.start_us)).unwrap_or(u32::MAX)
}

/// Selects the events that reach the estimator.
pub(super) struct Filter {
    thinning: Thinning,
    rows: (u16, u16),
}

impl Filter {
    pub(super) fn new(camera: CameraId, settings: &AnalysisSettings) -> Self {
        Self {
            thinning: Thinning::new(settings.thinning, camera, settings.seed),
            rows: settings.crop_v[camera.index()],
        }
    }

    fn passes(&self, view: &EventView, event: PackedEvent) -> bool {
        let (x, y) = (event.x(), event.y());
        (self.rows.0..=self.rows.1).contains(&y)
            && self
                .thinning
                .keeps_at(view.start_us + u64::from(event.t_us()), x, y, event.is_on())
    }

    /// Collects the events of a window.
    pub(super) fn window(&self, view: &EventView, window: &Window, out: &mut Vec<PackedEvent>) {
        let events = view.between(after(view, window.start_us), after(view, window.end_us));
        out.clear();
        out.extend(events.iter().filter(|e| self.passes(view, **e)));
    }

    /// Number of events in the idle time before it.
    pub(super) fn idle(&self, view: &EventView, window: &Window) -> u64 {
        let events = view.between(
            after(view, window.idle_start_us),
            after(view, window.start_us),
        );
        events.iter().filter(|e| self.passes(view, **e)).count() as u64
    }
}

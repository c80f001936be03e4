//! Locates thinned presses: each press, seed and factor.

use rayon::prelude::*;
use skinrig_model::{AnalysisSettings, CameraId, CentroidRule, Point2, PressId, SkinOutline};

use super::thinning::{ThinnedView, Thinner};
use crate::background::{Background, CoreThreshold};
use crate::locator::FittedLocator;
use crate::press_events::{EventView, RetainedPress};
use crate::result::{LocationOutcome, PressResult, Thinning};
use skinrig_statistics::seeded;

/// First random stream; no other part of an analysis uses these.
const STREAMS: u64 = 1 << 63;

/// A press to thin.
pub(crate) struct Attempt<'a> {
    press: PressId,
    pub(super) location: u32,
    truth: Point2,
    views: &'a [EventView; 2],
}

impl<'a> Attempt<'a> {
    /// A retained press with its row of the table; `None` without a measured position.
    pub(crate) fn new(row: &PressResult, retained: &'a RetainedPress) -> Option<Self> {
        Some(Self {
            press: row.press,
            location: row.location.index(),
            truth: row.truth?,
            views: &retained.views,
        })
    }

    /// Events per second of both cameras in the idle time before the press; `None` if one of them has none.
    pub(super) fn idle_events_per_s(&self) -> Option<f64> {
        let rate = |view: &EventView| {
            let idle = background(view);
            let idle_s = idle.idle_us as f64 * 1e-6;
            (idle_s > 0.0).then(|| idle.events as f64 / idle_s)
        };
        let [one, two] = self.views;
        Some(rate(one)? + rate(two)?)
    }
}

/// The idle time before the window of a view.
fn background(view: &EventView) -> Background {
    let (from, to) = (view.idle_from_us, view.window_us.0);
    Background {
        events: view.between(from, to).len() as u64,
        idle_us: u64::from(to.saturating_sub(from)),
    }
}

/// A press located, or not, from some of its events.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Trial {
    /// Length of the error vector, mm; `None` if the press is not located.
    pub error_mm: Option<f64>,
    /// Remaining events of both cameras.
    pub events: u32,
    /// Remaining events per second of the press window.
    pub events_per_s: f64,
}

/// Results of one press.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Outcome {
    pub location: u32,
    /// With all of its events.
    pub full: Trial,
    /// By seed, kind and power of two from 1 on, in this order.
    thinned: Vec<Trial>,
    kinds: usize,
    max_power: usize,
}

impl Outcome {
    /// The press thinned by 2^`power` with this seed.
    pub(crate) fn trial(&self, seed: usize, kind: usize, power: usize) -> &Trial {
        match power {
            0 => &self.full,
            _ => &self.thinned[(seed * self.kinds + kind) * self.max_power + power - 1],
        }
    }
}

/// Parameters for thinning, clustering and locating presses.
pub(crate) struct Trials<'a> {
    pub locator: &'a FittedLocator,
    pub outline: &'a SkinOutline,
    /// Crop, radius, seeds and factors.
    pub settings: &'a AnalysisSettings,
    /// How the core threshold of DBSCAN follows the background at each factor.
    pub core: CoreThreshold,
    pub centroid: CentroidRule,
    pub kinds: &'a [Thinning],
}

impl Trials<'_> {
    /// Thins and locates every press; `accept` decides whether a position counts as located. The result is in the order of
    /// `attempts` and bit-identical for any number of threads: each press, seed and camera has its own random numbers.
    pub(crate) fn run(
        &self,
        attempts: &[Attempt<'_>],
        accept: impl Fn(&LocationOutcome) -> Option<Point2> + Sync,
    ) -> Vec<Outcome> {
        let thinners = || {
            self.settings
                .crop_v
                .map(|crop| Thinner::new(crop, self.settings.eps_px, self.core, self.centroid))
        };
        attempts
            .par_iter()
            .map_init(thinners, |thinners, attempt| {
                self.press(thinners, attempt, &accept)
            })
            .collect()
    }

    fn press(
        &self,
        thinners: &mut [Thinner; 2],
        attempt: &Attempt<'_>,
        accept: &impl Fn(&LocationOutcome) -> Option<Point2>,
    ) -> Outcome {
        let reduction = &self.settings.reduction;
        let windows_s = [0, 1].map(|k| {
            let (start, end) = attempt.views[k].window_us;
            f64::from(end.saturating_sub(start)) * 1e-6
        });
        let trial = |left: [ThinnedView; 2]| {
            let cameras = left.map(|l| l.features);
            let estimate = accept(&self.locator.outcome(self.outline, cameras).0);
            let truth = attempt.truth;
            let per_s = |k: usize| match windows_s[k] {
                s if s > 0.0 => f64::from(left[k].events) / s,
                _ => 0.0,
            };
            Trial {
                error_mm: estimate
                    .map(|at| libm::hypot(at.x_mm - truth.x_mm, at.y_mm - truth.y_mm)),
                events: left[0].events.saturating_add(left[1].events),
                events_per_s: per_s(0) + per_s(1),
            }
        };
        let full = CameraId::ALL.map(|camera| {
            let view = &attempt.views[camera.index()];
            let (start, end) = view.window_us;
            let window_us = u64::from(end.saturating_sub(start));
            let neighbours = background(view).neighbours(self.settings, camera, window_us);
            thinners[camera.index()].load(view.press_events(), neighbours)
        });
        let full = trial(full);
        let mut thinned = Vec::new();
        let mut left = [Vec::new(), Vec::new()];
        for seed in 0..reduction.seeds {
            for (k, left) in left.iter_mut().enumerate() {
                let stream = STREAMS
                    | u64::from(seed) << 33
                    | u64::from(attempt.press.index()) << 1
                    | k as u64;
                let mut rng = seeded::generator(self.settings.seed, stream);
                thinners[k].thin(&mut rng, self.kinds, reduction.max_power, left);
            }
            let [one, two] = &left;
            thinned.extend(one.iter().zip(two).map(|(one, two)| trial([*one, *two])));
        }
        Outcome {
            location: attempt.location,
            full,
            thinned,
            kinds: self.kinds.len(),
            max_power: reduction.max_power as usize,
        }
    }
}

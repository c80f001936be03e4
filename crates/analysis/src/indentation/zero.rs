//! Owns the return to zero: what is left of the change by a press when the time after it ends.
//!
//! A pixel fires when its brightness has moved by a threshold, so that it returns to within a threshold, not to zero: on the
//! way back it may keep an event. How many do depends on the camera and on how deep the press was: the median over the
//! calibration presses of about the same depth is subtracted.

use skinrig_model::AnalysisSettings;

use super::collector::PressPhases;
use super::phases::AFTER;
use crate::metrics::{mean_over_locations, rms_over_locations};
use crate::result::ZeroReturn;

/// Standard errors to the end of a 95 % interval.
const NORMAL: f64 = 1.96;
/// Shortest time after the release that says anything, s.
const SHORTEST_S: f64 = 0.5;

/// Fewest calibration presses whose median is taken, if there are as many; a quarter of all, if that is more.
const NEAREST: usize = 8;
/// Presses whose depths differ by less than this share are of the same depth.
const SAME_DEPTH: f64 = 0.11;
/// Differences of distances in depth that are none, mm: presses at equal distances count together.
const TIE_MM: f64 = 1e-6;

/// A calibration press: its measured depth, mm, and by camera the events left per changed pixel, if any changed.
struct Calibrating {
    depth_mm: f64,
    shares: [Option<f64>; 2],
}

/// Events left per changed pixel, by camera and depth: those of calibration presses.
pub(super) struct Habit(Vec<Calibrating>);

/// True if the time after the releases is long enough.
pub(super) fn is_observed(press: &PressPhases) -> bool {
    press.seconds[AFTER] >= SHORTEST_S
}

impl Habit {
    /// From calibration presses with their measured depths, mm.
    pub(super) fn new(presses: &[(f64, [&PressPhases; 2])]) -> Self {
        let share = |camera: &PressPhases| {
            let rest = camera.rest;
            (rest.pixels > 0).then(|| rest.toward as f64 / rest.pixels as f64)
        };
        let each = presses.iter().map(|(depth_mm, cameras)| Calibrating {
            depth_mm: *depth_mm,
            shares: cameras.map(share),
        });
        Self(each.collect())
    }

    /// Median of a camera over the calibration presses that are nearest in depth: all of the same depth, and at least so many.
    fn share(&self, camera: usize, depth_mm: f64) -> Option<f64> {
        let with_share = self.0.iter().filter_map(|press| {
            let apart_mm = (press.depth_mm - depth_mm).abs();
            Some((apart_mm, press.shares[camera]?))
        });
        let mut nearest: Vec<(f64, f64)> = with_share.collect();
        nearest.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        let least = NEAREST.max(nearest.len() / 4);
        let farthest_mm = nearest.get(least - 1).or(nearest.last())?.0;
        let within_mm = (farthest_mm + TIE_MM).max(SAME_DEPTH * depth_mm.abs());
        let near = nearest.partition_point(|n| n.0 < within_mm);
        nearest.truncate(near);
        let mut shares: Vec<f64> = nearest.iter().map(|n| n.1).collect();
        shares.sort_unstable_by(f64::total_cmp);
        shares.get(shares.len() / 2).copied()
    }

    /// What is left of a press of this depth, mm, averaged over both cameras by their changes; `None` if no pixel changed, in it or in
    /// calibration presses.
    pub(super) fn rest_mm(&self, cameras: [&PressPhases; 2], depth_mm: f64) -> Option<f64> {
        let (mut left, mut size) = (0.0, 0.0);
        for (k, camera) in cameras.iter().enumerate() {
            let habit = self.share(k, depth_mm)?;
            left += camera.rest.toward as f64 - habit * camera.rest.pixels as f64;
            size += camera.rest.size as f64;
        }
        (size > 0.0).then(|| depth_mm * left / size)
    }
}

/// The return of the scored presses: location and rest, mm, in plan order.
pub(super) fn zero_return(
    after_s: f64,
    rests: &[(u32, f64)],
    settings: &AnalysisSettings,
) -> ZeroReturn {
    let (resamples, seed) = (settings.bootstrap_resamples, settings.seed);
    let mean_mm = mean_over_locations(rests, resamples, seed);
    let trend = trend(rests);
    let beyond = |low: f64, high: f64| low > ZeroReturn::LIMIT_MM || high < -ZeroReturn::LIMIT_MM;
    let drifts = mean_mm
        .low
        .zip(mean_mm.high)
        .is_some_and(|(l, h)| beyond(l, h))
        || trend.is_some_and(|(mm, se)| mm.abs() - NORMAL * se > ZeroReturn::LIMIT_MM);
    ZeroReturn {
        after_s,
        mean_mm,
        rms_mm: rms_over_locations(rests, resamples, seed),
        trend_mm: trend.map(|(mm, _)| mm),
        drifts,
    }
}

/// Change of a straight line through the rests from the first to the last, and its standard error, mm.
fn trend(rests: &[(u32, f64)]) -> Option<(f64, f64)> {
    let n = rests.len() as f64;
    if rests.len() < 3 {
        return None;
    }
    let centre = (n - 1.0) / 2.0;
    let mean = rests.iter().map(|r| r.1).sum::<f64>() / n;
    let each = || {
        rests
            .iter()
            .enumerate()
            .map(|(i, r)| (i as f64 - centre, r.1 - mean))
    };
    let spread: f64 = each().map(|(t, _)| t * t).sum();
    let slope = each().map(|(t, mm)| t * mm).sum::<f64>() / spread;
    let squares: f64 = each().map(|(t, mm)| (mm - slope * t).powi(2)).sum();
    let se = (squares / (n - 2.0) / spread).sqrt();
    Some((slope * (n - 1.0), se * (n - 1.0)))
}

#[cfg(test)]
mod tests {
    use super::super::image::{ImageSums, ReturnSums};
    use super::super::phases::PHASES;
    use super::*;

    fn camera(toward: i64, pixels: u64) -> PressPhases {
        PressPhases {
            row: 0,
            events: [[0; 2]; PHASES],
            seconds: [1.0; PHASES],
            images: [ImageSums::default(); 2],
            rest: ReturnSums {
                toward,
                size: 5 * pixels,
                pixels,
            },
        }
    }

    #[test]
    fn what_every_press_keeps_is_no_rest() {
        let usual = camera(300, 1_000);
        let habit = Habit::new(&[(2.0, [&usual, &usual]); 3]);
        assert_eq!(habit.rest_mm([&usual, &usual], 2.0), Some(0.0));
        // A tenth of the change by the press is left besides.
        let more = camera(300 + 500, 1_000);
        let rest = habit.rest_mm([&more, &more], 2.0).unwrap();
        assert!((rest - 0.2).abs() < 1e-12, "{rest}");
        assert_eq!(habit.rest_mm([&camera(0, 0), &camera(0, 0)], 2.0), None);
    }

    #[test]
    fn deep_and_shallow_presses_keep_different_shares() {
        let (shallow, deep) = (camera(500, 1_000), camera(200, 1_000));
        let depths = (0..10).map(|i| 1.0 + 0.01 * f64::from(i));
        let presses: Vec<_> = depths
            .flat_map(|mm| [(mm, [&shallow, &shallow]), (mm + 1.5, [&deep, &deep])])
            .collect();
        let habit = Habit::new(&presses);
        assert_eq!(habit.rest_mm([&shallow, &shallow], 1.05), Some(0.0));
        assert_eq!(habit.rest_mm([&deep, &deep], 2.55), Some(0.0));
        assert_eq!(Habit::new(&[]).rest_mm([&deep, &deep], 2.0), None);
    }

    #[test]
    fn a_steady_rest_and_a_growing_one_are_drift() {
        let settings = AnalysisSettings::default();
        let of = |rest: &dyn Fn(u32) -> f64| {
            let rests: Vec<(u32, f64)> = (0..60).map(|i| (i % 12, rest(i))).collect();
            zero_return(2.0, &rests, &settings)
        };
        let scatter = |i: u32| 0.02 * (f64::from((i * 7919) % 17) / 8.0 - 1.0);
        assert!(!of(&|i| scatter(i)).drifts);
        assert!(!of(&|i| 10.0 * scatter(i)).drifts);
        assert!(of(&|i| 0.08 + scatter(i)).drifts);
        let growing = of(&|i| -0.05 + 0.1 * f64::from(i) / 59.0 + scatter(i));
        assert!(growing.drifts && (growing.trend_mm.unwrap() - 0.1).abs() < 0.02);
    }
}

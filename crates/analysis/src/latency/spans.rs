//! Defines the trial and the background around a contact.

use skinrig_model::Background;

use super::bins::HostTimeView;
use crate::result::PressResult;

/// Length of a trial on either side of the contact (public code: of the middle of the press), µs.
const TRIAL_US: f64 = 850_000.0;
/// Minimum distance of idle time from a press, µs.
const GUARD_US: f64 = 50_000.0;
/// Period of the presses in the published recording (public code), µs.
const PERIOD_US: f64 = 868e6 / 289.0;
/// Background of the public code after the middle of the press, µs.
const AFTER_US: (f64, f64) = (1_500_000.0, 2_400_000.0);
/// Minimum length of a background, µs.
const MIN_BACKGROUND_US: f64 = 20_000.0;
/// Tolerance for comparing times converted from whole µs, µs.
const ROUNDING_US: f64 = 2.0;

/// Time between a press and its neighbours.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Neighbours {
    /// Release of the previous press, µs after the contact (negative); minus infinity without one.
    pub release_before_us: f64,
    /// Contact of the next press, µs after the contact; infinity without one.
    pub contact_after_us: f64,
}

impl Neighbours {
    /// Neighbours of every press with known timing, by row.
    #[must_use]
    pub(crate) fn of(presses: &[PressResult]) -> Vec<Option<Self>> {
        let mut order: Vec<usize> = (0..presses.len()).collect();
        order.retain(|i| presses[*i].timing.is_some());
        order.sort_by_key(|i| presses[*i].timing.map(|t| t.contact));
        let mut out = vec![None; presses.len()];
        let us = |ns: i64| ns as f64 * 1e-3;
        for (k, &i) in order.iter().enumerate() {
            let timing = |k: usize| order.get(k).and_then(|i| presses[*i].timing);
            out[i] = timing(k).map(|own| Self {
                release_before_us: k
                    .checked_sub(1)
                    .and_then(timing)
                    .map_or(f64::NEG_INFINITY, |t| us(t.release.0 - own.contact.0)),
                contact_after_us: timing(k + 1)
                    .map_or(f64::INFINITY, |t| us(t.contact.0 - own.contact.0)),
            });
        }
        out
    }
}

/// Trial and background: host times relative to the contact, µs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Spans {
    /// Trial; includes the contact.
    pub trial_us: (f64, f64),
    /// Background.
    pub background_us: (f64, f64),
    /// True if the trial is shorter than nominal.
    pub shortened: bool,
}

impl Spans {
    /// Trial and background of a press, where both cameras were recording and no neighbour is in contact; `None` without a
    /// trial or without a background of 20 ms.
    #[must_use]
    pub(crate) fn of(
        sights: &[HostTimeView<'_>; 2],
        neighbours: Neighbours,
        background: Background,
    ) -> Option<Self> {
        let latest = |f: fn(&HostTimeView<'_>) -> f64| f(&sights[0]).max(f(&sights[1]));
        let earliest = |f: fn(&HostTimeView<'_>) -> f64| f(&sights[0]).min(f(&sights[1]));
        let begin = latest(|s| s.host_us(0.0));
        let end = earliest(|s| s.host_us(f64::from(s.view().length_us)));
        let middle = 0.5 * latest(|s| s.host_us(s.view().release_us));
        let (requested, idle) = match background {
            Background::Before => {
                let idle_from = latest(|s| s.host_us(f64::from(s.view().idle_from_us)));
                let window_from = earliest(|s| s.host_us(f64::from(s.view().window_us.0)));
                let idle = (idle_from, window_from.min(-GUARD_US));
                ((-TRIAL_US, TRIAL_US), idle)
            }
            // The public code cuts 1.5 s -/+ 0.85 s out of a window of one period around the middle of the press.
            Background::After => {
                let from = middle - 0.5 * PERIOD_US + 1.5e6;
                let trial = (from - TRIAL_US, from + TRIAL_US);
                (trial, (middle + AFTER_US.0, middle + AFTER_US.1))
            }
        };
        let trial = (
            requested
                .0
                .max(begin)
                .max(neighbours.release_before_us + GUARD_US),
            requested
                .1
                .min(end)
                .min(neighbours.contact_after_us - GUARD_US),
        );
        let idle = (
            idle.0
                .max(begin)
                .max(neighbours.release_before_us + GUARD_US),
            idle.1.min(end).min(neighbours.contact_after_us - GUARD_US),
        );
        let usable =
            trial.0 <= 0.0 && trial.1 > 0.0 && idle.1 - idle.0 >= MIN_BACKGROUND_US - ROUNDING_US;
        usable.then_some(Self {
            trial_us: trial,
            background_us: idle,
            shortened: trial.0 > requested.0 + ROUNDING_US || trial.1 < requested.1 - ROUNDING_US,
        })
    }
}

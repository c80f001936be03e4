//! The detection-latency study: its parts compared with slow references, planted onsets, inputs without a result.

#![expect(clippy::unwrap_used, reason = "tests")]

mod binning;
mod detecting;
mod planted;

use proptest::prelude::*;
use skinrig_analysis::analyze;
use skinrig_analysis::latency::bins::{Grid, HostTimeView};
use skinrig_analysis::latency::cusum::background_rate_per_s;
use skinrig_analysis::latency::interval::{Outcome, Plan};
use skinrig_analysis::latency::smooth::{Boundary, Kernel};
use skinrig_analysis::latency::study;
use skinrig_analysis::latency::sweep::{OnsetStatistics, choose, sweep, thresholds};
use skinrig_analysis::latency::thin::choose_events;
use skinrig_analysis::latency::trial::{Detector, Label, Trial};
use skinrig_analysis::press_events::{EventView, PackedEvent, RetainedPress, RetainedPresses};
use skinrig_analysis::result::{Analysis, ClockFit, ClockMethod, Latency, ThresholdRow};
use skinrig_model::{
    Background, CdEvent, HostDuration, LatencySettings, Polarity, PressId, PressRole,
};
use skinrig_planted::grid::Random;

const BIN_S: f64 = 2e-4;

/// Poisson counts from the times between events: slow, and correct for any rate.
fn counts(random: &mut Random, per_s: impl Fn(usize) -> f64, bins: usize) -> Vec<u32> {
    (0..bins)
        .map(|bin| {
            let (mut n, mut t) = (0, -libm::log(1.0 - random.unit()));
            while t < per_s(bin) * BIN_S {
                n += 1;
                t -= libm::log(1.0 - random.unit());
            }
            n
        })
        .collect()
}

fn detector() -> Detector {
    let settings = LatencySettings::default();
    // About onsets, wherever they are.
    let edges = Boundary::Renormalised;
    Detector {
        earliest_ms: f64::NEG_INFINITY,
        ..Detector::new(
            &settings,
            edges,
            thresholds(skinrig_model::ThresholdGrid {
                from: 1.0,
                to: 20.0,
                count: 20,
            }),
            0.0,
        )
    }
}

fn label(press: u32) -> Label {
    Label {
        press: PressId::from_index(press),
        location: press,
    }
}

/// The onset at each threshold, ms.
fn onsets_ms(trial: &Trial) -> Vec<Option<f64>> {
    trial.searches.iter().map(|s| s.onset_ms()).collect()
}

/// Bins from `first` to `first + counts.len()`.
fn run(detector: &Detector, first: i64, counts: &[u32], background: &[u32]) -> Trial {
    let grid = Grid {
        first,
        len: counts.len(),
    };
    detector.run(label(0), grid, counts, background)
}

/// A camera's view that begins 1 s before the contact, with events at these host times after the contact, µs.
fn view(clock: &ClockFit, contact_us: f64, after_us: &[f64]) -> EventView {
    let rate = 1.0 + clock.drift_ppm * 1e-6;
    let start_us = (contact_us - 1e6).floor().max(0.0) as u64;
    let contact_us = contact_us - start_us as f64;
    let mut events: Vec<PackedEvent> = after_us
        .iter()
        .map(|after| {
            let t_us = start_us + (contact_us + after * rate).round() as u64;
            let event = CdEvent {
                t_us,
                x: 3,
                y: 200,
                polarity: Polarity::On,
            };
            PackedEvent::pack(&event, start_us).unwrap()
        })
        .collect();
    events.sort_unstable();
    EventView {
        start_us,
        length_us: 3_000_000,
        window_us: ((contact_us - 5e4).ceil() as u32, (contact_us + 5e5) as u32),
        idle_from_us: (contact_us - 5.5e5) as u32,
        contact_us,
        release_us: contact_us + 4.5e5,
        events,
    }
}

//! Owns the reasons for which the clocks of a session are not known well enough.

use serde::{Deserialize, Serialize};
use skinrig_model::{CameraId, DeviceRole};

use super::MapName;
use crate::clock::RatesError;
use crate::timebase::CameraClockError;
use crate::with_text::with_text;

/// Why the alignment of a session cannot be used. In JSON `kind`, fields, and `text`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, thiserror::Error)]
#[serde(remote = "Self", tag = "kind", rename_all = "snake_case")]
pub enum AlignmentViolation {
    /// The trigger box sent reports, but the host never asked it for the time.
    #[error("host from box: expected time exchanges, found none")]
    NoExchanges,
    /// No clock fits the time exchanges with the box.
    #[error(
        "host from box: expected time exchanges that fit a clock, found {exchanges} that do not"
    )]
    ExchangesFitNoClock {
        /// Time exchanges.
        exchanges: usize,
    },
    /// Time exchanges with the box exclude each other.
    #[error(
        "host from box: expected consistent time exchanges, found some that exclude each other"
    )]
    ExchangesInconsistent,
    /// The trains of the box give no clock of a camera.
    #[error("{camera} from box: expected a clock, found none: {why}")]
    NoTrainsClock {
        /// The camera.
        camera: CameraId,
        /// Why not.
        why: CameraClockError,
    },
    /// A camera's clock is unknown where there is a press.
    #[error("{camera} from host: expected a map at {at_s:.3} s, found none")]
    NoMap {
        /// The camera.
        camera: CameraId,
        /// First such contact or release on the host clock, s.
        at_s: f64,
    },
    /// Too many contacts and releases far from all ties of a camera's clock while it was recording.
    #[error(
        "{camera} from host, contacts and releases without a tie within {tie_limit_s} s: expected at most {} %, found {found_percent:.1} %",
        rounded(*.limit_percent)
    )]
    FarFromTies {
        /// The camera.
        camera: CameraId,
        /// Maximum distance from a tie, s.
        tie_limit_s: f64,
        /// Maximum share, percent.
        limit_percent: f64,
        /// Share found, percent.
        found_percent: f64,
    },
    /// Trains arrived, but away from the line of a clock.
    #[error(
        "{clock}, clock drift: expected the trains that {camera} saw within {near_us:.0} µs of a clock's line, found \
         {off_line} of {sent} up to {furthest_us:.0} µs off it: they arrived, but this clock drifts faster than \
         plausible, or jumps"
    )]
    ClockDrifts {
        /// The device with this clock: the trigger box if both cameras agree.
        clock: DeviceRole,
        /// The camera with these counts.
        camera: CameraId,
        /// Maximum distance from the line, µs.
        near_us: f64,
        /// Trains beyond it.
        off_line: u32,
        /// Trains that the box sent.
        sent: u32,
        /// Largest distance from the line, µs.
        furthest_us: f64,
    },
    /// Residuals of a map are too large.
    #[error(
        "{}, residual rms: expected at most {} µs, found {found_us:.1} µs",
        .map.name(), rounded(*.limit_us)
    )]
    Residuals {
        /// The map.
        map: MapName,
        /// Maximum RMS, µs.
        limit_us: f64,
        /// RMS found, µs.
        found_us: f64,
    },
    /// A map is too uncertain at the presses.
    #[error(
        "{}, 95 % interval at the presses plus systematic bound: expected at most {} µs, found {found_us:.1} µs",
        .map.name(), rounded(*.limit_us)
    )]
    Interval {
        /// The map.
        map: MapName,
        /// Maximum of half width and bound together, µs.
        limit_us: f64,
        /// Sum found, µs.
        found_us: f64,
    },
    /// Too many held-out points are outside the intervals stated for them.
    #[error(
        "{}, share outside the stated interval: expected at most {} %, found {found_percent:.1} %",
        .map.name(), rounded(*.limit_percent)
    )]
    Coverage {
        /// The map.
        map: MapName,
        /// Maximum share outside, with three standard errors of chance, percent.
        limit_percent: f64,
        /// Share outside, percent.
        found_percent: f64,
    },
    /// The exchanges with the box bound the host's clock too loosely at the presses.
    #[error(
        "{}, bound at the presses: expected at most {} µs, found {found_us:.1} µs",
        .map.name(), rounded(*.limit_us)
    )]
    Bound {
        /// The map.
        map: MapName,
        /// Maximum bound, µs.
        limit_us: f64,
        /// Largest bound found, µs.
        found_us: f64,
    },
    /// Two clocks differ too much in rate.
    #[error(
        "{}, drift: expected at most {} ppm, found {found_ppm:.1} ppm",
        .map.name(), rounded(*.limit_ppm)
    )]
    Drift {
        /// The map.
        map: MapName,
        /// Maximum, ppm.
        limit_ppm: f64,
        /// Drift found, without sign, ppm.
        found_ppm: f64,
    },
    /// A camera's trigger input lost too many edges.
    #[error(
        "{camera}, trigger input, lost edges: expected at most {} %, found {found_percent:.1} %",
        rounded(*.limit_percent)
    )]
    LostEdges {
        /// The camera.
        camera: CameraId,
        /// Maximum share of the edges sent, percent.
        limit_percent: f64,
        /// Share found, percent.
        found_percent: f64,
    },
    /// A camera's trigger input has too many edges that were never sent.
    #[error(
        "{camera}, trigger input, doubled and spurious edges: expected at most {} %, found {found_percent:.1} %",
        rounded(*.limit_percent)
    )]
    ExtraEdges {
        /// The camera.
        camera: CameraId,
        /// Maximum share of the edges sent, percent.
        limit_percent: f64,
        /// Share found, percent.
        found_percent: f64,
    },
    /// The event rates give no clock of a camera.
    #[error("{camera}: no clock alignment: {why}")]
    NoRatesClock {
        /// The camera.
        camera: CameraId,
        /// Why not.
        why: RatesError,
    },
    /// Too few planned presses have a burst of events.
    #[error(
        "{camera}: expected bursts of events at {least_percent:.0} % or more of the {presses} planned presses, found {found}"
    )]
    PressesWithoutBursts {
        /// The camera.
        camera: CameraId,
        /// Minimum share, percent.
        least_percent: f64,
        /// Planned presses within the recording.
        presses: u32,
        /// Planned presses with a burst.
        found: u32,
    },
    /// Too many bursts of events during the plan have no planned press.
    #[error(
        "{camera}: expected {least_percent:.0} % or more of the {bursts} bursts of events during the plan to be \
         planned presses, found {found}: the recording has more presses than the schedule"
    )]
    BurstsWithoutPresses {
        /// The camera.
        camera: CameraId,
        /// Minimum share, percent.
        least_percent: f64,
        /// Bursts of events from the first planned press to the last.
        bursts: u32,
        /// Bursts that are planned presses.
        found: u32,
    },
    /// Another alignment by event rates fits about as well.
    #[error(
        "alignment by event rates: expected log-odds of at least {least_log_odds} (natural logarithm) against all other \
         alignments, found {log_odds:.1}: {}; check the schedule (presses, sync presses, period) against the \
         recordings{}",
        rival(.runner_up_s.as_ref(), *.period_s),
        if *.log_odds > 0.0 { ", or lower analysis.alignment.min_log_odds" } else { "" }
    )]
    UncertainRates {
        /// Minimum.
        least_log_odds: f64,
        /// Found, against all others.
        log_odds: f64,
        /// How much later the presses of each camera are in the likeliest other alignment, s (`None`: this camera is not
        /// aligned by event rates); `None` as a whole if a plan unrelated to the recordings is likelier.
        runner_up_s: Option<[Option<f64>; 2]>,
        /// Median time from one planned press to the next, s.
        period_s: f64,
    },
}

with_text!(AlignmentViolation);

/// A limit without the digits that arithmetic added.
fn rounded(limit: f64) -> f64 {
    (limit * 1e3).round() / 1e3
}

/// The likeliest other alignment.
fn rival(runner_up_s: Option<&[Option<f64>; 2]>, period_s: f64) -> String {
    let each = CameraId::ALL
        .into_iter()
        .zip(runner_up_s.into_iter().flatten());
    let each: Vec<String> = each
        .filter_map(|(camera, shift_s)| {
            let shift_s = (*shift_s)?;
            let presses = shift_s / period_s;
            Some(format!("{camera} {shift_s:+.1} s ({presses:+.1} presses)"))
        })
        .collect();
    if each.is_empty() {
        return "the plan may not belong to these recordings at all".to_owned();
    }
    format!(
        "presses later by {} fit about as well or better",
        each.join(" and ")
    )
}

//! Plausibility audit: independent laws that every valid session obeys, and the likeliest fault behind a violation.
//!
//! Each law has its own file and is checked independently. One fault often violates several laws; findings that follow from
//! a more certain one are dropped, so that one fault gives one finding. Bounds and sources: `docs/reference/audit.md`.

mod advice;
mod blind_guess;
mod burst;
mod clock_step;
mod commanded;
mod complete;
mod drift;
#[cfg(test)]
mod even_path;
mod exchanged;
mod finding;
mod fixed_pixel;
mod follow;
mod frames;
mod height;
mod local;
mod mark_step;
mod observed_press;
mod order;
mod pattern;
mod permuted;
mod readings;
mod rearranged;
mod recording_gaps;
mod repetitions;
mod resection;
mod scale;
mod segments;
mod slow;
mod statistics;
mod whole_presses;

use crate::bursts::PressBurst;
use crate::input::SessionInput;
use crate::onsets::Onset;
use crate::result::{Analysis, Finding};
use crate::stream::Silences;

/// Evidence from the streams alone, camera 1 and camera 2.
#[derive(Debug, Clone, Default)]
pub(crate) struct Streams {
    /// Silent periods.
    pub silences: [Silences; 2],
    /// Contacts detected in the counts, s on the host clock; empty for a session of several legs.
    pub contacts_s: [Vec<f64>; 2],
    /// First event, s on the host clock; with the contacts.
    pub begun_s: [Option<f64>; 2],
    /// Onsets of the presses.
    pub onsets: [Vec<Onset>; 2],
    /// Events of each press against the idle rate, by row of the plan.
    pub bursts: [Vec<Option<PressBurst>>; 2],
}

/// Violated laws, most certain finding first; empty for a plausible session.
///
/// Uses the table of presses, the journal, the clock fits and the event rates of `analysis`. Only the last law uses located
/// positions: a calibration can absorb a fault that the nominal geometry shows.
#[must_use]
pub(crate) fn audit(input: &SessionInput, analysis: &Analysis, streams: &Streams) -> Vec<Finding> {
    let presses_seen = observed_press::observed_presses(input, analysis, &streams.bursts);
    let [one, two] = &streams.silences;
    let found = [
        complete::findings(input, analysis),
        recording_gaps::findings(input, analysis, [one, two]),
        commanded::findings(input, &presses_seen),
        height::findings(
            input,
            analysis,
            streams.onsets.each_ref().map(Vec::as_slice),
        )
        .into_iter()
        .collect(),
        pattern::findings(
            &presses_seen,
            streams.contacts_s.each_ref().map(Vec::as_slice),
            streams.begun_s,
        ),
        burst::findings(analysis, &presses_seen),
        mark_step::findings(input),
        clock_step::findings(
            &presses_seen,
            streams.contacts_s.each_ref().map(Vec::as_slice),
            analysis.clocks,
        ),
        whole_presses::findings(
            &presses_seen,
            streams.contacts_s.each_ref().map(Vec::as_slice),
        ),
        follow::findings(analysis, &presses_seen),
        repetitions::findings(&presses_seen),
        drift::findings(input, analysis),
        blind_guess::findings(analysis).into_iter().collect(),
    ]
    .concat();
    order::leading_first(found)
}

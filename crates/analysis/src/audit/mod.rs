//! The plausibility audit: independent laws that every sane session obeys, and the fault that most likely broke one.
//!
//! Each law is judged on its own, in its own file. A fault often breaks several laws; what follows from a finding
//! that is more certain is left out, so that one fault gives one finding. Bounds and their sources: `docs/reference/audit.md`.

mod advice;
mod burst;
mod commanded;
mod complete;
mod covered;
mod drift;
mod finding;
mod follow;
mod frames;
mod height;
mod order;
mod pattern;
mod readings;
mod repetitions;
mod resection;
mod segments;
mod statistics;
mod touch;
mod worth;

use crate::input::SessionInput;
use crate::onsets::Onset;
use crate::result::{Analysis, Finding};
use crate::stream::Silences;

/// What the streams say by themselves, camera 1 and camera 2.
#[derive(Debug, Clone, Default)]
pub struct Streams {
    /// Where they are silent.
    pub silences: [Silences; 2],
    /// Contacts that stand out of their counts, s on the host's clock; empty when nobody asks for them.
    pub contacts_s: [Vec<f64>; 2],
    /// When the events of the presses began.
    pub onsets: [Vec<Onset>; 2],
}

/// The laws that the session breaks, the most certain finding first; empty for a plausible session.
///
/// Reads the table of presses, the journal, the clock fits and the event rates of `analysis`. Where the presses were located
/// plays a part only in the last law: a calibration can absorb a fault that the nominal geometry shows.
#[must_use]
pub fn audit(input: &SessionInput, analysis: &Analysis, streams: &Streams) -> Vec<Finding> {
    let touches = touch::touches(input, analysis);
    let [one, two] = &streams.silences;
    let found = [
        complete::findings(input, analysis),
        covered::findings(input, analysis, [one, two]),
        commanded::findings(input, &touches),
        height::findings(
            input,
            analysis,
            streams.onsets.each_ref().map(Vec::as_slice),
        )
        .into_iter()
        .collect(),
        pattern::findings(&touches, streams.contacts_s.each_ref().map(Vec::as_slice)),
        burst::findings(analysis, &touches),
        follow::findings(analysis, &touches),
        repetitions::findings(&touches),
        drift::findings(input, analysis),
        worth::findings(analysis).into_iter().collect(),
    ]
    .concat();
    order::leading_first(found)
}

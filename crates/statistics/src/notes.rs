//! Caveats of a comparison.

use super::comparison::Note;
use super::error::Side;
use super::influence::{BOOTSTRAP_FROM, InferenceData, Measure};
use super::sample::Data;
use super::spread::RepeatEstimator;

/// Collects the caveats of a comparison.
pub(super) fn notes(data: [&Data; 2], of: &[Measure; 2]) -> Vec<Note> {
    let mut notes = Vec::new();
    let locations = of.iter().map(Measure::locations).min().unwrap_or(0);
    if locations < BOOTSTRAP_FROM {
        let locations = locations as u32;
        notes.push(Note::FewLocations { locations });
    }
    if RepeatEstimator::for_samples(data) == RepeatEstimator::Pairs {
        notes.push(Note::UnequalRepetitions);
    }
    for (side, of) in [Side::A, Side::B].into_iter().zip(of) {
        match &of.shape {
            InferenceData::Percentile(at) | InferenceData::Width(at, ..) if at.missed() > 0 => {
                notes.push(Note::Missed {
                    side,
                    missed: at.missed(),
                    trials: of.presses(),
                });
            }
            InferenceData::Share(_) if of.value <= 0.0 || of.value >= 1.0 => {
                notes.push(Note::AtTheBorder { side });
            }
            InferenceData::Counts(0, ..) => notes.push(Note::AtTheBorder { side }),
            _ => {}
        }
    }
    notes
}

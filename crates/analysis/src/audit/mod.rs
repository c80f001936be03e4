//! The plausibility audit: independent laws that every sane session obeys, and the fault that most likely broke one.
//!
//! Each law is judged on its own, in its own file. A fault often breaks several laws; what follows from a finding
//! that is more certain is left out, so that one fault gives one finding. Bounds and their sources: `docs/audit.md`.

mod advice;
mod burst;
mod commanded;
mod complete;
mod drift;
mod follow;
mod order;
mod repetitions;
mod statistics;
mod touch;

use crate::input::SessionInput;
use crate::result::{Analysis, Fault, Finding, Law};
use skinrig_model::CameraId;

/// The laws that the session breaks, the most certain finding first; empty for a plausible session.
///
/// Reads the table of presses, the journal, the clock fits and the event rates of `analysis`; never where the
/// presses were located: a calibration can absorb a fault that the nominal geometry shows.
#[must_use]
pub fn audit(input: &SessionInput, analysis: &Analysis) -> Vec<Finding> {
    let touches = touch::touches(input, analysis);
    let found = [
        complete::findings(input, analysis),
        commanded::findings(input, &touches),
        burst::findings(analysis, &touches),
        follow::findings(analysis, &touches),
        repetitions::findings(&touches),
        drift::findings(input, analysis),
    ]
    .concat();
    order::leading_first(found)
}

/// A finding, with the advice that belongs to its fault.
fn finding(law: Law, fault: Fault, camera: Option<CameraId>, evidence: String) -> Finding {
    Finding {
        law,
        fault,
        camera,
        evidence,
        advice: advice::of(fault).to_owned(),
        invalidates: fault.invalidates(),
    }
}

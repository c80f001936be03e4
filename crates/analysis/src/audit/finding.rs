//! Constructor of findings.

use skinrig_model::CameraId;

use super::advice;
use crate::result::{Evidence, Fault, Finding, Law};

/// A finding with the advice for its fault.
pub(super) fn finding(
    law: Law,
    fault: Fault,
    camera: Option<CameraId>,
    evidence: Evidence,
) -> Finding {
    Finding {
        law,
        fault,
        camera,
        evidence,
        advice: advice::of(fault).to_owned(),
        invalidates: fault.invalidates(),
    }
}

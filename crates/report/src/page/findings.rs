//! Owns the audit's findings on the page.

use minijinja::{Value, context};
use skinrig_analysis::result::Finding;

use crate::format::words;

/// The violated law, as a statement that should hold.
pub(crate) fn law(finding: &Finding) -> &'static str {
    use skinrig_analysis::result::Law;
    match finding.law {
        Law::BurstWithMotion => "events burst while the tip moves in the skin",
        Law::CentroidFollowsPosition => "the centroid follows the position of the press",
        Law::RepetitionsAgree => "repetitions at one location agree",
        Law::AsCommanded => "depth, speed and position match the commands",
        Law::ClockDrift => "a camera's clock drifts no more than a crystal",
        Law::Complete => "the data of the session are complete",
    }
}

/// The likely fault and the camera concerned.
pub(crate) fn fault(finding: &Finding) -> String {
    let fault = words(&finding.fault);
    match finding.camera {
        Some(camera) => format!("{fault}, camera {}", camera.number()),
        None => fault,
    }
}

pub(super) fn values(findings: &[Finding]) -> Vec<Value> {
    findings
        .iter()
        .map(|f| {
            context! { law => law(f), fault => fault(f), evidence => f.evidence.clone(), advice => f.advice.clone() }
        })
        .collect()
}

//! Owns the audit's findings on the page.

use skinrig_analysis::result::Finding;

use crate::document::{Group, Text, paragraph};
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

/// The card of all findings; `None` without any.
pub(super) fn card(findings: &[Finding]) -> Option<Group> {
    let finding = |f: &Finding| {
        let fault = Text::new().bold(format!("Likely: {}.", fault(f))).add(" ");
        Group::new("finding")
            .with(paragraph(
                fault.span("soft", format!("Violated: {}.", law(f))),
            ))
            .with(paragraph(f.evidence.to_string()))
            .with(paragraph(
                Text::new().bold("Do:").add(format!(" {}", f.advice)),
            ))
    };
    let faults = match findings.len() {
        0 => return None,
        1 => "1 fault".to_owned(),
        n => format!("{n} faults"),
    };
    let card = Group::titled(format!("The plausibility audit found {faults}"))
        .class("findings")
        .attribute("role", "alert")
        .test_id("findings");
    Some(card.with_all(findings.iter().map(finding)))
}

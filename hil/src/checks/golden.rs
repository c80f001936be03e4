//! Check `golden`: a campaign on the golden skin.

use std::path::Path;

use skinrig_analysis::result::ANALYSIS_VERSION;
use skinrig_protocol::suite::{Check, Measure};

use crate::bench::{Bench, CampaignRun};
use crate::findings::{Findings, GoldenRecord};
use crate::golden_values;

/// Runs the check. The bench runs and analyses the campaign; metrics that it did not measure become unmeasured.
pub(super) fn golden(check: &Check, bench: &mut dyn Bench, findings: &mut Findings) {
    let Measure::Golden { protocol } = &check.measure else {
        return;
    };
    if let Some(run) = campaign(protocol, bench, findings) {
        if let Some(analysis) = &run.analysis {
            golden_values::add(analysis, run.lost_bytes, findings);
        }
        findings.golden = Some(GoldenRecord {
            files: run.files,
            skin: run.skin,
            analysis_version: ANALYSIS_VERSION,
        });
    }
    unmeasured_if_missing(check, findings);
}

/// Runs a campaign on the skin; its evidence goes to `findings`. `None` without a session, or where no skin lies on the bench.
pub(super) fn campaign(
    protocol: &Path,
    bench: &mut dyn Bench,
    findings: &mut Findings,
) -> Option<CampaignRun> {
    if bench.rig().robot.sample_is_off {
        findings.not_applicable = Some("the rig file says `robot.sample_is_off: true`".to_owned());
        return None;
    }
    match bench.run_campaign(protocol) {
        Ok(mut run) => {
            findings.evidence.append(&mut run.evidence);
            Some(run)
        }
        Err(why) => {
            findings.evidence.push(*why);
            None
        }
    }
}

/// Metrics of the skin without a value were not measured.
pub(super) fn unmeasured_if_missing(check: &Check, findings: &mut Findings) {
    if findings.not_applicable.is_some() {
        return;
    }
    for metric in check.metrics {
        if !findings.values.iter().any(|v| v.metric == metric.name) {
            findings.unmeasured("skin", metric.name);
        }
    }
}

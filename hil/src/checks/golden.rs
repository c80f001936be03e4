//! Check `golden`: a campaign on the golden skin.

use skinrig_protocol::suite::{Check, Measure};

use crate::bench::Bench;
use crate::findings::{Findings, GoldenRecord};

/// Runs the check. The bench runs and analyses the campaign; metrics that it did not measure become unmeasured.
pub(super) fn golden(check: &Check, bench: &mut dyn Bench, findings: &mut Findings) {
    let Measure::Golden { protocol } = &check.measure else {
        return;
    };
    if bench.rig().robot.sample_is_off {
        findings.not_applicable = Some("the rig file says `robot.sample_is_off: true`".to_owned());
        return;
    }
    match bench.run_golden(protocol) {
        Ok(run) => {
            *findings = run.findings;
            findings.golden = Some(GoldenRecord {
                files: run.files,
                skin: run.skin,
                analysis_version: run.analysis_version,
            });
        }
        Err(why) => findings.evidence.push(*why),
    }
    for metric in check.metrics {
        if !findings.values.iter().any(|v| v.metric == metric.name) {
            findings.unmeasured("skin", metric.name);
        }
    }
}

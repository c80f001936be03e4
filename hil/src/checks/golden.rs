//! Checks: the golden skin.

use skinrig_protocol::suite::{Check, Measure};

use crate::bench::Bench;
use crate::findings::{Findings, GoldenKept};

/// Makes the check. What it measured comes from the bench, which runs and analyses the campaign; what that did not measure is
/// unmeasured.
pub fn golden(check: &Check, bench: &mut dyn Bench, found: &mut Findings) {
    let Measure::Golden { protocol } = &check.measure else {
        return;
    };
    if bench.rig().robot.sample_is_off {
        found.not_here = Some("the rig file says `robot.sample_is_off: true`".to_owned());
        return;
    }
    match bench.golden(protocol) {
        Ok(run) => {
            *found = run.findings;
            found.golden = Some(GoldenKept {
                files: run.files,
                skin: run.skin,
                analysis_version: run.analysis_version,
            });
        }
        Err(why) => found.evidence.push(*why),
    }
    for metric in check.metrics {
        if !found.values.iter().any(|v| v.metric == metric.name) {
            found.unmeasured("skin", metric.name);
        }
    }
}

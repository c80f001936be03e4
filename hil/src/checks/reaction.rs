//! Check `reaction`: a campaign that feels its presses while it records.

use skinrig_analysis::result::FeltTouches;
use skinrig_nightly::EvidenceKind;
use skinrig_protocol::suite::{Check, Measure};

use super::golden::{campaign, unmeasured_if_missing};
use crate::bench::{Bench, OnlineComparison};
use crate::device_evidence::SKIN;
use crate::findings::Findings;
use crate::golden_evidence;

/// Least number of presses for a share or a median.
const PRESSES: u64 = 12;

/// Runs the check. Metrics that it did not measure become unmeasured.
pub(super) fn reaction(check: &Check, bench: &mut dyn Bench, findings: &mut Findings) {
    let Measure::Reaction { protocol } = &check.measure else {
        return;
    };
    if let Some(run) = campaign(protocol, bench, findings)
        && let Some(analysis) = &run.analysis
    {
        golden_evidence::add(analysis, run.lost_bytes, findings);
        if analysis.is_valid() {
            match &analysis.felt {
                Some(felt) => values(felt, findings),
                None => findings.add_evidence(
                    EvidenceKind::TimeOut,
                    "computer",
                    never_felt(&run.files.session),
                ),
            }
        }
        // Report the findings of the analysis in any case: they explain why there may be nothing to compare.
        match bench.compare_online(&run.files) {
            Ok(comparison) => differences(comparison, findings),
            Err(why) if analysis.is_valid() => findings.evidence.push(*why),
            Err(_) => {}
        }
        for value in &mut findings.values {
            value.with_note(format!("session {}", run.files.session));
        }
    }
    unmeasured_if_missing(check, findings);
}

/// A run does not wait for learning: on a slow computer it may end before.
fn never_felt(session: &str) -> String {
    format!(
        "expected the run to feel from its first scored press on, found that it never began: learning failed or lasted until \
         the end; `skinrig show {session}` has the reason"
    )
}

/// Touches felt while the session was recorded, compared with its analysis.
fn values(felt: &FeltTouches, findings: &mut Findings) {
    if felt.presses > 0 {
        let share = 100.0 * f64::from(felt.felt) / f64::from(felt.presses);
        findings
            .value(SKIN, "felt", share)
            .with_samples(felt.presses as usize, PRESSES);
    }
    findings.value(SKIN, "false_alarms", felt.false_alarms as f64);
    findings.value(SKIN, "skipped", f64::from(felt.skipped));
    let reaction_ms = felt.reactions.as_ref().map(|r| r.reaction_ms);
    for (metric, ms) in [("delay", Some(felt.delay_ms)), ("reaction", reaction_ms)] {
        if let Some(ms) = ms
            && let Some(median) = ms.median
        {
            findings
                .value(SKIN, metric, median * 1e-3)
                .with_samples(ms.n as usize, PRESSES);
        }
    }
}

fn differences(comparison: OnlineComparison, findings: &mut Findings) {
    let OnlineComparison { windows, equal } = comparison;
    if windows > 0 {
        findings
            .value(SKIN, "differences", (windows - equal) as f64)
            .with_samples(windows, 1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use skinrig_analysis::result::{FeltReactions, Spread};
    use skinrig_model::Reaction;

    fn felt(presses: u32, reactions: Option<FeltReactions>) -> FeltTouches {
        FeltTouches {
            from_s: 10.0,
            presses,
            outside: 0,
            felt: presses / 2,
            missed: presses - presses / 2,
            alarmed: 0,
            delay_ms: spread(presses / 2, 20.0),
            lag_ms: spread(40, 1.0),
            false_alarms: 3,
            at_risk_s: 20.0,
            error_mm: Spread::default(),
            region_mm: Spread::default(),
            with_regions: 0,
            held: 0,
            depth_error_mm: Spread::default(),
            depth_within_mm: Spread::default(),
            with_depths: 0,
            depths_held: 0,
            reactions,
            skipped: 1,
        }
    }

    fn spread(n: u32, ms: f64) -> Spread {
        Spread {
            n,
            median: (n > 0).then_some(ms),
            p99: None,
        }
    }

    fn measured(felt: &FeltTouches) -> Vec<(&'static str, Option<f64>, Option<u64>, u64)> {
        let mut findings = Findings::default();
        values(felt, &mut findings);
        let of = |v: &crate::findings::Value| (v.metric, v.value, v.n, v.needs);
        findings.values.iter().map(of).collect()
    }

    #[test]
    fn what_was_felt_becomes_values_in_the_units_of_the_suite() {
        let reactions = FeltReactions {
            reaction: Reaction::Stop,
            reaction_ms: spread(8, 25.0),
            since_event_ms: Spread::default(),
            depth_mm: Spread::default(),
            early: Vec::new(),
            regions: (0, 0),
        };
        let expected = [
            ("felt", Some(50.0), Some(18), 12),
            ("false_alarms", Some(3.0), None, 0),
            ("skipped", Some(1.0), None, 0),
            ("delay", Some(0.02), Some(9), 12),
            ("reaction", Some(0.025), Some(8), 12),
        ];
        assert_eq!(measured(&felt(18, Some(reactions))), expected);
    }

    #[test]
    fn nothing_pressed_and_nothing_felt_is_no_value() {
        let names: Vec<&str> = measured(&felt(0, None)).iter().map(|v| v.0).collect();
        assert_eq!(names, ["false_alarms", "skipped"]);
    }
}

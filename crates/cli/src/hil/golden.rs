//! Runs the golden campaign: a protocol through controller, recorder and analysis, in the night's folder.

use std::path::Path;

use skinrig_hil::findings::Findings;
use skinrig_hil::{Bench, GoldenRun, Problem};
use skinrig_hil::{golden_values, run_evidence};
use skinrig_model::RunEnd;
use skinrig_nightly::{Evidence, EvidenceKind, GoldenSession};
use skinrig_protocol::{Plan, Protocol};

use super::real_bench::RealBench;
use crate::analysis_request::AnalysisRequest;
use crate::exit::Failure;
use crate::results;
use crate::rig::{bench, gates};
use crate::{check, run};

/// Closes every device and runs the golden campaign.
///
/// # Errors
/// [`Problem`] if nothing was recorded.
pub(super) fn golden(bench: &mut RealBench, file: &Path) -> Result<GoldenRun, Problem> {
    let (protocol, plan) = protocol(bench, file)?;
    let folder = bench.folder().to_owned();
    let rig = bench.take_rig(&protocol)?;
    let duration_s = plan.summary().duration_s;
    let preflight = gates::of_bench(bench.rig(), &rig, &folder, duration_s);
    let intent = run::intent_of(&protocol, protocol.seed, duration_s, bench.command_line());
    let (session, report) = run::record(
        &intent,
        &plan,
        rig,
        &folder,
        Some(preflight),
        // The night tells people about itself.
        None,
        bench.operator(),
    )
    .map_err(|f| problem(EvidenceKind::Disk, "computer", &f))?;
    let mut findings = Findings::default();
    if let RunEnd::Stopped(why) = &report.end
        && !report.end.is_complete()
    {
        findings.add_evidence(EvidenceKind::TimeOut, "robot", why.to_string());
    }
    findings.evidence.extend(run_evidence::from_report(&report));
    let mut golden = GoldenRun {
        files: GoldenSession {
            session: name(&session),
            report: None,
            results_sha256: None,
        },
        skin: Some(protocol.prototype.id.clone()),
        analysis_version: skinrig_analysis::result::ANALYSIS_VERSION,
        findings,
    };
    match analyze(&session) {
        Ok((results, html)) => {
            golden.files.report = Some(html);
            golden.files.results_sha256 = Some(results.provenance.results_hash.clone());
            let lost = results.provenance.lost_bytes;
            golden_values::add(&results.analysis, lost, &mut golden.findings);
        }
        Err(failure) => {
            golden
                .findings
                .evidence
                .push(*problem(EvidenceKind::Audit, "skin", &failure))
        }
    }
    Ok(golden)
}

/// The protocol, tightened to the limits of the bench, and its plan.
fn protocol(bench: &RealBench, file: &Path) -> Result<(Protocol, Plan), Problem> {
    let refused = |f: Failure| problem(EvidenceKind::Refused, "skin", &f);
    let mut protocol = check::load(file, &[]).map_err(refused)?.protocol;
    bench::tighten(&mut protocol, bench.rig());
    let mut plan = protocol.compile();
    protocol
        .check(&plan)
        .map_err(|found| refused(Failure::findings(&found)))?;
    plan.seed = protocol.seed;
    Ok((protocol, plan))
}

fn analyze(session: &Path) -> Result<(results::Results, String), Failure> {
    let results = results::analyze_session(session, AnalysisRequest::default())?;
    let (_, html) = results::write_results(&results, None, None)?;
    Ok((results, name(&html)))
}

fn name(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default();
    name.to_string_lossy().into_owned()
}

fn problem(kind: EvidenceKind, subject: &str, failure: &Failure) -> Problem {
    Box::new(Evidence::new(kind, subject, failure.message.as_str()))
}

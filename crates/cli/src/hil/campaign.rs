//! Runs the campaigns of a suite: a protocol through controller, recorder and analysis, in the night's folder.

use std::path::Path;

use skinrig_hil::run_evidence;
use skinrig_hil::{Bench, CampaignRun, OnlineComparison, Problem};
use skinrig_model::RunEnd;
use skinrig_nightly::{Evidence, EvidenceKind, GoldenSession};
use skinrig_protocol::{Plan, Protocol};

use super::real_bench::RealBench;
use crate::analysis_request::AnalysisRequest;
use crate::exit::Failure;
use crate::paths::file_name;
use crate::results;
use crate::rig::{bench, gates};
use crate::{check, online, run};

/// Closes every device and runs a campaign.
///
/// # Errors
/// [`Problem`] if nothing was recorded.
pub(super) fn run(bench: &mut RealBench, file: &Path) -> Result<CampaignRun, Problem> {
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
        // The night sends its own messages.
        None,
        bench.operator(),
    )
    .map_err(|f| problem(EvidenceKind::Disk, "computer", &f))?;
    let mut evidence = Vec::new();
    if let RunEnd::Stopped(why) = &report.end
        && !report.end.is_complete()
    {
        let what = why.to_string();
        evidence.push(Evidence::new(EvidenceKind::TimeOut, "robot", what));
    }
    evidence.extend(run_evidence::from_report(&report));
    let mut campaign = CampaignRun {
        files: GoldenSession {
            session: file_name(&session),
            report: None,
            results_sha256: None,
        },
        skin: Some(protocol.prototype.id.clone()),
        analysis: None,
        lost_bytes: [0; 2],
        evidence,
    };
    match analyze(&session) {
        Ok((results, html)) => {
            campaign.files.report = Some(html);
            campaign.files.results_sha256 = Some(results.provenance.results_hash.clone());
            campaign.lost_bytes = results.provenance.lost_bytes;
            campaign.analysis = Some(Box::new(results.analysis));
        }
        Err(failure) => {
            campaign
                .evidence
                .push(*problem(EvidenceKind::Audit, "skin", &failure));
        }
    }
    Ok(campaign)
}

/// Replays a session of this night as a live source.
///
/// # Errors
/// [`Problem`] if it cannot be replayed.
pub(super) fn compare_online(
    bench: &RealBench,
    session: &GoldenSession,
) -> Result<OnlineComparison, Problem> {
    let path = bench.folder().join(&session.session);
    let compared = online::compare(&path).map_err(|f| problem(EvidenceKind::Audit, "skin", &f))?;
    Ok(OnlineComparison {
        windows: compared.windows,
        equal: compared.equal,
    })
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
    Ok((results, file_name(&html)))
}

fn problem(kind: EvidenceKind, subject: &str, failure: &Failure) -> Problem {
    Box::new(Evidence::new(kind, subject, failure.message.as_str()))
}

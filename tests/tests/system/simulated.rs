//! A protocol on the simulated rig, recorded and analysed.

use skinrig_analysis::analyze;
use skinrig_analysis::result::Analysis;
use skinrig_controller::RunReport;
use skinrig_protocol::{Plan, Protocol};
use skinrig_results::{AlignedSession, AnalysisOptions, Session};
use skinrig_sim::{SimConfig, simulated_rig};
use skinrig_tests::record;

/// Report and analysis of a session; its file is not kept.
pub(crate) fn simulated(
    protocol: &Protocol,
    plan: &Plan,
    config: &SimConfig,
) -> (RunReport, Analysis) {
    aligned(protocol, plan, config, |report, session| {
        let analysis = analyze(&session.input, &session.events).expect("an analysis");
        (report, analysis)
    })
}

/// What `make` makes of a recorded session; its file is not kept.
pub(crate) fn aligned<T>(
    protocol: &Protocol,
    plan: &Plan,
    config: &SimConfig,
    make: impl FnOnce(RunReport, AlignedSession) -> T,
) -> T {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("simulated.session.sqlite");
    let report =
        record(protocol, plan, simulated_rig(config), &path, |_, _| {}).expect("a session");
    let opened = Session::open(&path, AnalysisOptions::default()).expect("a session");
    make(report, opened.read_input().expect("its input").align())
}

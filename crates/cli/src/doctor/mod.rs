//! `skinrig doctor`: checks that this machine is ready for the bench, with a next step for each problem.
//!
//! Devices are queried as in `skinrig devices`; everything else is read from system files below one folder, so that tests can
//! plant a machine. A check that is not possible states why, and counts as neither good nor bad.

mod access;
mod bench;
mod cables;
mod case;
mod clock;
mod disk;
mod finding;
mod inputs;
mod machine;
mod notify;
mod permissions;
mod power;
mod rates;
mod real_time;
mod survey;
#[cfg(test)]
#[cfg(unix)]
mod tests;
mod usb;
mod versions;

use crate::args::DoctorArgs;
use crate::exit::{Exit, Outcome};
use crate::hil::lease;
use crate::rig::bench as rig_bench;
use crate::rig::inputs as rig_inputs;
use case::Case;
use finding::{Finding, Verdict};
use machine::Machine;
use skinrig_text::Paint;
use survey::Survey;

/// `skinrig doctor`.
///
/// # Errors
/// [`crate::exit::Failure`] for a rig file that cannot be read. Problems are not an error: they exit with [`Exit::Rig`].
pub(crate) fn doctor(args: &DoctorArgs, json: bool) -> Outcome {
    let rig = args.rig.as_deref().map(rig_bench::load).transpose()?;
    let lease = rig.as_ref().map(lease::path);
    // Querying the trigger box resets it, which would disturb the holder of the bench.
    let survey = if lease.as_deref().is_some_and(bench::is_held) {
        Survey::of_a_held_bench(rig.as_ref())
    } else {
        Survey::query(rig.as_ref())
    };
    let mut findings = examine(&Case {
        machine: &Machine::current(),
        rig: rig.as_ref(),
        inputs: &rig.as_ref().map(rig_inputs::all).unwrap_or_default(),
        survey: &survey,
        sessions: &args.sessions,
        lease: lease.as_deref(),
    });
    if let Some(file) = &args.notify {
        findings.extend(notify::findings(file)?);
    }
    if json {
        crate::terminal::print_json(&finding::json(rig.as_ref(), &findings));
    } else {
        let paint = Paint::new(crate::terminal::is_coloured(&std::io::stdout()));
        crate::terminal::out(format_args!(
            "{}",
            finding::table(rig.as_ref(), &findings, paint)
        ));
    }
    Ok(if findings.iter().any(|f| f.verdict == Verdict::Problem) {
        Exit::Rig
    } else {
        Exit::Ok
    })
}

/// All findings, in the order of the report.
fn examine(case: &Case<'_>) -> Vec<Finding> {
    let mut findings = inputs::findings(case);
    findings.extend(permissions::findings(case));
    findings.extend(cables::findings(case));
    findings.extend(versions::findings(case));
    findings.extend(disk::findings(case));
    findings.extend(real_time::findings(case));
    findings.extend(power::findings(case));
    findings.extend(clock::findings(case));
    findings.extend(bench::findings(case));
    findings
}

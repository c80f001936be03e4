//! `skinrig hil run`: a suite on a bench, from its plan to its results.

use std::path::Path;

use chrono::{SecondsFormat, Utc};
use skinrig_device::RealClock;
use skinrig_hil::Tonight;
use skinrig_hil::runner::plan::Known;
use skinrig_model::HostDuration;
use skinrig_nightly::night::NIGHT_VERSION;
use skinrig_nightly::{Night, NightExit, Verdict, Versions};
use skinrig_protocol::rig::RigFile;
use skinrig_protocol::suite::{Measure, Suite};

use super::args::HilRunArgs;
use super::bench::RealBench;
use super::folder;
use super::live::Live;
use crate::check;
use crate::exit::{Exit, Failure, Outcome};
use crate::rig::bench;
use crate::signals::Operator;

/// `skinrig hil run`.
///
/// # Errors
/// [`Failure`] before the night begins: 2 for what was asked for, 3 for what the computer does not let us.
pub fn run(args: &HilRunArgs, command_line: &str, json: bool) -> Outcome {
    // Before any device is opened: from then on a robot may be live.
    let operator = Operator::of_suite().map_err(Failure::rig)?;
    let suite = load(&args.suite)?;
    let rig = bench::load(&args.rig)?;
    bench::refuse_without_sample(&rig)?;
    known_checks(&suite, args.only.as_deref())?;
    let clock = RealClock::start();
    let tonight = Tonight {
        only: args.only.as_deref(),
        known: known(&suite, &rig, args.only.as_deref())?,
        ..Tonight::new(&suite, &clock)
    };
    let planned = tonight.planned_from(0);
    if planned > suite.budget {
        return Err(Failure::input(format!(
            "{}: budget: expected a plan of at most {}, found one of about {}\n  \
             next: raise the budget, shorten or `skip` a check, or choose checks with --only",
            suite.file_name,
            minutes(suite.budget),
            minutes(planned)
        )));
    }
    if !json {
        outln!(
            "{} on {}: about {} of {}",
            suite.name,
            bench::display_name(&rig),
            minutes(planned),
            minutes(suite.budget)
        );
    }
    if args.history.is_some() {
        errln!("warning: --history: nothing is kept yet");
    }
    let started = Utc::now();
    let (id, folder) = folder::make(&args.out, started, &suite.name)?;
    let night = blank(
        id,
        &suite,
        &rig,
        started.to_rfc3339_opts(SecondsFormat::Secs, true),
    );
    let mut live = Live::new(folder.clone(), suite.checks.len());
    let mut bench = RealBench::new(rig, folder.clone(), operator, command_line);
    let night = tonight.run(night, &mut bench, &mut live);
    if json {
        crate::print_json(&serde_json::to_value(&night).map_err(Failure::internal)?);
    } else {
        outln!(
            "{}: {}, took {} of {}\n{}",
            suite.name,
            night.verdict.name(),
            minutes(HostDuration::from_secs_f64(night.took_s)),
            minutes(suite.budget),
            folder.display()
        );
    }
    if let Some(why) = live.unwritten {
        return Err(Failure::rig(format!(
            "{}: the night could not be written: {why}",
            folder.display()
        )));
    }
    Ok(Exit::Night(night.exit))
}

/// `6 min`, `40 s`.
fn minutes(d: HostDuration) -> String {
    match d.as_secs_f64() {
        s if s < 90.0 => format!("{s:.0} s"),
        s => format!("{:.1} min", s / 60.0),
    }
}

fn load(path: &Path) -> Result<Suite, Failure> {
    let bytes = std::fs::read(path)
        .map_err(|e| Failure::input(format!("cannot read {}: {e}", path.display())))?;
    Suite::parse(&path.display().to_string(), &bytes).map_err(|found| Failure::findings(&found))
}

/// Every word of `--only` is a check of the suite.
fn known_checks(suite: &Suite, only: Option<&[String]>) -> Result<(), Failure> {
    for word in only.unwrap_or_default() {
        if !suite.checks.iter().any(|c| c.name == word) {
            let names: Vec<&str> = suite.checks.iter().map(|c| c.name).collect();
            return Err(Failure::input(format!(
                "--only: expected checks of {} ({}), found `{word}`",
                suite.file_name,
                names.join(", ")
            )));
        }
    }
    Ok(())
}

/// What the plan of the night relies on; reads and checks the golden protocol.
fn known(suite: &Suite, rig: &RigFile, only: Option<&[String]>) -> Result<Known, Failure> {
    let wanted = |name: &str| only.is_none_or(|o| o.iter().any(|w| w == name));
    let mut known = Known {
        golden: None,
        touch_points: rig.frame.touch_off.as_ref().map(|t| t.points.len()),
    };
    for c in &suite.checks {
        if let Measure::Golden { protocol } = &c.measure
            && c.skip.is_none()
            && wanted(c.name)
        {
            let checked = check::load(protocol, &[])?;
            known.golden = Some(HostDuration::from_secs_f64(
                checked.plan.summary().duration_s,
            ));
        }
    }
    Ok(known)
}

/// A night of which nothing is known but who and when.
fn blank(id: String, suite: &Suite, rig: &RigFile, started: String) -> Night {
    Night {
        version: NIGHT_VERSION,
        id,
        suite: suite.name.clone(),
        suite_sha256: suite.sha256.clone(),
        rig: bench::display_name(rig),
        rig_kind: rig.kind.name().to_owned(),
        rig_sha256: rig.sha256.clone(),
        versions: Versions {
            software: format!("skinrig {}", env!("CARGO_PKG_VERSION")),
            ..Versions::default()
        },
        started,
        took_s: 0.0,
        planned_s: 0.0,
        budget_s: 0.0,
        finished: false,
        ended_early: None,
        lease_note: None,
        checks: Vec::new(),
        golden: None,
        verdict: Verdict::Fail,
        exit: NightExit::Fail,
    }
}

//! `skinrig hil run`: runs a suite on a bench and writes its results.

use std::io;
use std::path::Path;

use chrono::{SecondsFormat, Utc};
use sha2::{Digest as _, Sha256};
use skinrig_device::RealClock;
use skinrig_hil::history::HistoryError;
use skinrig_hil::night_folder::{self, NightFolder};
use skinrig_hil::runner::plan::PlanInputs;
use skinrig_hil::{Bench as _, SuiteRunner};
use skinrig_model::HostDuration;
use skinrig_nightly::night::NIGHT_VERSION;
use skinrig_nightly::{Night, NightExit, Verdict, Versions, junit};
use skinrig_protocol::Protocol;
use skinrig_protocol::rig::RigFile;
use skinrig_protocol::suite::{Measure, Suite};
use skinrig_report::night::{self, Trends, span};
use skinrig_report::trend::sentence;

use super::args::HilRunArgs;
use super::live::{self, NightProgress};
use super::real_bench::RealBench;
use super::trend::NightTrends;
use super::{contradictions, lease, messages, trend};
use crate::check;
use crate::exit::{Exit, Failure, Outcome};
use crate::host::host_name;
use crate::notify;
use crate::rig::{bench, inputs};
use crate::signals::Operator;

/// `skinrig hil run`.
///
/// # Errors
/// [`Failure`] before the night begins: 2 for bad input, 3 for the rig or the computer.
pub(crate) fn run(args: &HilRunArgs, command_line: &str, json: bool) -> Outcome {
    // Signals are handled before any device opens, because a robot may be live from then on.
    let operator = Operator::of_suite().map_err(Failure::rig)?;
    let suite = load(&args.suite)?;
    let mut rig = bench::load(&args.rig)?;
    if args.tolerant {
        bench::tolerate(&mut rig);
    }
    bench::refuse_without_sample(&rig)?;
    inputs::check(&rig)?;
    known_checks(&suite, args.only.as_deref())?;
    contradictions::refuse(&suite, &rig, args.only.as_deref())?;
    let settings = suite.notify.as_ref().map(|n| (&suite.file_name, n));
    let settings = settings.or_else(|| rig.notify.as_ref().map(|n| (&rig.file_name, n)));
    let notifier = settings.map(|(file, settings)| notify::open(settings, file));
    let notifier = notifier.transpose()?;
    let clock = RealClock::start();
    let runner = SuiteRunner {
        only: args.only.as_deref(),
        inputs: plan_inputs(&suite, &rig, args.only.as_deref())?,
        ..SuiteRunner::new(&suite, &clock)
    };
    let planned = runner.planned_from(0);
    if planned > suite.budget {
        return Err(Failure::input(format!(
            "{}: budget: expected a plan of at most {}, found one of about {}\n  \
             next: raise the budget, shorten or `skip` a check, or choose checks with --only",
            suite.file_name,
            span(suite.budget.as_secs_f64()),
            span(planned.as_secs_f64())
        )));
    }
    let lease = lease::take(&rig, &format!("hil run {}", suite.name))?;
    let started = Utc::now();
    let folder = NightFolder::create(&args.out, started, &suite.name)
        .map_err(|e| Failure::rig(format!("{e}\n  next: choose a writable folder with --out")))?;
    if !json {
        outln!(
            "{} on {}: about {} of {}\n{}\n",
            suite.name,
            bench::display_name(&rig),
            span(planned.as_secs_f64()),
            span(suite.budget.as_secs_f64()),
            folder.path().display()
        );
    }
    let started = started.to_rfc3339_opts(SecondsFormat::Secs, true);
    let mut night = blank(folder.id().to_owned(), &suite, &rig, started);
    night.lease_note = lease.note().map(str::to_owned);
    let mut live = NightProgress::new(folder.clone(), &suite);
    let mut bench =
        RealBench::new(rig, folder.path().to_owned(), operator, command_line).holding(lease);
    let mut night = runner.run(night, &mut bench, &mut live);
    let write_error = live.finish();
    bench.close();
    bench.propose();
    drop(bench);
    let mut trends = keep(&mut night, &folder, args.history.as_deref());
    if let Some(e) = write_error {
        trends = Err(NightFileError::Night(e));
    }
    if let Err(why) = &trends {
        night.lose(&why.to_string());
    }
    if let Some(notifier) = notifier {
        let after = trends.as_ref().ok().and_then(Option::as_ref);
        let after = after.and_then(|after| after.as_ref().ok());
        night.notifications = messages::send(notifier, &night, &folder, after);
        if let Err(e) = folder.write_json(&night) {
            trends = Err(NightFileError::Night(e));
        }
    }
    if json {
        crate::terminal::print_json(&serde_json::to_value(&night).map_err(Failure::internal)?);
    } else {
        let paint = live::paint(&io::stdout());
        outln!("{}", night::tree(&night, paint).trim_end());
        if trends.is_ok() {
            outln!("{}", folder.path().join(night_folder::PAGE).display());
        }
    }
    match trends {
        Ok(None) => Ok(Exit::Night(night.exit)),
        // The exit code depends on the limits alone, not on what the trends say.
        Ok(Some(Ok(after))) => {
            if !json {
                outln!("{}", sentence(&after.report));
                outln!("{}", folder.path().join(night_folder::TRENDS).display());
            }
            Ok(Exit::Night(night.exit))
        }
        Ok(Some(Err(why))) => {
            errln!(
                "warning: no trends for this night: --history: {why}\n  \
                 next: fix this, then add the night with `skinrig hil trend HISTORY --rebuild {}`",
                args.out.display()
            );
            Ok(Exit::Night(night.exit))
        }
        Err(why) => Err(Failure::rig(format!(
            "{}: {why}\n  next: free disk space or choose another folder with --out; the measurements are printed above",
            folder.path().display()
        ))),
    }
}

/// Trends after the night, if a history was given.
type TrendOutcome = Option<Result<NightTrends, HistoryError>>;

/// A file of the night could not be written.
#[derive(Debug, thiserror::Error)]
enum NightFileError {
    /// JSON.
    #[error(transparent)]
    Night(io::Error),
    /// Another file.
    #[error("{name}: {source}")]
    File {
        name: &'static str,
        source: io::Error,
    },
    /// Rendering JUnit XML failed.
    #[error(transparent)]
    Junit(#[from] junit::SerializeError),
}

/// Writes the page and JUnit XML of the finished night, and adds it to the history. A night that no history takes ends with the
/// exit code of the infrastructure, unless it has a worse one: trends that stop must not go unnoticed.
fn keep(
    night: &mut Night,
    folder: &NightFolder,
    history: Option<&Path>,
) -> Result<TrendOutcome, NightFileError> {
    let write = |name: &'static str, text: &str| {
        folder
            .write(name, text)
            .map_err(|source| NightFileError::File { name, source })
    };
    let page =
        |night: &Night, trends: Trends<'_>| write(night_folder::PAGE, &night::html(night, trends));
    write(night_folder::JUNIT, &junit::junit(night, &host_name())?)?;
    let Some(history) = history else {
        page(night, Trends::NotRequested)?;
        return Ok(None);
    };
    // The page exists even if reading the history fails.
    let ended = Trends::Unavailable("the program ended before reading them");
    page(night, ended)?;
    let after = trend::after(history, night, folder.path());
    match &after {
        Ok(after) => {
            write(night_folder::TRENDS, &after.page())?;
            let trends = Trends::Available {
                report: &after.report,
                links: &after.links,
                page: night_folder::TRENDS,
            };
            page(night, trends)?;
        }
        Err(why) => {
            if night.exit == NightExit::Pass {
                night.exit = NightExit::Infrastructure;
                folder.write_json(night).map_err(NightFileError::Night)?;
            }
            page(night, Trends::Unavailable(&why.to_string()))?;
        }
    }
    Ok(Some(after))
}

fn load(path: &Path) -> Result<Suite, Failure> {
    let bytes = skinrig_formats::regular::read_text(path)
        .map_err(|e| Failure::input(format!("cannot read {}: {e}", path.display())))?;
    Suite::parse(&path.display().to_string(), &bytes).map_err(|found| Failure::findings(&found))
}

/// Rejects `--only` names that are not checks of the suite.
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

/// Inputs of the night's plan. Reads and checks the protocols of its campaigns.
fn plan_inputs(
    suite: &Suite,
    rig: &RigFile,
    only: Option<&[String]>,
) -> Result<PlanInputs, Failure> {
    let is_selected = |name: &str| only.is_none_or(|o| o.iter().any(|w| w == name));
    let mut inputs = PlanInputs {
        golden: None,
        reaction: None,
        touch_points: rig.frame.touch_off.as_ref().map(|t| t.points.len()),
    };
    for c in &suite.checks {
        if c.skip.is_some() || !is_selected(c.name) {
            continue;
        }
        match &c.measure {
            Measure::Golden { protocol } => inputs.golden = Some(duration(protocol, |_| Ok(()))?),
            Measure::Reaction { protocol } => inputs.reaction = Some(duration(protocol, feels)?),
            _ => {}
        }
    }
    Ok(inputs)
}

/// Planned duration of a campaign whose protocol passes `test`.
fn duration(
    file: &Path,
    test: fn(&Protocol) -> Result<(), &'static str>,
) -> Result<HostDuration, Failure> {
    let checked = check::load(file, &[])?;
    test(&checked.protocol).map_err(|why| Failure::input(format!("{}: {why}", file.display())))?;
    Ok(HostDuration::from_secs_f64(
        checked.plan.summary().duration_s,
    ))
}

/// The check `reaction` needs a protocol that feels.
fn feels(protocol: &Protocol) -> Result<(), &'static str> {
    match protocol.online {
        Some(_) => Ok(()),
        None => Err(
            "expected `online` in the protocol of the check `reaction`, found none\n  next: add `online: {}`, or copy hil/reaction.yaml",
        ),
    }
}

/// SHA-256 of the suite's text, and of the protocols of its campaigns if it has any: both say what is measured.
fn digest(suite: &Suite) -> String {
    let protocols = suite
        .checks
        .iter()
        .filter_map(|check| match &check.measure {
            Measure::Golden { protocol } | Measure::Reaction { protocol } => Some(protocol),
            _ => None,
        });
    let protocols: Vec<_> = protocols.collect();
    if protocols.is_empty() {
        return suite.sha256.clone();
    }
    let mut hash = Sha256::new_with_prefix(&suite.text);
    for protocol in protocols {
        // Those of checks that run have been read before; that of a skipped one may be missing.
        hash.update(std::fs::read(protocol).unwrap_or_default());
    }
    hash.finalize().iter().map(|b| format!("{b:02x}")).collect()
}

/// A night before its first check.
fn blank(id: String, suite: &Suite, rig: &RigFile, started: String) -> Night {
    Night {
        version: NIGHT_VERSION,
        id,
        suite: suite.name.clone(),
        suite_sha256: digest(suite),
        rig: bench::display_name(rig),
        rig_kind: rig.kind.name().to_owned(),
        rig_sha256: rig.sha256.clone(),
        versions: Versions {
            software: crate::version::SOFTWARE.to_owned(),
            ..Versions::default()
        },
        started,
        took_s: 0.0,
        planned_s: 0.0,
        budget_s: 0.0,
        finished: false,
        ended_early: None,
        lease_note: None,
        notifications: Vec::new(),
        checks: Vec::new(),
        golden: None,
        verdict: Verdict::Fail,
        exit: NightExit::Fail,
    }
}

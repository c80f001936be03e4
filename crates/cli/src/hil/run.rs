//! `skinrig hil run`: a suite on a bench, from its plan to its results.

use std::io;
use std::path::Path;

use chrono::{SecondsFormat, Utc};
use skinrig_device::RealClock;
use skinrig_hil::history::HistoryError;
use skinrig_hil::runner::plan::PlanInputs;
use skinrig_hil::{Bench as _, SuiteRunner};
use skinrig_model::HostDuration;
use skinrig_nightly::night::NIGHT_VERSION;
use skinrig_nightly::{Night, NightExit, Verdict, Versions, junit};
use skinrig_protocol::rig::RigFile;
use skinrig_protocol::suite::{Measure, Suite};
use skinrig_report::ReportError;
use skinrig_report::night::{self, Trends, span};
use skinrig_report::trend::sentence;

use super::args::HilRunArgs;
use super::live::{self, Live};
use super::real_bench::RealBench;
use super::trend::After;
use super::{folder, lease, trend};
use crate::check;
use crate::exit::{Exit, Failure, Outcome};
use crate::host::host_name;
use crate::rig::{bench, inputs};
use crate::signals::Operator;

/// `skinrig hil run`.
///
/// # Errors
/// [`Failure`] before the night begins: 2 for what was asked for, 3 for what the computer does not let us.
pub(crate) fn run(args: &HilRunArgs, command_line: &str, json: bool) -> Outcome {
    // Before any device is opened: from then on a robot may be live.
    let operator = Operator::of_suite().map_err(Failure::rig)?;
    let suite = load(&args.suite)?;
    let mut rig = bench::load(&args.rig)?;
    if args.tolerant {
        bench::tolerate(&mut rig);
    }
    bench::refuse_without_sample(&rig)?;
    inputs::check(&rig)?;
    known_checks(&suite, args.only.as_deref())?;
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
    let (id, folder) = folder::make(&args.out, started, &suite.name)?;
    if !json {
        outln!(
            "{} on {}: about {} of {}\n{}\n",
            suite.name,
            bench::display_name(&rig),
            span(planned.as_secs_f64()),
            span(suite.budget.as_secs_f64()),
            folder.display()
        );
    }
    let started = started.to_rfc3339_opts(SecondsFormat::Secs, true);
    let mut night = blank(id, &suite, &rig, started);
    night.lease_note = lease.note().map(str::to_owned);
    let mut live = Live::new(folder.clone(), &suite);
    let mut bench = RealBench::new(rig, folder.clone(), operator, command_line).holding(lease);
    let night = runner.run(night, &mut bench, &mut live);
    let unwritten = live.finish();
    // Nothing is open any more.
    bench.close();
    bench.propose();
    drop(bench);
    let trends = keep(&night, &folder, args.history.as_deref());
    if json {
        crate::terminal::print_json(&serde_json::to_value(&night).map_err(Failure::internal)?);
    } else {
        let paint = live::paint(&io::stdout());
        outln!("{}", night::tree(&night, paint).trim_end());
        outln!("{}", folder.join(folder::PAGE).display());
    }
    match unwritten.map_or(trends, |e| Err(KeepError::Night(e))) {
        Ok(None) => Ok(Exit::Night(night.exit)),
        // Trends say what moved; whether the night is good is said by its limits alone.
        Ok(Some(trends)) => {
            match trends {
                Ok(after) if !json => {
                    outln!("{}", sentence(&after.report));
                    outln!("{}", folder.join(folder::TRENDS).display());
                }
                Ok(_) => {}
                Err(why) => errln!(
                    "warning: no trends for this night: --history: {why}\n  \
                     next: once that is mended, `skinrig hil trend HISTORY --rebuild {}` adds this night",
                    args.out.display()
                ),
            }
            Ok(Exit::Night(night.exit))
        }
        Err(why) => Err(Failure::rig(format!(
            "{}: {why}\n  next: free some space, or choose another folder with --out; what was measured is above",
            folder.display()
        ))),
    }
}

/// What the trends say, when they were asked for, or why they say nothing.
type TrendOutcome = Option<Result<After, HistoryError>>;

/// Why a night is not written in all its forms.
#[derive(Debug, thiserror::Error)]
enum KeepError {
    /// The night as JSON.
    #[error(transparent)]
    Night(io::Error),
    /// Another file of the night.
    #[error("{name}: {source}")]
    File {
        name: &'static str,
        source: io::Error,
    },
    /// A page that cannot be put together.
    #[error(transparent)]
    Page(#[from] ReportError),
    /// JUnit XML that cannot be put together.
    #[error(transparent)]
    Junit(#[from] junit::SerializeError),
}

/// Writes the finished night in its other forms, and adds it to the history.
fn keep(night: &Night, folder: &Path, history: Option<&Path>) -> Result<TrendOutcome, KeepError> {
    let write = |name: &'static str, text: &str| {
        folder::write(folder, name, text).map_err(|source| KeepError::File { name, source })
    };
    let page = |trends: Trends<'_>| {
        let page = night::html(night, trends)?;
        write(folder::PAGE, &page)
    };
    write(folder::JUNIT, &junit::junit(night, &host_name())?)?;
    let Some(history) = history else {
        page(Trends::NotRequested)?;
        return Ok(None);
    };
    // There before the history is touched: whatever is wrong with that, the night has its page.
    page(Trends::Unavailable(
        "the program ended before it had read them",
    ))?;
    let after = trend::after(history, night, folder);
    match &after {
        Ok(after) => {
            write(folder::TRENDS, &after.page()?)?;
            page(Trends::Available {
                report: &after.report,
                links: &after.links,
                page: folder::TRENDS,
            })?;
        }
        Err(why) => page(Trends::Unavailable(&why.to_string()))?,
    }
    Ok(Some(after))
}

fn load(path: &Path) -> Result<Suite, Failure> {
    let bytes = skinrig_formats::regular::read_text(path)
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
fn plan_inputs(
    suite: &Suite,
    rig: &RigFile,
    only: Option<&[String]>,
) -> Result<PlanInputs, Failure> {
    let wanted = |name: &str| only.is_none_or(|o| o.iter().any(|w| w == name));
    let mut inputs = PlanInputs {
        golden: None,
        touch_points: rig.frame.touch_off.as_ref().map(|t| t.points.len()),
    };
    for c in &suite.checks {
        if let Measure::Golden { protocol } = &c.measure
            && c.skip.is_none()
            && wanted(c.name)
        {
            let checked = check::load(protocol, &[])?;
            inputs.golden = Some(HostDuration::from_secs_f64(
                checked.plan.summary().duration_s,
            ));
        }
    }
    Ok(inputs)
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
        checks: Vec::new(),
        golden: None,
        verdict: Verdict::Fail,
        exit: NightExit::Fail,
    }
}

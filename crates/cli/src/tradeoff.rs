//! `skinrig tradeoff`: the trade-off between speed and accuracy, measured on a session.

use std::ops::ControlFlow;
use std::sync::atomic::Ordering;

use rustix::time::{ClockId, clock_gettime};
use skinrig_analysis::AnalysisError;
use skinrig_analysis::tradeoff::{
    Cost, Measured, Plan, Predicted, Prediction, Predictions, Progress, Requirement, Row,
    Selection, Tradeoff, Unselected, measure,
};
use skinrig_catalogue::results_digest;
use skinrig_model::RunHeader;
use skinrig_report::tradeoff::{Rows, label, page, protocol_lines, terminal_table};
use skinrig_results::Origin;
use skinrig_text::Paint;

use crate::analyses::tradeoff_path;
use crate::analysis_request::AnalysisRequest;
use crate::args::{CostKind, TradeoffArgs};
use crate::beside_session::{SessionIdentity, TRADEOFF};
use crate::exit::{Exit, Failure, Outcome};
use crate::paths::file_name;
use crate::phase::Phase;
use crate::results::{check_writable, not_official, open, write, write_named};
use crate::selection;
use crate::signals::leave_on_ctrl_c;
use crate::terminal::Output;
use skinrig_report::Variant;

/// CPU time of this thread, s.
fn thread_cpu_s() -> f64 {
    let now = clock_gettime(ClockId::ThreadCPUTime);
    now.tv_sec as f64 + now.tv_nsec as f64 * 1e-9
}

/// The machine whose CPU times the results have. Its processor is `null` where the system does not name it.
fn machine() -> serde_json::Value {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = text.lines().find_map(|line| {
        let (key, value) = line.split_once(':')?;
        (key.trim() == "model name").then(|| value.trim().to_owned())
    });
    let threads = std::thread::available_parallelism().ok();
    serde_json::json!({
        "processor": name,
        "architecture": std::env::consts::ARCH,
        "threads": threads.map(std::num::NonZero::get),
    })
}

impl From<CostKind> for Cost {
    fn from(kind: CostKind) -> Self {
        match kind {
            CostKind::Cpu => Self::Cpu,
            CostKind::Bytes => Self::Bytes,
            CostKind::Delay => Self::Delay,
            CostKind::Pixels => Self::Pixels,
        }
    }
}

/// A requirement and the choice that meets it.
struct Recommendation<'a> {
    question: String,
    found: Result<Selection<'a>, Unselected>,
}

fn recommendations<'a>(measured: &'a Measured, args: &TradeoffArgs) -> Vec<Recommendation<'a>> {
    let target = args.target_rmse.map(|mm| Recommendation {
        question: format!(
            "cheapest ({}) whose RMSE is at most {mm} mm at the upper end of its 95 % interval",
            cost_name(args.cost)
        ),
        found: measured.select(Requirement::Target(mm, args.cost.into())),
    });
    let budget = args.budget.map(|s| Recommendation {
        question: format!(
            "most accurate within {} µs of CPU time per press",
            (s * 1e9).round() / 1e3
        ),
        found: measured.select(Requirement::Budget(s * 1e6, Cost::Cpu)),
    });
    let pixels = args.pixels.map(|grid| Recommendation {
        question: format!(
            "most accurate with at most {} pixels of a camera ({grid})",
            grid.pixels()
        ),
        found: measured.select(Requirement::Budget(f64::from(grid.pixels()), Cost::Pixels)),
    });
    target.into_iter().chain(budget).chain(pixels).collect()
}

fn bound(bound: Option<f64>) -> String {
    bound.map_or("-".to_owned(), |mm| format!("{mm:.2}"))
}

/// Why there is no recommendation.
fn refusal(unselected: &Unselected) -> String {
    match unselected {
        Unselected::Target(rmse) => format!(
            "none: the first in rank has RMSE {} mm [{}, {}] (n {} that confirm), which ends the search",
            bound(rmse.value),
            bound(rmse.low),
            bound(rmse.high),
            rmse.n
        ),
        other => format!("none: {other}"),
    }
}

/// Prints a recommendation with its requirement and the lines of the protocol that select it. `own` lists the changes of a variant.
fn print_recommendation(
    recommendation: &Recommendation<'_>,
    own: Option<&str>,
    predictions: &Predictions,
) {
    outln!("{}:", recommendation.question);
    let (row, rmse, prediction, ranked_by) = match &recommendation.found {
        Ok(found) => {
            let prediction = predictions.get(found.index);
            (found.row, &found.confirmed_mm, prediction, found.ranked_by)
        }
        Err(unselected) => {
            outln!("  {}\n", refusal(unselected));
            return;
        }
    };
    let name = match own {
        _ if !row.overrides.is_empty() => label(&row.choice),
        Some(own) => own.to_owned(),
        None => "the session's own settings".to_owned(),
    };
    let paint = Paint::new(crate::terminal::is_coloured(&std::io::stdout()));
    let chosen = format!("{name}: RMSE {} mm", bound(rmse.value));
    outln!(
        "  {}, 95 % interval [{}, {}], n {} that did not choose ({ranked_by} locations did);\n  {:.3} ms of CPU time per press, {} pixels",
        paint.bold(&chosen),
        bound(rmse.low),
        bound(rmse.high),
        rmse.n,
        row.cpu_us * 1e-3,
        row.pixels
    );
    if let Some(prediction) = prediction {
        print_prediction(prediction, row);
    }
    outln!("");
    if !row.overrides.is_empty() {
        lines_on_top(row, own)
            .lines()
            .for_each(|line| outln!("  {line}"));
        outln!("");
    }
}

/// The protocol lines of a row, which change the settings of the measurement: not always those of the session.
fn lines_on_top(row: &Row, own: Option<&str>) -> String {
    let lines = protocol_lines(row);
    match own {
        Some(own) if !lines.is_empty() => format!("# on top of {own}\n{lines}"),
        _ => lines,
    }
}

/// What was predicted of a row, and whether its measurement agrees.
fn print_prediction(prediction: &Prediction, row: &Row) {
    let Predicted { value, low, high } = prediction.rmse_mm;
    let measured = bound(row.rmse_mm.value);
    outln!("  {measured} mm on all presses, predicted {value:.2} mm [{low:.2}, {high:.2}]");
    let holds = row
        .rmse_mm
        .value
        .is_some_and(|mm| prediction.rmse_mm.contains(mm));
    if !holds {
        outln!("  OUTSIDE the prediction: confirm this choice on a new session");
    }
}

/// How many of the random combinations measure what was predicted.
fn check_in_words(result: &Tradeoff) -> String {
    let checks = || result.predictions.of.iter().filter(|p| p.is_check);
    let all = checks().count();
    if all == 0 {
        return "no prediction to check: too few combinations locate enough presses".to_owned();
    }
    let holds = |p: &&Prediction| {
        let row = &result.rows[p.row];
        row.rmse_mm.value.is_some_and(|mm| p.rmse_mm.contains(mm))
    };
    let in_time = |p: &&Prediction| {
        let row = &result.rows[p.row];
        p.cpu_us.is_some_and(|us| us.contains(row.cpu_us))
    };
    format!(
        "checked on {all} random combinations: the predicted interval holds for the RMSE of {}, for the CPU time of {}",
        checks().filter(holds).count(),
        checks().filter(in_time).count()
    )
}

const fn cost_name(cost: CostKind) -> &'static str {
    match cost {
        CostKind::Cpu => "CPU time",
        CostKind::Bytes => "bytes",
        CostKind::Delay => "delay",
        CostKind::Pixels => "pixels",
    }
}

/// The best choice so far, with its interval.
fn progress_in_words(progress: &Progress<'_>) -> String {
    let best = progress.best.map(|row| {
        let [value, low, high] = [row.rmse_mm.value, row.rmse_mm.low, row.rmse_mm.high].map(bound);
        let name = label(&row.choice);
        format!(", best so far: {name}, {value} mm [{low}, {high}]")
    });
    format!(
        "choice {} (ctrl-C leaves with the best so far){}",
        progress.measured,
        best.unwrap_or_default()
    )
}

/// The rig of a session, in words.
fn rig_in_words(header: &RunHeader) -> String {
    let name = &header.rig_name;
    if Origin::of(header) == Some(Origin::Simulated) {
        format!("Rig: {name}, SIMULATED. CPU times are this machine's.")
    } else {
        format!("Rig: {name}. CPU times are this machine's.")
    }
}

/// `skinrig tradeoff`.
///
/// # Errors
/// When the session cannot be analysed or a file cannot be written; [`Failure::limit`] when no choice meets a
/// requirement.
pub(crate) fn tradeoff(args: &TradeoffArgs, output: Output) -> Outcome {
    let target = selection::sessions(&args.session)?.one(&args.session)?;
    let choices = AnalysisRequest {
        overrides: &args.overrides,
        reference_code: false,
        calibration_from: None,
        name: None,
        selection: target.selected.as_ref(),
    };
    let (aligned, variant) = open(&target.path, choices)?;
    if let (Some(variant), Some(out)) = (&variant, &args.out) {
        not_official(&tradeoff_path(&target.path, None), out, variant)?;
    }
    let variant_name = variant.as_ref().map(|v| v.name.as_str());
    let html_path = match &args.out {
        Some(out) => out.clone(),
        None => tradeoff_path(&target.path, variant_name),
    };
    check_writable(&html_path)?;
    let identity = SessionIdentity::of(&aligned.session.reader).map_err(Failure::session)?;
    let mut rig = rig_in_words(&aligned.session.header);
    if let Some(variant) = &variant {
        rig += &format!(
            " Not the session's own settings: {}.",
            variant.changes_with_selection()
        );
    }
    let plan = Plan {
        full: args.full,
        checks: usize::from(args.check),
        repeats: args.repeats,
        least_located: args.min_located.map(|percent| percent / 100.0),
    };
    let measured = {
        let stop = leave_on_ctrl_c().map_err(Failure::internal)?;
        if args.full {
            errln!("measuring all combinations; ctrl-C leaves with the best so far");
        }
        let phase = Phase::reading("reading", aligned.events.bytes_read());
        let mut watch = |progress: &Progress<'_>| {
            phase.say(progress_in_words(progress));
            if stop.load(Ordering::Relaxed) {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        };
        let (input, events) = (&aligned.input, &aligned.events);
        measure(input, events, plan, &mut thread_cpu_s, &mut watch)
    };
    let measured = measured.map_err(|e| match e {
        AnalysisError::Invalid(_) => Failure::limit(e),
        other => Failure::input(other),
    })?;
    let recommendations = recommendations(&measured, args);
    let own = variant.as_ref().map(Variant::changes_with_selection);
    let result = &measured.tradeoff;
    let mut document = serde_json::json!({ "format": TRADEOFF.format, "format_version": TRADEOFF.version, "session": identity, "rig": rig, "variant": variant, "machine": machine(), "tradeoff": result });
    let found = recommendations.iter().map(|a| {
        let found = a.found.as_ref().ok();
        let row = found.map(|f| f.row);
        serde_json::json!({
            "question": a.question,
            "choice": row.map(|r| label(&r.choice)),
            "row": row,
            "confirmed_mm": found.map(|f| f.confirmed_mm),
            "ranking_locations": found.map(|f| f.ranked_by),
            "protocol": row.map(|row| lines_on_top(row, own.as_deref())),
        })
    });
    document["answers"] = serde_json::Value::Array(found.collect());
    let json_path = html_path.with_extension("json");
    let text = serde_json::to_string_pretty(&document).map_err(Failure::internal)?;
    let text = results_digest::with_digest(&text);
    let html = page(result, &file_name(&target.path), &rig);
    let write = if args.out.is_some() {
        write_named
    } else {
        write
    };
    write(&html_path, html.as_bytes())?;
    write(&json_path, text.as_bytes())?;
    if output.json {
        document["files"] = serde_json::json!({ "page": html_path, "results": json_path });
        crate::terminal::print_json(&document);
    } else {
        recommendations
            .iter()
            .for_each(|a| print_recommendation(a, own.as_deref(), &result.predictions));
        if args.check > 0 {
            outln!("{}\n", check_in_words(result));
        }
        if recommendations.is_empty() || output.verbose {
            let rows = if output.verbose {
                Rows::All
            } else {
                Rows::Front
            };
            let color = crate::terminal::is_coloured(&std::io::stdout());
            let table = terminal_table(result, rows, &rig, color);
            crate::terminal::out(format_args!("{table}"));
        } else {
            let (tried, of) = (result.rows.len(), result.predictions.combinations);
            outln!("{rig}\n{tried} of {of} choices tried; the page and -v have the table");
        }
        outln!("\npage     {}", html_path.display());
        outln!("results  {}", json_path.display());
    }
    if result.is_interrupted {
        errln!(
            "INTERRUPTED after {} of {} choices: the answer is the best so far",
            result.rows.len(),
            result.predictions.combinations
        );
        return Ok(Exit::Stopped);
    }
    let unmet =
        |a: &Recommendation<'_>| Some((a.question.clone(), refusal(a.found.as_ref().err()?)));
    match recommendations.iter().find_map(unmet) {
        None => Ok(Exit::Ok),
        Some((question, why)) => {
            let (tried, of) = (result.rows.len(), result.predictions.combinations);
            let full = if tried < of { ", or try --full" } else { "" };
            Err(Failure::limit(format!(
                "expected a choice that is {question}, found {why}; {tried} tried\n  next: relax the requirement, use more presses \
                 (`analysis.study_presses`), press more locations{full}"
            )))
        }
    }
}

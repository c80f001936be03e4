//! `skinrig tradeoff`: the trade-off between speed and accuracy, measured on a session.

use rustix::time::{ClockId, clock_gettime};
use skinrig_analysis::AnalysisError;
use skinrig_analysis::tradeoff::{
    Cost, Measured, Plan, Requirement, Selection, Unselected, measure,
};
use skinrig_model::RunHeader;
use skinrig_report::tradeoff::{Rows, label, page, protocol_lines, terminal_table};
use skinrig_results::Origin;
use skinrig_text::Paint;

use crate::analyses::tradeoff_path;
use crate::analysis_request::AnalysisRequest;
use crate::args::{CostKind, TradeoffArgs};
use crate::exit::{Exit, Failure, Outcome};
use crate::phase::Phase;
use crate::results::{not_official, open, write};
use crate::terminal::Output;
use crate::tradeoff_file::FORMAT;

/// CPU time of this thread, s.
fn thread_cpu_s() -> f64 {
    let now = clock_gettime(ClockId::ThreadCPUTime);
    now.tv_sec as f64 + now.tv_nsec as f64 * 1e-9
}

impl From<CostKind> for Cost {
    fn from(kind: CostKind) -> Self {
        match kind {
            CostKind::Cpu => Self::Cpu,
            CostKind::Bytes => Self::Bytes,
            CostKind::Delay => Self::Delay,
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
    target.into_iter().chain(budget).collect()
}

fn bound(bound: Option<f64>) -> String {
    bound.map_or("-".to_owned(), |mm| format!("{mm:.2}"))
}

/// Why there is no recommendation.
fn refusal(unselected: &Unselected) -> String {
    match unselected {
        Unselected::Target(rmse) => format!(
            "none: the most accurate has RMSE {} mm [{}, {}] on the {} presses that confirm",
            bound(rmse.value),
            bound(rmse.low),
            bound(rmse.high),
            rmse.n
        ),
        other => format!("none: {other}"),
    }
}

/// Prints a recommendation with its requirement and the lines of the protocol that select it. `own` lists the changes of a variant.
fn print_recommendation(recommendation: &Recommendation<'_>, own: Option<&str>) {
    outln!("{}:", recommendation.question);
    let (row, rmse) = match &recommendation.found {
        Ok(found) => (found.row, &found.confirmed_mm),
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
        "  {}, 95 % interval [{}, {}], n {} that did not choose;\n  {:.3} ms of CPU time per press\n",
        paint.bold(&chosen),
        bound(rmse.low),
        bound(rmse.high),
        rmse.n,
        row.cpu_us * 1e-3
    );
    if !row.overrides.is_empty() {
        protocol_lines(row)
            .lines()
            .for_each(|line| outln!("  {line}"));
        outln!("");
    }
}

const fn cost_name(cost: CostKind) -> &'static str {
    match cost {
        CostKind::Cpu => "CPU time",
        CostKind::Bytes => "bytes",
        CostKind::Delay => "delay",
    }
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
    let choices = AnalysisRequest {
        overrides: &args.overrides,
        reference_code: false,
        calibration_from: None,
        name: None,
    };
    let (aligned, variant) = open(&args.session, choices)?;
    if let (Some(variant), Some(out)) = (&variant, &args.out) {
        not_official(&tradeoff_path(&args.session, None), out, variant)?;
    }
    let mut rig = rig_in_words(&aligned.session.header);
    if let Some(variant) = &variant {
        rig += &format!(
            " Not the session's own settings: {}.",
            variant.changed.join(", ")
        );
    }
    let plan = Plan {
        full: args.full,
        repeats: args.repeats,
        least_located: args.min_located.map(|percent| percent / 100.0),
    };
    let phase = Phase::reading("measuring every choice", aligned.events.bytes_read());
    let measured = measure(&aligned.input, &aligned.events, plan, &mut thread_cpu_s);
    drop(phase);
    let measured = measured.map_err(|e| match e {
        AnalysisError::Invalid(_) => Failure::limit(e),
        other => Failure::input(other),
    })?;
    let recommendations = recommendations(&measured, args);
    let result = &measured.tradeoff;
    let mut document = serde_json::json!({ "format": FORMAT.0, "format_version": FORMAT.1, "rig": rig, "variant": variant, "tradeoff": result });
    let found = recommendations.iter().map(|a| {
        let found = a.found.as_ref().ok();
        let row = found.map(|f| f.row);
        serde_json::json!({
            "question": a.question,
            "choice": row.map(|r| label(&r.choice)),
            "row": row,
            "confirmed_mm": found.map(|f| f.confirmed_mm),
            "protocol": row.map(protocol_lines),
        })
    });
    document["answers"] = serde_json::Value::Array(found.collect());
    let html_path = args
        .out
        .clone()
        .unwrap_or_else(|| tradeoff_path(&args.session, variant.as_ref().map(|v| v.name.as_str())));
    let json_path = html_path.with_extension("json");
    let name = args
        .session
        .file_name()
        .map(|n| n.to_string_lossy().into_owned());
    let text = serde_json::to_string_pretty(&document).map_err(Failure::internal)?;
    let html = page(result, &name.unwrap_or_default(), &rig);
    write(&html_path, html.as_bytes())?;
    write(&json_path, text.as_bytes())?;
    if output.json {
        document["files"] = serde_json::json!({ "page": html_path, "results": json_path });
        crate::terminal::print_json(&document);
    } else {
        let own = variant.as_ref().map(|v| v.changed.join(", "));
        recommendations
            .iter()
            .for_each(|a| print_recommendation(a, own.as_deref()));
        let table = terminal_table(
            result,
            if output.verbose {
                Rows::All
            } else {
                Rows::Front
            },
            &rig,
            crate::terminal::is_coloured(&std::io::stdout()),
        );
        crate::terminal::out(format_args!("{table}"));
        outln!("\npage     {}", html_path.display());
        outln!("results  {}", json_path.display());
    }
    let unmet =
        |a: &Recommendation<'_>| Some((a.question.clone(), refusal(a.found.as_ref().err()?)));
    match recommendations.iter().find_map(unmet) {
        None => Ok(Exit::Ok),
        Some((question, why)) => Err(Failure::limit(format!(
            "expected a choice that is {question}, found {why}; {} tried\n  next: relax the requirement, press more locations, or try --full",
            result.rows.len()
        ))),
    }
}

//! `skinrig check` and `skinrig plan`: everything before a device is opened.

use std::path::Path;

use skinrig_formats::regular;
use skinrig_protocol::{Diagnostics, Plan, Protocol, Step, path_svg};

use crate::args::{PlanArgs, ProtocolArgs};
use crate::exit::{Exit, Failure, Outcome};
use crate::sample_size;

/// A protocol whose plan passed every check.
pub struct CheckedProtocol {
    /// The protocol.
    pub protocol: Protocol,
    /// Its plan.
    pub plan: Plan,
}

/// Findings about a protocol that was rejected, and its plan if it compiled.
struct Rejection {
    found: Diagnostics,
    planned: Option<CheckedProtocol>,
}

/// Reads, compiles and checks a protocol.
///
/// # Errors
/// [`Failure::input`] with every finding at once.
pub fn load(path: &Path, overrides: &[String]) -> Result<CheckedProtocol, Failure> {
    read(path, overrides)?.map_err(|rejection| Failure::findings(&rejection.found))
}

/// Like [`load`], for protocol text that is not in a file.
///
/// # Errors
/// [`Failure::input`] with every finding at once.
pub(crate) fn load_text(
    name: &str,
    text: &str,
    overrides: &[String],
) -> Result<CheckedProtocol, Failure> {
    parse(name, text.as_bytes(), overrides)?
        .map_err(|rejection| Failure::findings(&rejection.found))
}

fn read(
    path: &Path,
    overrides: &[String],
) -> Result<Result<CheckedProtocol, Box<Rejection>>, Failure> {
    let bytes = regular::read_text(path).map_err(|e| {
        Failure::input(format!("{}: cannot read the protocol: {e}", path.display()))
    })?;
    parse(&path.to_string_lossy(), &bytes, overrides)
}

fn parse(
    name: &str,
    bytes: &[u8],
    overrides: &[String],
) -> Result<Result<CheckedProtocol, Box<Rejection>>, Failure> {
    let loader = regular::read_text;
    let protocol = match Protocol::parse(name, bytes, overrides, &loader) {
        Ok(protocol) => protocol,
        Err(found) => {
            let planned = None;
            return Ok(Err(Box::new(Rejection { found, planned })));
        }
    };
    let plan = protocol.compile();
    let result = protocol.check(&plan);
    if result.is_ok() {
        let outline = &protocol.surroundings.outline;
        skinrig_analysis::check::before_recording(&plan.presses, &protocol.analysis, outline)
            .map_err(|e| Failure::input(format!("{name}: {e}")))?;
    }
    let checked = CheckedProtocol { protocol, plan };
    Ok(match result {
        Ok(()) => Ok(checked),
        Err(found) => Err(Box::new(Rejection {
            found,
            planned: Some(checked),
        })),
    })
}

/// `skinrig check`.
///
/// # Errors
/// See [`load`].
pub fn check(args: &ProtocolArgs, json: bool) -> Outcome {
    let checked = match read(&args.protocol, &args.overrides)? {
        Ok(checked) => checked,
        Err(rejection) if json => {
            crate::terminal::print_json(&serde_json::json!({
                "protocol": args.protocol, "findings": rejection.found.list(),
            }));
            return Ok(Exit::Input);
        }
        Err(rejection) => return Err(Failure::findings(&rejection.found)),
    };
    let summary = checked.plan.summary();
    if json {
        crate::terminal::print_json(&serde_json::json!({
            "protocol": args.protocol, "sha256": checked.protocol.sha256,
            "plan_sha256": checked.plan.digest(), "summary": summary,
        }));
    } else {
        outln!("{}: ok", args.protocol.display());
        outln!("{summary}");
    }
    Ok(Exit::Ok)
}

/// `skinrig plan`.
///
/// # Errors
/// See [`load`] and `sample_size::propose`; [`Failure::internal`] when the SVG cannot be written.
pub fn plan(args: &PlanArgs, json: bool) -> Outcome {
    if let (Some(difference_mm), Some(session)) = (args.detect.detect, &args.detect.from) {
        return sample_size::propose(difference_mm, session, &args.detect, json);
    }
    let Some(protocol) = &args.protocol else {
        return Err(Failure::input("expected a protocol file, found none"));
    };
    // Also draw a plan that breaks its limits, to show where it does.
    let read = read(protocol, &args.overrides)?;
    let drawn = match &read {
        Ok(checked) => Some(checked),
        Err(rejection) => rejection.planned.as_ref(),
    };
    if let (Some(file), Some(CheckedProtocol { protocol, plan })) = (&args.svg, drawn) {
        let drawing = path_svg(plan, &protocol.surroundings);
        crate::results::write_named(file, drawing.as_bytes())?;
    }
    let checked = read.map_err(|rejection| Failure::findings(&rejection.found))?;
    let summary = checked.plan.summary();
    if json {
        crate::terminal::print_json(&serde_json::json!({
            "sha256": checked.plan.digest(), "summary": summary, "plan": with_numbers(&checked.plan)?,
        }));
        return Ok(Exit::Ok);
    }
    outln!("{summary}");
    if args.steps {
        for (number, step) in (1..).zip(&checked.plan.steps) {
            outln!("{number:>6}  {}", describe_step(step));
        }
    }
    outln!("digest    {}", checked.plan.digest());
    if let Some(file) = &args.svg {
        outln!("drawn in  {}", file.display());
    }
    Ok(Exit::Ok)
}

/// The plan as JSON with presses, repetitions and locations numbered from 1, as people count them. The stored plan, of which the
/// digest is taken, holds indices.
fn with_numbers(plan: &Plan) -> Result<serde_json::Value, Failure> {
    let mut value = serde_json::to_value(plan).map_err(Failure::internal)?;
    let rows = value["presses"].as_array_mut().into_iter().flatten();
    for (row, press) in rows.zip(&plan.presses) {
        if let Some(row) = row.as_object_mut() {
            row.remove("id");
        }
        row["press"] = serde_json::json!(press.id);
        row["repetition"] = serde_json::json!(press.repetition);
        row["location"] = serde_json::json!(press.location);
    }
    let rows = value["steps"].as_array_mut().into_iter().flatten();
    for (row, step) in rows.zip(&plan.steps) {
        match step {
            Step::Press(p) => row["press"] = serde_json::json!(p.press),
            Step::Begin { repetition } => row["repetition"] = serde_json::json!(repetition),
            Step::Look { repetition, .. } => row["repetition"] = serde_json::json!(repetition),
            Step::Travel { .. } | Step::Pause { .. } | Step::Learn => {}
        }
    }
    Ok(value)
}

/// One step on one line.
fn describe_step(step: &Step) -> String {
    let seconds = |d: skinrig_model::HostDuration| format!("{:.3} s", d.as_secs_f64());
    match step {
        Step::Begin { repetition: None } => "begin of the sync presses".into(),
        Step::Begin {
            repetition: Some(r),
        } => format!("begin of {r}"),
        Step::Travel {
            to,
            speed_mm_s,
            deadline,
        } => {
            let [x, y, z] = to.to_array();
            let within = seconds(*deadline);
            format!("travel to ({x:.3}, {y:.3}, {z:.3}) mm at {speed_mm_s} mm/s within {within}")
        }
        Step::Pause { duration } => format!("pause {}", seconds(*duration)),
        Step::Learn => "learn what a touch is".to_owned(),
        Step::Look { number, repetition } => format!("look {number}, after {repetition}"),
        Step::Press(p) => {
            let at = p
                .start_after_begin
                .map_or_else(String::new, |t| format!(", {} after begin", seconds(t)));
            format!(
                "{} at ({:.3}, {:.3}) mm, {} mm deep{at}: approach {:.3}, indent {:.3}, retract \
                 {:.3} mm/s, hold {}, within {}",
                p.press,
                p.at.x_mm,
                p.at.y_mm,
                p.depth_mm,
                p.approach_speed_mm_s,
                p.indent_speed_mm_s,
                p.retract_speed_mm_s,
                seconds(p.hold),
                seconds(p.deadline),
            )
        }
    }
}

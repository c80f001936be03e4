//! `skinrig check` and `skinrig plan`: everything before a device is opened.

use std::io::IsTerminal;
use std::path::Path;

use skinrig_protocol::{Plan, Protocol, Step, Violation, path_svg};

use crate::args::{PlanArgs, ProtocolArgs};
use crate::exit::{Exit, Failure, Outcome};

/// A protocol whose plan passed every check.
pub struct Checked {
    /// The protocol.
    pub protocol: Protocol,
    /// Its plan.
    pub plan: Plan,
}

/// Reads, compiles and checks a protocol.
///
/// # Errors
/// [`Failure::input`] with every finding at once.
pub fn load(path: &Path, overrides: &[String]) -> Result<Checked, Failure> {
    let bytes = std::fs::read(path).map_err(|e| {
        Failure::input(format!("{}: cannot read the protocol: {e}", path.display()))
    })?;
    let loader = |p: &Path| std::fs::read(p);
    let color = std::io::stderr().is_terminal();
    let protocol = Protocol::parse(&path.to_string_lossy(), &bytes, overrides, &loader)
        .map_err(|found| Failure::input(format!("in the protocol\n{}", found.render(color))))?;
    let plan = protocol.compile();
    let home = Some(protocol.motion.home);
    let violations = skinrig_protocol::check(&plan, &protocol.surroundings, home);
    if violations.is_empty() {
        Ok(Checked { protocol, plan })
    } else {
        Err(Failure::input(describe(path, &violations)))
    }
}

fn describe(path: &Path, violations: &[Violation]) -> String {
    let mut text = format!(
        "{}: the plan breaks {} limit(s)\n",
        path.display(),
        violations.len()
    );
    for violation in violations {
        text.push_str(&format!("  {violation}\n"));
    }
    text
}

/// `skinrig check`.
///
/// # Errors
/// See [`load`].
pub fn check(args: &ProtocolArgs, json: bool) -> Outcome {
    let checked = load(&args.protocol, &args.overrides)?;
    let summary = checked.plan.summary();
    if json {
        crate::print_json(&serde_json::json!({
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
/// See [`load`]; [`Failure::internal`] when the SVG cannot be written.
pub fn plan(args: &PlanArgs, json: bool) -> Outcome {
    let checked = load(&args.protocol.protocol, &args.protocol.overrides)?;
    let summary = checked.plan.summary();
    if let Some(file) = &args.svg {
        std::fs::write(
            file,
            path_svg(&checked.plan, &checked.protocol.surroundings),
        )
        .map_err(|e| {
            Failure::internal(format!("{}: cannot write the path: {e}", file.display()))
        })?;
    }
    if json {
        crate::print_json(&serde_json::json!({
            "sha256": checked.plan.digest(), "summary": summary, "plan": checked.plan,
        }));
        return Ok(Exit::Ok);
    }
    outln!("{summary}");
    if args.steps {
        for (number, step) in checked.plan.steps.iter().enumerate() {
            outln!("{number:>6}  {}", describe_step(step));
        }
    }
    outln!("digest    {}", checked.plan.digest());
    if let Some(file) = &args.svg {
        outln!("drawn in  {}", file.display());
    }
    Ok(Exit::Ok)
}

/// One step on one line.
fn describe_step(step: &Step) -> String {
    let seconds = |d: skinrig_model::HostDuration| format!("{:.3} s", d.as_secs_f64());
    match step {
        Step::Begin { repetition: None } => "begin of the sync presses".into(),
        Step::Begin {
            repetition: Some(r),
        } => format!("begin of repetition {}", r + 1),
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
        Step::Press(p) => {
            let at = p
                .start_after_begin
                .map_or_else(String::new, |t| format!(", {} after begin", seconds(t)));
            format!(
                "press {} at ({:.3}, {:.3}) mm, {} mm deep{at}: approach {:.3}, indent {:.3}, retract \
                 {:.3} mm/s, hold {}, within {}",
                p.press.0,
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

//! `skinrig sessions`.

use skinrig_recorder::{SessionState, SessionSummary, list};

use crate::args::SessionsArgs;
use crate::exit::{Exit, Failure, Outcome};

/// Lists the sessions of a folder.
///
/// # Errors
/// [`Failure::input`] when the folder cannot be read.
pub fn sessions(args: &SessionsArgs, json: bool) -> Outcome {
    let mut found = list(&args.folder).map_err(Failure::input)?;
    if let Some(wanted) = &args.prototype {
        found.retain(
            |s| matches!(&s.state, SessionState::Readable { prototype, .. } if prototype == wanted),
        );
    }
    if json {
        crate::print_json(&serde_json::to_value(&found).map_err(Failure::internal)?);
        return Ok(Exit::Ok);
    }
    if found.is_empty() {
        outln!("no sessions in {}", args.folder.display());
        return Ok(Exit::Ok);
    }
    outln!(
        "{:<19}  {:<14}  {:<22}  {:<24}  {:>13}  {:>8}  file",
        "started (UTC)",
        "prototype",
        "protocol",
        "rig",
        "valid/planned",
        "MB"
    );
    for session in &found {
        outln!("{}", line(session));
    }
    Ok(Exit::Ok)
}

fn line(session: &SessionSummary) -> String {
    let name = session.path.file_name();
    let file = name
        .map(|n| n.to_string_lossy().into_owned())
        .unwrap_or_default();
    match &session.state {
        SessionState::Broken { reason } => format!("broken: {file}: {reason}"),
        SessionState::Readable {
            started_at,
            prototype,
            protocol_name,
            rig_name,
            end,
            sealed,
            totals,
            ..
        } => {
            let protocol = protocol_name.rsplit('/').next().unwrap_or_default();
            let state = match (end.as_deref(), sealed) {
                (Some("completed"), true) => String::new(),
                (Some(end), true) => format!("  ({end})"),
                (Some(end), false) => format!("  ({end}, not sealed)"),
                (None, _) if skinrig_recorder::writer_of(&session.path).is_some() => {
                    "  (under way)".to_owned()
                }
                (None, _) => "  (cut off)".to_owned(),
            };
            format!(
                "{:<19}  {:<14}  {:<22}  {:<24}  {:>13}  {:>8.1}  {file}{state}",
                started_at.chars().take(19).collect::<String>(),
                clip(prototype, 14),
                clip(protocol, 22),
                clip(rig_name, 24),
                format!("{}/{}", totals.presses.valid, totals.presses.planned),
                session.size_bytes as f64 / 1e6,
            )
        }
    }
}

fn clip(text: &str, width: usize) -> String {
    if text.chars().count() <= width {
        text.to_owned()
    } else {
        text.chars().take(width - 1).chain(['…']).collect()
    }
}

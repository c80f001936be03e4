//! `skinrig select`: writes a selection of sessions.

use std::fmt::Write as _;
use std::path::{Component, Path};

use skinrig_protocol::Selection;

use super::{facts, read};
use crate::args::{Exclude, SelectArgs};
use crate::exit::{Exit, Failure, Outcome};
use crate::paths::{folder_of, shell_path};
use crate::results::write;

/// Writes the selection, and reads it back.
///
/// # Errors
/// [`Failure::input`] for a session without a seal, for presses that do not exist, and when the file exists.
pub(crate) fn select(args: &SelectArgs, json: bool) -> Outcome {
    if args.out.exists() {
        return Err(Failure::input(format!(
            "{}: expected a new file, found one\n  next: choose another with --out, or edit this one",
            args.out.display()
        )));
    }
    if !args.exclude.is_empty() && args.sessions.len() > 1 {
        return Err(Failure::input(format!(
            "--exclude: expected one session, found {}\n  next: leave --exclude out and add `exclude` in the file",
            args.sessions.len()
        )));
    }
    write(&args.out, text(args)?.as_bytes())?;
    let selection = read(&args.out).inspect_err(|_| {
        // The findings show the text; a file that cannot be used is not left behind.
        let _ = std::fs::remove_file(&args.out);
    })?;
    print(args, &selection, json);
    Ok(Exit::Ok)
}

fn print(args: &SelectArgs, selection: &Selection, json: bool) {
    let excluded: usize = selection
        .sessions
        .iter()
        .map(|s| s.selected_out.len())
        .sum();
    if json {
        crate::terminal::print_json(&serde_json::json!({
            "selection": args.out, "name": selection.name, "sha256": selection.sha256,
            "sessions": selection.sessions.len(), "excluded": excluded,
        }));
        return;
    }
    outln!(
        "selection {}: {} session(s), {excluded} press(es) excluded",
        args.out.display(),
        selection.sessions.len()
    );
    outln!("SHA-256   {}", selection.sha256);
    outln!("next      `skinrig analyze {}`", shell_path(&args.out));
}

/// The file's text.
fn text(args: &SelectArgs) -> Result<String, Failure> {
    let mut out = format!(
        "skinrig_selection: 1\nname: {}\nsessions:\n",
        quoted(&args.name)
    );
    let folder = folder_of(&args.out);
    for session in &args.sessions {
        let facts = facts(session).map_err(Failure::session)?;
        let Some(hash) = facts.content_sha256 else {
            return Err(Failure::input(format!(
                "{0}: expected a sealed session, found one that is still running or was cut off\n  next: `skinrig resume {on}` \
                 continues and seals it",
                session.display(),
                on = shell_path(session)
            )));
        };
        let file = relative(folder, session)?;
        // Writing to a string cannot fail.
        let _ = writeln!(
            out,
            "  - file: {}\n    content_sha256: {hash}",
            quoted(&file)
        );
        if !args.exclude.is_empty() {
            out.push_str("    exclude:\n");
        }
        for Exclude { presses, reason } in &args.exclude {
            let by = quoted(args.decided_by.as_deref().unwrap_or_default());
            let _ = writeln!(
                out,
                "      - presses: [{presses}]\n        reason: {}\n        decided_by: {by}",
                quoted(reason)
            );
        }
    }
    Ok(out)
}

/// A YAML text in double quotes.
fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

/// The path of `session` from `folder`, with `/` between names.
fn relative(folder: &Path, session: &Path) -> Result<String, Failure> {
    let absolute = |path: &Path| {
        path.canonicalize()
            .map_err(|e| Failure::input(format!("{}: cannot find: {e}", path.display())))
    };
    let (from, to) = (absolute(folder)?, absolute(session)?);
    let (from, to): (Vec<_>, Vec<_>) = (from.components().collect(), to.components().collect());
    let shared = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
    let up = from[shared..].iter().map(|_| "..".to_owned());
    let down = to[shared..]
        .iter()
        .map(|c: &Component<'_>| c.as_os_str().to_string_lossy().into_owned());
    Ok(up.chain(down).collect::<Vec<_>>().join("/"))
}

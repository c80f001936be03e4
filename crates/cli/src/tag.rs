//! `skinrig tag`: tags and notes that people add to a finished session, in a log beside it.

use std::ffi::OsString;

use chrono::{SecondsFormat, Utc};
use skinrig_recorder::{
    Annotation, Annotations, SessionReader, annotate, annotations, is_valid_tag,
};

use crate::args::TagArgs;
use crate::exit::{Exit, Failure, Outcome};

/// Adds and removes tags and notes, and prints all of them.
///
/// # Errors
/// [`Failure::input`] for an invalid tag, session or log.
pub(crate) fn tag(args: &TagArgs, json: bool) -> Outcome {
    // As in `show`, the file must be given: never guess the session of a folder, because annotations are permanent.
    let session = args.session.clone();
    let session_id = SessionReader::open(&session)
        .and_then(|reader| reader.session_id())
        .map_err(Failure::session)?;
    let (add, remove) = checked(&args.tags, &args.remove)?;
    let has_changes = !add.is_empty() || !remove.is_empty() || args.note.is_some();
    let all = if has_changes {
        let annotation = Annotation {
            session_id,
            at: Utc::now().to_rfc3339_opts(SecondsFormat::Secs, true),
            by: args.by.clone().unwrap_or_else(crate::host::user_name),
            add,
            remove,
            note: args.note.clone(),
        };
        annotate(&session, &annotation)
    } else {
        annotations(&session, &session_id)
    };
    let all = all.map_err(Failure::session)?;
    if has_changes {
        crate::catalogue::automatic::register(&session);
    }
    if json {
        crate::terminal::print_json(&serde_json::json!({
            "session": session, "tags": all.tags, "notes": all.notes,
        }));
    } else {
        outln!("{}", session.display());
        outln!("tags  {}", words(&all));
        for note in &all.notes {
            outln!("      {} {}: {}", note.at, note.by, note.text);
        }
    }
    Ok(Exit::Ok)
}

/// The tags, in order; `-` without any.
#[must_use]
pub(crate) fn words(all: &Annotations) -> String {
    let tags: Vec<&str> = all.tags.iter().map(String::as_str).collect();
    match tags[..] {
        [] => "-".to_owned(),
        _ => tags.join(" "),
    }
}

/// Rewrites every `-TAG` of `skinrig tag` as `--remove=TAG`; the option parser would split it into letters.
#[must_use]
pub(crate) fn expand_removals(arguments: Vec<OsString>) -> Vec<OsString> {
    let command = |a: &OsString| !a.to_string_lossy().starts_with('-');
    let at = arguments.iter().skip(1).position(command);
    let Some(at) = at.filter(|at| arguments[at + 1] == "tag") else {
        return arguments;
    };
    let mut is_value = false;
    let expand = |(i, word): (usize, OsString)| {
        let text = word.to_string_lossy().into_owned();
        let own = text.strip_prefix('-').filter(|tag| {
            i > at + 1 && !is_value && is_valid_tag(tag) && !matches!(*tag, "h" | "V")
        });
        is_value = matches!(text.as_str(), "--note" | "--by" | "--remove");
        own.map_or(word, |tag| format!("--remove={tag}").into())
    };
    arguments.into_iter().enumerate().map(expand).collect()
}

/// Validates the tags to add and to remove; returns each once.
fn checked(add: &[String], remove: &[String]) -> Result<(Vec<String>, Vec<String>), Failure> {
    if let Some(wrong) = add.iter().chain(remove).find(|tag| !is_valid_tag(tag)) {
        return Err(Failure::input(format!(
            "expected a tag of 1 to 40 of a-z, 0-9, `.`, `_`, `-`, found `{}`\n  next: \
             for free text use --note",
            wrong.escape_debug()
        )));
    }
    if let Some(both) = add.iter().find(|tag| remove.contains(tag)) {
        return Err(Failure::input(format!(
            "expected `{both}` or `-{both}`, found both"
        )));
    }
    let once = |tags: &[String]| {
        let mut tags = tags.to_vec();
        tags.sort();
        tags.dedup();
        tags
    };
    Ok((once(add), once(remove)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_minus_removes_a_tag() {
        let expanded = |line: &str| -> String {
            let words = expand_removals(line.split(' ').map(OsString::from).collect());
            let words: Vec<_> = words.iter().map(|w| w.to_string_lossy()).collect();
            words.join(" ")
        };
        assert_eq!(
            expanded("skinrig --json tag s good -bad --note -x -v2 --by Ann"),
            "skinrig --json tag s good --remove=bad --note -x --remove=v2 --by Ann"
        );
        for line in [
            "skinrig tag -h",
            "skinrig run tag -b",
            "skinrig",
            "skinrig tag s -A",
        ] {
            assert_eq!(expanded(line), line);
        }
    }

    #[test]
    fn invalid_tags_are_rejected() {
        let own = |all: &[&str]| -> Vec<String> { all.iter().map(|t| (*t).to_owned()).collect() };
        let (add, remove) = checked(&own(&["good-skin", "v2", "v2"]), &own(&["bad"])).unwrap();
        assert_eq!((add, remove), (own(&["good-skin", "v2"]), own(&["bad"])));
        for (add, remove) in [
            (&["a"][..], &["a"][..]),
            (&[""], &[]),
            (&["A b"], &[]),
            (&[], &["-"]),
        ] {
            assert!(
                checked(&own(add), &own(remove)).is_err(),
                "{add:?} {remove:?}"
            );
        }
    }
}

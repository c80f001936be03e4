//! `skinrig sessions`, and finding sessions in a folder.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use skinrig_recorder::{SESSION_SUFFIX, SessionReader, SessionState, SessionSummary, writer_of};
use skinrig_text::{Column, Table, cut};

use crate::analyses;
use crate::args::SessionsArgs;
use crate::exit::{Exit, Failure, Outcome};
use crate::paths::{file_name, shell_path};
use crate::shelf::Shelf;

/// Lists the sessions of a folder.
///
/// # Errors
/// [`Failure::input`] when the folder cannot be read.
pub(crate) fn sessions(args: &SessionsArgs, json: bool) -> Outcome {
    let mut found = Shelf::told(&args.folder)?.sessions;
    let in_all = found.len();
    if let Some(prototype_id) = &args.prototype {
        found.retain(|s| s.prototype() == Some(prototype_id));
    }
    found.retain(|s| args.tags.iter().all(|tag| s.has_tag(tag)));
    if json {
        crate::terminal::print_json(&serde_json::to_value(&found).map_err(Failure::internal)?);
        return Ok(Exit::Ok);
    }
    if found.is_empty() {
        match in_all {
            0 => outln!("no sessions in {}", args.folder.display()),
            n => outln!(
                "no matching sessions in {}, {n} in all",
                args.folder.display()
            ),
        }
        return Ok(Exit::Ok);
    }
    let table = Table::new([
        Column::left(19),
        Column::left(14).clipped(),
        Column::left(22).clipped(),
        Column::left(24).clipped(),
        Column::right(13),
        Column::right(8),
    ]);
    outln!(
        "{}",
        table.row([
            "started (UTC)",
            "prototype",
            "protocol",
            "rig",
            "valid/planned",
            "MB",
            "file"
        ])
    );
    for session in &found {
        outln!("{}", line(&table, session));
    }
    Ok(Exit::Ok)
}

/// The session at `place`: the file itself, or in a folder the session being recorded, else the one written last.
///
/// # Errors
/// [`Failure::input`] when there is none, or when several are being recorded.
pub(crate) fn find(place: &Path) -> Result<PathBuf, Failure> {
    if !place.is_dir() {
        return Ok(place.to_owned());
    }
    let all = files(place)?;
    let mut running = all.iter().filter(|p| writer_of(p).is_some());
    match (running.next(), running.next()) {
        (Some(one), Some(other)) => Err(Failure::input(format!(
            "{}: expected one session that is being written, found {}, {} and perhaps more\n  next: name the file",
            place.display(),
            one.display(),
            other.display()
        ))),
        (Some(one), None) => Ok(one.clone()),
        (None, _) => {
            let newest = all.into_iter().max_by_key(|p| (modified_at(p), p.clone()));
            newest.ok_or_else(|| none_in(place))
        }
    }
}

/// The running session at `place`.
///
/// # Errors
/// [`Failure::input`] with the actual state of the session.
pub(crate) fn find_running(place: &Path) -> Result<PathBuf, Failure> {
    let session = find(place)?;
    if writer_of(&session).is_some() {
        return Ok(session);
    }
    let (shown, word) = (session.display(), shell_path(&session));
    let state = SessionReader::open(&session).and_then(|reader| {
        let legs = reader.legs()?; // fails without a header
        Ok((reader.seal()?.is_some(), reader.end()?.is_some(), legs))
    });
    Err(Failure::input(match state {
        Ok((true, ..)) => format!(
            "{shown}: expected a running session, found a sealed one, which never changes\n  next: `skinrig tag {word} --note \
             TEXT` adds a note beside it; `skinrig resume {word}` continues one that was stopped"
        ),
        Ok(_) => format!(
            "{shown}: expected a running session, found one that no program is running\n  next: `skinrig resume {word}` continues \
            it"
        ),
        Err(e) => e.to_string(),
    }))
}

/// The sessions of `prototype` in `folder`, oldest first; the name must match exactly.
///
/// # Errors
/// [`Failure::input`] when the folder cannot be read; when it has none of them, with the prototypes that it has.
pub(crate) fn of_prototype(folder: &Path, prototype: &str) -> Result<Vec<PathBuf>, Failure> {
    let all = Shelf::read(folder)?.sessions;
    let of = |s: &&SessionSummary| s.prototype() == Some(prototype);
    let found: Vec<PathBuf> = all.iter().filter(of).map(|s| s.path.clone()).collect();
    if !found.is_empty() {
        return Ok(found);
    }
    let mut known: Vec<&str> = all.iter().filter_map(SessionSummary::prototype).collect();
    known.sort_unstable();
    known.dedup();
    let known = match known[..] {
        [] => "no sessions".to_owned(),
        _ => format!("sessions of {}", known.join(", ")),
    };
    Err(Failure::input(format!(
        "{}: expected sessions of the prototype `{prototype}`, found {known}\n  next: `skinrig prototypes {on}` lists them",
        folder.display(),
        on = shell_path(folder)
    )))
}

/// The representative of several copies of one session: one whose rows are those that were sealed before a changed one, sealed
/// before unsealed (`salvage` never seals), analysed before not analysed, then the shorter path before the longer.
fn representative<'a>(copies: &[&'a SessionSummary]) -> Option<&'a SessionSummary> {
    if let [only] = copies {
        return Some(only);
    }
    let rank = |s: &&&SessionSummary| {
        let sealed = matches!(s.state, SessionState::Readable { sealed: true, .. });
        let analysed = match &s.state {
            SessionState::Readable { session_id, .. } => {
                analyses::summary(&s.path, session_id, None).is_ok()
            }
            SessionState::Empty | SessionState::Broken { .. } => false,
        };
        let changed = SessionReader::open_checked(&s.path).is_err();
        (
            changed,
            !sealed,
            !analysed,
            s.path.as_os_str().len(),
            s.path.clone(),
        )
    };
    copies.iter().min_by_key(rank).copied()
}

fn by_id(all: &[SessionSummary]) -> BTreeMap<&str, Vec<&SessionSummary>> {
    let mut groups: BTreeMap<&str, Vec<&SessionSummary>> = BTreeMap::new();
    for session in all {
        if let SessionState::Readable { session_id, .. } = &session.state {
            groups.entry(session_id).or_default().push(session);
        }
    }
    groups
}

/// The sessions of a list in its order, without copies of the same session (`skinrig salvage` creates one).
#[must_use]
pub(crate) fn originals(all: &[SessionSummary]) -> Vec<&SessionSummary> {
    let chosen: BTreeSet<&Path> = by_id(all)
        .values()
        .filter_map(|copies| representative(copies).map(|s| s.path.as_path()))
        .collect();
    let broken = |s: &SessionSummary| matches!(s.state, SessionState::Broken { .. });
    all.iter()
        .filter(|s| broken(s) || chosen.contains(s.path.as_path()))
        .collect()
}

/// A note on every copy that [`originals`] leaves out.
#[must_use]
pub(crate) fn copies(all: &[SessionSummary]) -> Vec<String> {
    let mut notes = Vec::new();
    for copies in by_id(all).values() {
        let Some(chosen) = representative(copies) else {
            continue;
        };
        for copy in copies.iter().filter(|s| s.path != chosen.path) {
            let changed = SessionReader::open_checked(&copy.path).err();
            let (copy, chosen) = (copy.path.display(), chosen.path.display());
            notes.push(match changed {
                Some(changed) => {
                    format!("not counted, a copy of {chosen} that was changed: {changed}")
                }
                None => {
                    format!("{copy} is a copy of the session {chosen}; it is not counted again")
                }
            });
        }
    }
    notes
}

/// The folder has no session.
pub(crate) fn none_in(folder: &Path) -> Failure {
    Failure::input(format!(
        "{}: expected a session, found none\n  next: `skinrig run` records one; name another folder or a file",
        folder.display()
    ))
}

/// The session files of a folder, unsorted.
///
/// # Errors
/// [`Failure::input`] when it cannot be read.
pub(crate) fn files(folder: &Path) -> Result<Vec<PathBuf>, Failure> {
    let refused = |e: std::io::Error| Failure::input(format!("{}: {e}", folder.display()));
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(refused)? {
        let path = entry.map_err(refused)?.path();
        if file_name(&path).ends_with(SESSION_SUFFIX) {
            found.push(path);
        }
    }
    Ok(found)
}

/// Time of the last write to a session or its log.
fn modified_at(session: &Path) -> Option<SystemTime> {
    let mut log = session.as_os_str().to_owned();
    log.push("-wal");
    let at = |path: &Path| std::fs::metadata(path).and_then(|m| m.modified()).ok();
    at(session).max(at(Path::new(&log)))
}

fn line(table: &Table, session: &SessionSummary) -> String {
    let file = file_name(&session.path);
    match &session.state {
        SessionState::Empty if writer_of(&session.path).is_some() => format!("beginning: {file}"),
        SessionState::Empty => format!("empty: {file}: it has no records; remove it"),
        SessionState::Broken { reason } => format!("broken: {file}: {reason}"),
        SessionState::Readable {
            started_at,
            prototype,
            protocol_name,
            rig_name,
            end,
            sealed,
            presses,
            annotations,
            tags_problem,
            ..
        } => {
            let protocol = protocol_name.rsplit('/').next().unwrap_or_default();
            let state = match (end.as_deref(), sealed) {
                (Some("completed"), true) => String::new(),
                (Some(end), true) => format!("  ({end})"),
                (Some(end), false) => format!("  ({end}, not sealed)"),
                (None, _) if writer_of(&session.path).is_some() => "  (under way)".to_owned(),
                (None, _) => "  (cut off)".to_owned(),
            };
            let mut notes = match annotations.tags.is_empty() {
                true => String::new(),
                false => format!("  [{}]", crate::tag::words(annotations)),
            };
            if !annotations.notes.is_empty() {
                notes += &format!("  {} note(s)", annotations.notes.len());
            }
            if let Some(problem) = tags_problem {
                notes += &format!("  tags unreadable: {problem}");
            }
            table.row([
                cut(started_at, 19),
                prototype,
                protocol,
                rig_name,
                &format!("{}/{}", presses.valid, presses.planned),
                &format!("{:.1}", session.size_bytes as f64 / 1e6),
                &format!("{file}{state}{notes}"),
            ])
        }
    }
}

/// The session at `place` as [`find`] takes it; `None` as long as there is none.
///
/// # Errors
/// [`Failure::input`] for a folder that cannot be read.
pub(crate) fn find_if_any(place: &Path) -> Result<Option<PathBuf>, Failure> {
    let mut folder = match place.is_dir() {
        true => std::fs::read_dir(place).map_err(Failure::input)?,
        false => return Ok(place.exists().then(|| place.to_owned())),
    };
    let is_session = |entry: std::io::Result<std::fs::DirEntry>| {
        entry.is_ok_and(|e| {
            let name = e.file_name();
            name.to_string_lossy().ends_with(SESSION_SUFFIX)
        })
    };
    if folder.any(is_session) {
        find(place).map(Some)
    } else {
        Ok(None)
    }
}

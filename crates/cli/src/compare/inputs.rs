//! Resolves the arguments of `compare` (session files, folders, prototypes) and reads the results of each session.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use skinrig_compare::{Session, Subject};
use skinrig_recorder::SessionReader;

use super::facts::facts;
use crate::analyses;
use crate::analysis_request::AnalysisRequest;
use crate::analyze::without_selection;
use crate::args::CompareArgs;
use crate::exit::Failure;
use crate::results::analyze_shown;
use crate::selection::result::{self, SelectedResult, without_results};
use crate::selection::{self, Target};
use crate::sessions::{copies, originals};
use crate::shelf::Shelf;

/// Most skins in one comparison: letters A to H.
const MAX_SKINS: usize = 8;

/// A skin and the files of its sessions.
pub(super) struct SkinSessions {
    pub subject: Subject,
    pub paths: Vec<PathBuf>,
    /// Effect of a selection on each session; empty without one.
    pub selected: Vec<SelectedResult>,
}

/// Resolves each skin argument.
pub(super) fn subjects(args: &CompareArgs) -> Result<Vec<SkinSessions>, Failure> {
    if args.skins.len() > MAX_SKINS {
        return Err(Failure::input(format!(
            "expected at most {MAX_SKINS} skins, found {}\n  next: compare them in groups with a common first one",
            args.skins.len()
        )));
    }
    let letters = 'A'..;
    let found = args.skins.iter().zip(letters);
    found
        .map(|(text, letter)| skin_sessions(text, letter, &args.sessions, args.analysis.as_deref()))
        .collect()
}

fn skin_sessions(
    text: &str,
    letter: char,
    folder: &Path,
    analysis: Option<&str>,
) -> Result<SkinSessions, Failure> {
    let path = Path::new(text);
    let (name, targets) = if path.is_dir() {
        (None, session_paths(path, None)?)
    } else if path.is_file() {
        (None, selection::sessions(path)?.sessions)
    } else if text.contains(std::path::MAIN_SEPARATOR)
        || [crate::paths::SESSION_SUFFIX, ".yaml", ".yml"]
            .iter()
            .any(|ending| text.ends_with(ending))
    {
        return Err(Failure::input(format!(
            "{text}: expected a session, a selection, a folder of sessions or the name of a prototype, found no such file\n  \
             next: `skinrig sessions` lists what is there"
        )));
    } else {
        (Some(text), session_paths(folder, Some(text))?)
    };
    if targets.is_empty() {
        let (what, expected) = match name {
            Some(name) => (folder.display(), format!("sessions of prototype `{name}`")),
            None => (path.display(), "sessions".to_owned()),
        };
        return Err(Failure::input(format!(
            "{what}: expected {expected}, found none\n  next: `skinrig sessions {what}` lists what is there; --sessions \
             names another folder"
        )));
    }
    let mut selected = Vec::new();
    let mut sessions = Vec::new();
    for target in &targets {
        let (session, of_selection) = session(target, analysis)?;
        sessions.push(session);
        selected.extend(of_selection);
    }
    let paths: Vec<PathBuf> = targets.iter().map(|t| t.path.clone()).collect();
    let own = sessions.first().map(|s| s.facts.prototype.clone());
    let mut name = name.map(str::to_owned).or(own).unwrap_or_default();
    if let Some(analysis) = analysis {
        name = format!("{name} ({})", changes(&paths, analysis)?);
    }
    if let Some(first) = selected.first() {
        name = format!("{name}, selection {}", first.name);
    }
    Ok(SkinSessions {
        subject: Subject {
            letter,
            name,
            sessions,
        },
        paths,
        selected,
    })
}

/// The sessions of a folder, of one prototype or all. A broken file is an error; it is not skipped.
fn session_paths(folder: &Path, prototype: Option<&str>) -> Result<Vec<Target>, Failure> {
    let mut selected = Shelf::told(folder)?.sessions;
    selected.retain(|s| prototype.is_none() || s.prototype() == prototype);
    for copy in copies(&selected) {
        errln!("note: {copy}");
    }
    Ok(originals(&selected)
        .into_iter()
        .map(|s| Target {
            path: s.path.clone(),
            selected: None,
        })
        .collect())
}

/// Changed settings of the variant `name` in these sessions.
fn changes(paths: &[PathBuf], name: &str) -> Result<String, Failure> {
    let mut all = BTreeSet::new();
    for path in paths {
        let reader = SessionReader::open(path).map_err(Failure::session)?;
        let id = reader.session_id().map_err(Failure::session)?;
        all.insert(analyses::variant(path, &id, name)?.to_string());
    }
    Ok(all.into_iter().collect::<Vec<_>>().join("; "))
}

/// Reads the results of a session, or analyses it; also returns what its selection changes.
fn session(
    target: &Target,
    name: Option<&str>,
) -> Result<(Session, Option<SelectedResult>), Failure> {
    let Target { path, selected } = target;
    let unreadable = Failure::session;
    let reader = SessionReader::open_checked(path).map_err(unreadable)?;
    let header = reader.header().map_err(unreadable)?;
    let facts = facts(path, &reader, &header)?;
    let variant = name
        .map(|name| analyses::variant(path, &facts.session_id, name))
        .transpose()?;
    if let Some(selected) = selected {
        let (analysis, stated) =
            result::analysis(path, &facts.session_id, selected, variant.as_ref())?;
        return Ok((Session { facts, analysis }, Some(stated)));
    }
    let choices = match &variant {
        Some(variant) => {
            without_selection(variant, "compare")?;
            AnalysisRequest::of_variant(variant)
        }
        None => AnalysisRequest::default(),
    };
    let analysis = match analyses::stored(path, &facts.session_id, name) {
        Some(analysis) => analysis,
        None => {
            analyze_shown(path, choices)
                .map_err(|f| without_results(path, f))?
                .analysis
        }
    };
    Ok((Session { facts, analysis }, None))
}

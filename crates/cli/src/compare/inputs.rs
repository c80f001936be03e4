//! Resolves the arguments of `compare` (session files, folders, prototypes) and reads the results of each session.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use skinrig_compare::{Session, Subject};
use skinrig_recorder::{SessionReader, list};

use super::facts::facts;
use crate::analyses;
use crate::analysis_request::AnalysisRequest;
use crate::args::CompareArgs;
use crate::exit::Failure;
use crate::results::analyze_shown;
use crate::sessions::{copies, originals};

/// Most skins in one comparison: letters A to H.
const MAX_SKINS: usize = 8;

/// A skin and the files of its sessions.
pub(super) struct SkinSessions {
    pub subject: Subject,
    pub paths: Vec<PathBuf>,
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
    let (name, paths) = if path.is_dir() {
        (None, session_paths(path, None)?)
    } else if path.is_file() {
        (None, vec![path.to_owned()])
    } else if text.contains(std::path::MAIN_SEPARATOR)
        || text.ends_with(crate::paths::SESSION_SUFFIX)
    {
        return Err(Failure::input(format!(
            "{text}: expected a session, a folder of sessions or the name of a prototype, found no such file\n  \
             next: `skinrig sessions` lists what is there"
        )));
    } else {
        (Some(text), session_paths(folder, Some(text))?)
    };
    if paths.is_empty() {
        let (what, expected) = match name {
            Some(name) => (folder.display(), format!("sessions of prototype `{name}`")),
            None => (path.display(), "sessions".to_owned()),
        };
        return Err(Failure::input(format!(
            "{what}: expected {expected}, found none\n  next: `skinrig sessions {what}` lists what is there; --sessions \
             names another folder"
        )));
    }
    let sessions: Result<Vec<Session>, Failure> =
        paths.iter().map(|p| session(p, analysis)).collect();
    let sessions = sessions?;
    let own = sessions.first().map(|s| s.facts.prototype.clone());
    let mut name = name.map(str::to_owned).or(own).unwrap_or_default();
    if let Some(analysis) = analysis {
        name = format!("{name} ({})", changes(&paths, analysis)?);
    }
    Ok(SkinSessions {
        subject: Subject {
            letter,
            name,
            sessions,
        },
        paths,
    })
}

/// The sessions of a folder, of one prototype or all. A broken file is an error; it is not skipped.
fn session_paths(folder: &Path, prototype: Option<&str>) -> Result<Vec<PathBuf>, Failure> {
    let all = list(folder).map_err(Failure::session)?;
    let mut selected = all;
    selected.retain(|s| prototype.is_none() || s.prototype() == prototype);
    for copy in copies(&selected) {
        errln!("note: {copy}");
    }
    Ok(originals(&selected)
        .into_iter()
        .map(|s| s.path.clone())
        .collect())
}

/// What the variant `name` changes in these sessions.
fn changes(paths: &[PathBuf], name: &str) -> Result<String, Failure> {
    let mut all = BTreeSet::new();
    for path in paths {
        let reader = SessionReader::open(path).map_err(Failure::session)?;
        let id = reader.session_id().map_err(Failure::session)?;
        all.insert(analyses::variant(path, &id, name)?.to_string());
    }
    Ok(all.into_iter().collect::<Vec<_>>().join("; "))
}

fn session(path: &Path, name: Option<&str>) -> Result<Session, Failure> {
    let unreadable = Failure::session;
    let reader = SessionReader::open(path).map_err(unreadable)?;
    let header = reader.header().map_err(unreadable)?;
    let facts = facts(path, &reader, &header)?;
    let variant = name
        .map(|name| analyses::variant(path, &facts.session_id, name))
        .transpose()?;
    let analysis = match analyses::stored(path, &facts.session_id, name) {
        Some(analysis) => analysis,
        None => {
            let choices =
                variant
                    .as_ref()
                    .map_or_else(AnalysisRequest::default, |v| AnalysisRequest {
                        overrides: &v.changed,
                        reference_code: v.reference_code,
                        name: Some(&v.name),
                        calibration_from: v.calibration_from.as_deref(),
                    });
            analyze_shown(path, choices)
                .map_err(|f| Failure {
                    message: format!("{}\n  ({}: no results)", f.message, path.display()),
                    ..f
                })?
                .analysis
        }
    };
    Ok(Session { facts, analysis })
}

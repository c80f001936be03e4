//! Session arguments: a session file, or a selection that stands for several.

pub(crate) mod result;
mod write;

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use skinrig_model::SelectedOut;
use skinrig_protocol::Selection;
use skinrig_protocol::selection::{SessionFacts, SessionFault};
use skinrig_recorder::{RecorderError, SessionReader};
use skinrig_report::SelectionName;

use crate::exit::{Exit, Failure, Outcome};
use crate::paths::folder_of;

pub(crate) use self::write::select;

/// The part of a selection that belongs to one session.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct SelectedPresses {
    /// The selection.
    pub name: SelectionName,
    /// The presses that do not count.
    pub out: Vec<SelectedOut>,
}

impl SelectedPresses {
    /// Part of the names of results: begins with the selection's hash, because two selections may have the same name.
    pub(crate) fn label(&self) -> String {
        let hash = &self.name.sha256;
        format!("selection-{}", hash.get(..16).unwrap_or(hash))
    }
}

/// A session of an argument.
#[derive(Debug, Clone)]
pub(crate) struct Target {
    pub path: PathBuf,
    /// The selection that names it.
    pub selected: Option<SelectedPresses>,
}

/// The sessions of an argument.
#[derive(Debug)]
pub(crate) struct Targets {
    /// The selection, if the argument is one.
    pub selection: Option<Selection>,
    pub sessions: Vec<Target>,
}

impl Targets {
    /// Runs `command` on each session, also after a failure. Returns the first failure; prints further ones.
    pub(crate) fn each(&self, mut command: impl FnMut(&Target) -> Outcome) -> Outcome {
        let mut all = Ok(Exit::Ok);
        for target in &self.sessions {
            match (&all, command(target)) {
                (Ok(_), result) => all = result,
                (Err(_), Err(further)) => errln!("{}", further.message),
                (Err(_), Ok(_)) => {}
            }
        }
        all
    }

    /// Prints one document per session: that of a session argument, or those of a selection together.
    pub(crate) fn print(&self, documents: Vec<Value>) {
        let Some(selection) = &self.selection else {
            documents.iter().for_each(crate::terminal::print_json);
            return;
        };
        crate::terminal::print_json(
            &json!({ "selection": about(selection), "sessions": documents }),
        );
    }

    /// The only session.
    ///
    /// # Errors
    /// [`Failure::input`] for a selection of several.
    pub(crate) fn one(mut self, argument: &Path) -> Result<Target, Failure> {
        match (self.sessions.pop(), self.sessions.len()) {
            (Some(only), 0) => Ok(only),
            (_, others) => Err(Failure::input(format!(
                "{}: expected a selection of one session, found {}\n  next: write one for each session with `skinrig select`",
                argument.display(),
                others + 1
            ))),
        }
    }
}

/// A selection, for programs.
pub(crate) fn about(selection: &Selection) -> Value {
    json!({
        "name": selection.name, "sha256": selection.sha256, "file": selection.file_name,
        "description": selection.description,
    })
}

/// True for the name of a selection rather than a session.
pub(crate) fn is_named(path: &Path) -> bool {
    let ending = path.extension().and_then(|e| e.to_str());
    matches!(ending, Some("yaml" | "yml")) && path.is_file()
}

/// The sessions that a command line argument names.
///
/// # Errors
/// [`Failure::findings`] for an invalid selection.
pub(crate) fn sessions(argument: &Path) -> Result<Targets, Failure> {
    if !is_named(argument) {
        let path = argument.to_owned();
        let sessions = vec![Target {
            path,
            selected: None,
        }];
        return Ok(Targets {
            selection: None,
            sessions,
        });
    }
    let selection = read(argument)?;
    let name = SelectionName {
        name: selection.name.clone(),
        sha256: selection.sha256.clone(),
        file: argument.to_owned(),
    };
    let each = selection.sessions.iter().map(|session| Target {
        path: session.path.clone(),
        selected: Some(SelectedPresses {
            name: name.clone(),
            out: session.selected_out.clone(),
        }),
    });
    Ok(Targets {
        sessions: each.collect(),
        selection: Some(selection),
    })
}

fn read(path: &Path) -> Result<Selection, Failure> {
    let name = path.display().to_string();
    let bytes = crate::paths::read_input(path, "write a selection with `skinrig select`")?;
    let folder = folder_of(path);
    Selection::parse(&name, &bytes, &|file| look_up(folder, file))
        .map_err(|f| Failure::findings(&f))
}

/// Finds a session from the folder of its selection, or by its name in it.
fn look_up(folder: &Path, file: &str) -> Result<SessionFacts, SessionFault> {
    let name = Path::new(file).file_name().unwrap_or_default();
    let beside = folder.join(name);
    let bundled = crate::paths::beside(&beside, ".bundle").join(name);
    let mut places = [folder.join(file), beside, bundled].into_iter();
    let path = places.find(|p| p.is_file()).ok_or(SessionFault::Missing)?;
    facts(&path).map_err(|e| SessionFault::Unreadable(e.to_string()))
}

/// Facts of a session that a selection checks.
fn facts(path: &Path) -> Result<SessionFacts, RecorderError> {
    let reader = SessionReader::open_unchanged(path)?;
    let seal = reader.seal()?;
    let presses = reader.presses()?;
    Ok(SessionFacts {
        path: path.to_owned(),
        content_sha256: seal.map(|s| s.content_sha256()),
        roles: presses.iter().map(|(press, _)| press.role).collect(),
    })
}

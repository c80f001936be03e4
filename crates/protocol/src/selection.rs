//! Selections: files that name sessions by the hash of their content, and presses that do not count.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::Serialize;
use sha2::{Digest, Sha256};
use skinrig_model::{PressId, PressRole, SelectedOut, SelectionReason};
use skinrig_settings::{Collector, Diagnostics, Field, NumberSpan, Numbers, Settings, open, quote};

use crate::file::hex;

/// Sessions, and presses of theirs that do not count.
#[derive(Debug, Clone, PartialEq, Settings)]
#[settings(name = "selection", version = "skinrig_selection")]
pub struct Selection {
    /// The file's name as given to [`Selection::parse`].
    #[setting(skip)]
    pub file_name: String,
    /// Lower-case hex SHA-256 of its text.
    #[setting(skip)]
    pub sha256: String,
    /// Name of this selection. Every result from it shows it.
    #[setting(example = "mine")]
    pub name: String,
    /// What it is for.
    pub description: Option<String>,
    /// The sessions; `skinrig select` writes them.
    #[setting(items = 1..=10_000, example = "[{file: NAME.session.sqlite, content_sha256: HASH}]")]
    pub sessions: Vec<SelectedSession>,
}

/// A session of a selection.
#[derive(Debug, Clone, PartialEq, Settings)]
#[settings(name = "selected_session")]
pub struct SelectedSession {
    /// The session file, from the folder of this file. If it is not there, the same name beside this file, or in its bundle there.
    #[setting(example = "NAME.session.sqlite")]
    pub file: String,
    /// Hash of its content: the seal's, which `skinrig select` copies.
    #[setting(read = digest, example = "HASH")]
    pub content_sha256: String,
    /// The only presses that count, besides sync presses; absent: all.
    pub only: Option<PressChoice>,
    /// Presses that do not count.
    #[setting(default = "[]", items = 0..=10_000)]
    pub exclude: Vec<PressChoice>,
    /// Where the file was found.
    #[setting(skip)]
    pub path: PathBuf,
    /// The presses that do not count, one by one.
    #[setting(skip)]
    pub selected_out: Vec<SelectedOut>,
}

/// Presses chosen for a reason.
#[derive(Debug, Clone, PartialEq, Eq, Settings)]
#[settings(name = "press_choice")]
pub struct PressChoice {
    /// Their numbers in the report.
    pub presses: Numbers,
    /// Why; results show it.
    #[setting(example = "the lamp failed")]
    pub reason: String,
    /// Who decided.
    #[setting(example = "A. Person")]
    pub decided_by: String,
}

/// A session file, as a selection needs it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SessionFacts {
    /// Where it was found.
    pub path: PathBuf,
    /// Hash of its content, lower-case hex; `None` without a seal.
    pub content_sha256: Option<String>,
    /// Roles of its planned presses, in order of number.
    pub roles: Vec<PressRole>,
}

/// Why a session of a selection cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub enum SessionFault {
    /// No file has the name.
    Missing,
    /// The file is not a readable session; the text says why.
    Unreadable(String),
}

impl Selection {
    /// Reads a selection from the bytes of a file named `name`; `look_up` finds a session by its `file`.
    ///
    /// # Errors
    /// [`Diagnostics`] with every finding at once: also sessions that are missing, unsealed or have another content, and
    /// presses that do not exist or are chosen twice.
    pub fn parse(
        name: &str,
        bytes: &[u8],
        look_up: &dyn Fn(&str) -> Result<SessionFacts, SessionFault>,
    ) -> Result<Self, Diagnostics> {
        let (mut out, root) = open(name, bytes, &[], Self::TABLE)?;
        let found = root.and_then(|root| {
            let mut selection = Self::from_mapping(&root, &mut out)?;
            let fields = root.at("sessions").items();
            for (session, field) in selection.sessions.iter_mut().zip(fields) {
                session.resolve(field, look_up, &mut out);
            }
            each_content_once(&selection.sessions, fields, &mut out);
            Some(selection)
        });
        match found {
            Some(selection) if out.is_clean() => Ok(Self {
                file_name: name.to_owned(),
                sha256: hex(&Sha256::digest(bytes)),
                ..selection
            }),
            _ => Err(out.finish()),
        }
    }
}

impl SelectedSession {
    /// Finds the session and the presses that do not count.
    fn resolve(
        &mut self,
        field: &Field,
        look_up: &dyn Fn(&str) -> Result<SessionFacts, SessionFault>,
        out: &mut Collector,
    ) {
        let Some(facts) = self.facts(field, look_up, out) else {
            return;
        };
        let mut chosen = BTreeMap::new();
        let exclude = field.at("exclude").items();
        for (choice, at) in self.exclude.iter().zip(exclude) {
            let why = choice.why();
            for (press, span) in choice.presses(at, &facts.roles, out) {
                if chosen.insert(press, why.clone()).is_some() {
                    out.error(span.span, at.path.as_str(), "a press is excluded twice")
                        .expected("each press once")
                        .found(press.to_string());
                }
            }
        }
        if let Some(only) = &self.only {
            let at = field.at("only");
            let kept = only.presses(at, &facts.roles, out);
            let kept: BTreeMap<_, _> = kept.into_iter().collect();
            for (press, _) in chosen.iter().filter(|(press, _)| !kept.contains_key(press)) {
                out.error(
                    at.span,
                    at.path.as_str(),
                    "an excluded press is not among the only ones",
                )
                .expected("`exclude` within `only`")
                .found(press.to_string())
                .help(format!("remove press {} from `exclude`", press.number()));
            }
            for press in excludable(&facts.roles).filter(|press| !kept.contains_key(press)) {
                chosen.insert(press, only.why());
            }
        }
        self.path = facts.path;
        let chosen = chosen.into_iter();
        self.selected_out = chosen
            .map(|(press, why)| SelectedOut { press, why })
            .collect();
    }

    fn facts(
        &self,
        field: &Field,
        look_up: &dyn Fn(&str) -> Result<SessionFacts, SessionFault>,
        out: &mut Collector,
    ) -> Option<SessionFacts> {
        let (file, hash) = (field.at("file"), field.at("content_sha256"));
        match look_up(&self.file) {
            Ok(facts) if facts.content_sha256.as_ref() == Some(&self.content_sha256) => {
                return Some(facts);
            }
            Ok(facts) => {
                out.error(
                    hash.span,
                    hash.path.as_str(),
                    "the session has another content",
                )
                .expected(format!("the hash of the content of {}", quote(&self.file)))
                .found(match &facts.content_sha256 {
                    Some(other) => format!("a session with the content {other}"),
                    None => "a session without a seal".to_owned(),
                })
                .help(format!(
                    "restore the file, or name {} in a new selection with `skinrig select`",
                    facts.path.display()
                ));
            }
            Err(SessionFault::Missing) => {
                out.error(file.span, file.path.as_str(), "the session is missing")
                    .expected("a session file, from the folder of the selection or beside it")
                    .found(quote(&self.file))
                    .help("copy the session beside the selection");
            }
            Err(SessionFault::Unreadable(why)) => {
                out.error(file.span, file.path.as_str(), "the session cannot be read")
                    .expected("a readable session")
                    .found(why);
            }
        }
        None
    }
}

impl PressChoice {
    fn why(&self) -> SelectionReason {
        SelectionReason {
            reason: self.reason.clone(),
            decided_by: self.decided_by.clone(),
        }
    }

    /// The presses with the place of each in the text. Reports presses that do not exist, and sync presses.
    fn presses(
        &self,
        field: &Field,
        roles: &[PressRole],
        out: &mut Collector,
    ) -> Vec<(PressId, NumberSpan)> {
        let path = format!("{}.presses", field.path);
        let mut presses = Vec::new();
        for span in &self.presses.0 {
            if span.last as usize > roles.len() {
                out.error(span.span, path.as_str(), "the session has no such press")
                    .expected(format!("numbers from 1 to {}", roles.len()))
                    .found(match span.first == span.last {
                        true => format!("`{}`", span.first),
                        false => format!("`{}-{}`", span.first, span.last),
                    });
                continue;
            }
            let found = (span.first - 1..span.last).map(PressId::from_index);
            let sync = |p: &PressId| roles.get(p.index() as usize) == Some(&PressRole::Sync);
            if let Some(press) = found.clone().find(sync) {
                out.error(
                    span.span,
                    path.as_str(),
                    "a sync press aligns the clocks and never scores",
                )
                .expected("other presses")
                .found(press.to_string());
            }
            presses.extend(found.filter(|p| !sync(p)).map(|press| (press, *span)));
        }
        presses
    }
}

/// All presses but sync presses.
fn excludable(roles: &[PressRole]) -> impl Iterator<Item = PressId> {
    let all = (0u32..).zip(roles);
    let others = all.filter(|(_, role)| **role != PressRole::Sync);
    others.map(|(index, _)| PressId::from_index(index))
}

/// Reports sessions that are named twice.
fn each_content_once(sessions: &[SelectedSession], fields: &[Field], out: &mut Collector) {
    let mut seen = BTreeMap::new();
    for (session, field) in sessions.iter().zip(fields) {
        if let Some(before) = seen.insert(&session.content_sha256, &session.file) {
            let at = field.at("content_sha256");
            out.error(at.span, at.path.as_str(), "the session is selected twice")
                .expected("each session once")
                .found(format!("the content of {}", quote(before)));
        }
    }
}

/// A SHA-256 as 64 lower-case hex digits.
fn digest(field: &Field, out: &mut Collector) -> Option<String> {
    let text = field.as_text()?;
    let hex = |c: char| c.is_ascii_digit() || ('a'..='f').contains(&c);
    if text.len() == 64 && text.chars().all(hex) {
        return Some(text.to_owned());
    }
    out.error(field.span, field.path.as_str(), "not a hash")
        .expected("64 digits of 0-9 and a-f, as `skinrig select` writes them")
        .found(quote(text));
    None
}

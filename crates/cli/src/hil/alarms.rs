//! Preserves the golden session of a night that raised an alarm, beside the history, so that old nights can be deleted.

use std::io;
use std::path::{Path, PathBuf};

use skinrig_hil::history;
use skinrig_hil::night_folder;
use skinrig_nightly::trend::{Alarm, Report};
use skinrig_recorder::{RecorderError, SessionReader};
use skinrig_report::trend::Links;

use crate::paths::shell_word;

/// Why the session of an alarm is missing.
#[derive(Debug, thiserror::Error)]
pub(crate) enum MissingEvidence {
    /// The night has no golden session.
    #[error("that night has no golden session")]
    NoGolden,
    /// The session is not sealed.
    #[error("{} is not sealed", session.display())]
    Unsealed {
        /// The session.
        session: PathBuf,
    },
    /// The folder of the night is not on this computer, or has no such file.
    #[error("{session}: not on this computer")]
    Elsewhere {
        /// The session.
        session: String,
    },
    /// The session cannot be read.
    #[error(transparent)]
    Session(#[from] RecorderError),
    /// The session cannot be copied.
    #[error("{}: {source}", to.display())]
    Copy {
        /// The copy.
        to: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
}

/// Files that belong to an alarm.
#[derive(Debug)]
pub(crate) struct AlarmEvidence {
    /// Folder of the history.
    home: PathBuf,
    /// Page of the night that raised it.
    page: Option<PathBuf>,
    /// Golden session of that night.
    pub session: Result<PathBuf, MissingEvidence>,
}

/// Copies the session of every alarm to `alarms/NIGHT/` beside the history, unless it is there
/// already. Returns one entry per alarm.
pub(super) fn keep(history: &Path, report: &Report) -> Vec<AlarmEvidence> {
    let preserve = |alarm: &Alarm| {
        let night = &report.nights[alarm.raised];
        let home = history::folder_of(history, &night.folder);
        let page = home.join(night_folder::PAGE);
        let evidence_folder = history::folder_of(history, "alarms").join(file_name_part(&alarm.id));
        let session = match &night.golden {
            Some(golden) => copy(&home.join(golden), &evidence_folder),
            None => Err(MissingEvidence::NoGolden),
        };
        AlarmEvidence {
            home: history::folder_of(history, ""),
            page: page.is_file().then_some(page),
            session,
        }
    };
    report.alarms.iter().map(preserve).collect()
}

/// Looks for the session of every alarm in the folder of its night, which may be on another computer. Returns one entry per alarm.
pub(super) fn find(report: &Report) -> Vec<AlarmEvidence> {
    let look = |alarm: &Alarm| {
        let night = &report.nights[alarm.raised];
        let home = PathBuf::from(&night.folder);
        let page = home.join(night_folder::PAGE);
        let session = match night.golden.as_ref().map(|golden| home.join(golden)) {
            None => Err(MissingEvidence::NoGolden),
            Some(session) if session.is_file() => Ok(session),
            Some(session) => Err(MissingEvidence::Elsewhere {
                session: session.display().to_string(),
            }),
        };
        AlarmEvidence {
            page: page.is_file().then_some(page),
            session,
            home,
        }
    };
    report.alarms.iter().map(look).collect()
}

/// Links or copies a sealed session into `folder`, unless it is there already.
fn copy(session: &Path, folder: &Path) -> Result<PathBuf, MissingEvidence> {
    let name = session.file_name().unwrap_or_default();
    let to = folder.join(name);
    if to.is_file() {
        return Ok(to);
    }
    if SessionReader::open(session)?.seal()?.is_none() {
        return Err(MissingEvidence::Unsealed {
            session: session.to_owned(),
        });
    }
    let part = folder.join("part");
    let copied = std::fs::create_dir_all(folder).and_then(|()| {
        std::fs::hard_link(session, &to).or_else(|_| {
            std::fs::copy(session, &part)?;
            std::fs::rename(&part, &to)
        })
    });
    match copied {
        Ok(()) => Ok(to),
        Err(source) => Err(MissingEvidence::Copy { to, source }),
    }
}

/// Converts `id` to a safe file name.
fn file_name_part(id: &str) -> String {
    let safe = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
    let name: String = id.chars().map(|c| if safe(c) { c } else { '-' }).collect();
    name.trim_start_matches('.').to_owned()
}

impl AlarmEvidence {
    /// Links for a page in `folder`; without a folder, no links to files.
    pub(super) fn links(&self, folder: Option<&Path>) -> Links {
        let session = self.session.as_ref().ok();
        let commands = session.map_or_else(Vec::new, |path| {
            let path = shell_word(&path.display().to_string());
            vec![
                format!("skinrig run --replay {path}"),
                format!("skinrig verify {path}"),
            ]
        });
        let href = |path: &Path| folder.map(|folder| href(&self.home, folder, path));
        Links {
            night: self.page.as_deref().and_then(href),
            session: session.and_then(|p| href(p)),
            commands,
            missing: self.session.as_ref().err().map(ToString::to_string),
        }
    }
}

/// Link to `path` from a page in `folder`: relative if `path` is below `folder` or both are in `home`, so that they can be moved
/// together.
fn href(home: &Path, folder: &Path, path: &Path) -> String {
    let full = |p: &Path| {
        let p = if p.as_os_str().is_empty() {
            Path::new(".")
        } else {
            p
        };
        std::fs::canonicalize(p).unwrap_or_else(|_| p.to_owned())
    };
    let (home, folder, path) = (full(home), full(folder), full(path));
    let (scheme, path) = match (path.strip_prefix(&folder), folder.strip_prefix(&home)) {
        (Ok(below), _) => ("", below.to_owned()),
        (Err(_), Ok(down)) if path.starts_with(&home) => {
            let up: PathBuf = down.components().map(|_| "..").collect();
            ("", up.join(path.strip_prefix(&home).unwrap_or(&path)))
        }
        (Err(_), _) => ("file://", path),
    };
    let plain = |b: u8| b.is_ascii_alphanumeric() || b"-_./~".contains(&b);
    let text = path.display().to_string();
    let each = text.bytes().map(|b| {
        if plain(b) {
            char::from(b).to_string()
        } else {
            format!("%{b:02X}")
        }
    });
    scheme.to_owned() + &each.collect::<String>()
}

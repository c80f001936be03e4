//! Moves sessions into a store and back, and refers to those that are there.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use serde::Serialize;
use skinrig_objects::{ObjectUrl, Store, StoreError, connect};
use skinrig_recorder::{
    SESSION_SUFFIX, SessionReader, SessionReference, copy_session, reference_to, verify, writer_of,
};
use skinrig_results::Rescan;

use super::args::{StoreArgs, StoreCommand, StoreLinkArgs, StorePutArgs};
use crate::catalogue::automatic;
use crate::exit::{Exit, Failure, Outcome};
use crate::paths::{beside, file_name, shell_path};
use crate::phase::Phase;
use crate::whole_file;

/// What became of a session.
#[derive(Debug, Serialize)]
struct Moved {
    session: PathBuf,
    url: String,
    bytes: u64,
    /// False if there was nothing to do.
    changed: bool,
}

/// `skinrig store`.
pub(super) fn store(args: &StoreArgs, json: bool) -> Outcome {
    match &args.command {
        StoreCommand::Put(a) => {
            let (store, to) = (open()?, address(&a.to)?);
            each(&a.sessions, json, &mut |session| {
                put(&store, a, &to, session)
            })
        }
        StoreCommand::Get(a) => each(&a.sessions, json, &mut get),
        StoreCommand::Link(a) => link(a, json),
    }
}

fn open() -> Result<Arc<Store>, Failure> {
    connect(std::env::vars()).map_err(failure)
}

fn address(text: &str) -> Result<ObjectUrl, Failure> {
    ObjectUrl::parse(text).map_err(Failure::input)
}

/// Bad input, unless the store or the disk failed.
fn failure(error: StoreError) -> Failure {
    match error {
        StoreError::Store { .. } | StoreError::File { .. } | StoreError::Start(_) => {
            Failure::internal(error)
        }
        other => Failure::input(other),
    }
}

/// Does `work` for each session, prints what became of it, and goes on after a failure.
fn each<S: AsRef<Path>>(
    sessions: &[S],
    json: bool,
    work: &mut dyn FnMut(&Path) -> Result<Moved, Failure>,
) -> Outcome {
    let mut done = Vec::new();
    let mut failures: Vec<Failure> = Vec::new();
    for session in sessions {
        match work(session.as_ref()) {
            Ok(moved) => {
                if moved.changed {
                    automatic::register(&moved.session);
                }
                if !json {
                    print(&moved);
                }
                done.push(moved);
            }
            Err(failure) => {
                errln!("{}", failure.message);
                failures.push(failure);
            }
        }
    }
    if json {
        crate::terminal::print_json(&serde_json::json!({ "sessions": done }));
    }
    match failures.first() {
        None => Ok(Exit::Ok),
        Some(first) => Err(Failure {
            exit: first.exit,
            message: format!(
                "error: {} of {} sessions stay as they are\n  next: fix what is named above, then repeat the command",
                failures.len(),
                sessions.len()
            ),
            is_damage: false,
        }),
    }
}

fn print(moved: &Moved) {
    let megabytes = moved.bytes as f64 / 1e6;
    let what = if moved.changed { "" } else { "  (unchanged)" };
    outln!(
        "{}  {megabytes:.1} MB  {}{what}",
        moved.session.display(),
        moved.url
    );
}

fn put(
    store: &Store,
    args: &StorePutArgs,
    to: &ObjectUrl,
    session: &Path,
) -> Result<Moved, Failure> {
    let name = file_name(session);
    let shown = session.display();
    if let Some(known) = SessionReference::of(session).map_err(Failure::session)? {
        let url = to.join(&name).to_string();
        if known.url != url {
            return Err(Failure::input(format!(
                "{shown}: expected the file of a session, found a reference to {}, not to {url}\n  next: `skinrig store get {}` fetches it, \
                 then repeat the command",
                known.url,
                shell_path(session)
            )));
        }
        return Ok(Moved {
            session: session.to_owned(),
            url,
            bytes: known.bytes,
            changed: false,
        });
    }
    if !name.ends_with(SESSION_SUFFIX) {
        return Err(Failure::input(format!(
            "{shown}: expected a name that ends with `{SESSION_SUFFIX}`, found another\n  next: rename the file"
        )));
    }
    if let Some(writer) = writer_of(session) {
        return Err(Failure::input(format!(
            "{shown}: expected a session that has ended, found one that {writer} is recording\n  next: repeat the command afterwards"
        )));
    }
    let reader = SessionReader::open(session).map_err(Failure::session)?;
    let id = reader.session_id().map_err(Failure::session)?;
    let Some(seal) = reader.seal().map_err(Failure::session)? else {
        return Err(Failure::input(format!(
            "{shown}: expected a sealed session, found one that is not finished\n  next: `skinrig resume {}` seals it",
            shell_path(session)
        )));
    };
    drop(reader);
    // A damaged one could not be fetched back, and `skinrig salvage` needs its file.
    let report = verify::<Rescan>(session).map_err(Failure::session)?;
    if let Some(problem) = report.problems.first() {
        return Err(Failure::input(format!(
            "{shown}: expected a sound session, found a damaged one: {problem}\n  next: `skinrig verify {}` lists the damage, \
             `skinrig salvage` copies the intact part",
            shell_path(session)
        )));
    }
    let url = to.join(&name);
    let sent = Arc::new(AtomicU64::new(0));
    let phase = Phase::reading(
        &format!("sending {name}, and reading it back"),
        sent.clone(),
    );
    let mut count = |bytes| {
        sent.fetch_add(bytes, Ordering::Relaxed);
    };
    store.send(session, &url, &mut count).map_err(failure)?;
    let reference = reference_to(&url.to_string()).map_err(Failure::session)?;
    drop(phase);
    if (&reference.session_id, &reference.content_sha256) != (&id, &seal.content_sha256()) {
        return Err(Failure::internal(format!(
            "{shown}: expected its own content at {url}, found another; the file stays"
        )));
    }
    if !args.keep {
        let text = reference.text().map_err(Failure::session)?;
        whole_file::write(session, text.as_bytes()).map_err(|e| {
            Failure::internal(format!(
                "{shown}: cannot replace it by a reference: {e}; the file stays"
            ))
        })?;
    }
    Ok(Moved {
        session: session.to_owned(),
        url: reference.url,
        bytes: reference.bytes,
        changed: true,
    })
}

fn get(session: &Path) -> Result<Moved, Failure> {
    let shown = session.display();
    let Some(reference) = SessionReference::of(session).map_err(Failure::session)? else {
        let bytes = std::fs::metadata(session).map(|m| m.len());
        return match bytes {
            Ok(bytes) => Ok(Moved {
                session: session.to_owned(),
                url: String::new(),
                bytes,
                changed: false,
            }),
            Err(e) => Err(Failure::input(format!("{shown}: {e}"))),
        };
    };
    let _phase = Phase::begin(&format!("fetching {}", file_name(session)));
    let fetched = beside(session, ".fetched");
    // Of an earlier command that was killed.
    let _ = std::fs::remove_file(&fetched);
    let done = copy_session(session, &fetched).map_err(Failure::session).and_then(|()| {
        let report = verify::<Rescan>(&fetched).map_err(Failure::session)?;
        if let Some(problem) = report.problems.first() {
            return Err(Failure::input(format!(
                "{shown}: expected the session that was sent to {}, found it damaged: {problem}\n  next: restore the object from a copy, or \
                 copy its intact part into a new session: `skinrig salvage {}`",
                reference.url,
                shell_path(session)
            )));
        }
        std::fs::rename(&fetched, session).map_err(|e| Failure::internal(format!("{shown}: cannot replace the reference: {e}")))
    });
    if done.is_err() {
        let _ = std::fs::remove_file(&fetched);
    }
    done.map(|()| Moved {
        session: session.to_owned(),
        url: reference.url,
        bytes: reference.bytes,
        changed: true,
    })
}

fn link(args: &StoreLinkArgs, json: bool) -> Outcome {
    let (store, from) = (open()?, address(&args.from)?);
    let mut found = store.list(&from).map_err(failure)?;
    found.retain(|object| object.url.key.ends_with(SESSION_SUFFIX));
    if found.is_empty() {
        return Err(Failure::input(format!(
            "{from}: expected sessions, found none\n  next: `skinrig store put SESSION --to {from}` puts one there"
        )));
    }
    std::fs::create_dir_all(&args.to)
        .map_err(|e| Failure::input(format!("{}: {e}", args.to.display())))?;
    let urls: Vec<PathBuf> = found
        .iter()
        .map(|object| object.url.to_string().into())
        .collect();
    each(&urls, json, &mut |url| {
        refer(&args.to, &url.to_string_lossy())
    })
}

/// Writes a reference to the session at `url`, unless it is there.
fn refer(folder: &Path, url: &str) -> Result<Moved, Failure> {
    let url = address(url)?;
    let session = folder.join(url.name());
    let known = SessionReference::of(&session).map_err(Failure::session)?;
    let is_known = known.is_some_and(|known| known.url == url.to_string());
    let reference = reference_to(&url.to_string()).map_err(Failure::session)?;
    if !is_known {
        if session.symlink_metadata().is_ok() {
            return Err(Failure::input(format!(
                "{}: expected no file, or a reference to {url}, found another\n  next: choose another folder with --to",
                session.display()
            )));
        }
        let text = reference.text().map_err(Failure::session)?;
        whole_file::write(&session, text.as_bytes())
            .map_err(|e| Failure::internal(format!("{}: {e}", session.display())))?;
    }
    Ok(Moved {
        session,
        url: reference.url,
        bytes: reference.bytes,
        changed: !is_known,
    })
}

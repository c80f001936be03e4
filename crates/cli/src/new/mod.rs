//! `skinrig new` and `skinrig init`: starter files, which are embedded in the program.

mod files;

use std::fs::{self, OpenOptions};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

pub(crate) use self::files::ProtocolKind;
use self::files::{LAB, PROTOCOL_SCHEMA, StarterFile};
use crate::args::{InitArgs, NewArgs};
use crate::check;
use crate::exit::{Exit, Failure, Outcome};
use crate::paths::shell_path;

/// Outcome of writing a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
enum WriteOutcome {
    /// Created.
    New,
    /// Existing generated file, replaced by the content of this version.
    Updated,
    /// Existing file, unchanged.
    Kept,
}

/// Bytes of both cameras per second of the demonstration, at the published event rates.
pub(crate) fn demo_rate_b_s() -> Option<f64> {
    let demo = ProtocolKind::Demo.file();
    let checked = check::load_text(demo.name(), &demo.content(), &[]).ok()?;
    let summary = checked.plan.summary();
    Some(summary.expected_bytes / summary.duration_s)
}

/// Writes one protocol of a kind, and the schema for editors beside it. Never overwrites a protocol.
///
/// # Errors
/// [`Failure::input`] when the file already exists or cannot be written.
pub(crate) fn new(args: &NewArgs, json: bool) -> Outcome {
    let template = args.kind.file();
    let file = match &args.file {
        Some(file) => file.clone(),
        None => PathBuf::from(template.name()),
    };
    let folder = match file.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    };
    fs::create_dir_all(folder).map_err(|e| unwritable(folder, &e))?;
    if write(&file, template)? == WriteOutcome::Kept {
        return Err(Failure::input(format!(
            "{}: expected a new file, found an existing one\n  next: choose another name, such as `skinrig new {} OTHER.yaml`",
            file.display(),
            args.kind.name(),
        )));
    }
    let mut written = vec![file.clone()];
    let schema = folder.join(PROTOCOL_SCHEMA.name());
    if write(&schema, PROTOCOL_SCHEMA)? != WriteOutcome::Kept {
        written.push(schema);
    }
    if json {
        crate::terminal::print_json(&serde_json::json!({ "files": written }));
        return Ok(Exit::Ok);
    }
    for path in &written {
        outln!("{}", path.display());
    }
    outln!(
        "next: set `operator` and `prototype.id`, then `skinrig check {}`",
        shell_path(&file)
    );
    Ok(Exit::Ok)
}

/// Creates a lab folder: protocols, rig file, suites, schemas, and a folder for sessions. Keeps existing files; updates schemas.
///
/// # Errors
/// [`Failure::input`] when a file cannot be written.
pub(crate) fn init(args: &InitArgs, json: bool) -> Outcome {
    let folder = args.folder.as_path();
    let mut files = Vec::new();
    for file in LAB {
        let path = folder.join(file.path);
        let parent = path.parent().unwrap_or(folder);
        fs::create_dir_all(parent).map_err(|e| unwritable(parent, &e))?;
        files.push((path.clone(), write(&path, *file)?));
    }
    let sessions = folder.join("sessions");
    fs::create_dir_all(&sessions).map_err(|e| unwritable(&sessions, &e))?;
    let count = |what| files.iter().filter(|(_, written)| *written == what).count();
    if json {
        let rows = files
            .iter()
            .map(|(path, written)| serde_json::json!({ "file": path, "written": written }));
        crate::terminal::print_json(&serde_json::json!({ "files": rows.collect::<Vec<_>>() }));
        return Ok(Exit::Ok);
    }
    let skipped = match (count(WriteOutcome::Kept), count(WriteOutcome::Updated)) {
        (0, 0) => String::new(),
        (skipped, updated) => format!(", {updated} updated, {skipped} kept"),
    };
    outln!(
        "{}: {} files written{skipped}",
        folder.display(),
        count(WriteOutcome::New)
    );
    outln!("protocols/       campaigns to copy from; `skinrig new --help` lists them");
    outln!("hil/rigs/        bench.yaml: copy it and fill in what `skinrig devices` shows");
    outln!("hil/             suites of checks: first-contact.yaml, nightly.yaml");
    outln!("sessions/        where recordings go");
    let enter = if folder == Path::new(".") {
        String::new()
    } else {
        format!("cd {} && ", shell_path(folder))
    };
    outln!("next: {enter}skinrig run protocols/demo.yaml");
    Ok(Exit::Ok)
}

/// Creates a missing file; updates a generated one.
fn write(path: &Path, file: StarterFile) -> Result<WriteOutcome, Failure> {
    let content = file.content();
    match OpenOptions::new().write(true).create_new(true).open(path) {
        Ok(mut new) => {
            new.write_all(content.as_bytes())
                .map_err(|e| unwritable(path, &e))?;
            Ok(WriteOutcome::New)
        }
        Err(e) if e.kind() == ErrorKind::AlreadyExists && file.is_generated() => {
            if fs::read(path).is_ok_and(|found| found == content.as_bytes()) {
                return Ok(WriteOutcome::Kept);
            }
            fs::write(path, content.as_bytes()).map_err(|e| unwritable(path, &e))?;
            Ok(WriteOutcome::Updated)
        }
        Err(e) if e.kind() == ErrorKind::AlreadyExists => Ok(WriteOutcome::Kept),
        Err(e) => Err(unwritable(path, &e)),
    }
}

fn unwritable(path: &Path, e: &std::io::Error) -> Failure {
    Failure::input(format!(
        "{}: expected a writable path: {e}\n  next: choose another folder",
        path.display()
    ))
}

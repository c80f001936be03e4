//! `skinrig publish`: an RO-Crate of sessions or a selection, from which every number can be derived again.

mod card;
mod checks;
mod documents;
mod headline;
mod reproduce;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use skinrig_analysis::Analysis;
use skinrig_analysis::result::Estimate;
use skinrig_export::{Folder, METADATA, seal_crate};
use skinrig_protocol::{Publication, Selection};
use skinrig_recorder::{RecorderError, SessionReader};

use self::card::Published;
use self::documents::{ABOUT, SELECTED, description, documents, protocol_file};
use self::headline::{FORMAT, Headline, Number, SelectionEntry, SessionNumbers};
use crate::args::PublishArgs;
use crate::exit::{Exit, Failure, Outcome};
use crate::export;
use crate::paths::{SESSION_SUFFIX, file_name, shell_path, stem};
use crate::results::{self, write};
use crate::selection::{self, SelectedPresses, Target, Targets};
use crate::version::SOFTWARE;
use crate::{analyses, provenance, signature};

pub(crate) use self::reproduce::reproduce;

/// Writes the crate.
///
/// # Errors
/// [`Failure::findings`] for an invalid publication or selection; [`Failure::input`] for a session without a seal;
/// [`Failure::limit`] for an INVALID session; [`Failure::internal`] when a file cannot be written.
pub(crate) fn publish(args: &PublishArgs, json: bool) -> Outcome {
    let about_bytes = read(&args.about)?;
    let name = args.about.display().to_string();
    let about = Publication::parse(&name, &about_bytes).map_err(|f| Failure::findings(&f))?;
    let targets = targets(&args.sessions)?;
    let stems = stems(&targets)?;
    let selection_bytes = match &targets.selection {
        Some(selection) => named_apart(selection, &stems)?,
        None => Vec::new(),
    };
    new_folder(&args.out)?;
    let mut numbers = Vec::new();
    let mut sessions = Vec::new();
    for (target, stem) in targets.sessions.iter().zip(&stems) {
        let (of_session, published) = one_session(&args.out, target, stem)?;
        numbers.push(of_session);
        sessions.push(published);
    }
    let headline = Headline {
        format: FORMAT.0.to_owned(),
        format_version: FORMAT.1,
        software: SOFTWARE.to_owned(),
        selection: targets.selection.as_ref().map(entry),
        sessions: numbers,
    };
    let selection = targets.selection.as_ref().map(|s| (s, &*selection_bytes));
    for (name, bytes) in documents((&about, &about_bytes), selection, &sessions, &headline)? {
        write(&args.out.join(name), &bytes)?;
    }
    seal_crate(&args.out, &description(&about, &headline)).map_err(export::refused)?;
    if let Some(key) = &args.sign {
        signature::sign(key, &args.out.join(METADATA))?;
    }
    print(args, &headline, json);
    Ok(Exit::Ok)
}

fn print(args: &PublishArgs, headline: &Headline, json: bool) {
    let numbers: usize = headline.sessions.iter().map(|s| s.numbers.len()).sum();
    let metadata = args.out.join(METADATA);
    if json {
        crate::terminal::print_json(&serde_json::json!({
            "crate": args.out, "metadata": metadata, "sessions": headline.sessions.len(), "numbers": numbers,
            "software": headline.software, "selection": headline.selection,
        }));
        return;
    }
    if let Some(selection) = &headline.selection {
        outln!(
            "SELECTION `{}` (SHA-256 {})",
            selection.name,
            selection.sha256
        );
    }
    outln!("crate     {}", args.out.display());
    outln!("sessions  {}", headline.sessions.len());
    outln!(
        "numbers   {numbers}, in {}",
        args.out.join(headline::FILE).display()
    );
    outln!("next      `skinrig reproduce {}`", shell_path(&args.out));
}

fn read(path: &Path) -> Result<Vec<u8>, Failure> {
    let next = "`skinrig schema publication` has the keys of the file for --about";
    crate::paths::read_input(path, next)
}

/// Session files, or one selection.
fn targets(arguments: &[PathBuf]) -> Result<Targets, Failure> {
    if let [only] = arguments {
        return selection::sessions(only);
    }
    if let Some(selection) = arguments.iter().find(|a| selection::is_named(a)) {
        return Err(Failure::input(format!(
            "{}: expected session files, or one selection alone\n  next: publish the selection alone",
            selection.display()
        )));
    }
    let sessions = arguments.iter().map(|path| Target {
        path: path.clone(),
        selected: None,
    });
    Ok(Targets {
        selection: None,
        sessions: sessions.collect(),
    })
}

/// Names of the sessions' files in the crate, without endings.
fn stems(targets: &Targets) -> Result<Vec<String>, Failure> {
    let mut seen: BTreeMap<String, &Path> = BTreeMap::new();
    let mut stems = Vec::new();
    for target in &targets.sessions {
        let stem = stem(&target.path);
        if let Some(before) = seen.insert(stem.clone(), &target.path) {
            return Err(Failure::input(format!(
                "{}: expected another file name, found that of {}\n  next: copy one session to a file with another name",
                target.path.display(),
                before.display()
            )));
        }
        stems.push(stem);
    }
    Ok(stems)
}

/// The bytes of the selection's file, whose name no other file of the crate has.
fn named_apart(selection: &Selection, stems: &[String]) -> Result<Vec<u8>, Failure> {
    let name = file_name(Path::new(&selection.file_name));
    let is_protocol = |stem: &String| name == protocol_file(&format!("{stem}.bundle"));
    if name == ABOUT || stems.iter().any(is_protocol) {
        return Err(Failure::input(format!(
            "{}: expected a selection with another name, found that of another file of the crate\n  next: rename it, for example to \
             NAME.selection.yaml",
            selection.file_name
        )));
    }
    read(Path::new(&selection.file_name))
}

fn new_folder(path: &Path) -> Result<(), Failure> {
    let is_empty = std::fs::read_dir(path).map(|mut files| files.next().is_none());
    if path.symlink_metadata().is_ok() && !is_empty.unwrap_or(false) {
        return Err(Failure::input(format!(
            "{}: expected a new or empty folder, found one with files\n  next: choose another with --out",
            path.display()
        )));
    }
    std::fs::create_dir_all(path).map_err(|e| {
        Failure::internal(format!(
            "{}: cannot create: {e}\n  next: choose another folder with --out",
            path.display()
        ))
    })
}

/// Names in a folder, in order.
fn names_in(folder: &Path) -> Result<Vec<String>, Failure> {
    let mut found = Vec::new();
    for file in std::fs::read_dir(folder).map_err(Failure::internal)? {
        let name = file.map_err(Failure::internal)?.file_name();
        found.push(name.to_string_lossy().into_owned());
    }
    found.sort();
    Ok(found)
}

fn entry(selection: &Selection) -> SelectionEntry {
    SelectionEntry {
        file: file_name(Path::new(&selection.file_name)),
        name: selection.name.clone(),
        sha256: selection.sha256.clone(),
    }
}

/// Writes the bundle of a session, its protocol, and its results with the selection.
fn one_session(
    out: &Path,
    target: &Target,
    stem: &str,
) -> Result<(SessionNumbers, Published), Failure> {
    let reader = SessionReader::open_checked(&target.path).map_err(Failure::session)?;
    let header = reader.header().map_err(Failure::session)?;
    let bundle = format!("{stem}.bundle");
    let folder = Folder::new(&out.join(&bundle), stem, false).map_err(export::refused)?;
    export::bundle(&target.path, &reader, &header, &folder)?;
    let session_id = reader.session_id().map_err(Failure::session)?;
    let copy = folder.file(SESSION_SUFFIX);
    let official = official(&copy, &session_id)?;
    let (analysis, without) = match &target.selected {
        None => (official, None),
        Some(selected) => {
            let folder = selected_folder(out, stem, selected)?;
            (
                with_selection(&copy, selected, &folder)?,
                Some(official.scored.rmse_mm),
            )
        }
    };
    if !analysis.is_valid() {
        return Err(Failure::limit(format!(
            "{}: expected a session with usable numbers, found an INVALID one\n  {}\n  next: leave it out; `skinrig export --to bundle` \
             packs it alone",
            target.path.display(),
            analysis.invalid_because().join("\n  ")
        )));
    }
    described(&reader, analysis, without.as_ref(), bundle)
}

/// Description of a session with this analysis in a crate.
fn described(
    reader: &SessionReader,
    analysis: Analysis,
    without: Option<&Estimate>,
    bundle: String,
) -> Result<(SessionNumbers, Published), Failure> {
    let header = reader.header().map_err(Failure::session)?;
    let provenance =
        provenance::provenance(reader, &header, &analysis).map_err(Failure::session)?;
    let numbers = SessionNumbers {
        bundle: bundle.clone(),
        session_id: reader.session_id().map_err(Failure::session)?,
        prototype: header.prototype.clone(),
        content_sha256: content(reader).map_err(Failure::session)?,
        numbers: Number::all(&analysis, without),
    };
    let published = Published {
        bundle,
        provenance,
        protocol_text: header.protocol_text,
        analysis,
    };
    Ok((numbers, published))
}

/// Hash of the seal; empty without one.
fn content(reader: &SessionReader) -> Result<String, RecorderError> {
    let seal = reader.seal()?;
    Ok(seal.map_or_else(String::new, |s| s.content_sha256()))
}

/// The official analysis that was written beside the copy of a session.
fn official(copy: &Path, session_id: &str) -> Result<Analysis, Failure> {
    analyses::stored(copy, session_id, None).ok_or_else(|| {
        Failure::internal(format!(
            "{}: expected the results just written, found others\n  next: publish into another folder",
            copy.display()
        ))
    })
}

/// Folder of the results with a selection.
fn selected_folder(out: &Path, stem: &str, selected: &SelectedPresses) -> Result<Folder, Failure> {
    let stem = format!("{stem}.{}", selected.label());
    Folder::new(&out.join(SELECTED), &stem, false).map_err(export::refused)
}

/// Analyses the copy of a session with its selection and writes results, report and tables. They do not depend on where the crate
/// is.
fn with_selection(
    copy: &Path,
    selected: &SelectedPresses,
    folder: &Folder,
) -> Result<Analysis, Failure> {
    let mut selected = selected.clone();
    selected.name.file = selected.name.file.file_name().unwrap_or_default().into();
    let request = crate::analysis_request::AnalysisRequest {
        selection: Some(&selected),
        ..Default::default()
    };
    let results = results::analyze_shown(copy, request)?;
    let reader = SessionReader::open(copy).map_err(Failure::session)?;
    let header = reader.header().map_err(Failure::session)?;
    export::results_and_tables(&results, &reader, &header, folder)?;
    Ok(results.analysis)
}

//! `skinrig export`: a session's data in other programs' formats.

use std::path::{Path, PathBuf};

use skinrig_analysis::{Analysis, LegStart};
use skinrig_export::{
    CsvFiles, ExportError, Folder, MANIFEST, NpzFile, ParquetFiles, Source, TableName, TableWriter,
};
use skinrig_model::{CameraId, RunHeader};
use skinrig_recorder::{SessionReader, copy_session, tags_path};

use crate::analysis_request::AnalysisRequest;
use crate::args::{ExportArgs, ExportKind, ExportTable};
use crate::exit::{Exit, Failure, Outcome};
use crate::paths::{SESSION_SUFFIX, beside, file_name, shell_path, stem};
use crate::results::{self, Results};
use crate::selection::{self, Target};
use crate::signature;

/// Writes the requested formats and prints the paths of the files.
///
/// # Errors
/// [`Failure::input`] for an unreadable session; [`Failure::internal`] when a file cannot be written; after writing
/// [`Failure::limit`] for the results of an INVALID one.
pub(crate) fn export(args: &ExportArgs, json: bool) -> Outcome {
    let is_bundle = args.kinds.contains(&ExportKind::Bundle);
    let targets = selection::sessions(&args.session)?;
    if is_bundle && targets.selection.is_some() {
        return Err(Failure::input(format!(
            "--to bundle: expected a session, found the selection {}\n  next: `skinrig publish` packs a selection",
            args.session.display()
        )));
    }
    if is_bundle && (args.kinds.len() > 1 || !args.only.is_empty()) {
        return Err(Failure::input(
            "--to bundle: expected no other format and no --only\n  next: use a second `skinrig export` for those",
        ));
    }
    if !is_bundle && args.sign.is_some() {
        return Err(Failure::input(
            "--sign: expected --to bundle, found another format\n  next: add --to bundle, or leave --sign out",
        ));
    }
    let mut documents = Vec::new();
    let all = targets.each(|target| {
        let (folder, written, invalid) = export_one(args, target, is_bundle)?;
        if !json {
            written.iter().for_each(|path| outln!("{}", path.display()));
        }
        documents.push(serde_json::json!({ "folder": folder.path(), "written": written }));
        invalid.map_or(Ok(Exit::Ok), Err)
    });
    if json && !documents.is_empty() {
        targets.print(documents);
    }
    all
}

/// Exports one session; returns the folder, the files, and the failure of an INVALID session whose results are in them.
fn export_one(
    args: &ExportArgs,
    target: &Target,
    is_bundle: bool,
) -> Result<(Folder, Vec<PathBuf>, Option<Failure>), Failure> {
    let reader = SessionReader::open_checked(&target.path).map_err(Failure::session)?;
    let header = reader.header().map_err(Failure::session)?;
    let folder = folder(args, target, if is_bundle { ".bundle" } else { ".export" })?;
    let (written, invalid) = if is_bundle {
        holds_only(&folder, &stem(&target.path))?;
        let (mut written, invalid) = bundle(&target.path, &reader, &header, &folder)?;
        if let Some(key) = &args.sign {
            written.push(signature::sign(key, &folder.path().join(MANIFEST))?);
        }
        (written, invalid)
    } else {
        files(args, target, &reader, &header, &folder)?
    };
    Ok((folder, written, invalid))
}

/// Rejects a folder with files of others: a bundle does not verify with a file that its manifest does not list.
fn holds_only(folder: &Folder, stem: &str) -> Result<(), Failure> {
    let failed = |e| Failure::internal(format!("{}: {e}", folder.path().display()));
    for entry in std::fs::read_dir(folder.path()).map_err(failed)? {
        let name = entry.map_err(failed)?.file_name();
        let name = name.to_string_lossy();
        if !name.starts_with(stem) && !name.starts_with(MANIFEST) {
            return Err(Failure::input(format!(
                "{}: expected a folder for the bundle alone, found {name} there\n  next: name a new folder with --out",
                folder.path().display()
            )));
        }
    }
    Ok(())
}

/// The folder given with `--out`, else one beside the session. Files from a selection carry its label.
fn folder(args: &ExportArgs, target: &Target, ending: &str) -> Result<Folder, Failure> {
    let session = &target.path;
    let path = args.out.clone().unwrap_or_else(|| beside(session, ending));
    // In an untrusted folder a link could lead anywhere.
    if args.out.is_none() && path.is_symlink() {
        return Err(Failure::internal(format!(
            "{}: expected a folder or a new path, found a link\n  next: choose another folder with --out",
            path.display()
        )));
    }
    let mut stem = stem(session);
    if let Some(selected) = &target.selected {
        stem = format!("{stem}.{}", selected.label());
    }
    Folder::new(&path, &stem, args.overwrite).map_err(Failure::internal)
}

pub(crate) fn refused(e: ExportError) -> Failure {
    match e {
        ExportError::Session(e) => Failure::session(e),
        e @ ExportError::OtherContent { .. } => Failure::input(e),
        e => Failure::internal(e),
    }
}

/// The requested tables, small ones first.
fn tables(only: &[ExportTable]) -> Vec<TableName> {
    let is_selected = |table: &TableName| {
        let group = match table {
            TableName::Presses => ExportTable::Presses,
            TableName::Pose => ExportTable::Pose,
            TableName::Results => ExportTable::Results,
            TableName::Events(_) => ExportTable::Events,
        };
        only.is_empty() || only.contains(&group)
    };
    TableName::ALL.into_iter().filter(is_selected).collect()
}

/// Each requested format once.
fn kinds(requested: &[ExportKind]) -> Vec<ExportKind> {
    let all = [
        ExportKind::Parquet,
        ExportKind::Npz,
        ExportKind::Csv,
        ExportKind::Raw,
        ExportKind::Hdf5,
    ];
    let is_selected =
        |kind: &ExportKind| requested.contains(kind) || requested.contains(&ExportKind::All);
    all.into_iter().filter(is_selected).collect()
}

/// Exports all formats except a bundle.
fn files(
    args: &ExportArgs,
    target: &Target,
    reader: &SessionReader,
    header: &RunHeader,
    folder: &Folder,
) -> Result<(Vec<PathBuf>, Option<Failure>), Failure> {
    let (kinds, tables) = (kinds(&args.kinds), tables(&args.only));
    // Report a taken name before an hour of work, not after.
    let endings: Vec<String> = kinds
        .iter()
        .flat_map(|kind| endings(*kind, &tables))
        .collect();
    folder.check_free(&endings).map_err(refused)?;
    let tabular = |kind: &ExportKind| kind.is_tabular();
    let needed = kinds.iter().any(tabular) && tables.iter().any(|t| t.needs_analysis());
    let results = if needed {
        let choices = AnalysisRequest {
            selection: target.selected.as_ref(),
            ..AnalysisRequest::default()
        };
        let found = results::analyze_shown(&target.path, choices);
        Some(found.map_err(without_analysis)?)
    } else {
        None
    };
    let source = Source {
        reader,
        header,
        analysis: results.as_ref().map(analysis_and_legs),
    };
    let mut written = Vec::new();
    for kind in &kinds {
        written.extend(one_kind(*kind, &source, &tables, folder).map_err(refused)?);
    }
    let invalid = results.and_then(|results| invalid(&target.path, &results.analysis));
    Ok((written, invalid))
}

/// The failure of an export with the numbers of an INVALID session; `None` for a valid one.
#[must_use]
pub fn invalid(session: &Path, analysis: &Analysis) -> Option<Failure> {
    (!analysis.is_valid()).then(|| {
        Failure::limit(format!(
            "{0}: INVALID, do not use the exported numbers (`valid` is false in the results): {1}\n  next: `skinrig analyze {on}` says \
             what to mend",
            session.display(),
            analysis.invalid_because().join("; "), on = shell_path(session)))
    })
}

fn analysis_and_legs(results: &Results) -> (&Analysis, &[LegStart]) {
    (&results.analysis, &results.legs)
}

fn without_analysis(failure: Failure) -> Failure {
    Failure {
        message: format!(
            "{}\n  next: `--only events --only pose` needs no analysis",
            failure.message
        ),
        ..failure
    }
}

/// Suffixes of the files.
fn endings(kind: ExportKind, tables: &[TableName]) -> Vec<String> {
    let each = |end: &str| {
        tables
            .iter()
            .map(|t| format!(".{}.{end}", t.name()))
            .collect()
    };
    match kind {
        ExportKind::Parquet => each("parquet"),
        ExportKind::Csv => each("csv"),
        ExportKind::Npz => vec![".npz".to_owned()],
        ExportKind::Raw => CameraId::ALL.map(|c| camera_ending(c, "raw")).into(),
        ExportKind::Hdf5 => CameraId::ALL.map(|c| camera_ending(c, "hdf5")).into(),
        ExportKind::Bundle | ExportKind::All => Vec::new(),
    }
}

fn camera_ending(camera: CameraId, end: &str) -> String {
    format!(".camera{}.{end}", camera.number())
}

fn one_kind(
    kind: ExportKind,
    source: &Source<'_>,
    tables: &[TableName],
    folder: &Folder,
) -> Result<Vec<PathBuf>, ExportError> {
    let all = |to: &mut dyn TableWriter| -> Result<(), ExportError> {
        tables.iter().try_for_each(|table| source.write(*table, to))
    };
    let folder = folder.clone();
    match kind {
        ExportKind::Parquet => {
            let mut to = ParquetFiles::new(folder);
            all(&mut to).map(|()| to.into_paths())
        }
        ExportKind::Csv => {
            let mut to = CsvFiles::new(folder);
            all(&mut to).map(|()| to.into_paths())
        }
        ExportKind::Npz => {
            let mut to = NpzFile::create(folder)?;
            all(&mut to)?;
            Ok(vec![to.finish()?])
        }
        ExportKind::Raw => cameras(&folder, "raw", |camera, path| {
            skinrig_export::write_raw(source.reader, source.header, camera, path)
        }),
        ExportKind::Hdf5 => cameras(&folder, "hdf5", |camera, path| {
            skinrig_export::write_hdf5(source.reader, source.header, camera, path)
        }),
        // A bundle consists of the other formats, and `all` is expanded before.
        ExportKind::Bundle | ExportKind::All => Ok(Vec::new()),
    }
}

/// Writes one file per camera.
fn cameras(
    folder: &Folder,
    end: &str,
    write: impl Fn(CameraId, &Path) -> Result<(), ExportError>,
) -> Result<Vec<PathBuf>, ExportError> {
    let each = CameraId::ALL.into_iter();
    each.map(|camera| folder.write_atomic(&camera_ending(camera, end), |path| write(camera, path)))
        .collect()
}

/// Writes the files of a bundle that follow from the session: all but the session itself and its tags. Returns the failure of an INVALID
/// session, too.
///
/// # Errors
/// [`Failure::input`] for a session that cannot be analysed; [`Failure::internal`] when a file cannot be written.
pub(crate) fn derived(
    session: &Path,
    reader: &SessionReader,
    header: &RunHeader,
    folder: &Folder,
) -> Result<(Vec<PathBuf>, Option<Failure>), Failure> {
    let mut results = results::analyze_shown(session, AnalysisRequest::default())?;
    // Measured on one machine at one time: it does not follow from the session.
    results.tradeoff = None;
    results.scene = None;
    let mut written = documents(&results, folder)?;
    let source = Source {
        reader,
        header,
        analysis: Some(analysis_and_legs(&results)),
    };
    for (kind, tables) in [
        (ExportKind::Raw, &BUNDLED[..]),
        (ExportKind::Parquet, &BUNDLED),
        // No poses as CSV: the table is long and holds only numbers.
        (ExportKind::Csv, &BUNDLED[..2]),
    ] {
        written.extend(one_kind(kind, &source, tables, folder).map_err(refused)?);
    }
    Ok((written, invalid(session, &results.analysis)))
}

/// Writes results and report.
fn documents(results: &Results, folder: &Folder) -> Result<Vec<PathBuf>, Failure> {
    let (json, html) = results::documents(results)?;
    let mut written = Vec::new();
    for (ending, text) in [(".results.json", json), (".report.html", html)] {
        let file = folder.write_atomic(ending, |to| {
            std::fs::write(to, &text).map_err(|e| ExportError::File {
                path: to.to_owned(),
                found: e.to_string(),
            })
        });
        written.push(file.map_err(refused)?);
    }
    Ok(written)
}

/// Writes what an analysis adds to a session: results, report, and the tables of presses and results.
///
/// # Errors
/// [`Failure::internal`] when a file cannot be written.
pub(crate) fn results_and_tables(
    results: &Results,
    reader: &SessionReader,
    header: &RunHeader,
    folder: &Folder,
) -> Result<Vec<PathBuf>, Failure> {
    let mut written = documents(results, folder)?;
    let source = Source {
        reader,
        header,
        analysis: Some(analysis_and_legs(results)),
    };
    for kind in [ExportKind::Parquet, ExportKind::Csv] {
        written.extend(one_kind(kind, &source, &BUNDLED[..2], folder).map_err(refused)?);
    }
    Ok(written)
}

/// The tables of a bundle.
const BUNDLED: [TableName; 3] = [TableName::Presses, TableName::Results, TableName::Pose];
/// Suffix of the file of tags and notes.
pub(crate) const TAGS: &str = ".tags.jsonl";

/// Writes the session, its results, camera streams and tables into a folder that `verify` can check.
///
/// # Errors
/// [`Failure::input`] for a session without a seal; otherwise as [`derived`].
pub(crate) fn bundle(
    session: &Path,
    reader: &SessionReader,
    header: &RunHeader,
    folder: &Folder,
) -> Result<(Vec<PathBuf>, Option<Failure>), Failure> {
    if reader.seal().map_err(Failure::session)?.is_none() {
        return Err(Failure::input(format!(
            "{}: expected a sealed session for a bundle, found one that is still running or was cut off\n  next: `skinrig resume` \
            continues and seals it",
            session.display()
        )));
    }
    let mut names = vec![SESSION_SUFFIX, ".results.json", ".report.html", TAGS]
        .into_iter()
        .map(str::to_owned)
        .collect::<Vec<_>>();
    for kind in [ExportKind::Raw, ExportKind::Parquet, ExportKind::Csv] {
        names.extend(endings(kind, &BUNDLED));
    }
    folder.check_free(&names).map_err(refused)?;
    let copy = |from: &Path, ending: &str| {
        folder.write_atomic(ending, |to| {
            copy_session(from, to).map_err(|e| ExportError::File {
                path: to.to_owned(),
                found: e.to_string(),
            })
        })
    };
    let mut written = vec![copy(session, SESSION_SUFFIX).map_err(refused)?];
    let tags = tags_path(session);
    if tags.is_file() {
        written.push(copy(&tags, TAGS).map_err(refused)?);
    }
    let (files, invalid) = derived(session, reader, header, folder)?;
    written.extend(files);
    let names: Vec<String> = written.iter().map(|path| file_name(path)).collect();
    let session_id = reader.session_id().map_err(Failure::session)?;
    skinrig_export::seal_bundle(
        folder.path(),
        &session_id,
        &header.prototype,
        crate::version::SOFTWARE,
        &names[0],
        &names,
    )
    .map_err(refused)?;
    written.push(folder.path().join(MANIFEST));
    Ok((written, invalid))
}

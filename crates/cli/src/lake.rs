//! `skinrig lake`: adds sessions to a Parquet dataset.

use std::path::{Path, PathBuf};

use chrono::{DateTime, Utc};
use skinrig_analysis::ANALYSIS_VERSION;
use skinrig_export::{Lake, LakeCommit, LakeState, Partition, Source};
use skinrig_model::RunHeader;
use skinrig_recorder::{SessionReader, list};

use crate::analysis_request::AnalysisRequest;
use crate::args::LakeArgs;
use crate::exit::{Exit, Failure, Outcome};
use crate::export;
use crate::results;

/// Outcome for a session.
enum Added {
    Now,
    /// Added again, because this file was missing or damaged.
    Again(PathBuf),
    IsThere,
    /// Not added, and why.
    LeftOut(String),
}

/// Adds each session that is not there yet, and writes damaged ones again.
///
/// # Errors
/// After all others: [`Failure::limit`] if a session is not sealed or INVALID; [`Failure::input`] for one that cannot be read, or that
/// the lake has with another content; [`Failure::internal`] when a file cannot be written.
pub(crate) fn lake(args: &LakeArgs, json: bool) -> Outcome {
    let lake = Lake::new(&args.to);
    let mut rows = Vec::new();
    let (mut added, mut mended, mut there, mut left_out) = (0, 0, 0, 0);
    let mut failed: Option<Failure> = None;
    for path in files(&args.sessions)? {
        // One session that fails does not keep the others out.
        let outcome = add(&lake, &path).unwrap_or_else(|failure| {
            let why = failure.message.trim_start_matches("error: ").to_owned();
            failed.get_or_insert(failure);
            Added::LeftOut(why)
        });
        let (state, why) = match outcome {
            Added::Now => {
                added += 1;
                ("added", None)
            }
            Added::Again(damaged) => {
                mended += 1;
                let why = format!("{} was missing or damaged", damaged.display());
                errln!("{}: written again: {why}", path.display());
                ("written_again", Some(why))
            }
            Added::IsThere => {
                there += 1;
                ("there", None)
            }
            Added::LeftOut(why) => {
                left_out += 1;
                errln!("{}: left out: {why}", path.display());
                ("left_out", Some(why))
            }
        };
        rows.push(serde_json::json!({ "session": path, "state": state, "why": why }));
    }
    if json {
        crate::terminal::print_json(&serde_json::json!({ "lake": args.to, "sessions": rows }));
    } else {
        let again = match mended {
            0 => String::new(),
            n => format!("{n} damaged ones written again, "),
        };
        outln!(
            "{}: {added} sessions added, {again}{there} already there",
            args.to.display()
        );
    }
    if left_out == 0 {
        return Ok(Exit::Ok);
    }
    let summary = format!(
        "{}: {left_out} sessions left out\n  next: mend what the lines above name, and repeat the command; `skinrig resume` seals a session, \
         `skinrig report` explains an INVALID one",
        args.to.display()
    );
    Err(match failed {
        Some(failed) => Failure {
            message: format!("error: {summary}"),
            ..failed
        },
        None => Failure::limit(summary),
    })
}

/// The sessions of the arguments, those of a folder by name.
fn files(arguments: &[PathBuf]) -> Result<Vec<PathBuf>, Failure> {
    let mut files = Vec::new();
    for argument in arguments {
        if argument.is_dir() {
            let mut found: Vec<PathBuf> = list(argument)
                .map_err(Failure::session)?
                .into_iter()
                .map(|session| session.path)
                .collect();
            found.sort();
            files.extend(found);
        } else {
            files.push(argument.clone());
        }
    }
    Ok(files)
}

fn add(lake: &Lake, path: &Path) -> Result<Added, Failure> {
    let reader = SessionReader::open_checked(path).map_err(Failure::session)?;
    let header = reader.header().map_err(Failure::session)?;
    let Some(seal) = reader.seal().map_err(Failure::session)? else {
        return Ok(Added::LeftOut("it is not sealed".to_owned()));
    };
    let commit = LakeCommit {
        session_id: reader.session_id().map_err(Failure::session)?,
        content_sha256: seal.content_sha256(),
        partition: partition(path, &header)?,
    };
    let state = lake.state(&commit).map_err(export::refused)?;
    if state == LakeState::Whole {
        return Ok(Added::IsThere);
    }
    let results = results::analyze_shown(path, AnalysisRequest::default())?;
    if !results.analysis.is_valid() {
        return Ok(Added::LeftOut("it is INVALID".to_owned()));
    }
    let source = Source {
        reader: &reader,
        header: &header,
        analysis: Some((&results.analysis, &results.legs)),
    };
    lake.add(&source, &commit).map_err(export::refused)?;
    Ok(match state {
        LakeState::Damaged(file) => Added::Again(file),
        LakeState::Absent | LakeState::Whole => Added::Now,
    })
}

fn partition(path: &Path, header: &RunHeader) -> Result<Partition, Failure> {
    let started = DateTime::parse_from_rfc3339(&header.started_at).map_err(|e| {
        Failure::input(format!(
            "{}: expected the time of the start, found `{}`: {e}\n  next: `skinrig verify` checks the file",
            path.display(),
            header.started_at
        ))
    })?;
    Ok(Partition {
        analysis: ANALYSIS_VERSION,
        prototype: header.prototype.clone(),
        bench: header.rig_name.clone(),
        day: started.with_timezone(&Utc).format("%Y-%m-%d").to_string(),
    })
}

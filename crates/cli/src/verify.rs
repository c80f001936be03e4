//! `skinrig verify`: a session, or a bundle with one.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use skinrig_export::{BundleReport, Folder, same_bytes, verify_bundle};
use skinrig_recorder::{RecorderError, SessionReader, verify as recheck};

use crate::args::SessionArg;
use crate::exit::{Exit, Failure, Outcome};
use crate::export;
use crate::phase::Phase;
use skinrig_results::Rescan;

/// Recomputes everything in a session, and holds the files of a bundle against its manifest.
///
/// # Errors
/// [`Failure::input`] for a file that is no session and a folder that is no bundle; [`Failure::limit`] when something does not match.
pub(crate) fn verify(args: &SessionArg, json: bool) -> Outcome {
    if args.session.is_dir() {
        return bundle(&args.session, json);
    }
    session(&args.session, json)
}

/// Every file of a bundle, then the session in it.
fn bundle(folder: &Path, json: bool) -> Outcome {
    let mut report = verify_bundle(folder).map_err(Failure::input)?;
    if report.problems.is_empty() {
        let inside = folder.join(&report.session);
        let id = SessionReader::open(&inside).and_then(|reader| reader.session_id());
        let id = id.map_err(Failure::session)?;
        if id != report.session_id {
            let place = &report.session;
            let problem = format!(
                "{place}: expected session {}, found {id}",
                report.session_id
            );
            report.problems.push(problem);
        }
        let session = recheck(&inside, &mut Rescan::default()).map_err(Failure::session)?;
        report.problems.extend(session.problems);
        // A manifest can be written anew, the session's seal not: everything else must follow from it.
        if report.problems.is_empty() {
            report.problems.extend(made_anew(folder, &report)?);
        }
    }
    let (name, problems) = (folder.display(), report.problems.len());
    if json {
        let mut shown = serde_json::to_value(&report).map_err(Failure::internal)?;
        shown["sound"] = (problems == 0).into();
        crate::terminal::print_json(&shown);
    } else {
        for problem in &report.problems {
            outln!("{name}: {problem}");
        }
        if problems == 0 {
            outln!(
                "{name}: sound; session {} is as it was sealed, and the other {} files follow from it",
                report.session_id,
                report.files - 1
            );
            if report.names.iter().any(|n| n.ends_with(export::TAGS)) {
                outln!(
                    "{name}: but for the tags: people wrote them later, and no seal covers them"
                );
            }
        }
    }
    if problems == 0 {
        Ok(Exit::Ok)
    } else {
        Err(Failure::limit(format!(
            "{name}: {problems} problem(s); the bundle is not what was exported"
        )))
    }
}

/// Makes everything that a bundle derives from its session once more, in a folder of its own, and holds the files against that.
fn made_anew(folder: &Path, report: &BundleReport) -> Result<Vec<String>, Failure> {
    let place = scratch()?;
    let found = held_against(folder, report, &place);
    // What is left there is no fault of the bundle.
    let _ = std::fs::remove_dir_all(&place);
    found
}

fn held_against(
    folder: &Path,
    report: &BundleReport,
    place: &Path,
) -> Result<Vec<String>, Failure> {
    let inside = folder.join(&report.session);
    let reader = SessionReader::open(&inside).map_err(Failure::session)?;
    let header = reader.header().map_err(Failure::session)?;
    let stem = crate::paths::beside(&inside, "");
    let stem = stem.file_name().unwrap_or_default().to_string_lossy();
    let scratch = Folder::new(place, &stem, false).map_err(Failure::internal)?;
    let made = export::derived(&inside, &reader, &header, &scratch)?;
    let software = crate::version::SOFTWARE;
    let mut known = BTreeSet::from([report.session.clone(), format!("{stem}{}", export::TAGS)]);
    let mut problems = Vec::new();
    for file in made {
        let name = file
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        let there = folder.join(&name);
        if !report.names.contains(&name) {
            problems.push(format!("{name}: expected this file, found none"));
        } else if !same_bytes(&file, &there).map_err(Failure::internal)? {
            problems.push(format!(
                "{name}: expected what the sealed session gives, found something else; a bundle of another version than \
                 {software} has to be exported again"
            ));
        }
        known.insert(name);
    }
    let unknown = report.names.iter().filter(|name| !known.contains(*name));
    problems.extend(
        unknown
            .map(|name| format!("{name}: expected no such file: the session does not produce it")),
    );
    Ok(problems)
}

/// A new folder for files that are taken away again.
fn scratch() -> Result<PathBuf, Failure> {
    let place = std::env::temp_dir();
    for n in 0..1000 {
        let folder = place.join(format!("skinrig-verify-{}-{n}", std::process::id()));
        match std::fs::create_dir(&folder) {
            Ok(()) => return Ok(folder),
            Err(e) if e.kind() == std::io::ErrorKind::AlreadyExists => {}
            Err(e) => return Err(Failure::internal(format!("{}: {e}", folder.display()))),
        }
    }
    Err(Failure::internal(format!(
        "{}: expected room for a folder, found none",
        place.display()
    )))
}

fn session(path: &Path, json: bool) -> Outcome {
    if let Err(e @ RecorderError::NotASession { .. }) = SessionReader::open(path) {
        return Err(Failure::session(e));
    }
    let phase = Phase::begin("checking every byte");
    let report = recheck(path, &mut Rescan::default()).map_err(Failure::session)?;
    drop(phase);
    let name = path.display();
    if json {
        crate::terminal::print_json(&serde_json::json!({
            "session": path, "sound": report.is_sound(), "sealed": report.sealed,
            "problems": report.problems, "more_problems": report.more_problems, "remarks": report.remarks,
            "totals": report.totals,
        }));
    } else {
        for problem in &report.problems {
            // Some problems name the file themselves.
            let problem = problem
                .strip_prefix(&format!("{name}: "))
                .unwrap_or(problem);
            outln!("{name}: {problem}");
        }
        if report.more_problems > 0 {
            outln!("{name}: and {} more", report.more_problems);
        }
        for remark in &report.remarks {
            outln!("{name}: note: {remark}");
        }
        if let (true, Some(t)) = (report.is_sound(), report.totals) {
            outln!(
                "{name}: sound{}; {} presses, {} events, {} chunks, {:.1} MB of camera bytes, {} pose samples",
                if report.sealed {
                    ", sealed"
                } else {
                    ", but not sealed: camera bytes, poses and counts were checked, not every byte"
                },
                t.presses.planned + t.sync.planned,
                t.cd_events,
                t.chunks,
                t.raw_bytes as f64 / 1e6,
                t.pose_samples
            );
        }
    }
    if report.is_sound() {
        Ok(Exit::Ok)
    } else {
        Err(Failure::limit(format!(
            "{name}: {} problem(s); the file is not what was recorded",
            report.problems.len() as u64 + report.more_problems
        )))
    }
}

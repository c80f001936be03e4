//! `skinrig verify`: checks a session or a bundle.

use std::collections::BTreeSet;
use std::fmt::Display;
use std::path::{Path, PathBuf};

use skinrig_export::{BundleReport, Folder, same_bytes, verify_bundle};
use skinrig_recorder::{
    PressTally, Problem, RecorderError, SessionReader, VerifyReport, verify as recheck,
};

use crate::args::SessionArg;
use crate::exit::{Exit, Failure, Outcome};
use crate::export;
use crate::phase::Phase;
use crate::selection;
use skinrig_results::Rescan;

/// Recomputes everything in a session, and compares the files of a bundle with its manifest.
///
/// # Errors
/// [`Failure::input`] if the file is not a session or the folder is not a bundle; [`Failure::limit`] if something does not match.
pub(crate) fn verify(args: &SessionArg, json: bool) -> Outcome {
    if args.session.is_dir() {
        return bundle(&args.session, json);
    }
    // Reading a selection compares its hashes with the seals; this compares the seals with the content.
    let targets = selection::sessions(&args.session)?;
    let mut documents = Vec::new();
    let all = targets.each(|target| {
        let report = check(&target.path)?;
        let name = target.path.display();
        if json {
            documents.push(document(&target.path, &report));
        } else {
            print(&name, &report);
        }
        outcome(&name, &report)
    });
    if json {
        targets.print(documents);
    }
    all
}

/// Checks every file of a bundle, then its session.
fn bundle(folder: &Path, json: bool) -> Outcome {
    let mut report = verify_bundle(folder).map_err(Failure::input)?;
    if report.problems.is_empty() {
        let inside = folder.join(&report.session);
        let id = SessionReader::open(&inside).and_then(|reader| reader.session_id());
        let id = id.map_err(Failure::session)?;
        if id != report.session_id {
            let expected = format!("session {}", report.session_id);
            report
                .problems
                .push(Problem::new(&report.session, expected, id));
        }
        let session = recheck::<Rescan>(&inside).map_err(Failure::session)?;
        report.more_problems = session.more_problems;
        report
            .problems
            .extend(session.problems.into_iter().map(|problem| Problem {
                place: format!("{}: {}", report.session, problem.place),
                ..problem
            }));
        // A manifest can be forged, the session's seal cannot: everything else must follow from the session.
        if report.problems.is_empty() {
            report
                .problems
                .extend(compare_with_rebuilt(folder, &report)?);
        }
    }
    let name = folder.display();
    let problems = report.problems.len() as u64 + report.more_problems;
    if json {
        let mut shown = serde_json::to_value(&report).map_err(Failure::internal)?;
        shown["sound"] = (problems == 0).into();
        crate::terminal::print_json(&shown);
    } else {
        print_problems(&name, &report.problems, report.more_problems);
        if problems == 0 {
            outln!(
                "{name}: sound; session {} is as it was sealed, and the other {} files follow from it",
                report.session_id,
                report.files - 1
            );
            if report.names.iter().any(|n| n.ends_with(export::TAGS)) {
                outln!("{name}: except the tags, which people added later and no seal covers");
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

/// Derives the files of a bundle from its session again, in a scratch folder, and compares them with the bundle's.
fn compare_with_rebuilt(folder: &Path, report: &BundleReport) -> Result<Vec<Problem>, Failure> {
    let place = scratch()?;
    let found = compare_rebuilt_files(folder, report, &place);
    // Leftovers in the scratch folder are not a fault of the bundle.
    let _ = std::fs::remove_dir_all(&place);
    found
}

fn compare_rebuilt_files(
    folder: &Path,
    report: &BundleReport,
    place: &Path,
) -> Result<Vec<Problem>, Failure> {
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
        let bundled = folder.join(&name);
        if !report.names.contains(&name) {
            problems.push(Problem::new(&name, "this file", "none"));
        } else if !same_bytes(&file, &bundled).map_err(Failure::internal)? {
            problems.push(Problem::new(
                &name,
                "the content that follows from the sealed session",
                format_args!(
                    "other content; a bundle of another version than {software} must be exported again"
                ),
            ));
        }
        known.insert(name);
    }
    let unknown = report.names.iter().filter(|name| !known.contains(*name));
    problems.extend(unknown.map(|name| {
        Problem::new(
            name,
            "only files that follow from the session",
            "another file",
        )
    }));
    Ok(problems)
}

fn print_problems(name: &impl Display, problems: &[Problem], more: u64) {
    for problem in problems {
        outln!("{name}: {problem}");
    }
    if more > 0 {
        outln!("{name}: and {more} more");
    }
}

/// Creates a scratch folder.
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
        "{}: expected to create a scratch folder, found all 1000 names taken",
        place.display()
    )))
}

/// Number of presses made, and of planned ones where they differ.
fn presses(presses: PressTally, sync: PressTally) -> String {
    let made = presses.made() + sync.made();
    let planned = presses.planned + sync.planned;
    if made == planned {
        format!("{made} presses")
    } else {
        format!("{made} of {planned} planned presses")
    }
}

/// Recomputes everything in a session.
fn check(path: &Path) -> Result<VerifyReport, Failure> {
    if let Err(e @ RecorderError::NotASession { .. }) = SessionReader::open(path) {
        return Err(Failure::session(e));
    }
    let _phase = Phase::begin("checking every byte");
    recheck::<Rescan>(path).map_err(Failure::session)
}

fn document(path: &Path, report: &VerifyReport) -> serde_json::Value {
    serde_json::json!({
        "session": path, "sound": report.is_sound(), "sealed": report.sealed,
        "problems": report.problems, "more_problems": report.more_problems, "remarks": report.remarks,
        "totals": report.totals,
    })
}

fn print(name: &impl Display, report: &VerifyReport) {
    print_problems(name, &report.problems, report.more_problems);
    for remark in &report.remarks {
        outln!("{name}: note: {remark}");
    }
    if let (true, Some(t)) = (report.is_sound(), report.totals) {
        outln!(
            "{name}: sound{}; {}, {} events, {} chunks, {:.1} MB of camera bytes, {} pose samples",
            if report.sealed {
                ", sealed"
            } else {
                ", but not sealed: camera bytes, poses and counts were checked, not every byte"
            },
            presses(t.presses, t.sync),
            t.cd_events,
            t.chunks,
            t.raw_bytes as f64 / 1e6,
            t.pose_samples
        );
    }
}

fn outcome(name: &impl Display, report: &VerifyReport) -> Outcome {
    if report.is_sound() {
        Ok(Exit::Ok)
    } else {
        Err(Failure::limit(format!(
            "{name}: {} problem(s); the file is not what was recorded",
            report.problems.len() as u64 + report.more_problems
        )))
    }
}

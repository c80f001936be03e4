//! `skinrig verify`: checks a session or a bundle.

use std::collections::BTreeSet;
use std::fmt::Display;
use std::path::{Path, PathBuf};

use skinrig_analysis::Analysis;
use skinrig_export::{BundleReport, Folder, MANIFEST, same_bytes, verify_bundle};
use skinrig_recorder::{
    PressTally, Problem, RecorderError, SessionReader, VerifyReport, verify as recheck,
};

use crate::analyses;
use crate::args::VerifyArgs;
use crate::exit::{Exit, Failure, Outcome};
use crate::export;
use crate::paths::{SESSION_SUFFIX, file_name, shell_path, stem};
use crate::phase::Phase;
use crate::selection;
use crate::signature;
use skinrig_results::Rescan;

/// Recomputes everything in a session, and compares the files of a bundle with its manifest.
///
/// # Errors
/// [`Failure::input`] if the file is not a session or the folder is not a bundle; [`Failure::limit`] if something does not match.
pub(crate) fn verify(args: &VerifyArgs, json: bool) -> Outcome {
    if args.session.is_dir() {
        return bundle(&args.session, args.signers.as_deref(), json);
    }
    if let Some(signers) = &args.signers {
        return Err(Failure::input(format!(
            "--signers {}: expected the folder of a bundle, found a file\n  next: leave --signers out, or export a bundle with --sign",
            signers.display()
        )));
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
        outcome(&target.path, &report)
    });
    if json {
        targets.print(documents);
    }
    all
}

/// Checks every file of a bundle, then its session.
fn bundle(folder: &Path, signers: Option<&Path>, json: bool) -> Outcome {
    let signature = signature::verify(&folder.join(MANIFEST), signers)?;
    let report = check_bundle(folder, &Scratch::new()?, Derivation::OfIntact)?.report;
    let name = folder.display();
    let problems = report.problems.len() as u64 + report.more_problems;
    if json {
        let mut shown = serde_json::to_value(&report).map_err(Failure::internal)?;
        shown["sound"] = (problems == 0).into();
        shown["signature"] = serde_json::to_value(&signature).map_err(Failure::internal)?;
        crate::terminal::print_json(&shown);
    } else {
        signature.iter().for_each(|s| outln!("{name}: {s}"));
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

/// When to derive the files of a bundle from its session again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Derivation {
    /// If all files are those of the manifest.
    OfIntact,
    /// If the session is intact.
    Always,
}

/// A bundle, and what follows from its session.
pub(crate) struct CheckedBundle {
    pub report: BundleReport,
    /// Hash of the session's seal; empty if the session is damaged.
    pub content_sha256: String,
    /// The official analysis, derived again; `None` if the session is damaged.
    pub analysis: Option<Analysis>,
}

/// Compares a bundle with its manifest, its session with the seal, and the other files with what follows from the session.
///
/// # Errors
/// [`Failure::input`] if the folder is not a bundle.
pub(crate) fn check_bundle(
    folder: &Path,
    scratch: &Scratch,
    derivation: Derivation,
) -> Result<CheckedBundle, Failure> {
    let mut report = verify_bundle(folder).map_err(Failure::input)?;
    let is_intact =
        |report: &BundleReport| report.problems.iter().all(|p| p.place != report.session);
    let mut checked = CheckedBundle {
        content_sha256: String::new(),
        analysis: None,
        report: report.clone(),
    };
    if !is_intact(&report) || (derivation == Derivation::OfIntact && !report.problems.is_empty()) {
        return Ok(checked);
    }
    let inside = folder.join(&report.session);
    let reader = SessionReader::open(&inside).map_err(Failure::session)?;
    let id = reader.session_id().map_err(Failure::session)?;
    let seal = reader.seal().map_err(Failure::session)?;
    drop(reader);
    let mut wrong = Vec::new();
    if id != report.session_id {
        let expected = format!("session {}", report.session_id);
        wrong.push(Problem::new(&report.session, expected, &id));
    }
    let session = recheck::<Rescan>(&inside).map_err(Failure::session)?;
    report.more_problems = session.more_problems;
    wrong.extend(session.problems.into_iter().map(|problem| Problem {
        place: format!("{}: {}", report.session, problem.place),
        ..problem
    }));
    // A manifest can be forged, the session's seal cannot: everything else must follow from the session.
    if wrong.is_empty() {
        let rebuilt = compare_with_rebuilt(folder, &report, scratch)?;
        report.problems.extend(rebuilt);
        let copy = scratch
            .path()
            .join(format!("{}{SESSION_SUFFIX}", stem(&inside)));
        let content = seal.map(|s| s.content_sha256());
        checked.analysis = analyses::stored_of(&copy, (&id, content.as_deref()), None);
        checked.content_sha256 = content.unwrap_or_default();
    }
    report.problems.extend(wrong);
    checked.report = report;
    Ok(checked)
}

/// Derives the files of a bundle from its session again, in the scratch folder, and compares them with the bundle's.
fn compare_with_rebuilt(
    folder: &Path,
    report: &BundleReport,
    place: &Scratch,
) -> Result<Vec<Problem>, Failure> {
    let inside = folder.join(&report.session);
    let reader = SessionReader::open(&inside).map_err(Failure::session)?;
    let header = reader.header().map_err(Failure::session)?;
    let stem = stem(&inside);
    let scratch = Folder::new(place.path(), &stem, false).map_err(Failure::internal)?;
    let (made, _) = export::derived(&inside, &reader, &header, &scratch)?;
    let software = crate::version::SOFTWARE;
    let mut known = BTreeSet::from([report.session.clone(), format!("{stem}{}", export::TAGS)]);
    let mut problems = Vec::new();
    for file in made {
        let name = file_name(&file);
        let bundled = folder.join(&name);
        if report.problems.iter().any(|p| p.place == name) {
            // Already reported: missing or different from the manifest.
        } else if !report.names.contains(&name) {
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

/// A scratch folder, removed at the end.
pub(crate) struct Scratch(PathBuf);

impl Scratch {
    /// Creates a folder with a new name.
    ///
    /// # Errors
    /// [`Failure::internal`] when the folder for temporary files cannot be used.
    pub(crate) fn new() -> Result<Self, Failure> {
        let place = std::env::temp_dir();
        for n in 0..1000 {
            let folder = place.join(format!("skinrig-verify-{}-{n}", std::process::id()));
            match std::fs::create_dir(&folder) {
                Ok(()) => return Ok(Self(folder)),
                Err(e) if e.kind() == std::io::ErrorKind::AlreadyExists => {}
                Err(e) => return Err(Failure::internal(format!("{}: {e}", folder.display()))),
            }
        }
        Err(Failure::internal(format!(
            "{}: expected to create a scratch folder, found all 1000 names taken",
            place.display()
        )))
    }

    pub(crate) fn path(&self) -> &Path {
        &self.0
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        // Leftovers are not a fault of what was checked.
        let _ = std::fs::remove_dir_all(&self.0);
    }
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
    if let Err(e @ (RecorderError::NotASession { .. } | RecorderError::NewerSchema { .. })) =
        SessionReader::open(path)
    {
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

fn outcome(session: &Path, report: &VerifyReport) -> Outcome {
    if report.is_sound() {
        Ok(Exit::Ok)
    } else {
        Err(Failure::limit(format!(
            "{}: {} problem(s); the file is not what was recorded\n  next: restore it from a copy, or copy its intact part into a new \
            session: `skinrig salvage {}`",
            session.display(),
            report.problems.len() as u64 + report.more_problems,
            shell_path(session)
        )))
    }
}

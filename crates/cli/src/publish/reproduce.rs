//! `skinrig reproduce`: compares a crate with its checksums and derives every headline number again.

use std::collections::BTreeMap;
use std::io::Read as _;
use std::path::{Component, Path};

use serde::Serialize;
use skinrig_analysis::Analysis;
use skinrig_export::{Folder, METADATA, same_bytes, verify_crate};

use super::headline::{FILE, FORMAT, Headline, Number, SessionNumbers};
use super::{SELECTED, selected_folder, with_selection};
use crate::args::ReproduceArgs;
use crate::exit::{Exit, Failure, Outcome};
use crate::selection::{self, SelectedPresses};
use crate::signature;
use crate::verify::{self, Derivation, Scratch};
use crate::version::SOFTWARE;

/// Largest file of numbers, bytes.
const MAX_BYTES: u64 = 64 << 20;

/// One comparison.
#[derive(Debug, Serialize)]
struct Check {
    /// What was compared.
    what: String,
    pass: bool,
    expected: String,
    found: String,
}

impl Check {
    fn pass(what: impl Into<String>, found: impl Into<String>) -> Self {
        let found = found.into();
        Self {
            what: what.into(),
            pass: true,
            expected: found.clone(),
            found,
        }
    }

    fn fail(
        what: impl Into<String>,
        expected: impl Into<String>,
        found: impl Into<String>,
    ) -> Self {
        Self {
            what: what.into(),
            pass: false,
            expected: expected.into(),
            found: found.into(),
        }
    }

    fn print(&self) {
        if self.pass {
            outln!("PASS  {}: {}", self.what, self.found);
        } else {
            outln!(
                "FAIL  {}: expected {}, found {}",
                self.what,
                self.expected,
                self.found
            );
        }
    }
}

/// Checks the crate.
///
/// # Errors
/// [`Failure::input`] for a folder that is not a crate of skinrig; [`Failure::limit`] if anything does not match.
pub(crate) fn reproduce(args: &ReproduceArgs, json: bool) -> Outcome {
    let folder = &args.folder;
    let report = verify_crate(folder).map_err(Failure::input)?;
    let headline = headline(folder)?;
    let mut checks = Vec::new();
    let mut add = |check: Check| {
        if !json {
            check.print();
        }
        checks.push(check);
    };
    if !json {
        outln!(
            "{}: published with {}, this is {SOFTWARE}",
            folder.display(),
            headline.software
        );
    }
    match signature::verify(&folder.join(METADATA), args.signers.as_deref()) {
        Ok(None) => {}
        Ok(Some(signature)) => add(Check::pass("signature", signature.to_string())),
        Err(e) if e.is_verdict() => add(Check::fail("signature", "one that counts", e.to_string())),
        Err(e) => return Err(e.into()),
    }
    for problem in &report.problems {
        add(Check::fail(
            &*problem.place,
            &*problem.expected,
            &*problem.found,
        ));
    }
    if report.problems.is_empty() {
        add(Check::pass(
            "checksums",
            format!("{} files", report.files.len()),
        ));
    }
    for bundle in unnamed(folder, &headline)? {
        add(Check::fail(
            bundle,
            "numbers of this session, too",
            "none in the list of numbers",
        ));
    }
    let selected = selected(folder, &headline, &mut add);
    for session in &headline.sessions {
        let presses = selected
            .as_ref()
            .map(|all| all.get(&session.content_sha256));
        check_session(folder, session, presses, &mut add)?;
    }
    let failed = checks.iter().filter(|c| !c.pass).count();
    if json {
        crate::terminal::print_json(&serde_json::json!({
            "crate": folder, "name": report.name, "published_with": headline.software, "this": SOFTWARE,
            "selection": headline.selection, "checks": checks, "reproduced": failed == 0,
        }));
    }
    if failed == 0 {
        return Ok(Exit::Ok);
    }
    let version = match headline.software == SOFTWARE {
        true => "ask the authors for the crate as they published it".to_owned(),
        false => format!("repeat it with {}", headline.software),
    };
    Err(Failure::limit(format!(
        "{}: {failed} of {} checks FAIL\n  next: {version}",
        folder.display(),
        checks.len()
    )))
}

/// Reads the numbers of a crate.
fn headline(folder: &Path) -> Result<Headline, Failure> {
    let path = folder.join(FILE);
    let not = |found: String| {
        Failure::input(format!(
            "{}: expected the numbers of a crate that `skinrig publish` made, found {found}\n  next: any RO-Crate validator checks other crates",
            path.display()
        ))
    };
    let mut text = String::new();
    let is_file = path.symlink_metadata().is_ok_and(|m| m.is_file());
    let file = std::fs::File::open(&path).map_err(|e| not(e.to_string()))?;
    let read = file.take(MAX_BYTES).read_to_string(&mut text);
    read.map_err(|e| not(e.to_string()))?;
    let found: Headline = serde_json::from_str(&text).map_err(|e| not(e.to_string()))?;
    let version = (found.format.as_str(), found.format_version);
    let selection = found.selection.iter().map(|s| s.file.as_str());
    let mut names = found
        .sessions
        .iter()
        .map(|s| s.bundle.as_str())
        .chain(selection);
    match names.find(|name| !is_plain(name)) {
        Some(name) => Err(not(format!("a file outside the folder: {name:?}"))),
        None if version != FORMAT || !is_file => {
            Err(not(format!("{} of version {}", version.0, version.1)))
        }
        None if found.sessions.iter().all(|s| s.numbers.is_empty()) => {
            Err(not("no number".to_owned()))
        }
        None => Ok(found),
    }
}

/// Bundles in the crate of which it states no number.
fn unnamed(folder: &Path, headline: &Headline) -> Result<Vec<String>, Failure> {
    let mut found = Vec::new();
    for file in std::fs::read_dir(folder).map_err(Failure::internal)? {
        let name = file.map_err(Failure::internal)?.file_name();
        let name = name.to_string_lossy().into_owned();
        let mut named = headline.sessions.iter().filter(|s| !s.numbers.is_empty());
        if name.ends_with(".bundle") && !named.any(|s| s.bundle == name) {
            found.push(name);
        }
    }
    found.sort();
    Ok(found)
}

/// True for the name of something directly in the folder.
fn is_plain(name: &str) -> bool {
    let mut parts = Path::new(name).components();
    matches!(
        (parts.next(), parts.next()),
        (Some(Component::Normal(_)), None)
    )
}

/// The selected presses by the hash of the session's content; `None` without a selection, empty for one that does not fit, which
/// is a failed check.
fn selected(
    folder: &Path,
    headline: &Headline,
    add: &mut impl FnMut(Check),
) -> Option<BTreeMap<String, SelectedPresses>> {
    let expected = headline.selection.as_ref()?;
    let found = match selection::sessions(&folder.join(&expected.file)) {
        Ok(found) => found,
        Err(failure) => {
            add(Check::fail(
                "selection",
                expected.sha256.as_str(),
                failure.message,
            ));
            return Some(BTreeMap::new());
        }
    };
    let Some(read) = found.selection else {
        add(Check::fail(
            "selection",
            expected.sha256.as_str(),
            "a session",
        ));
        return Some(BTreeMap::new());
    };
    let what = format!("selection `{}`", expected.name);
    add(
        match (&read.name, &read.sha256) == (&expected.name, &expected.sha256) {
            true => Check::pass(what, format!("SHA-256 {}", read.sha256)),
            false => Check::fail(what, expected.sha256.as_str(), read.sha256),
        },
    );
    let hashes = read.sessions.iter().map(|s| s.content_sha256.clone());
    let presses = found
        .sessions
        .into_iter()
        .filter_map(|target| target.selected);
    Some(hashes.zip(presses).collect())
}

/// Derives the files and numbers of one session again.
fn check_session(
    folder: &Path,
    session: &SessionNumbers,
    selected: Option<Option<&SelectedPresses>>,
    add: &mut impl FnMut(Check),
) -> Result<(), Failure> {
    let name = &session.bundle;
    let scratch = Scratch::new()?;
    let bundle = match verify::check_bundle(&folder.join(name), &scratch, Derivation::Always) {
        Ok(bundle) => bundle,
        Err(failure) => {
            add(Check::fail(name.as_str(), "a bundle", failure.message));
            return not_derived(session, add);
        }
    };
    let problems = bundle.report.problems.iter();
    let problems: Vec<Check> = problems
        .map(|p| Check::fail(format!("{name}: {}", p.place), &*p.expected, &*p.found))
        .collect();
    if problems.is_empty() {
        let files = format!(
            "{} files follow from the sealed session",
            bundle.report.files - 1
        );
        add(Check::pass(name.as_str(), files));
    }
    problems.into_iter().for_each(&mut *add);
    let (true, Some(official)) = (
        bundle.content_sha256 == session.content_sha256,
        bundle.analysis,
    ) else {
        add(Check::fail(
            format!("{name}: session"),
            format!("the content {}", session.content_sha256),
            format!("{}, or damage", bundle.content_sha256),
        ));
        return not_derived(session, add);
    };
    let found = match selected {
        None => Number::all(&official, None),
        Some(None) => return not_derived(session, add),
        Some(Some(presses)) => {
            let copy = folder.join(name).join(&bundle.report.session);
            let analysis = with_selection_again(folder, session, presses, &copy, &scratch, add)?;
            Number::all(&analysis, Some(&official.scored.rmse_mm))
        }
    };
    for number in &session.numbers {
        let what = format!("{name}: {}", number.name());
        add(match number.among(&found) {
            Some(again) if again.is(number) => Check::pass(what, again.text()),
            Some(again) => Check::fail(what, number.text(), again.text()),
            None => Check::fail(what, number.text(), "no such number"),
        });
    }
    for number in found.iter().filter(|n| n.among(&session.numbers).is_none()) {
        let what = format!("{name}: {}", number.name());
        add(Check::fail(what, "no such number", number.text()));
    }
    Ok(())
}

/// Analyses the session with its selection, and compares the files with those in the crate.
fn with_selection_again(
    folder: &Path,
    session: &SessionNumbers,
    presses: &SelectedPresses,
    copy: &Path,
    scratch: &Scratch,
    add: &mut impl FnMut(Check),
) -> Result<Analysis, Failure> {
    let stem = session
        .bundle
        .strip_suffix(".bundle")
        .unwrap_or(&session.bundle);
    let again = selected_folder(scratch.path(), stem, presses)?;
    let analysis = with_selection(copy, presses, &again)?;
    let (mut compared, mut equal) = (0, 0);
    for file in list(&again)? {
        let name = file.file_name().unwrap_or_default();
        let published = folder.join(SELECTED).join(name);
        compared += 1;
        if same_bytes(&file, &published).unwrap_or(false) {
            equal += 1;
        } else {
            let what = format!("{SELECTED}/{}", name.to_string_lossy());
            add(Check::fail(
                what,
                "the content that follows from the session",
                "other content, or none",
            ));
        }
    }
    if equal == compared {
        let what = format!("{}: with the selection", session.bundle);
        add(Check::pass(
            what,
            format!("{equal} files follow from the session"),
        ));
    }
    Ok(analysis)
}

fn list(folder: &Folder) -> Result<Vec<std::path::PathBuf>, Failure> {
    let files = std::fs::read_dir(folder.path()).map_err(Failure::internal)?;
    let mut paths = Vec::new();
    for file in files {
        paths.push(file.map_err(Failure::internal)?.path());
    }
    paths.sort();
    Ok(paths)
}

/// Each number of a session that could not be analysed.
fn not_derived(session: &SessionNumbers, add: &mut impl FnMut(Check)) -> Result<(), Failure> {
    for number in &session.numbers {
        let what = format!("{}: {}", session.bundle, number.name());
        add(Check::fail(
            what,
            number.text(),
            "nothing: the session or its selection cannot be used",
        ));
    }
    Ok(())
}

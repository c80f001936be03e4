//! `skinrig reproduce`: compares a crate with its checksums and derives every headline number again.

use std::collections::BTreeMap;
use std::io::Read as _;
use std::path::{Component, Path};

use skinrig_analysis::Analysis;
use skinrig_export::{METADATA, compare_description, same_bytes, verify_crate};
use skinrig_protocol::{Publication, Selection};
use skinrig_recorder::SessionReader;

use super::card::Published;
use super::checks::{Check, Checks};
use super::documents::{ABOUT, SELECTED, description, documents};
use super::headline::{FILE, FORMAT, Headline, SessionNumbers};
use super::{described, selected_folder, with_selection};
use crate::args::ReproduceArgs;
use crate::exit::{Exit, Failure, Outcome};
use crate::selection::{self, SelectedPresses};
use crate::signature;
use crate::verify::{self, Derivation, Scratch};
use crate::version::SOFTWARE;

/// Largest file of numbers, bytes.
const MAX_BYTES: u64 = 64 << 20;

/// Checks the crate.
///
/// # Errors
/// [`Failure::input`] for a folder that is not a crate of skinrig; [`Failure::limit`] if anything does not match.
pub(crate) fn reproduce(args: &ReproduceArgs, json: bool) -> Outcome {
    let folder = &args.folder;
    let report = verify_crate(folder).map_err(Failure::input)?;
    let headline = headline(folder)?;
    let mut checks = Checks {
        is_quiet: json,
        ..Checks::default()
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
        // A valid signature proves nothing without knowing whose key it is.
        Ok(Some(signature)) if signature.signer.is_none() => {
            if !checks.is_quiet {
                outln!("note  signature: {signature}");
            }
        }
        Ok(Some(signature)) => checks.add(Check::pass("signature", signature.to_string())),
        Err(e) if e.is_verdict() => {
            checks.add(Check::fail("signature", "one that counts", e.to_string()))
        }
        Err(e) => return Err(e.into()),
    }
    report.problems.iter().for_each(|p| checks.fail(p));
    if report.problems.is_empty() {
        checks.add(Check::pass(
            "checksums",
            format!("{} files", report.files.len()),
        ));
    }
    for bundle in unnamed(folder, &headline)? {
        checks.add(Check::fail(
            bundle,
            "numbers of this session, too",
            "none in the list of numbers",
        ));
    }
    let selected = selected(folder, &headline, &mut checks);
    let mut derived = Vec::new();
    for session in &headline.sessions {
        let presses = selected
            .as_ref()
            .map(|(_, all)| all.get(&session.content_sha256));
        derived.extend(check_session(folder, session, presses, &mut checks)?);
    }
    // Documents cannot be derived from anything that failed.
    if checks.failed() == 0 {
        let selection = selected
            .as_ref()
            .and_then(|(selection, _)| selection.as_ref());
        check_documents(folder, &headline, derived, selection, &mut checks)?;
    }
    let failed = checks.failed();
    if json {
        crate::terminal::print_json(&serde_json::json!({
            "crate": folder, "name": report.name, "published_with": headline.software, "this": SOFTWARE,
            "selection": headline.selection, "checks": checks.all, "reproduced": failed == 0,
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
        checks.all.len()
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
    let is_named = |name: &String| {
        let mut named = headline.sessions.iter().filter(|s| !s.numbers.is_empty());
        named.any(|s| s.bundle == *name)
    };
    let mut names = super::names_in(folder)?;
    names.retain(|name| name.ends_with(".bundle") && !is_named(name));
    Ok(names)
}

/// True for the name of something directly in the folder.
fn is_plain(name: &str) -> bool {
    let mut parts = Path::new(name).components();
    matches!(
        (parts.next(), parts.next()),
        (Some(Component::Normal(_)), None)
    )
}

/// A selection, and its presses by the hash of the session's content.
type Selected = (Option<Selection>, BTreeMap<String, SelectedPresses>);

/// `None` without a selection, empty for one that does not fit, which is a failed check.
fn selected(folder: &Path, headline: &Headline, checks: &mut Checks) -> Option<Selected> {
    let expected = headline.selection.as_ref()?;
    let found = match selection::sessions(&folder.join(&expected.file)) {
        Ok(found) => found,
        Err(failure) => {
            checks.add(Check::fail(
                "selection",
                expected.sha256.as_str(),
                failure.message,
            ));
            return Some(Selected::default());
        }
    };
    let Some(read) = found.selection else {
        checks.add(Check::fail(
            "selection",
            expected.sha256.as_str(),
            "a session",
        ));
        return Some(Selected::default());
    };
    let what = format!("selection `{}`", expected.name);
    checks.add(
        match (&read.name, &read.sha256) == (&expected.name, &expected.sha256) {
            true => Check::pass(what, format!("SHA-256 {}", read.sha256)),
            false => Check::fail(what, expected.sha256.as_str(), read.sha256.as_str()),
        },
    );
    let hashes = read.sessions.iter().map(|s| s.content_sha256.clone());
    let presses = found
        .sessions
        .into_iter()
        .filter_map(|target| target.selected);
    let presses = hashes.zip(presses).collect();
    Some((Some(read), presses))
}

/// A session with what a crate states of it.
struct Derived {
    numbers: SessionNumbers,
    published: Published,
    /// Names of its files with the selection.
    selected: Vec<String>,
}

/// Derives the files and numbers of one session again; `None` if that is impossible.
fn check_session(
    folder: &Path,
    session: &SessionNumbers,
    selected: Option<Option<&SelectedPresses>>,
    checks: &mut Checks,
) -> Result<Option<Derived>, Failure> {
    let name = &session.bundle;
    let scratch = Scratch::new()?;
    let bundle = match verify::check_bundle(&folder.join(name), &scratch, Derivation::Always) {
        Ok(bundle) => bundle,
        Err(failure) => {
            checks.add(Check::fail(name.as_str(), "a bundle", failure.message));
            not_derived(session, checks);
            return Ok(None);
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
        checks.add(Check::pass(name.as_str(), files));
    }
    problems.into_iter().for_each(|check| checks.add(check));
    let (true, Some(official)) = (
        bundle.content_sha256 == session.content_sha256,
        bundle.analysis,
    ) else {
        checks.add(Check::fail(
            format!("{name}: session"),
            format!("the content {}", session.content_sha256),
            format!("{}, or damage", bundle.content_sha256),
        ));
        not_derived(session, checks);
        return Ok(None);
    };
    let copy = folder.join(name).join(&bundle.report.session);
    let (analysis, without, selected) = match selected {
        None => (official, None, Vec::new()),
        Some(None) => {
            not_derived(session, checks);
            return Ok(None);
        }
        Some(Some(presses)) => {
            let (analysis, files) =
                with_selection_again(folder, session, presses, &copy, &scratch, checks)?;
            (analysis, Some(official.scored.rmse_mm), files)
        }
    };
    let reader = SessionReader::open(&copy).map_err(Failure::session)?;
    let (numbers, published) = described(&reader, analysis, without.as_ref(), name.clone())?;
    let found = &numbers.numbers;
    for number in &session.numbers {
        let what = format!("{name}: {}", number.name());
        checks.add(match number.among(found) {
            Some(again) if again.is(number) => Check::pass(what, again.text()),
            Some(again) => Check::fail(what, number.text(), again.text()),
            None => Check::fail(what, number.text(), "no such number"),
        });
    }
    for number in found.iter().filter(|n| n.among(&session.numbers).is_none()) {
        let what = format!("{name}: {}", number.name());
        checks.add(Check::fail(what, "no such number", number.text()));
    }
    Ok(Some(Derived {
        numbers,
        published,
        selected,
    }))
}

/// Compares the data card and all other files beside bundles and results with those that follow from the sessions, and the description
/// with what it must state.
fn check_documents(
    folder: &Path,
    headline: &Headline,
    derived: Vec<Derived>,
    selection: Option<&Selection>,
    checks: &mut Checks,
) -> Result<(), Failure> {
    let about_bytes = super::read(&folder.join(ABOUT))?;
    let about = Publication::parse(ABOUT, &about_bytes).map_err(|f| Failure::findings(&f))?;
    let selection_bytes = match &headline.selection {
        Some(entry) => super::read(&folder.join(&entry.file))?,
        None => Vec::new(),
    };
    let selection = selection.map(|s| (s, &*selection_bytes));
    let (mut numbers, mut sessions, mut selected) = (Vec::new(), Vec::new(), Vec::new());
    for session in derived {
        numbers.push(session.numbers);
        sessions.push(session.published);
        selected.extend(session.selected);
    }
    let again = Headline {
        format: FORMAT.0.to_owned(),
        format_version: FORMAT.1,
        sessions: numbers,
        ..headline.clone()
    };
    let files = documents((&about, &about_bytes), selection, &sessions, &again)?;
    for (name, bytes) in &files {
        let found = std::fs::read(folder.join(name)).ok();
        if found.as_ref() != Some(bytes) {
            checks.add(Check::fail(
                name.as_str(),
                "the content that follows from the sessions",
                "other content, or none",
            ));
        }
    }
    for name in super::names_in(folder)? {
        let is_bundle = again.sessions.iter().any(|s| s.bundle == name);
        let is_selected = name == SELECTED && selection.is_some();
        let is_description = name == METADATA || skinrig_export::is_signature(&name);
        if !(files.contains_key(&name) || is_bundle || is_selected || is_description) {
            checks.add(Check::fail(name, "only files of a crate", "another file"));
        }
    }
    if selection.is_some() {
        let mut others = super::names_in(&folder.join(SELECTED))?;
        others.retain(|name| !selected.contains(name));
        for name in others {
            let what = format!("{SELECTED}/{name}");
            checks.add(Check::fail(
                what,
                "only results with the selection",
                "another file",
            ));
        }
    }
    let described = compare_description(folder, &description(&about, &again));
    let described = described.map_err(Failure::internal)?;
    described.iter().for_each(|p| checks.fail(p));
    if checks.failed() == 0 {
        let what = format!(
            "{} files and the description follow from the sessions",
            files.len()
        );
        checks.add(Check::pass("documents", what));
    }
    Ok(())
}

/// Analyses the session with its selection, and compares the files with those in the crate. Returns their names, too.
fn with_selection_again(
    folder: &Path,
    session: &SessionNumbers,
    presses: &SelectedPresses,
    copy: &Path,
    scratch: &Scratch,
    checks: &mut Checks,
) -> Result<(Analysis, Vec<String>), Failure> {
    let stem = session
        .bundle
        .strip_suffix(".bundle")
        .unwrap_or(&session.bundle);
    let again = selected_folder(scratch.path(), stem, presses)?;
    let analysis = with_selection(copy, presses, &again)?;
    let names = super::names_in(again.path())?;
    let mut equal = 0;
    for name in &names {
        let published = folder.join(SELECTED).join(name);
        if same_bytes(&again.path().join(name), &published).unwrap_or(false) {
            equal += 1;
        } else {
            checks.add(Check::fail(
                format!("{SELECTED}/{name}"),
                "the content that follows from the session",
                "other content, or none",
            ));
        }
    }
    if equal == names.len() {
        let what = format!("{}: with the selection", session.bundle);
        checks.add(Check::pass(
            what,
            format!("{equal} files follow from the session"),
        ));
    }
    Ok((analysis, names))
}

/// Each number of a session that could not be analysed.
fn not_derived(session: &SessionNumbers, checks: &mut Checks) {
    for number in &session.numbers {
        let what = format!("{}: {}", session.bundle, number.name());
        checks.add(Check::fail(
            what,
            number.text(),
            "nothing: the session or its selection cannot be used",
        ));
    }
}

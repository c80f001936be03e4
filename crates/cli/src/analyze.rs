//! `skinrig analyze` and `skinrig report`, of a session or of each session of a selection.

use std::path::{Path, PathBuf};

use skinrig_analysis::digits::{self, Digits};
use skinrig_protocol::Selection;
use skinrig_recorder::SessionReader;
use skinrig_report::Variant;

use crate::analyses;
use crate::analysis_request::AnalysisRequest;
use crate::args::{AnalyzeArgs, ReportArgs};
use crate::exit::{Failure, Outcome};
use crate::phase::Phase;
use crate::results::{
    Results, analyze_shown, check_limit, document_with_files, not_official, open, print_results,
    write_shown,
};
use crate::selection::{self, Target};
use crate::terminal::Output;

/// An analysis, and the paths of its results and report.
struct Written {
    results: Results,
    digits: Option<Digits>,
    paths: (PathBuf, PathBuf),
}

/// `skinrig analyze`.
///
/// # Errors
/// See [`analyze_shown`], `write_results`, [`check_limit`]; of a selection the first limit that a session does not meet,
/// after all sessions.
pub(crate) fn analyze(args: &AnalyzeArgs, output: Output) -> Outcome {
    let targets = selection::sessions(&args.session)?;
    let found = targets.sessions.len();
    if args.out.is_some() && found > 1 {
        return Err(several("--out", found));
    }
    let selection = targets.selection.as_ref().filter(|_| !output.json);
    selection
        .iter()
        .for_each(|selection| outln!("{}", headline(selection)));
    let mut documents = Vec::new();
    let limits = targets.each(|target| {
        let written = analyze_one(args, target)?;
        let (results, digits) = (&written.results, written.digits.as_ref());
        if output.json {
            documents.push(document_with_files(results, digits, &written.paths));
        } else {
            selection.iter().for_each(|_| outln!(""));
            print_results(results, digits, output, &written.paths);
        }
        check_limit(results, args.max_rmse)
    });
    if output.json && !documents.is_empty() {
        targets.print(documents);
    }
    limits
}

/// A selection in one or two lines.
fn headline(selection: &Selection) -> String {
    let excluded: usize = selection
        .sessions
        .iter()
        .map(|s| s.selected_out.len())
        .sum();
    format!(
        "selection `{}`: {} session(s), {excluded} press(es) excluded\nSHA-256   {}",
        selection.name,
        selection.sessions.len(),
        selection.sha256
    )
}

/// An option for one session, of a selection of several.
fn several(option: &str, found: usize) -> Failure {
    Failure::input(format!(
        "{option}: expected one session, found a selection of {found}\n  next: leave {option} out; the files are beside each session"
    ))
}

fn analyze_one(args: &AnalyzeArgs, target: &Target) -> Result<Written, Failure> {
    let choices = AnalysisRequest {
        overrides: &args.overrides,
        reference_code: args.reference_code,
        name: args.name.as_deref(),
        calibration_from: args.calibration_from.as_deref(),
        selection: target.selected.as_ref(),
    };
    let own = analyses::results_path(&target.path, None);
    crate::results::check_writable(args.out.as_ref().unwrap_or(&own))?;
    let results = analyze_shown(&target.path, choices)?;
    if let (Some(variant), Some(out)) = (&results.provenance.variant, &args.out) {
        let official = analyses::results_path(&target.path, None);
        not_official(&official, out, variant)?;
    }
    let html = args.out.as_ref().map(|out| out.with_extension("html"));
    let older = replacement_note(&results, args.out.as_deref());
    let paths = write_shown(&results, args.out.as_deref(), html.as_deref())?;
    older.iter().for_each(|note| errln!("{note}"));
    crate::catalogue::automatic::register(&target.path);
    let valid = results.analysis.is_valid();
    if args.digits.is_some() && !valid {
        errln!("note: the session is INVALID: its numbers have no true digits to show");
    }
    let repetitions = args.digits.filter(|_| valid);
    let digits = repetitions.map(|n| true_digits(&target.path, choices, n));
    Ok(Written {
        digits: digits.transpose()?,
        results,
        paths,
    })
}

/// Digits of the results that hold when measured numbers move by one unit in the last place.
fn true_digits(
    path: &Path,
    choices: AnalysisRequest<'_>,
    repetitions: u32,
) -> Result<Digits, Failure> {
    let (aligned, _) = open(path, choices)?;
    let phase = Phase::steps("repeating the analysis", repetitions);
    let each = |finished| phase.step(finished);
    digits::digits(&aligned.input, &aligned.events, repetitions, &each)
        .map_err(|e| Failure::from(skinrig_results::ResultsError::from(e)))
}

/// A note if results of another version of the analysis, or of other settings under the same name, are about to be replaced.
fn replacement_note(results: &Results, out: Option<&Path>) -> Option<String> {
    let name = results.provenance.variant.as_ref().map(|v| v.name.as_str());
    let id = &results.provenance.session_id;
    let before = analyses::summary(&results.session, id, name)
        .ok()
        .filter(|_| out.is_none())?;
    let (then, now) = (before.analysis_version, results.analysis.version);
    if then != now {
        return Some(format!(
            "note: the results of analysis version {then} are replaced by those of version {now}"
        ));
    }
    let changes = |v: &Option<Variant>| v.as_ref().map(Variant::changes_with_selection);
    let (then, now) = (
        changes(&before.variant)?,
        changes(&results.provenance.variant)?,
    );
    (then != now).then(|| {
        format!(
            "note: the variant `{}` of other settings ({then}) is replaced",
            name.unwrap_or_default()
        )
    })
}

/// `skinrig report`.
///
/// # Errors
/// See [`analyze_shown`], `write_results`.
pub(crate) fn report(args: &ReportArgs, json: bool) -> Outcome {
    let targets = selection::sessions(&args.session)?;
    if let (Some(_), Some(name)) = (&targets.selection, &args.analysis) {
        return Err(Failure::input(format!(
            "--analysis {name}: expected a session, found a selection\n  next: leave --analysis out"
        )));
    }
    if args.out.is_some() && targets.sessions.len() > 1 {
        return Err(several("--out", targets.sessions.len()));
    }
    let mut documents = Vec::new();
    let limits = targets.each(|target| {
        let (results, paths) = report_one(args, target)?;
        if !json {
            outln!("{}", paths.1.display());
        }
        documents.push(serde_json::json!({ "report": paths.1, "results": paths.0 }));
        check_limit(&results, None)
    });
    if json && !documents.is_empty() {
        targets.print(documents);
    }
    limits
}

fn report_one(
    args: &ReportArgs,
    target: &Target,
) -> Result<(Results, (PathBuf, PathBuf)), Failure> {
    let variant = match &args.analysis {
        None => None,
        Some(name) => {
            let reader = SessionReader::open(&target.path).map_err(Failure::session)?;
            let id = reader.session_id().map_err(Failure::session)?;
            let variant = analyses::variant(&target.path, &id, name)?;
            without_selection(&variant, "report")?;
            Some(variant)
        }
    };
    let choices = variant
        .as_ref()
        .map_or_else(AnalysisRequest::default, AnalysisRequest::of_variant);
    let choices = AnalysisRequest {
        selection: target.selected.as_ref(),
        ..choices
    };
    let results = analyze_shown(&target.path, choices)?;
    let older = replacement_note(&results, None);
    let paths = write_shown(&results, None, args.out.as_deref())?;
    older.iter().for_each(|note| errln!("{note}"));
    crate::catalogue::automatic::register(&target.path);
    Ok((results, paths))
}

/// Rejects a variant that only its selection can make again; `command` also takes the selection.
pub(crate) fn without_selection(variant: &Variant, command: &str) -> Result<(), Failure> {
    let Some(selection) = &variant.selection else {
        return Ok(());
    };
    Err(Failure::input(format!(
        "analysis `{}`: expected a variant without a selection, found one of {selection}\n  next: name the selection instead of the \
         session: `skinrig {command} {}`",
        variant.name,
        selection.file.display()
    )))
}

//! Analyses a session, writes its results and prints them: for `analyze` and `report`, and as the last step of `run` and `import`.

use std::path::{Path, PathBuf};

use skinrig_analysis::digits::Digits;
use skinrig_analysis::result::LEAST_LOCATED;
use skinrig_analysis::tradeoff::Tradeoff;
use skinrig_analysis::{Analysis, LegStart};
use skinrig_catalogue::results_digest;
use skinrig_report::scene_prediction::ScenePrediction;
use skinrig_report::{Provenance, ReportInput, SelectionEffect, Variant};
use skinrig_results::{AlignedSession, AnalyzedSession, Session};

use crate::analyses;
use crate::analysis_request::AnalysisRequest;
use crate::beside_session::{self, BesideSessionError, SCENE, SessionIdentity, TRADEOFF};
use crate::exit::{Exit, Failure, Outcome};
use crate::phase::Phase;
use crate::terminal::Output;
use crate::whole_file;

/// The results of one session.
pub struct Results {
    /// Path of the session.
    pub session: PathBuf,
    /// The numbers.
    pub analysis: Analysis,
    /// Start of each further leg, as aligned by the analysis.
    pub legs: Vec<LegStart>,
    /// Their provenance.
    pub provenance: Provenance,
    /// The trade-off stored beside the session, or why it cannot be read.
    pub tradeoff: Option<Result<Tradeoff, BesideSessionError>>,
    /// What its scene predicts, stored beside the session, or why it cannot be read.
    pub scene: Option<Result<ScenePrediction, BesideSessionError>>,
}

impl Results {
    /// The input of the report crate.
    #[must_use]
    pub(crate) fn report_input(&self) -> ReportInput<'_> {
        ReportInput {
            analysis: &self.analysis,
            provenance: self.provenance.clone(),
            tradeoff: self
                .tradeoff
                .as_ref()
                .map(|t| t.as_ref().map_err(|e| e as _)),
            scene: self.scene.as_ref().map(|s| s.as_ref().map_err(|e| e as _)),
        }
    }
}

fn variant(choices: AnalysisRequest<'_>) -> Variant {
    let own = || analyses::default_name(choices);
    Variant {
        name: choices.name.map_or_else(own, str::to_owned),
        changed: choices.overrides.to_vec(),
        reference_code: choices.reference_code,
        calibration_from: choices.calibration_from.map(Path::to_owned),
        selection: choices.selection.map(|s| s.name.clone()),
    }
}

/// Opens and aligns a session, with its own settings or others; also returns how the settings differ.
///
/// # Errors
/// [`Failure::input`] for an unreadable session or settings that do not parse.
pub(crate) fn open(
    path: &Path,
    choices: AnalysisRequest<'_>,
) -> Result<(AlignedSession, Option<Variant>), Failure> {
    let session = Session::open(path, choices.of_session())?;
    let changes = session.is_changed || choices.name.is_some() || choices.selection.is_some();
    let variant = changes.then(|| variant(choices));
    Ok((session.read_input()?.align(), variant))
}

/// Analyses a session, with its own settings or others.
///
/// # Errors
/// [`Failure::input`] for an unreadable session or settings that do not parse.
pub fn analyze_session(path: &Path, choices: AnalysisRequest<'_>) -> Result<Results, Failure> {
    let (aligned, variant) = open(path, choices)?;
    let results = complete(path, aligned, variant)?;
    with_effect(results, choices)
}

/// Like [`analyze_session`], with its progress on the terminal.
pub(crate) fn analyze_shown(path: &Path, choices: AnalysisRequest<'_>) -> Result<Results, Failure> {
    let (aligned, variant) = open(path, choices)?;
    let phase = Phase::reading("analysing", aligned.events.bytes_read());
    let results = complete(path, aligned, variant)?;
    drop(phase);
    let _phase = Phase::begin("analysing without the selection");
    with_effect(results, choices)
}

/// Adds what a selection changes: the same analysis without it, without studies.
fn with_effect(mut results: Results, choices: AnalysisRequest<'_>) -> Result<Results, Failure> {
    let Some(selected) = choices.selection else {
        return Ok(results);
    };
    let without = AnalysisRequest {
        selection: None,
        ..choices
    };
    let rmse_without_mm = if selected.out.is_empty() {
        results.analysis.scored.rmse_mm
    } else {
        let (mut aligned, _) = open(&results.session, without)?;
        aligned.input.settings.study_presses = 0;
        aligned.analyze()?.analysis.scored.rmse_mm
    };
    results.provenance.selection = Some(SelectionEffect {
        excluded: selected.out.len() as u32,
        rmse_without_mm,
    });
    Ok(results)
}

fn complete(
    path: &Path,
    aligned: AlignedSession,
    variant: Option<Variant>,
) -> Result<Results, Failure> {
    let AnalyzedSession {
        session,
        legs,
        analysis,
    } = aligned.analyze()?;
    let mut provenance = crate::provenance::provenance(&session.reader, &session.header, &analysis)
        .map_err(Failure::session)?;
    provenance.variant = variant;
    let identity = SessionIdentity::of(&session.reader).map_err(Failure::session)?;
    Ok(Results {
        session: path.to_owned(),
        analysis,
        legs,
        provenance,
        tradeoff: beside_session::read(&TRADEOFF, path, &identity),
        scene: beside_session::read(&SCENE, path, &identity),
    })
}

/// Writes the results beside the session (or to `json_path`) and the report; returns both paths. A variant has its own files.
///
/// # Errors
/// [`Failure::internal`] when a file cannot be written.
pub(crate) fn write_results(
    results: &Results,
    json_path: Option<&Path>,
    html_path: Option<&Path>,
) -> Result<(PathBuf, PathBuf), Failure> {
    let name = results.provenance.variant.as_ref().map(|v| v.name.as_str());
    let (json, html) = documents(results)?;
    let to = |named: Option<&Path>, own: PathBuf, text: &str| match named {
        Some(path) => write_named(path, text.as_bytes()).map(|()| path.to_owned()),
        None => write(&own, text.as_bytes()).map(|()| own),
    };
    let own = analyses::results_path(&results.session, name);
    let json_path = to(json_path, own, &json)?;
    let own = analyses::report_path(&results.session, name);
    Ok((json_path, to(html_path, own, &html)?))
}

/// Like [`write_results`], with its phase on the terminal.
pub(crate) fn write_shown(
    results: &Results,
    json_path: Option<&Path>,
    html_path: Option<&Path>,
) -> Result<(PathBuf, PathBuf), Failure> {
    let _phase = Phase::begin("writing the report");
    write_results(results, json_path, html_path)
}

/// The results as JSON and the report.
///
/// # Errors
/// [`Failure::internal`] when one cannot be generated.
pub(crate) fn documents(results: &Results) -> Result<(String, String), Failure> {
    let input = results.report_input();
    let (json, html) = rayon::join(
        || serde_json::to_string_pretty(&skinrig_report::json(&input)),
        || skinrig_report::html(&input),
    );
    let json = results_digest::with_digest(&json.map_err(Failure::internal)?);
    Ok((json, html))
}

/// Writes a whole file or none: a full disk leaves no partial file.
pub(crate) fn write(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    whole_file::write(path, bytes).map_err(|e| unwritten(path, &e))
}

/// Like [`write`], at the path of an option: never in place of a file of another kind.
///
/// # Errors
/// [`Failure::input`] for such a file; [`Failure::internal`] when it cannot be written.
pub(crate) fn write_named(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    whole_file::write_named(path, bytes).map_err(|e| unwritten(path, &e))
}

/// Tests that the results can be written at `path` before they are computed.
///
/// # Errors
/// As [`write`].
pub(crate) fn check_writable(path: &Path) -> Result<(), Failure> {
    whole_file::probe(path).map_err(|e| unwritten(path, &e))
}

fn unwritten(path: &Path, error: &std::io::Error) -> Failure {
    let next = match error.kind() {
        std::io::ErrorKind::AlreadyExists => {
            let text = format!("{}: {error}\n  next: name another file", path.display());
            return Failure::input(text);
        }
        std::io::ErrorKind::StorageFull => "free some space",
        std::io::ErrorKind::NotFound => "create its folder",
        _ => "make its folder writable, or name another file where the command takes one (--out)",
    };
    Failure::internal(format!(
        "{}: cannot write: {error}\n  next: {next}",
        path.display()
    ))
}

/// The results for programs, with the paths of what was written.
pub(crate) fn document_with_files(
    results: &Results,
    digits: Option<&Digits>,
    paths: &(PathBuf, PathBuf),
) -> serde_json::Value {
    let mut document = skinrig_report::json(&results.report_input());
    document["files"] = serde_json::json!({
        "session": results.session, "results": paths.0, "report": paths.1,
    });
    if let Some(digits) = digits {
        document["digits"] = serde_json::json!(digits);
    }
    document
}

/// Prints the answer, or all figures (`-v`), and the paths of what was written.
/// With the true digits, if they were asked for.
pub(crate) fn print_results(
    results: &Results,
    digits: Option<&Digits>,
    output: Output,
    paths: &(PathBuf, PathBuf),
) {
    if output.json {
        crate::terminal::print_json(&document_with_files(results, digits, paths));
    } else {
        let color = crate::terminal::is_coloured(&std::io::stdout());
        let input = results.report_input();
        let text = if output.verbose {
            skinrig_report::terminal_table(&input, color) + "\n"
        } else {
            skinrig_report::terminal_summary(&input, color)
        };
        crate::terminal::out(format_args!("{text}"));
        if let Some(digits) = digits {
            crate::terminal::out(format_args!("\n{}\n", skinrig_report::digits_text(digits)));
        }
        outln!("session   {}", results.session.display());
        outln!("results   {}", paths.0.display());
        outln!("report    {}", paths.1.display());
        if !output.verbose && results.analysis.is_valid() {
            outln!("next      open the report, or print all figures with -v");
        }
    }
}

/// Ok, or code 4 when the session is INVALID, or the scored RMSE is above the limit, of few presses, or missing.
///
/// # Errors
/// [`Failure::limit`].
pub fn check_limit(results: &Results, max_rmse_mm: Option<f64>) -> Outcome {
    let analysis = &results.analysis;
    if !analysis.is_valid() {
        let next = if analysis.may_calibrate() {
            "see in the report why each press does not count; record what is missing with `skinrig resume` (an import: \
             mend its files and import them again), or undo the rule or the selection that excludes all"
        } else if analysis.alignment.is_usable() {
            "fix what the audit reports (each finding has a next step), then import or analyse again"
        } else {
            "see the alignment certificate in the report; limits are below `analysis.alignment`"
        };
        return Err(Failure::limit(format!(
            "the session is INVALID: do not use its numbers\n  {}\n  next: {next}",
            analysis.invalid_because().join("\n  ")
        )));
    }
    let Some(limit) = max_rmse_mm else {
        return Ok(Exit::Ok);
    };
    let metrics = &analysis.scored;
    if let Some(share) = analysis
        .located_of_scored()
        .filter(|share| *share < LEAST_LOCATED)
    {
        let owed = match analysis.scored_owed() {
            0 => String::new(),
            owed => format!(", as {owed} were never made"),
        };
        return Err(Failure::limit(format!(
            "scored RMSE: expected that of at least half of the scored presses (--max-rmse), found {:.1} %{owed}\n  next: the \
             report says why each press does not count",
            100.0 * share
        )));
    }
    match metrics.rmse_mm.value {
        Some(rmse) if rmse <= limit => Ok(Exit::Ok),
        Some(rmse) => {
            let short = format!("{rmse:.3}");
            // As many digits as tell it from the limit.
            let is_above = short.parse::<f64>().is_ok_and(|found| found > limit);
            let found = if is_above { short } else { rmse.to_string() };
            Err(Failure::limit(format!(
                "scored RMSE: expected at most {limit} mm (--max-rmse), found {found} mm"
            )))
        }
        None => Err(Failure::limit(format!(
            "scored RMSE: expected at most {limit} mm (--max-rmse), found none: no scored press was located"
        ))),
    }
}

/// Rejects `out` if the variant would replace the `official` results.
pub(crate) fn not_official(official: &Path, out: &Path, variant: &Variant) -> Result<(), Failure> {
    let place = |path: &Path| {
        let folder = crate::paths::folder_of(path).canonicalize().ok();
        (folder, path.file_name().map(std::ffi::OsStr::to_owned))
    };
    if place(official) != place(out) {
        return Ok(());
    }
    Err(Failure::input(format!(
        "--out {}: expected another path for the variant `{}`, found that of the official results\n  next: leave --out out",
        out.display(),
        variant.name
    )))
}

//! `skinrig compare`: whether skins are comparable, which one is better, and why.

mod facts;
mod inputs;
mod margins;

use std::path::{Path, PathBuf};

use skinrig_analysis::{Analysis, AnalysisError};
use skinrig_compare::{
    Comparison, Difference, Reanalyses, Session, Subject, compare as compare_skins,
};
use skinrig_model::AnalysisSettings;
use skinrig_recorder::SessionReader;
use skinrig_report::compare as report;

use crate::analyses;
use crate::analysis_request::AnalysisRequest;
use crate::args::CompareArgs;
use crate::exit::{Exit, Failure, Outcome};
use crate::phase::Phase;
use crate::results::{open, write_named};

/// Default file name of the page.
const PAGE: &str = "comparison.html";

/// `skinrig compare`.
///
/// # Errors
/// [`Failure::input`] for an unknown session or prototype, for limits that do not parse, and for skins that are not
/// comparable; [`Failure::internal`] when a file cannot be written.
pub(crate) fn compare(args: &CompareArgs, json: bool) -> Outcome {
    let (found, result) = compared(args)?;
    let blocked = refusal(&result, args);
    let mut document = report::json(&result);
    add_selections(&mut document, &found);
    if blocked.is_none() {
        let page = args.out.clone().unwrap_or_else(|| beside(&found));
        let results = write_page(&result, &document, &page)?;
        if json {
            document["files"] = serde_json::json!({ "page": page, "results": results });
            crate::terminal::print_json(&document);
        } else {
            for skin in &found {
                for selected in &skin.selected {
                    outln!("SELECTION {} {}", skin.subject.letter, selected.line());
                }
            }
            let table =
                report::terminal_table(&result, crate::terminal::is_coloured(&std::io::stdout()));
            crate::terminal::out(format_args!("{table}"));
            outln!("\npage      {}", page.display());
            outln!("results   {}", results.display());
        }
        return Ok(Exit::Ok);
    }
    if json {
        crate::terminal::print_json(&document);
    } else {
        let table =
            report::terminal_table(&result, crate::terminal::is_coloured(&std::io::stdout()));
        crate::terminal::out(format_args!("{table}"));
    }
    Err(Failure::input(blocked.unwrap_or_default()))
}

/// Adds the RMSE with and without a selection.
fn add_selections(document: &mut serde_json::Value, found: &[inputs::SkinSessions]) {
    let all = found.iter().flat_map(|skin| {
        skin.selected.iter().map(|selected| {
            let mut document = selected.document();
            document["skin"] = skin.subject.letter.to_string().into();
            document
        })
    });
    let all: Vec<_> = all.collect();
    if !all.is_empty() {
        document["selections"] = all.into();
    }
}

/// Settings in which two sessions with their stored analyses differ, and the number of settings.
///
/// # Errors
/// If a session cannot be read.
pub(crate) fn fact_differences(
    sides: [(&Path, Option<&str>); 2],
) -> Result<(Vec<Difference>, usize), Failure> {
    let side = |(path, name): (&Path, Option<&str>)| {
        let reader = SessionReader::open_unchanged(path).map_err(Failure::session)?;
        let header = reader.header().map_err(Failure::session)?;
        let facts = facts::facts(path, &reader, &header)?;
        if let Some(name) = name {
            analyses::parse(name).map_err(|e| Failure::input(format!("analysis `{name}`: {e}")))?;
        }
        let analysis = analyses::stored(path, &facts.session_id, name);
        Ok::<_, Failure>((facts, analysis))
    };
    let [(a, one), (b, two)] = [side(sides[0])?, side(sides[1])?];
    Ok(skinrig_compare::fact_differences([
        (&a, one.as_ref()),
        (&b, two.as_ref()),
    ]))
}

/// Compares skins and returns the results as JSON. If `out` names a page, also writes the page and the results file.
///
/// # Errors
/// As [`compare`].
pub(crate) fn document(args: &CompareArgs) -> Result<serde_json::Value, Failure> {
    let (found, result) = compared(args)?;
    if let Some(blocked) = refusal(&result, args) {
        return Err(Failure::input(blocked));
    }
    let mut document = report::json(&result);
    add_selections(&mut document, &found);
    if let Some(page) = &args.out {
        write_page(&result, &document, page)?;
    }
    Ok(document)
}

fn compared(args: &CompareArgs) -> Result<(Vec<inputs::SkinSessions>, Comparison), Failure> {
    let choices = margins::choices(args)?;
    let found = inputs::subjects(args)?;
    let subjects: Vec<Subject> = found.iter().map(|f| f.subject.clone()).collect();
    // Only comparable skins are analysed again.
    let allowed = skinrig_compare::differences(&subjects, &choices.overrides);
    let is_comparable = allowed.iter().all(|d| d.next.is_none() || d.overridden);
    let exchanged = if is_comparable {
        swap_settings(&found)?
    } else {
        Vec::new()
    };
    let phase = Phase::begin("comparing");
    let result = compare_skins(&subjects, &exchanged, &choices);
    drop(phase);
    Ok((found, result))
}

/// Writes the page and, beside it, its results; returns the path of the results.
fn write_page(
    result: &Comparison,
    document: &serde_json::Value,
    page: &Path,
) -> Result<PathBuf, Failure> {
    let results = page.with_extension("json");
    let html = report::html(result);
    let text = serde_json::to_string_pretty(document).map_err(Failure::internal)?;
    write_named(page, html.as_bytes())?;
    write_named(&results, text.as_bytes())?;
    Ok(results)
}

/// Default path of the page: beside the first session.
fn beside(found: &[inputs::SkinSessions]) -> PathBuf {
    let folder = found
        .first()
        .and_then(|f| f.paths.first())
        .map(|p| crate::paths::folder_of(p).to_owned());
    folder.unwrap_or_default().join(PAGE)
}

/// Why the skins are not comparable, and the next step; `None` if they are. Also rejects a `--despite` key that no rule has.
fn refusal(result: &Comparison, args: &CompareArgs) -> Option<String> {
    let lines: Vec<String> = result
        .blocking()
        .map(|d| {
            let values: Vec<String> = result
                .skins
                .iter()
                .zip(&d.values)
                .map(|(skin, value)| format!("{} {value}", skin.letter))
                .collect();
            let next = d
                .next
                .as_deref()
                .unwrap_or("see docs/reference/comparison.md");
            let despite = if d.is_final {
                String::new()
            } else {
                format!(", or override it with --despite {}", d.key)
            };
            format!(
                "{}: {} ({})\n  next: {next}{despite}",
                d.what,
                d.reason,
                values.join(", ")
            )
        })
        .collect();
    if !lines.is_empty() {
        return Some(format!(
            "these skins are not comparable\n  {}",
            lines.join("\n  ")
        ));
    }
    let unknown = args.despite.iter().find(|key| {
        let known = skinrig_compare::RULES.iter().any(|r| r.key == key.as_str());
        !known && !result.differences.iter().any(|d| d.key == key.as_str())
    });
    unknown.map(|key| {
        format!("--despite {key}: expected the key of a blocking difference, found one that no rule has\n  next: leave it out, or see docs/reference/comparison.md")
    })
}

/// For each skin but the first: the first analysed with its settings, and the skin with those of the first; `None` where they
/// agree.
fn swap_settings(found: &[inputs::SkinSessions]) -> Result<Reanalyses, Failure> {
    let Some((first, others)) = found.split_first() else {
        return Ok(Vec::new());
    };
    let own = |f: &inputs::SkinSessions| settings_of(&f.subject);
    others
        .iter()
        .map(|other| match (own(first), own(other)) {
            (Some(a), Some(b)) if !same_numbers(&a, &b) => {
                Ok(Some([reanalyse(first, &b)?, reanalyse(other, &a)?]))
            }
            _ => Ok(None),
        })
        .collect()
}

fn settings_of(subject: &Subject) -> Option<AnalysisSettings> {
    subject
        .sessions
        .first()
        .map(|s| s.analysis.settings.clone())
}

/// True when both settings locate presses alike; studies and intervals do not matter.
fn same_numbers(a: &AnalysisSettings, b: &AnalysisSettings) -> bool {
    let plain = |s: &AnalysisSettings| AnalysisSettings {
        exclude_press_numbers: Vec::new(),
        selected_out: Vec::new(),
        ..only_locating(s.clone())
    };
    plain(a) == plain(b)
}

/// The settings that decide where presses are located; studies are disabled.
fn only_locating(settings: AnalysisSettings) -> AnalysisSettings {
    let plain = AnalysisSettings::default();
    AnalysisSettings {
        study_presses: 0,
        reduction: plain.reduction,
        latency: plain.latency,
        cmre: plain.cmre,
        bits_per_event: plain.bits_per_event,
        within_mm: plain.within_mm,
        failure_penalty_mm: None,
        bootstrap_resamples: 2,
        seed: plain.seed,
        rate_bin_ms: plain.rate_bin_ms,
        ..settings
    }
}

/// Analyses the sessions of a skin with other settings, without studies.
fn reanalyse(
    found: &inputs::SkinSessions,
    settings: &AnalysisSettings,
) -> Result<Subject, Failure> {
    let mut subject = found.subject.clone();
    for (session, path) in subject.sessions.iter_mut().zip(&found.paths) {
        let (aligned, _) = open(path, AnalysisRequest::default())?;
        let (mut input, events) = (aligned.input, aligned.events);
        let own = input.settings.exclude_press_numbers.clone();
        let selected_out = session.analysis.settings.selected_out.clone();
        input.settings = AnalysisSettings {
            exclude_press_numbers: own,
            selected_out,
            seed: settings.seed,
            ..only_locating(settings.clone())
        };
        let analysed: Result<Analysis, AnalysisError> = skinrig_analysis::analyze(&input, &events);
        *session = Session {
            facts: session.facts.clone(),
            analysis: analysed.map_err(|e| Failure::input(format!("{}: {e}", path.display())))?,
        };
    }
    Ok(subject)
}

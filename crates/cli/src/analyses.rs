//! Names and files of analyses. The official one uses the session's own settings; any other is a variant with its own files.

mod stored;
mod summary;

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};
use skinrig_catalogue::{ANALYSIS_MARK, OFFICIAL, RESULTS_SUFFIX};
use skinrig_recorder::{RecorderError, SessionReader};
use skinrig_report::{Summary, Variant};

use crate::analysis_request::AnalysisRequest;
use crate::exit::Failure;
use crate::paths::{beside, folder_of, shell_path, stem};
use crate::selection::SelectedPresses;

pub(crate) use self::stored::{stored, stored_of};
pub(crate) use self::summary::{SummaryError, summary};

/// Longest name, in characters.
const MAX_CHARS: usize = 60;

/// Path of the results of the analysis `name`; `None` is the official one.
pub(crate) fn results_path(session: &Path, name: Option<&str>) -> PathBuf {
    path(session, name, RESULTS_SUFFIX)
}

/// Path of its report.
pub(crate) fn report_path(session: &Path, name: Option<&str>) -> PathBuf {
    path(session, name, ".report.html")
}

/// Path of its trade-off page; the results of the trade-off have the same name with another ending.
pub(crate) fn tradeoff_path(session: &Path, name: Option<&str>) -> PathBuf {
    path(session, name, ".tradeoff.html")
}

/// Path of the page of `scene predict`; its results have the same name with another ending.
pub(crate) fn scene_path(session: &Path) -> PathBuf {
    beside(session, ".scene.html")
}

/// Path of the page of `twin`; its results and its protocol have the same name with other endings.
pub(crate) fn twin_path(session: &Path) -> PathBuf {
    beside(session, ".twin.html")
}

fn path(session: &Path, name: Option<&str>, ending: &str) -> PathBuf {
    match name {
        None => beside(session, ending),
        Some(name) => beside(session, &format!("{ANALYSIS_MARK}{name}{ending}")),
    }
}

/// Invalid name of a variant.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(crate) enum NameError {
    /// The name of the session's own analysis.
    #[error("expected another name: `official` is the analysis with the session's own settings")]
    Official,
    /// Empty, too long, or with other characters than the name may have.
    #[error(
        "expected 1 to {MAX_CHARS} of a-z, 0-9, `.`, `_`, `=`, `-`, a letter or digit first, found `{}`",
        found.escape_debug()
    )]
    Characters {
        /// The text.
        found: String,
    },
}

/// Parses the name of a variant, for `--name` and `--analysis`.
///
/// # Errors
/// [`NameError`] for an invalid name.
pub(crate) fn parse(text: &str) -> Result<String, NameError> {
    let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || "._=-".contains(c);
    let first = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit();
    let fits = text.len() <= MAX_CHARS && text.starts_with(first) && text.chars().all(plain);
    match (fits, text) {
        (true, OFFICIAL) => Err(NameError::Official),
        (true, _) => Ok(text.to_owned()),
        (false, _) => Err(NameError::Characters {
            found: text.to_owned(),
        }),
    }
}

/// Default name of a variant, built from the settings it changes.
pub(crate) fn default_name(choices: AnalysisRequest<'_>) -> String {
    let reference = choices.reference_code.then(|| "reference-code".to_owned());
    let file = choices.calibration_from.and_then(Path::file_name);
    let earlier = file.map(|file| {
        let file = file.to_string_lossy();
        let name = file.split('.').next().unwrap_or_default();
        format!("calibration-from-{name}")
    });
    let words = choices
        .overrides
        .iter()
        .map(|o| o.trim().replacen("analysis.", "", 1));
    let exact = reference
        .into_iter()
        .chain(earlier)
        .chain(choices.selection.map(SelectedPresses::label))
        .chain(words)
        .collect::<Vec<_>>()
        .join("_");
    if parse(&exact).is_ok() {
        return exact;
    }
    // Characters that a file name cannot hold are replaced; a digest keeps similar names distinct.
    let mut name = String::new();
    for c in exact.to_lowercase().chars() {
        let plain = c.is_ascii_alphanumeric() || "._=".contains(c);
        match c {
            c if plain => name.push(c),
            _ if name.ends_with('-') => {}
            _ => name.push('-'),
        }
    }
    let mut name: String = name
        .trim_start_matches(['.', '_', '=', '-'])
        .chars()
        .take(MAX_CHARS - 9)
        .collect();
    if name.is_empty() {
        name.push('x');
    }
    name.push('-');
    for byte in &Sha256::digest(&exact)[..4] {
        // Writing to a string cannot fail.
        let _ = write!(name, "{byte:02x}");
    }
    name
}

/// An analysis stored beside a session.
pub(crate) struct AnalysisFile {
    /// Its name; `None`: the official one.
    pub name: Option<String>,
    /// Its results file.
    pub results: PathBuf,
    /// Its summary, or why there is none.
    pub summary: Result<Summary, SummaryError>,
}

/// The analyses beside a session, the official one first, then by name.
pub(crate) fn all(session: &Path, session_id: &str) -> Vec<AnalysisFile> {
    let listed = |name: Option<String>| AnalysisFile {
        results: results_path(session, name.as_deref()),
        summary: summary(session, session_id, name.as_deref()),
        name,
    };
    let official = results_path(session, None).is_file().then(|| listed(None));
    let stem = format!("{}{ANALYSIS_MARK}", stem(session));
    let entries = std::fs::read_dir(folder_of(session))
        .into_iter()
        .flatten()
        .flatten();
    let mut names: Vec<String> = entries
        .filter_map(|entry| {
            let file = entry.file_name().to_string_lossy().into_owned();
            let name = file.strip_prefix(&stem)?.strip_suffix(RESULTS_SUFFIX)?;
            parse(name).ok()
        })
        .collect();
    names.sort();
    official
        .into_iter()
        .chain(names.into_iter().map(|name| listed(Some(name))))
        .collect()
}

/// Reads what the variant `name` of a session changes.
///
/// # Errors
/// [`Failure::input`] when no variant has that name.
pub(crate) fn variant(session: &Path, session_id: &str, name: &str) -> Result<Variant, Failure> {
    let found = summary(session, session_id, Some(name)).map(|s| s.variant);
    if let Err(why) = &found
        && results_path(session, Some(name)).exists()
    {
        return Err(Failure::input(format!(
            "{0}: expected an analysis named `{name}` of this session, found one that cannot be used: {why}\n  next: `skinrig show {on}` \
             lists what it changes; `skinrig analyze {on} --set KEY=VALUE --name {name}` makes it again",
            session.display(),
            on = shell_path(session)
        )));
    }
    found.ok().flatten().ok_or_else(|| {
        let others: Vec<String> = all(session, session_id).into_iter().filter_map(|a| a.name).collect();
        let there = if others.is_empty() { "none".to_owned() } else { others.join(", ") };
        Failure::input(format!(
            "{0}: expected an analysis named `{name}`, found {there}\n  next: `skinrig analyze {on} --set KEY=VALUE --name {name}` \
             creates it, `skinrig show {on}` lists all",
            session.display(), on = shell_path(session)))
    })
}

/// Hash of the session's content, of its seal; `None` without a seal.
///
/// # Errors
/// If the session cannot be read, or its header is not the sealed one.
fn content_of(session: &Path) -> Result<Option<String>, RecorderError> {
    let reader = SessionReader::open(session)?;
    reader.headline()?;
    Ok(reader.seal()?.map(|seal| seal.content_sha256()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_variant_is_named_after_its_changes() {
        let name = |changed: &[&str], reference| {
            let changed: Vec<String> = changed.iter().map(|c| (*c).to_owned()).collect();
            default_name(AnalysisRequest {
                overrides: &changed,
                reference_code: reference,
                ..AnalysisRequest::default()
            })
        };
        let from = Path::new("lab/skin-7.session.sqlite");
        let earlier = default_name(AnalysisRequest {
            calibration_from: Some(from),
            ..AnalysisRequest::default()
        });
        assert_eq!(earlier, "calibration-from-skin-7");
        assert_eq!(name(&["analysis.min_samples=5"], false), "min_samples=5");
        assert_eq!(name(&[], true), "reference-code");
        assert_eq!(
            name(&["analysis.bin=2px", "analysis.seed=3"], true),
            "reference-code_bin=2px_seed=3"
        );
        // Changes with characters that a name cannot hold still get distinct names.
        let (a, b) = (
            name(&["analysis.eps=5 px"], false),
            name(&["analysis.eps=5/px"], false),
        );
        assert!(
            a.starts_with("eps=5-px-") && b.starts_with("eps=5-px-") && a != b,
            "{a} {b}"
        );
        let long = name(
            &[&format!(
                "analysis.exclude_press_numbers=[{}]",
                "7, ".repeat(50)
            )],
            false,
        );
        for name in [
            a,
            b,
            long,
            name(&["analysis.x=../../etc/passwd"], false),
            name(&["\u{202e}"], false),
        ] {
            assert_eq!(parse(&name).as_ref(), Ok(&name));
        }
    }

    #[test]
    fn files_of_an_analysis_are_beside_the_session() {
        for wrong in [
            "",
            "Official",
            "official",
            ".x",
            "-x",
            "a/b",
            "a b",
            "\u{202e}",
            &"x".repeat(61),
        ] {
            assert!(parse(wrong).is_err(), "{wrong:?}");
        }
        let session = Path::new("s/x.session.sqlite");
        assert_eq!(results_path(session, None), Path::new("s/x.results.json"));
        assert_eq!(
            results_path(session, Some("a")),
            Path::new("s/x.analysis-a.results.json")
        );
        assert_eq!(
            report_path(session, Some("a")),
            Path::new("s/x.analysis-a.report.html")
        );
    }
}

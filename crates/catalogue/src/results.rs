//! Analyses beside a session: their files, and what the catalogue takes from them.

use std::collections::BTreeSet;
use std::io::Read;
use std::path::Path;

use serde::Deserialize;
use serde::de::IgnoredAny;
use skinrig_recorder::SESSION_SUFFIX;

use crate::press::{self, Press, PressEntry};
use crate::results_digest;
use crate::results_error::ResultsError;

/// Precedes the variant's name in its file names.
pub const ANALYSIS_MARK: &str = ".analysis-";
/// Suffix of every results file.
pub const RESULTS_SUFFIX: &str = ".results.json";
/// Name of the official analysis in the catalogue; no variant may have it.
pub const OFFICIAL: &str = "official";
/// Largest results file, bytes.
const MOST_BYTES: u64 = 256 << 20;

/// The name of a session file without [`SESSION_SUFFIX`].
pub(crate) fn stem_of(file: &str) -> &str {
    file.strip_suffix(SESSION_SUFFIX).unwrap_or(file)
}

/// An analysis as the catalogue has it.
#[derive(Debug)]
pub struct AnalysisEntry {
    /// `official`, or the name of a variant.
    pub name: String,
    /// Its figures, or why its results cannot be used.
    pub figures: Result<AnalysisFigures, ResultsError>,
}

/// Figures of an analysis. Fields that its version did not have are empty.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct AnalysisFigures {
    /// Version of the analysis.
    pub version: u32,
    /// Hash of the results.
    pub results_hash: String,
    /// False if the numbers must not be used.
    pub is_valid: bool,
    /// `key=value` of each setting that a variant changes.
    pub changed: Vec<String>,
    /// RMSE of the scored presses, mm, with its 95 % interval and their number.
    pub rmse_mm: EstimateEntry,
    /// Median error, mm.
    pub median_mm: Option<f64>,
    /// 95th percentile of the errors, mm.
    pub p95_mm: Option<f64>,
    /// Mean error along x and y, mm.
    pub bias_mm: [Option<f64>; 2],
    /// Standard deviation between repetitions, mm.
    pub repeat_std_mm: Option<f64>,
    /// RMSE where no press calibrated, mm; `None`: not known.
    pub left_out_rmse_mm: Option<f64>,
    /// Share of scored presses that were located.
    pub located_rate: Option<f64>,
    /// Fits between clocks.
    pub clocks: Vec<ClockEntry>,
    /// Calibration of the cameras.
    pub calibration: Option<CalibrationEntry>,
    /// Its presses, by number; those of the official analysis are registered.
    pub presses: Vec<PressEntry>,
}

/// An estimate with its 95 % interval.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
pub struct EstimateEntry {
    /// `None` if n is too small.
    pub value: Option<f64>,
    /// Lower end of the interval.
    pub low: Option<f64>,
    /// Upper end.
    pub high: Option<f64>,
    /// Number of samples.
    pub n: u32,
}

/// A fit between two clocks.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
pub struct ClockEntry {
    /// The clocks, for example `camera1_from_box`.
    pub map: String,
    /// Relative rate.
    pub drift_ppm: Option<f64>,
    /// RMS of the residuals, µs.
    pub residual_rms_us: Option<f64>,
    /// Largest residual, µs.
    pub residual_max_us: Option<f64>,
    /// Number of ties.
    pub n: u64,
}

/// A calibration of the cameras.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CalibrationEntry {
    /// Fitted model.
    pub model: String,
    /// RMSE of the calibration presses before, mm.
    pub rmse_before_mm: Option<f64>,
    /// After, mm.
    pub rmse_after_mm: Option<f64>,
    /// Number of these presses.
    pub n: u32,
    /// Parameter, value, standard error.
    pub values: Vec<(String, Option<f64>, Option<f64>)>,
}

/// The parts of a results file that the catalogue reads; all others are skipped.
#[derive(Deserialize)]
struct Document {
    analysis: Analysis,
    provenance: Provenance,
    /// Lists of many sessions read it; without it the results are those of an older version.
    summary: Summary,
    valid: bool,
}

/// The part that a list of sessions shows. It does so for those alone that have all of it.
#[derive(Deserialize)]
struct Summary {
    #[serde(rename = "session_id")]
    _session_id: String,
    #[serde(default, rename = "content_sha256")]
    _content_sha256: Option<String>,
    #[serde(rename = "analysis_version")]
    _analysis_version: u32,
    #[serde(rename = "results_hash")]
    _results_hash: String,
    #[serde(rename = "valid")]
    _valid: bool,
    #[serde(rename = "counts")]
    _counts: IgnoredAny,
    #[serde(rename = "rmse_mm")]
    _rmse_mm: EstimateEntry,
    #[serde(default)]
    left_out_rmse_mm: EstimateEntry,
    #[serde(rename = "repeat_std_mm")]
    _repeat_std_mm: EstimateEntry,
    #[serde(rename = "located_rate")]
    _located_rate: EstimateEntry,
}

#[derive(Deserialize)]
struct Analysis {
    version: u32,
    #[serde(default)]
    alignment: Alignment,
    #[serde(default)]
    calibration: Option<Calibration>,
    scored: Scored,
    #[serde(default)]
    presses: Vec<Press>,
}

#[derive(Deserialize, Default)]
struct Alignment {
    #[serde(default)]
    maps: Vec<ClockEntry>,
}

#[derive(Deserialize)]
struct Calibration {
    model: serde_json::Value,
    names: Vec<String>,
    values: Vec<Option<f64>>,
    #[serde(default)]
    standard_errors: Vec<Option<f64>>,
    rmse_before_mm: Option<f64>,
    rmse_after_mm: Option<f64>,
    n: u32,
}

#[derive(Deserialize)]
struct Scored {
    rmse_mm: EstimateEntry,
    #[serde(default)]
    median_mm: EstimateEntry,
    #[serde(default)]
    p95_mm: EstimateEntry,
    #[serde(default)]
    bias_x_mm: EstimateEntry,
    #[serde(default)]
    bias_y_mm: EstimateEntry,
    #[serde(default)]
    repeat_std_mm: EstimateEntry,
    #[serde(default)]
    located_rate: EstimateEntry,
}

#[derive(Deserialize)]
struct Provenance {
    session_id: String,
    #[serde(default)]
    content_sha256: Option<String>,
    #[serde(default)]
    results_hash: String,
    #[serde(default)]
    variant: Option<Variant>,
}

#[derive(Deserialize)]
struct Variant {
    name: String,
    #[serde(default)]
    changed: Vec<String>,
}

impl From<Calibration> for CalibrationEntry {
    fn from(found: Calibration) -> Self {
        let model = match found.model {
            serde_json::Value::String(word) => word,
            other => other.to_string(),
        };
        let errors = found
            .standard_errors
            .into_iter()
            .chain(std::iter::repeat(None));
        let values = found.names.into_iter().zip(found.values).zip(errors);
        Self {
            model,
            rmse_before_mm: found.rmse_before_mm,
            rmse_after_mm: found.rmse_after_mm,
            n: found.n,
            values: values
                .map(|((name, value), error)| (name, value, error))
                .collect(),
        }
    }
}

/// Reads the analysis `name` of the session `session_id` with this content (of its seal) from its results file.
pub(crate) fn read(
    path: &Path,
    name: &str,
    session_id: &str,
    content: Option<&str>,
) -> AnalysisEntry {
    AnalysisEntry {
        name: name.to_owned(),
        figures: figures(path, name, session_id, content),
    }
}

/// True if no two names are the same.
fn is_unique<'a>(mut names: impl Iterator<Item = &'a String>) -> bool {
    let mut seen = BTreeSet::new();
    names.all(|name| seen.insert(name))
}

fn figures(
    path: &Path,
    name: &str,
    session_id: &str,
    content: Option<&str>,
) -> Result<AnalysisFigures, ResultsError> {
    let mut text = Vec::new();
    std::fs::File::open(path).and_then(|file| file.take(MOST_BYTES).read_to_end(&mut text))?;
    results_digest::check(&text)?;
    let found: Document =
        serde_json::from_slice(&text).map_err(|e| ResultsError::OtherVersion(Some(e)))?;
    let own = &found.provenance;
    if own.session_id != session_id {
        return Err(ResultsError::OtherSession);
    }
    if own.content_sha256.as_deref() != content {
        return Err(ResultsError::OtherContent);
    }
    let of = own.variant.as_ref().map_or(OFFICIAL, |v| v.name.as_str());
    if of != name {
        return Err(ResultsError::OtherAnalysis {
            found: of.to_owned(),
        });
    }
    let changed = found.provenance.variant.map(|v| v.changed);
    let analysis = found.analysis;
    let scored = analysis.scored;
    let presses = press::entries(analysis.presses);
    let maps = analysis.alignment.maps.iter().map(|clock| &clock.map);
    let fitted = analysis.calibration.iter().flat_map(|fit| &fit.names);
    let (Some(presses), true, true) = (presses, is_unique(maps), is_unique(fitted)) else {
        return Err(ResultsError::Contradictory);
    };
    Ok(AnalysisFigures {
        version: analysis.version,
        results_hash: found.provenance.results_hash,
        is_valid: found.valid,
        changed: changed.unwrap_or_default(),
        rmse_mm: scored.rmse_mm,
        median_mm: scored.median_mm.value,
        p95_mm: scored.p95_mm.value,
        bias_mm: [scored.bias_x_mm.value, scored.bias_y_mm.value],
        repeat_std_mm: scored.repeat_std_mm.value,
        left_out_rmse_mm: found.summary.left_out_rmse_mm.value,
        located_rate: scored.located_rate.value,
        clocks: analysis.alignment.maps,
        calibration: analysis.calibration.map(CalibrationEntry::from),
        presses,
    })
}

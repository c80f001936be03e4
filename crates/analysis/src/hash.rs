//! Owns the digest of the results, which identifies identical analyses.

use serde::Serialize;
use sha2::{Digest, Sha256};

use crate::result::{
    Analysis, CalibrationResult, Indentation, Latency, LocationOutcome, Metrics, PressCounts,
    PressResult, PressView, Region,
};
use crate::rule::Rule;
use skinrig_model::{
    AnalysisSettings, LocationId, Point2, PressId, PressRole, RepetitionId, StereoGeometry, Verdict,
};

/// Content of the digest: settings, geometry, table of presses, metrics, and whether they may be used. It excludes absolute times,
/// so that a replay at another time has the same digest, and texts, so that a reworded message does not change it.
#[derive(Serialize)]
struct Results<'a> {
    version: u32,
    is_valid: bool,
    settings: &'a AnalysisSettings,
    geometry: &'a StereoGeometry,
    counts: &'a PressCounts,
    calibration: &'a Option<CalibrationResult>,
    scored: &'a Metrics,
    scored_without_exclusions: &'a Metrics,
    presses: Vec<Row<'a>>,
    indentation: &'a Option<Indentation>,
    latency: &'a Option<Latency>,
}

#[derive(Serialize)]
struct Row<'a> {
    press: PressId,
    role: PressRole,
    repetition: RepetitionId,
    location: LocationId,
    planned: Point2,
    depth_mm: f64,
    truth: Option<Point2>,
    verdict: Verdict,
    rule: Option<Rule>,
    views: &'a [Option<PressView>; 2],
    location_outcome: &'a LocationOutcome,
    region: &'a Option<Region>,
    extrapolated: bool,
}

impl<'a> Row<'a> {
    fn of(press: &'a PressResult) -> Self {
        Self {
            press: press.press,
            role: press.role,
            repetition: press.repetition,
            location: press.location,
            planned: press.planned,
            depth_mm: press.depth_mm,
            truth: press.truth,
            verdict: press.verdict,
            rule: press.rule(),
            views: &press.views,
            location_outcome: &press.location_outcome,
            region: &press.region,
            extrapolated: press.extrapolated,
        }
    }
}

/// Lower-case hex SHA-256 over the canonical JSON of the results: fields in order of declaration, no spaces, every number in
/// its shortest exact form.
#[must_use]
pub fn results_hash(analysis: &Analysis) -> String {
    let results = Results {
        version: analysis.version,
        is_valid: analysis.is_valid(),
        settings: &analysis.settings,
        geometry: &analysis.geometry,
        counts: &analysis.counts,
        calibration: &analysis.calibration,
        scored: &analysis.scored,
        scored_without_exclusions: &analysis.scored_without_exclusions,
        presses: analysis.presses.iter().map(Row::of).collect(),
        indentation: &analysis.indentation,
        latency: &analysis.latency,
    };
    let mut digest = HashWriter(Sha256::new());
    // Neither the writer nor the types can fail: no maps with non-string keys, no I/O.
    if let Err(error) = serde_json::to_writer(&mut digest, &results) {
        digest.0.update(error.to_string());
    }
    let bytes = digest.0.finalize();
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}

struct HashWriter(Sha256);

impl std::io::Write for HashWriter {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.update(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

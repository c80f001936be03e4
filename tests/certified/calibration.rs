//! Camera geometries fitted from easy, average and hard starts.

use skinrig_analysis::calibrate::{calibrate, choose};
use skinrig_analysis::result::{LocationOutcome, PressResult, PressView, WarningCause};
use skinrig_analysis::sets::CalibrationSet;
use skinrig_model::{
    AnalysisSettings, CalibrationModel, LocationId, Point2, PressId, PressRole, RepetitionId,
    StereoGeometry, Verdict,
};

use crate::problem::{Problem, Solution, numbers};

/// Names of the parameters, in the order of the data.
const NAMES: [&str; 10] = [
    "x1", "y1", "x2", "y2", "skew1", "skew2", "w1", "w2", "scale1", "scale2",
];
/// Levels of the starts.
pub(crate) const STARTS: [&str; 3] = ["easy", "average", "hard"];

fn view(column: f64) -> PressView {
    PressView {
        events: 100,
        on_events: 50,
        clusters: 1,
        cluster_events: 100,
        centroid_u: Some(column),
        centroid_v: Some(240.0),
        rate_per_s: 0.0,
        idle_rate_per_s: 0.0,
        idle_s: 0.0,
        spread_u: None,
        spread_v: None,
        width_u: None,
        core_threshold: None,
    }
}

fn press(i: usize, row: &[f64]) -> PressResult {
    let (index, at) = (u32::try_from(i).unwrap(), Point2::new(row[2], row[3]));
    PressResult {
        press: PressId::from_index(index),
        role: PressRole::Calibrate,
        repetition: RepetitionId::from_index(0),
        location: LocationId::from_index(index),
        planned: at,
        depth_mm: 1.5,
        truth: Some(at),
        verdict: Verdict::Valid,
        cause: None,
        timing: None,
        views: [Some(view(row[0])), Some(view(row[1]))],
        location_outcome: LocationOutcome::Missing,
        region: None,
        extrapolated: false,
    }
}

/// The solution from one of the [`STARTS`].
pub(crate) fn solve(problem: &Problem, start: &str) -> Solution {
    let presses: Vec<PressResult> = problem
        .rows("presses")
        .iter()
        .enumerate()
        .map(|(i, row)| press(i, row))
        .collect();
    let set = CalibrationSet::from_presses(&presses);
    let values = numbers(&problem.inputs["starts"][start]);
    let first: [f64; 8] = std::array::from_fn(|i| values[i]);
    let geometry = StereoGeometry::paper_like(first);
    let count = problem.inputs["parameters"].as_u64().unwrap();
    let model = match count {
        4 => CalibrationModel::Positions,
        6 => CalibrationModel::PositionsSkews,
        8 => CalibrationModel::Full,
        _ => CalibrationModel::FullScale,
    };
    let Some((_, fit)) = calibrate(&set, &geometry, model, 1) else {
        return Solution::Refused("too few".to_owned(), "calibrate -> None", Vec::new());
    };
    if u64::from(fit.rank) < count {
        let settings = AnalysisSettings {
            calibration: model,
            bootstrap_resamples: 20,
            ..AnalysisSettings::default()
        };
        let warnings = choose(&set, &geometry, &settings).warnings;
        let is_refused = |cause: &WarningCause| {
            matches!(
                cause,
                WarningCause::OpenParameters { .. } | WarningCause::FewLocationsForAny { .. }
            )
        };
        let warned = warnings.iter().any(|w| is_refused(&w.cause));
        assert!(warned, "{}: {warnings:?}", problem.name);
        let outcome = format!("rank {}", fit.rank);
        return Solution::Refused(outcome, "CalibrationResult::rank", Vec::new());
    }
    let mut found: Vec<(&str, f64)> = NAMES.into_iter().zip(fit.values).collect();
    found.push(("rmse", fit.rmse_after_mm));
    Solution::Values(found)
}

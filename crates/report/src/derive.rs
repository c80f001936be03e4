//! Owns the summaries that only a drawing needs: per location, shares of sorted errors. Nothing here is a result.

use std::collections::{BTreeMap, BTreeSet};

use skinrig_analysis::result::{Analysis, PressResult};
use skinrig_model::{Point2, PressRole};

/// True for the presses behind the headline: scored, valid, with a truth and an estimate.
#[must_use]
pub fn counts(press: &PressResult) -> bool {
    press.role == PressRole::Score && press.verdict == "valid" && error_norm_mm(press).is_some()
}

/// Euclidean length of the error vector, mm; `None` without truth or estimate, or when it is not finite.
#[must_use]
pub fn error_norm_mm(press: &PressResult) -> Option<f64> {
    press
        .error_mm()
        .map(|(x, y)| x.hypot(y))
        .filter(|e| e.is_finite())
}

/// What the map shows at one location.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LocationSummary {
    /// Location, from 0.
    pub location: u32,
    /// Where it was planned.
    pub planned: Point2,
    /// Presses behind the summary.
    pub n: u32,
    /// Mean Euclidean error, mm.
    pub mean_error_mm: f64,
    /// Sample standard deviation (n - 1) of the estimates of equally deep presses about their mean, Euclid,
    /// mm, averaged over depths: the analysis' own definition. `None` without two equally deep presses.
    pub std_mm: Option<f64>,
}

/// One summary per location with at least one press that [`counts`], by location number.
#[must_use]
pub fn locations(analysis: &Analysis) -> Vec<LocationSummary> {
    let mut groups: BTreeMap<u32, Vec<&PressResult>> = BTreeMap::new();
    for press in analysis.presses.iter().filter(|p| counts(p)) {
        groups.entry(press.location).or_default().push(press);
    }
    groups
        .into_iter()
        .map(|(location, presses)| {
            let n = presses.len() as f64;
            let mean =
                |f: &dyn Fn(&PressResult) -> f64| presses.iter().map(|p| f(p)).sum::<f64>() / n;
            LocationSummary {
                location,
                planned: presses[0].planned,
                n: presses.len() as u32,
                mean_error_mm: mean(&|p| error_norm_mm(p).unwrap_or(0.0)),
                std_mm: spread_mm(&presses),
            }
        })
        .collect()
}

fn spread_mm(presses: &[&PressResult]) -> Option<f64> {
    let mut found: Vec<(f64, Point2)> = presses
        .iter()
        .filter_map(|p| Some((p.depth_mm, p.estimate()?)))
        .collect();
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    let stds: Vec<f64> = found
        .chunk_by(|a, b| a.0 == b.0)
        .filter(|repeats| repeats.len() > 1)
        .map(|repeats| {
            let n = repeats.len() as f64;
            let mx = repeats.iter().map(|r| r.1.x_mm).sum::<f64>() / n;
            let my = repeats.iter().map(|r| r.1.y_mm).sum::<f64>() / n;
            let mean = Point2::new(mx, my);
            let squares: f64 = repeats.iter().map(|r| r.1.distance_mm(mean).powi(2)).sum();
            (squares / (n - 1.0)).sqrt()
        })
        .collect();
    (!stds.is_empty()).then(|| stds.iter().sum::<f64>() / stds.len() as f64)
}

/// The errors of all presses that [`counts`], ascending, mm.
#[must_use]
pub fn sorted_errors_mm(analysis: &Analysis) -> Vec<f64> {
    let mut errors: Vec<f64> = analysis
        .presses
        .iter()
        .filter(|p| counts(p))
        .filter_map(error_norm_mm)
        .collect();
    errors.sort_by(f64::total_cmp);
    errors
}

/// Presses that one rule left out.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Rejection {
    /// `missed`, `invalid` or `excluded`.
    pub verdict: String,
    /// The rule; the reason in full when all of them share it.
    pub rule: String,
    /// The reason of the first of them, when they differ.
    pub example: Option<String>,
    /// How many.
    pub n: u32,
}

/// Presses that are not valid, grouped by verdict and rule, most frequent first. Sync presses, which the counts
/// leave apart, only with `sync`; all others only without.
#[must_use]
pub fn rejections(analysis: &Analysis, sync: bool) -> Vec<Rejection> {
    let mut groups: BTreeMap<(&str, &str), Vec<&str>> = BTreeMap::new();
    let rejected = analysis.presses.iter().filter(|p| p.verdict != "valid");
    for press in rejected.filter(|p| (p.role == PressRole::Sync) == sync) {
        let reason = press.reason.as_deref().unwrap_or("no reason given");
        let rule = press.rule.as_deref().unwrap_or(reason);
        let group = groups.entry((&press.verdict, rule)).or_default();
        group.push(reason);
    }
    let mut rows: Vec<Rejection> = groups
        .into_iter()
        .map(|((verdict, rule), reasons)| {
            let first = reasons[0];
            let alike = reasons.iter().all(|r| *r == first);
            Rejection {
                verdict: verdict.to_owned(),
                rule: if alike { first } else { rule }.to_owned(),
                example: (!alike).then(|| first.to_owned()),
                n: reasons.len() as u32,
            }
        })
        .collect();
    rows.sort_by_key(|row| std::cmp::Reverse(row.n));
    rows
}

/// Repetitions and locations in the plan, without the sync presses.
#[must_use]
pub fn extent(analysis: &Analysis) -> (u32, u32) {
    let planned = || {
        analysis
            .presses
            .iter()
            .filter(|p| p.role != PressRole::Sync)
    };
    let repetitions = planned().map(|p| p.repetition + 1).max().unwrap_or(0);
    let locations: BTreeSet<u32> = planned().map(|p| p.location).collect();
    (repetitions, locations.len() as u32)
}

/// Says so when the figures stand on another number of presses than the headline: they must not.
#[must_use]
pub fn disagreement(analysis: &Analysis) -> Option<String> {
    let drawn = analysis.presses.iter().filter(|p| counts(p)).count() as u64;
    let headline = u64::from(analysis.scored.rmse_mm.n);
    (drawn != headline).then(|| {
        format!("figures show {drawn} scored presses, the headline stands on {headline}: do not trust this report")
    })
}

//! Owns summaries for drawing only: per location, shares of sorted errors. None of them is a result.

use std::collections::{BTreeMap, BTreeSet};

use skinrig_analysis::exclusion::Exclusion;
use skinrig_analysis::result::{
    Analysis, Latency, LocatorComparison, Move, OffSensor, PressResult,
};
use skinrig_analysis::rule::Rule;
use skinrig_analysis::triangulate::locate;
use skinrig_model::{
    CameraId, LocationId, Locator, Point2, PressId, PressRole, StopMetric, Verdict, quantile,
};

use crate::format::{grouped, interval, number};

/// True for the presses behind the headline, if their error is finite.
#[must_use]
pub(crate) fn is_counted(press: &PressResult) -> bool {
    press.is_in_headline() && error_norm_mm(press).is_some()
}

/// Euclidean length of the error vector, mm; `None` without truth or estimate, or if not finite.
#[must_use]
pub(crate) fn error_norm_mm(press: &PressResult) -> Option<f64> {
    press
        .error_mm()
        .map(|(x, y)| libm::hypot(x, y))
        .filter(|e| e.is_finite())
}

/// 95 % interval of a value with this standard error: ± 1.96 of them (normal).
#[must_use]
pub(crate) fn interval_95(value: f64, standard_error: f64) -> (f64, f64) {
    let half = 1.96 * standard_error;
    (value - half, value + half)
}

/// Data of the skin map at one location.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LocationSummary {
    /// Number of the location.
    pub location: LocationId,
    /// Planned position, skin frame.
    pub planned: Point2,
    /// Number of presses.
    pub n: u32,
    /// Mean Euclidean error, mm.
    pub mean_error_mm: f64,
    /// Sample standard deviation (n - 1, Euclidean) of the estimates of equally deep presses about their mean, mm, averaged
    /// over depths, as the analysis defines it. `None` without two equally deep presses.
    pub std_mm: Option<f64>,
}

/// One summary per location with at least one press that `is_counted`, by location number.
#[must_use]
pub fn locations(analysis: &Analysis) -> Vec<LocationSummary> {
    let mut groups: BTreeMap<LocationId, Vec<&PressResult>> = BTreeMap::new();
    for press in analysis.presses.iter().filter(|p| is_counted(p)) {
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

/// Errors of all presses that [`is_counted`] accepts, ascending, mm.
#[must_use]
pub(crate) fn sorted_errors_mm(analysis: &Analysis) -> Vec<f64> {
    let mut errors: Vec<f64> = analysis
        .presses
        .iter()
        .filter(|p| is_counted(p))
        .filter_map(error_norm_mm)
        .collect();
    errors.sort_by(f64::total_cmp);
    errors
}

/// Presses rejected by one rule.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Rejection {
    /// Missed, invalid or excluded.
    pub verdict: Verdict,
    /// The rule; the full reason when all presses share it.
    pub rule: String,
    /// Reason of the first press, when reasons differ.
    pub example: Option<String>,
    /// Number of presses.
    pub n: u32,
}

/// Presses that are not valid, grouped by verdict and rule, most frequent first. `sync`: only sync presses, which the counts
/// exclude; otherwise all other presses.
#[must_use]
pub fn rejections(analysis: &Analysis, sync: bool) -> Vec<Rejection> {
    let mut groups: BTreeMap<(Verdict, Option<Rule>), Vec<&PressResult>> = BTreeMap::new();
    let rejected = analysis
        .presses
        .iter()
        .filter(|p| p.verdict != Verdict::Valid);
    for press in rejected.filter(|p| (p.role == PressRole::Sync) == sync) {
        let group = groups.entry((press.verdict, press.rule())).or_default();
        group.push(press);
    }
    let mut rows: Vec<(String, Rejection)> = groups
        .into_iter()
        .map(|((verdict, _), presses)| {
            let first = &presses[0].cause;
            let alike = presses.iter().all(|p| p.reason() == presses[0].reason());
            let text = |text: fn(&Exclusion) -> String| {
                let text = first.as_ref().map(text);
                text.unwrap_or_else(|| "no reason recorded".to_owned())
            };
            let (label, reason) = (text(Exclusion::label), text(Exclusion::to_string));
            let rejection = Rejection {
                verdict,
                rule: if alike { reason.clone() } else { label.clone() },
                example: (!alike).then_some(reason),
                n: presses.len() as u32,
            };
            (label, rejection)
        })
        .collect();
    rows.sort_by(|(a, row), (b, other)| {
        let order = |label, row: &Rejection| (std::cmp::Reverse(row.n), row.verdict, label);
        order(a, row).cmp(&order(b, other))
    });
    rows.into_iter().map(|(_, row)| row).collect()
}

/// Number of repetitions and locations in the plan, without sync presses.
#[must_use]
pub fn extent(analysis: &Analysis) -> (u32, u32) {
    let planned = || {
        analysis
            .presses
            .iter()
            .filter(|p| p.role != PressRole::Sync)
    };
    let repetitions = planned().map(|p| p.repetition.number()).max().unwrap_or(0);
    let locations: BTreeSet<LocationId> = planned().map(|p| p.location).collect();
    (repetitions, locations.len() as u32)
}

/// A warning if the figures use another number of presses than the headline, which is a defect.
#[must_use]
pub fn disagreement(analysis: &Analysis) -> Option<String> {
    let drawn = analysis.presses.iter().filter(|p| is_counted(p)).count() as u64;
    let headline = u64::from(analysis.scored.rmse_mm.n);
    (drawn != headline).then(|| {
        format!("figures show {drawn} scored presses, but the headline uses {headline}: do not trust this report")
    })
}

/// The error where no press calibrated, if a press of the headline is at a place that calibrated.
#[must_use]
pub(crate) fn rmse_elsewhere(analysis: &Analysis) -> Option<String> {
    if !analysis.scores_calibrating_places()? {
        return None;
    }
    let rmse = analysis.left_out_rmse()?;
    let (value, interval) = (number(rmse.value, 2), interval(&rmse, 1.0, 2));
    Some(format!(
        "{value} mm {interval} where no press calibrated, n {} presses",
        rmse.n
    ))
}

/// The RMSE of a campaign that ends by itself: its value, the level of its interval in percent, and the interval at that level.
pub(crate) struct RmseAtLook {
    pub value: String,
    pub level: String,
    pub interval: String,
    /// Presses behind it, and the look.
    pub extent: String,
}

/// The level of the interval of `metric`, in percent, if it is that of a look; others have 95 % intervals.
#[must_use]
pub(crate) fn level_at_look(analysis: &Analysis, metric: StopMetric) -> Option<String> {
    let found = match metric {
        StopMetric::Rmse => &analysis.scored.rmse_mm,
        StopMetric::Median => &analysis.scored.median_mm,
    };
    let look = analysis.campaign.as_ref()?.look_of(metric, found)?;
    Some(number(Some(look.level_percent()), 1))
}

/// `None` for other sessions: their RMSE has a 95 % interval.
#[must_use]
pub(crate) fn rmse_at_look(analysis: &Analysis) -> Option<RmseAtLook> {
    let campaign = analysis.campaign.as_ref()?;
    let look = campaign.look_of(StopMetric::Rmse, &analysis.scored.rmse_mm)?;
    let end = |mm: Option<f64>| mm.map_or_else(|| "open".to_owned(), |mm| number(Some(mm), 2));
    Some(RmseAtLook {
        value: number(Some(look.value_mm), 2),
        level: number(Some(look.level_percent()), 1),
        interval: format!("[{}, {}]", end(look.low_mm), end(look.high_mm)),
        extent: format!(
            "{} presses at look {} of {}",
            look.extent(),
            look.number,
            look.declared
        ),
    })
}

/// A note if the geometry differs from the one in the settings: nominal, or a smaller model. `None` without presses.
#[must_use]
pub fn geometry_note(analysis: &Analysis) -> Option<String> {
    use skinrig_model::CalibrationModel::{Auto, None as Nominal};
    let requested = analysis.settings.calibration;
    if analysis.presses.is_empty() {
        return None;
    }
    match analysis.calibration.as_ref().map(|c| c.model) {
        None if requested == Nominal => {
            Some("Located with the nominal camera geometry, uncalibrated, as configured".to_owned())
        }
        None => {
            Some("Located with the nominal camera geometry: no calibration was possible".to_owned())
        }
        Some(used) if requested != Auto && used != requested => Some(format!(
            "Calibrated with a smaller model ({}) than configured ({}), which could not be fitted",
            used.label(),
            requested.label()
        )),
        Some(_) => None,
    }
}

/// Onsets within the settings' window around the median onset, ascending, ms (the paper's true positives).
#[must_use]
pub fn onsets_ms(latency: &Latency) -> Vec<f64> {
    let mut onsets: Vec<f64> = latency
        .onsets
        .iter()
        .filter_map(|(_, onset)| *onset)
        .filter(|onset| onset.is_finite())
        .collect();
    onsets.sort_by(f64::total_cmp);
    let Some(median) = quantile(&onsets, 0.5) else {
        return vec![];
    };
    onsets.retain(|onset| (onset - median).abs() <= latency.settings.window_ms);
    onsets
}

/// 5th, 50th and 95th percentile of [`onsets_ms`], ms; `None` without any.
#[must_use]
pub(crate) fn onset_percentiles(latency: &Latency) -> Option<(f64, f64, f64)> {
    let onsets = onsets_ms(latency);
    Some((
        quantile(&onsets, 0.05)?,
        quantile(&onsets, 0.5)?,
        quantile(&onsets, 0.95)?,
    ))
}

/// A calibration press: ground truth, and estimates before and after the calibration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Residual {
    /// The press.
    pub press: PressId,
    /// Measured position.
    pub truth: Point2,
    /// Estimate with the geometry before calibration.
    pub before: Option<Point2>,
    /// Located with the calibrated geometry.
    pub after: Option<Point2>,
}

/// One line per camera with events outside the sensor, which the analysis ignores.
#[must_use]
pub fn off_sensor(analysis: &Analysis) -> Vec<String> {
    let cameras = CameraId::ALL.into_iter().zip(&analysis.off_sensor);
    let found = cameras.filter(|(_, off)| off.events > 0);
    let line = |(camera, off): (CameraId, &OffSensor)| {
        format!(
            "{camera}: {} of {} events lie outside the sensor",
            grouped(off.events),
            grouped(off.of)
        )
    };
    found.map(line).collect()
}

/// One row per calibration press with truth and both centroids, in plan order; empty without a calibration. "Before" uses
/// the same centroids with the geometry before calibration.
#[must_use]
pub fn residuals(analysis: &Analysis) -> Vec<Residual> {
    let Some(calibration) = &analysis.calibration else {
        return vec![];
    };
    let finite = |p: Point2| p.x_mm.is_finite() && p.y_mm.is_finite();
    let row = |press: &PressResult| {
        let columns = press.views.map(|v| v.and_then(|v| v.centroid_u));
        let truth = press.truth.filter(|t| finite(*t))?;
        if columns.iter().any(Option::is_none) {
            return None;
        }
        let outline = &analysis.rig.outline;
        let start = locate(&calibration.start, outline, columns);
        let after = locate(&analysis.geometry, outline, columns);
        Some(Residual {
            press: press.press,
            truth,
            before: start.estimate().filter(|p| finite(*p)),
            after: after.estimate().filter(|p| finite(*p)),
        })
    };
    let calibrating = analysis
        .presses
        .iter()
        .filter(|p| p.role == PressRole::Calibrate && p.verdict == Verdict::Valid);
    calibrating.filter_map(row).collect()
}

/// Display name of a locator.
#[must_use]
pub(crate) const fn locator_name(locator: Locator) -> &'static str {
    match locator {
        Locator::Auto => "automatic",
        Locator::Geometry => "geometry",
        Locator::Field => "geometry + field",
        Locator::Direct => "polynomial + field",
    }
}

/// The locator in use, if it is not the geometry alone.
#[must_use]
pub(crate) fn locator(analysis: &Analysis) -> Option<Locator> {
    let used = analysis.locator.as_ref()?.locator;
    (used != Locator::Geometry).then_some(used)
}

/// The locator in use and what it gains, if it is not the geometry alone.
#[must_use]
pub(crate) fn locator_note(analysis: &Analysis) -> Option<String> {
    locator(analysis)?;
    let l = analysis.locator.as_ref()?;
    let rmse = |of: &dyn Fn(&LocatorComparison) -> bool| {
        let row = l.compared.iter().find(|c| of(c))?;
        row.rmse_mm.value.map(|v| number(Some(v), 2))
    };
    let name = locator_name(l.locator);
    let (own, alone) = (
        rmse(&|c| c.chosen),
        rmse(&|c| c.locator == Locator::Geometry),
    );
    Some(match (own, alone) {
        (Some(own), Some(alone)) => {
            format!("{name}: {own} mm at left-out locations, geometry {alone} mm")
        }
        _ => name.to_owned(),
    })
}

/// Origin of a calibration that is not the session's own, and how far the skin moved since.
#[must_use]
pub(crate) fn recalibration_note(a: &Analysis) -> Option<String> {
    let r = a.recalibration.as_ref()?;
    let moved = |m: &Move, unit: &str| {
        let error = number(Some(m.standard_error), 2);
        format!("{} ± {error} {unit}", number(Some(m.value), 2))
    };
    Some(format!(
        "calibration of session {} of {}, corrected by {} presses: skin and cameras shifted by {} along x and {} along y and turned \
         by {} (value ± standard error); {} % of remounts disagree as much with the presses",
        r.from.session_id,
        r.from.started,
        r.presses,
        moved(&r.shift_mm[0], "mm"),
        moved(&r.shift_mm[1], "mm"),
        moved(&r.turn_deg, "degrees"),
        number(Some(100.0 * r.chance), 1),
    ))
}

//! What an analysis asks of its input before it begins.

use skinrig_model::range::analysis as limits;
use skinrig_model::{
    AnalysisSettings, CameraId, PlannedPress, Point2, RigGeometry, SENSOR_HEIGHT, SkinOutline,
    ValueRange,
};

use crate::cmre::ContactMap;
use crate::error::AnalysisError;
use crate::estimators::BIN_SIDES_PX;
use crate::input::SessionInput;

/// Largest coordinate, length or skew that is taken for one: 1000 km. Squares of it and sums of them stay exact
/// enough to be distances.
const MAX_COORDINATE_MM: f64 = 1e9;

/// Journal and plan fit together, settings are in range, the geometry can be used.
pub fn input(input: &SessionInput) -> Result<(), AnalysisError> {
    if input.planned.len() != input.outcomes.len() {
        return Err(AnalysisError::JournalLength {
            planned: input.planned.len(),
            outcomes: input.outcomes.len(),
        });
    }
    for (planned, outcome) in input.planned.iter().zip(&input.outcomes) {
        if let Some(found) = outcome.as_ref().map(|o| o.attempt.press)
            && found != planned.id
        {
            return Err(AnalysisError::JournalOrder {
                expected: planned.id,
                found,
            });
        }
    }
    settings(&input.settings)?;
    presses(&input.planned)?;
    geometry(&input.rig)
}

/// Checks before anything is recorded what an analysis would refuse afterwards: the settings, the plan, and whether the
/// two fit each other and the skin's outline.
///
/// # Errors
/// [`AnalysisError::Setting`] or [`AnalysisError::Plan`].
pub fn before_recording(
    planned: &[PlannedPress],
    chosen: &AnalysisSettings,
    outline: &SkinOutline,
) -> Result<(), AnalysisError> {
    settings(chosen)?;
    presses(planned)?;
    ContactMap::new(outline, &chosen.cmre)?;
    for press in &chosen.exclude_press_numbers {
        if !planned.iter().any(|p| p.id == *press) {
            return Err(AnalysisError::Setting {
                name: "exclude_press_numbers",
                expected: format!("presses of the plan, which has {}", planned.len()),
                found: press.to_string(),
            });
        }
    }
    Ok(())
}

/// Places and depths of the plan are numbers that distances can be taken of.
fn presses(all: &[PlannedPress]) -> Result<(), AnalysisError> {
    for planned in all {
        let numbers = [planned.at.x_mm, planned.at.y_mm, planned.depth_mm];
        if !numbers.iter().all(|n| n.abs() <= MAX_COORDINATE_MM) {
            return Err(AnalysisError::Plan {
                press: planned.id,
                found: format!(
                    "({}, {}) mm, depth {} mm",
                    numbers[0], numbers[1], numbers[2]
                ),
            });
        }
    }
    Ok(())
}

/// True for a point with finite coordinates within 1000 km of the origin.
pub fn is_place(p: &Point2) -> bool {
    p.x_mm.abs() <= MAX_COORDINATE_MM && p.y_mm.abs() <= MAX_COORDINATE_MM
}

/// Cameras and outline are such that rays, areas and distances are numbers.
///
/// # Errors
/// [`AnalysisError::Geometry`] or [`AnalysisError::Outline`].
pub fn geometry(rig: &RigGeometry) -> Result<(), AnalysisError> {
    for camera in CameraId::ALL {
        let model = &rig.nominal.cameras[camera.index()];
        let (p, a) = (model.position, model.aim);
        let numbers = [p.x_mm, p.y_mm, a.x_mm, a.y_mm, model.skew_deg];
        let edge_deg = model.lens.angle_deg(1.0).0;
        let finite = numbers.iter().all(|n| n.abs() <= MAX_COORDINATE_MM);
        let sees = edge_deg > 0.0 && edge_deg <= 360.0;
        if !finite || !sees || p == a {
            return Err(AnalysisError::Geometry {
                camera,
                found: format!(
                    "({}, {}) mm, skew {}°, {:?}",
                    p.x_mm, p.y_mm, model.skew_deg, model.lens
                ),
            });
        }
    }
    let o = &rig.outline;
    let side = |v: f64| v > 0.0 && v <= MAX_COORDINATE_MM;
    let corner = |v: f64| v >= 0.0 && v <= 0.5 * o.width_mm.min(o.height_mm);
    let placed = [o.centre.x_mm, o.centre.y_mm]
        .iter()
        .all(|n| n.abs() <= MAX_COORDINATE_MM);
    if placed
        && side(o.width_mm)
        && side(o.height_mm)
        && corner(o.chamfer_mm)
        && corner(o.radius_mm)
    {
        Ok(())
    } else {
        Err(AnalysisError::Outline {
            found: format!(
                "{} x {} mm about ({}, {}), chamfer {} mm, radius {} mm",
                o.width_mm, o.height_mm, o.centre.x_mm, o.centre.y_mm, o.chamfer_mm, o.radius_mm
            ),
        })
    }
}

/// Every setting is in its range.
///
/// # Errors
/// [`AnalysisError::Setting`] for the first setting out of its range.
pub fn settings(s: &AnalysisSettings) -> Result<(), AnalysisError> {
    let number = |name, range: ValueRange, found: f64| {
        if range.contains(found) {
            Ok(())
        } else {
            Err(AnalysisError::Setting {
                name,
                expected: range.describe(""),
                found: found.to_string(),
            })
        }
    };
    let optional =
        |name, range, found: Option<f64>| found.map_or(Ok(()), |found| number(name, range, found));
    let both = |name, range, (first, last): (f64, f64)| {
        number(name, range, first)?;
        number(name, range, last)?;
        in_order(name, first, last)
    };
    let (r, l, c) = (&s.reduction, &s.latency, &s.cmre);
    let few = &l.reduced;
    number("eps_px", limits::EPS_PX, s.eps_px)?;
    number("min_samples", limits::MIN_SAMPLES, s.min_samples.into())?;
    // Negative margins cut the ends off a press; no protocol asks for them.
    let margin = limits::WINDOW_MARGIN_MS;
    number("window_before_ms", margin, s.window_before_ms.abs())?;
    number("window_after_ms", margin, s.window_after_ms.abs())?;
    let after = limits::WINDOW_AFTER_CONTACT_MS;
    optional("window_after_contact_ms", after, s.window_after_contact_ms)?;
    number("rate_bin_ms", limits::RATE_BIN_MS, s.rate_bin_ms)?;
    let sigma = limits::MIN_RESPONSE_SIGMA;
    number("min_response_sigma", sigma, s.min_response_sigma)?;
    number("min_ray_sine", limits::MIN_RAY_SINE, s.min_ray_sine)?;
    let events = limits::MIN_CLUSTER_EVENTS;
    number("min_cluster_events", events, s.min_cluster_events.into())?;
    let resamples = limits::BOOTSTRAP_RESAMPLES;
    number(
        "bootstrap_resamples",
        resamples,
        s.bootstrap_resamples.into(),
    )?;
    optional(
        "failure_penalty_mm",
        limits::LENGTH_MM,
        s.failure_penalty_mm,
    )?;
    number("within_mm", limits::LENGTH_MM, s.within_mm)?;
    number("bits_per_event", limits::BITS_PER_EVENT, s.bits_per_event)?;
    number(
        "study_presses",
        limits::STUDY_PRESSES,
        s.study_presses.into(),
    )?;
    number("forget_ms", limits::FORGET_MS, s.forget_ms)?;
    number("thinning", limits::THINNING, s.thinning.into())?;
    let power = limits::REDUCTION_MAX_POWER;
    number("reduction.max_power", power, r.max_power.into())?;
    number("reduction.seeds", limits::REDUCTION_SEEDS, r.seeds.into())?;
    let samples = limits::REDUCTION_MIN_SAMPLES;
    number("reduction.min_samples", samples, r.min_samples.into())?;
    number("latency.bin_ms", limits::LATENCY_BIN_MS, l.bin_ms)?;
    number("latency.sigma_ms", limits::LATENCY_SIGMA_MS, l.sigma_ms)?;
    number("latency.alpha", limits::LATENCY_ALPHA, l.alpha)?;
    let (count, threshold) = (limits::LATENCY_COUNT, limits::LATENCY_THRESHOLD);
    number("latency.consecutive", count, l.consecutive.into())?;
    both("latency.threshold_range", threshold, l.threshold_range)?;
    number("latency.thresholds", count, l.thresholds.into())?;
    number("latency.target_rate", limits::SHARE, l.target_rate)?;
    number("latency.window_ms", limits::LATENCY_WINDOW_MS, l.window_ms)?;
    number(
        "latency.reduced.factor",
        limits::THINNING,
        few.factor.into(),
    )?;
    both(
        "latency.reduced.threshold_range",
        threshold,
        few.threshold_range,
    )?;
    number("latency.reduced.thresholds", count, few.thresholds.into())?;
    number(
        "latency.reduced.target_rate",
        limits::SHARE,
        few.target_rate,
    )?;
    number("cmre.cell_mm", limits::CMRE_CELL_MM, c.cell_mm)?;
    number("cmre.sigma_mm", limits::CMRE_WIDTH_MM, c.sigma_mm)?;
    number("cmre.sr_mm", limits::CMRE_WIDTH_MM, c.sr_mm)?;
    let a = &s.alignment;
    let time = limits::ALIGNMENT_TIME_US;
    number("alignment.max_residual_us", time, a.max_residual_us)?;
    number(
        "alignment.max_camera_interval_us",
        time,
        a.max_camera_interval_us,
    )?;
    number(
        "alignment.max_host_interval_us",
        time,
        a.max_host_interval_us,
    )?;
    let (distance, delay) = (limits::TIE_DISTANCE_US, limits::ROBOT_DELAY_US);
    number(
        "alignment.max_tie_distance_us",
        distance,
        a.max_tie_distance_us,
    )?;
    number("alignment.robot_delay_us", delay, a.robot_delay_us)?;
    number(
        "alignment.max_drift_ppm",
        limits::DRIFT_PPM,
        a.max_drift_ppm,
    )?;
    number("alignment.max_lost", limits::SHARE, a.max_lost)?;
    number("alignment.max_spurious", limits::SHARE, a.max_spurious)?;
    number("alignment.min_coverage", limits::SHARE, a.min_coverage)?;
    number("alignment.min_explained", limits::SHARE, a.min_explained)?;
    number("alignment.min_log_odds", limits::LOG_ODDS, a.min_log_odds)?;
    if !BIN_SIDES_PX.contains(&s.bin_px) {
        return Err(AnalysisError::Setting {
            name: "bin_px",
            expected: "1, 2, 4, 8 or 16 px".into(),
            found: s.bin_px.to_string(),
        });
    }
    for (from, to) in s.crop_v {
        if from > to || to >= SENSOR_HEIGHT {
            return Err(AnalysisError::Setting {
                name: "crop_v",
                expected: "first and last row, in order, within 0..=479".into(),
                found: format!("{from}..={to}"),
            });
        }
    }
    Ok(())
}

/// The ends of a grid are in order.
fn in_order(name: &'static str, first: f64, last: f64) -> Result<(), AnalysisError> {
    if first <= last {
        return Ok(());
    }
    Err(AnalysisError::Setting {
        name,
        expected: "first and last, in order".into(),
        found: format!("{first} to {last}"),
    })
}

//! What an analysis asks of its input before it begins.

use skinrig_model::{AnalysisSettings, CameraId, Point2, RigGeometry, SENSOR_HEIGHT};

use crate::error::AnalysisError;
use crate::estimators::BIN_SIDES_PX;
use crate::input::SessionInput;

/// Largest DBSCAN radius, px.
const MAX_EPS_PX: f64 = 50.0;
/// Largest coordinate, length or skew that is taken for one: 1000 km. Squares of it and sums of them stay exact
/// enough to be distances.
const MAX_COORDINATE_MM: f64 = 1e9;
/// Most bootstrap resamples.
const MAX_RESAMPLES: u32 = 1_000_000;

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
    settings(input)?;
    for planned in &input.planned {
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
    geometry(&input.rig)
}

/// True for a point with finite coordinates within 1000 km of the origin.
pub fn is_place(p: &Point2) -> bool {
    p.x_mm.abs() <= MAX_COORDINATE_MM && p.y_mm.abs() <= MAX_COORDINATE_MM
}

/// Cameras and outline are such that rays, areas and distances are numbers.
fn geometry(rig: &RigGeometry) -> Result<(), AnalysisError> {
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

fn settings(input: &SessionInput) -> Result<(), AnalysisError> {
    let s = &input.settings;
    let number = |name, ok: bool, expected, found: f64| {
        if ok {
            Ok(())
        } else {
            Err(AnalysisError::Setting {
                name,
                expected,
                found: found.to_string(),
            })
        }
    };
    let ms = |v: f64| (-10_000.0..=10_000.0).contains(&v);
    number(
        "eps_px",
        s.eps_px > 0.0 && s.eps_px <= MAX_EPS_PX,
        "a radius above 0 and up to 50 px",
        s.eps_px,
    )?;
    number(
        "min_samples",
        s.min_samples > 0,
        "at least 1 event",
        f64::from(s.min_samples),
    )?;
    let within = "a time between -10 s and 10 s";
    number(
        "window_before_ms",
        ms(s.window_before_ms),
        within,
        s.window_before_ms,
    )?;
    number(
        "window_after_ms",
        ms(s.window_after_ms),
        within,
        s.window_after_ms,
    )?;
    number(
        "rate_bin_ms",
        (0.1..=10_000.0).contains(&s.rate_bin_ms),
        "a bin between 0.1 ms and 10 s",
        s.rate_bin_ms,
    )?;
    number(
        "min_response_sigma",
        (0.0..=1e6).contains(&s.min_response_sigma),
        "a number of standard errors, 0 or more",
        s.min_response_sigma,
    )?;
    number(
        "min_ray_sine",
        (0.0..1.0).contains(&s.min_ray_sine),
        "a sine from 0 up to 1",
        s.min_ray_sine,
    )?;
    number(
        "bootstrap_resamples",
        s.bootstrap_resamples <= MAX_RESAMPLES,
        "at most a million resamples",
        f64::from(s.bootstrap_resamples),
    )?;
    let positive = |v: f64, most: f64| v > 0.0 && v <= most;
    number(
        "failure_penalty_mm",
        s.failure_penalty_mm.is_none_or(|mm| positive(mm, 1e6)),
        "a length above 0",
        s.failure_penalty_mm.unwrap_or(0.0),
    )?;
    number(
        "within_mm",
        positive(s.within_mm, 1e6),
        "a length above 0",
        s.within_mm,
    )?;
    number(
        "bits_per_event",
        positive(s.bits_per_event, 1024.0),
        "a number above 0 and up to 1024",
        s.bits_per_event,
    )?;
    number(
        "forget_ms",
        s.forget_ms >= 0.1 && s.forget_ms <= 60_000.0,
        "a time between 0.1 ms and 60 s",
        s.forget_ms,
    )?;
    number(
        "thinning",
        (1..=1 << 20).contains(&s.thinning),
        "a factor from 1 to 1048576",
        f64::from(s.thinning),
    )?;
    number(
        "bin_px",
        BIN_SIDES_PX.contains(&s.bin_px),
        "1, 2, 4, 8 or 16 px",
        f64::from(s.bin_px),
    )?;
    number(
        "window_after_contact_ms",
        s.window_after_contact_ms
            .is_none_or(|v| positive(v, 60_000.0)),
        "a time above 0 and up to 60 s",
        s.window_after_contact_ms.unwrap_or(0.0),
    )?;
    studies(s, &number)?;
    for (from, to) in s.crop_v {
        if from > to || to >= SENSOR_HEIGHT {
            return Err(AnalysisError::Setting {
                name: "crop_v",
                expected: "first and last row, in order, within 0..=479",
                found: format!("{from}..={to}"),
            });
        }
    }
    Ok(())
}

/// Ranges of the studies' settings. `number` makes the error.
fn studies(
    s: &AnalysisSettings,
    number: &impl Fn(&'static str, bool, &'static str, f64) -> Result<(), AnalysisError>,
) -> Result<(), AnalysisError> {
    let positive = |v: f64, most: f64| v > 0.0 && v <= most;
    let (r, l, c) = (&s.reduction, &s.latency, &s.cmre);
    number(
        "reduction.max_power",
        r.max_power <= 20,
        "a power of 2 from 0 to 20",
        f64::from(r.max_power),
    )?;
    number(
        "reduction.seeds",
        (1..=1000).contains(&r.seeds),
        "1 to 1000 seeds",
        f64::from(r.seeds),
    )?;
    number(
        "latency.bin_ms",
        (0.01..=10.0).contains(&l.bin_ms),
        "a bin between 0.01 ms and 10 ms",
        l.bin_ms,
    )?;
    number(
        "latency.sigma_ms",
        (0.0..=50.0).contains(&l.sigma_ms),
        "a width between 0 and 50 ms",
        l.sigma_ms,
    )?;
    number(
        "latency.alpha",
        l.alpha > 1.0 && l.alpha <= 1000.0,
        "a rate increase above 1 and up to 1000",
        l.alpha,
    )?;
    number(
        "latency.consecutive",
        (1..=1000).contains(&l.consecutive),
        "1 to 1000 bins",
        f64::from(l.consecutive),
    )?;
    let in_order = |(first, last)| positive(first, 1e6) && positive(last, 1e6) && first <= last;
    number(
        "latency.threshold_range",
        in_order(l.threshold_range),
        "two thresholds above 0 in order",
        l.threshold_range.0,
    )?;
    number(
        "latency.thresholds",
        (1..=1000).contains(&l.thresholds),
        "1 to 1000 thresholds",
        f64::from(l.thresholds),
    )?;
    number(
        "latency.target_rate",
        (0.0..=1.0).contains(&l.target_rate),
        "a share from 0 to 1",
        l.target_rate,
    )?;
    let few = &l.reduced;
    number(
        "latency.reduced.factor",
        (1..=1 << 20).contains(&few.factor),
        "a factor from 1 to 2^20",
        f64::from(few.factor),
    )?;
    number(
        "latency.reduced.threshold_range",
        in_order(few.threshold_range),
        "two thresholds above 0 in order",
        few.threshold_range.0,
    )?;
    number(
        "latency.reduced.thresholds",
        (1..=1000).contains(&few.thresholds),
        "1 to 1000 thresholds",
        f64::from(few.thresholds),
    )?;
    number(
        "latency.reduced.target_rate",
        (0.0..=1.0).contains(&few.target_rate),
        "a share from 0 to 1",
        few.target_rate,
    )?;
    number(
        "latency.window_ms",
        positive(l.window_ms, 10_000.0),
        "a time above 0 and up to 10 s",
        l.window_ms,
    )?;
    number(
        "cmre.cell_mm",
        (0.5..=100.0).contains(&c.cell_mm),
        "a side between 0.5 mm and 100 mm",
        c.cell_mm,
    )?;
    number(
        "cmre.sigma_mm",
        (0.001..=1000.0).contains(&c.sigma_mm),
        "a length between 0.001 mm and 1 m",
        c.sigma_mm,
    )?;
    number(
        "cmre.sr_mm",
        (0.001..=1e6).contains(&c.sr_mm),
        "a length between 0.001 mm and 1 km",
        c.sr_mm,
    )
}

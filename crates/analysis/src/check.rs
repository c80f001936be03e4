//! What an analysis asks of its input before it begins.

use skinrig_model::{CameraId, SENSOR_HEIGHT};

use crate::error::AnalysisError;
use crate::input::SessionInput;

/// Largest DBSCAN radius, px.
const MAX_EPS_PX: f64 = 50.0;
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
                expected: planned.id.0,
                found: found.0,
            });
        }
    }
    settings(input)?;
    for camera in CameraId::ALL {
        let model = &input.rig.nominal.cameras[camera.index()];
        let (p, a) = (model.position, model.aim);
        let numbers = [p.x_mm, p.y_mm, a.x_mm, a.y_mm, model.skew_deg];
        if !numbers.iter().all(|n| n.is_finite()) || p == a {
            return Err(AnalysisError::Geometry {
                camera,
                found: format!("({}, {}) mm", p.x_mm, p.y_mm),
            });
        }
    }
    Ok(())
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

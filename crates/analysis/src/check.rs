//! Validates the input of an analysis before it begins.

use skinrig_model::{
    AnalysisSettings, CameraId, PlannedPress, Point2, PressRole, RigGeometry, SENSOR_HEIGHT,
    SkinOutline,
};
use skinrig_settings::Settings;

use crate::cmre::ContactMap;
use crate::error::AnalysisError;
use crate::input::SessionInput;

/// Largest accepted coordinate, length or skew: 1000 km. Sums of squares remain accurate distances.
const MAX_COORDINATE_MM: f64 = 1e9;

/// Checks that journal and plan match, settings are in range, and the geometry is usable.
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
    excluded(&input.planned, &input.settings)?;
    geometry(&input.rig)
}

/// Checks before recording what an analysis would reject afterwards: the settings, the plan, and whether both match each
/// other and the skin's outline.
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
    excluded(planned, chosen)
}

/// Presses excluded by hand are in the plan, and of those that a rule can exclude.
fn excluded(planned: &[PlannedPress], chosen: &AnalysisSettings) -> Result<(), AnalysisError> {
    for press in &chosen.exclude_press_numbers {
        let expected = match planned.iter().find(|p| p.id == *press) {
            None => format!("presses of the plan, which has {}", planned.len()),
            Some(p) if p.role == PressRole::Sync => {
                "other presses than those for synchronisation, which never score".to_owned()
            }
            Some(_) => continue,
        };
        return Err(AnalysisError::Setting {
            name: "exclude_press_numbers".to_owned(),
            expected,
            found: press.to_string(),
        });
    }
    Ok(())
}

/// Positions and depths of the plan are finite and within range.
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
pub(crate) fn is_place(p: &Point2) -> bool {
    p.x_mm.abs() <= MAX_COORDINATE_MM && p.y_mm.abs() <= MAX_COORDINATE_MM
}

/// Checks that cameras and outline give finite rays, areas and distances.
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

/// Checks that every setting is in its range, and that pairs of settings are in order.
///
/// # Errors
/// [`AnalysisError::Setting`] for the first setting out of its range.
pub fn settings(s: &AnalysisSettings) -> Result<(), AnalysisError> {
    let wrong = |key: &str, expected: &str, found: String| AnalysisError::Setting {
        name: key.to_owned(),
        expected: expected.to_owned(),
        found,
    };
    // Negative margins shorten a press; no file can set them.
    let margins = AnalysisSettings {
        window_before_ms: s.window_before_ms.abs(),
        window_after_ms: s.window_after_ms.abs(),
        ..s.clone()
    };
    if let Some(out) = margins.out_of_range() {
        return Err(wrong(&out.key, &out.expected, out.found));
    }
    let reduced = s.latency.reduced.thresholds.into();
    for (key, grid) in [
        ("latency.thresholds", s.latency.thresholds),
        ("latency.reduced.thresholds", reduced),
    ] {
        if grid.from > grid.to {
            let found = format!("{} to {}", grid.from, grid.to);
            return Err(wrong(
                key,
                "the first threshold at or below the last",
                found,
            ));
        }
    }
    if !AnalysisSettings::BIN_SIDES_PX.contains(&s.bin_px) {
        return Err(wrong(
            "bin",
            "1, 2, 4, 8 or 16 px",
            format!("{} px", s.bin_px),
        ));
    }
    for (from, to) in s.crop_v {
        if from > to || to >= SENSOR_HEIGHT {
            let expected = "first and last row, in order, within 0 px to 479 px";
            return Err(wrong("crop", expected, format!("{from} px to {to} px")));
        }
    }
    Ok(())
}

//! Depth and force of presses from their events, when the calibration presses have more than one depth.
//!
//! While a camera's stream passes, the `collector` counts the phases of each press; `features` turns them into numbers that
//! do not depend on durations; `learn` fits a `regression` to the calibration presses and finds intervals at left-out
//! locations; `zero` measures what is left after the release. Scored presses only score. Decision and measurements:
//! `docs/adr/0045-*`.

mod collector;
mod errors;
mod features;
mod image;
mod kernel;
mod learn;
mod phases;
mod regression;
mod zero;

use std::collections::HashMap;

use skinrig_model::{PressId, PressRole, StereoGeometry, Verdict};

pub(crate) use collector::{PhaseCollector, PressPhases};
pub(crate) use phases::{PhasePlan, phase_plans};

use errors::{Row, Taught, quantity};
use features::{Observation, Scales};
use learn::{Learnt, Teacher};
use zero::{Habit, is_observed, zero_return};

use crate::input::SessionInput;
use crate::result::{Indentation, NoQuantity, PressIndentation, PressResult, Quantity, ZeroReturn};
use crate::sets::CalibrationSet;
use phases::{AFTER, depths_vary};

/// A located press.
struct SeenPress<'a> {
    row: usize,
    phases: [&'a PressPhases; 2],
    observation: Observation,
}

/// Estimates depth and force of every located press; `None` unless the calibration presses vary in depth.
/// `phases`: of each camera, by row.
pub(crate) fn estimate(
    input: &SessionInput,
    presses: &[PressResult],
    geometry: &StereoGeometry,
    phases: [&[PressPhases]; 2],
) -> Option<Indentation> {
    if !depths_vary(input) {
        return None;
    }
    let seen = seen_presses(presses, geometry, phases);
    let set = CalibrationSet::from_presses(presses);
    let depth_of = |row: usize| positive(input.outcomes[row].as_ref()?.measured_depth_mm);
    let force_of = |row: usize| positive(input.hold_forces_n.get(row).copied().flatten());
    let depth = learnt(input, &seen, presses, &set, depth_of);
    let force = if seen.iter().any(|s| force_of(s.row).is_some()) {
        learnt(input, &seen, presses, &set, force_of)
    } else {
        Err(NoQuantity::NotReported)
    };
    let ranged = |learnt: &Result<(Learnt, _), NoQuantity>, s: &SeenPress<'_>| {
        learnt.as_ref().ok()?.0.estimate(&s.observation)
    };
    let mut rows: Vec<PressIndentation> = seen
        .iter()
        .map(|s| PressIndentation {
            press: presses[s.row].press,
            depth_mm: ranged(&depth, s),
            force_n: ranged(&force, s),
            left_out_mm: left_out(&depth, presses[s.row].press).map(|(r, _)| r),
            measured_mm: depth_of(s.row),
            measured_n: force_of(s.row),
            rest_mm: None,
        })
        .collect();
    rows.sort_by_key(|r| r.press);
    let taught = depth.as_ref().ok().map(|(learnt, _)| learnt.taught);
    let zero = taught.and_then(|taught| zero(input, &seen, presses, &set, taught, &mut rows));
    let tables = [false, true].map(|is_force| error_rows(presses, &rows, is_force));
    let [depth_rows, force_rows] = tables;
    let (depth, no_depth) = summary(input, depth, depth_rows);
    let (force, no_force) = summary(input, force, force_rows);
    Some(Indentation {
        depth,
        no_depth,
        force,
        no_force,
        zero,
        presses: rows,
    })
}

/// Training data of a quantity: press and measurement of each calibration press.
type Lesson = (Learnt, Vec<(PressId, u32, f64, f64)>);

fn positive(value: Option<f64>) -> Option<f64> {
    value.filter(|v| v.is_finite() && *v > 0.0)
}

fn seen_presses<'a>(
    presses: &[PressResult],
    geometry: &StereoGeometry,
    phases: [&'a [PressPhases]; 2],
) -> Vec<SeenPress<'a>> {
    let scales = Scales::new(phases);
    let of = |k: usize| -> HashMap<usize, &'a PressPhases> {
        phases[k].iter().map(|p| (p.row, p)).collect()
    };
    let [one, two] = [of(0), of(1)];
    let rows = presses.iter().enumerate();
    rows.filter(|(_, p)| p.role != PressRole::Sync)
        .filter_map(|(row, press)| {
            let phases = [*one.get(&row)?, *two.get(&row)?];
            let at = press.estimate()?;
            Some(SeenPress {
                row,
                phases,
                observation: scales.observe(phases, geometry, at),
            })
        })
        .collect()
}

/// Learns a quantity from the calibration presses that measured it.
fn learnt(
    input: &SessionInput,
    seen: &[SeenPress<'_>],
    presses: &[PressResult],
    set: &CalibrationSet,
    measured: impl Fn(usize) -> Option<f64>,
) -> Result<Lesson, NoQuantity> {
    let by_press: HashMap<PressId, &SeenPress<'_>> =
        seen.iter().map(|s| (presses[s.row].press, s)).collect();
    let mut teachers: Vec<Teacher> = set
        .sights()
        .iter()
        .filter_map(|press| {
            let seen = by_press.get(&press.press)?;
            Some(Teacher {
                press: *press,
                observation: seen.observation,
                measured: measured(seen.row)?,
            })
        })
        .collect();
    let learnt = Learnt::new(&mut teachers, input.settings.seed)?;
    let depths: HashMap<PressId, f64> = presses.iter().map(|p| (p.press, p.depth_mm)).collect();
    let of = |t: &Teacher| {
        let depth_mm = depths.get(&t.press.press).copied().unwrap_or_default();
        (t.press.press, t.press.location, depth_mm, t.measured)
    };
    let rows = teachers.iter().map(of).collect();
    Ok((learnt, rows))
}

fn left_out(
    lesson: &Result<Lesson, NoQuantity>,
    press: PressId,
) -> Option<(crate::result::Ranged, f64)> {
    let (learnt, teachers) = lesson.as_ref().ok()?;
    let at = teachers.iter().position(|t| t.0 == press)?;
    Some((learnt.left_out[at]?, teachers[at].3))
}

/// The valid scored presses with estimate and measurement.
fn error_rows(presses: &[PressResult], rows: &[PressIndentation], is_force: bool) -> Vec<Row> {
    let by_press: HashMap<PressId, &PressIndentation> = rows.iter().map(|r| (r.press, r)).collect();
    let scored = presses
        .iter()
        .filter(|p| p.role == PressRole::Score && p.verdict == Verdict::Valid);
    scored
        .filter_map(|p| {
            let own = by_press.get(&p.press)?;
            let (estimate, measured) = if is_force {
                (own.force_n, own.measured_n)
            } else {
                (own.depth_mm, own.measured_mm)
            };
            Some(Row {
                location: p.location.index(),
                depth_mm: p.depth_mm,
                estimate: estimate?,
                measured: measured?,
            })
        })
        .collect()
}

fn summary(
    input: &SessionInput,
    lesson: Result<Lesson, NoQuantity>,
    scored: Vec<Row>,
) -> (Option<Quantity>, Option<NoQuantity>) {
    let (learnt, teachers) = match lesson {
        Ok(lesson) => lesson,
        Err(why) => return (None, Some(why)),
    };
    let pairs = teachers.iter().zip(&learnt.left_out);
    let left_out: Vec<Row> = pairs
        .filter_map(|((_, location, depth_mm, measured), estimate)| {
            Some(Row {
                location: *location,
                depth_mm: *depth_mm,
                estimate: (*estimate)?,
                measured: *measured,
            })
        })
        .collect();
    let taught = Taught {
        by: teachers.len() as u32,
        from_to: learnt.taught,
    };
    (
        Some(quantity(
            &scored,
            &left_out,
            &input.unreached_depths_mm(),
            taught,
            &input.settings,
        )),
        None,
    )
}

/// Fills in what is left of each press, and sums it up over the valid scored ones of `taught` depths: what is left of a shallow press is
/// less than what is left of deep ones.
fn zero(
    input: &SessionInput,
    seen: &[SeenPress<'_>],
    presses: &[PressResult],
    set: &CalibrationSet,
    taught: [f64; 2],
    rows: &mut [PressIndentation],
) -> Option<ZeroReturn> {
    let observed = |s: &&SeenPress<'_>| s.phases.iter().all(|p| is_observed(p));
    let teaches: HashMap<PressId, ()> = set.sights().iter().map(|s| (s.press, ())).collect();
    let habit: Vec<(f64, [&PressPhases; 2])> = seen
        .iter()
        .filter(observed)
        .filter(|s| teaches.contains_key(&presses[s.row].press))
        .filter_map(|s| {
            let at = rows.binary_search_by_key(&presses[s.row].press, |r| r.press);
            Some((rows[at.ok()?].measured_mm?, s.phases))
        })
        .collect();
    let habit = Habit::new(&habit);
    let mut rests = Vec::new();
    let mut after_s = f64::INFINITY;
    for s in seen.iter().filter(observed) {
        let press = &presses[s.row];
        let Ok(at) = rows.binary_search_by_key(&press.press, |r| r.press) else {
            continue;
        };
        let depth = rows[at].measured_mm.or(rows[at].depth_mm.map(|d| d.value));
        rows[at].rest_mm = depth.and_then(|mm| habit.rest_mm(s.phases, mm));
        let scores = press.role == PressRole::Score && press.verdict == Verdict::Valid;
        let measured = rows[at].measured_mm;
        let scores = scores && measured.is_none_or(|mm| Quantity::teaches(taught, mm));
        if let Some(mm) = rows[at].rest_mm.filter(|_| scores) {
            rests.push((press.location.index(), mm));
            let seconds = s.phases.iter().map(|p| p.seconds[AFTER]);
            after_s = seconds.fold(after_s, f64::min);
        }
    }
    (!rests.is_empty()).then(|| zero_return(after_s, &rests, &input.settings))
}

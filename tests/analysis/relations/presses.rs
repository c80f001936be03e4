//! Changes of the plan and the journal: order, names, copies and parts.

use skinrig_analysis::Analysis;
use skinrig_analysis::result::Estimate;
use skinrig_model::{
    AttemptId, ExcludedReason, HostDuration, Point2, PressId, PressRole, PressVerdict, PulseTrain,
    RepetitionId,
};
use skinrig_planted::grid::CLOCKS;

use super::base::{PLACES, SYNC, Session, contact_s, row};
use super::figures::kind;
use super::{BASE, Relation, begins, number};

/// Gives every press another ID, in plan, journal and marks.
fn rename(session: &mut Session, other: impl Fn(u32) -> u32) {
    let input = &mut session.input;
    let renamed = |id: PressId| PressId::from_index(other(id.index()));
    for planned in &mut input.planned {
        planned.id = renamed(planned.id);
    }
    for outcome in input.outcomes.iter_mut().flatten() {
        outcome.attempt.press = renamed(outcome.attempt.press);
    }
    for mark in &mut input.marks {
        mark.mark.press = renamed(mark.mark.press);
    }
    let marks = input.marks.clone();
    for edges in &mut input.edges {
        let of_each = edges.len() / marks.len();
        for (edges, sent) in edges.chunks_mut(of_each).zip(&marks) {
            let begins_us = edges[0].t_us;
            let pulses = PulseTrain::new(sent.mark)
                .into_iter()
                .flat_map(|p| p.pulses());
            let ends = pulses.flat_map(|(rise, width)| [rise, rise + width]);
            for (edge, after_us) in edges.iter_mut().zip(ends) {
                edge.t_us = begins_us + after_us;
            }
        }
    }
}

/// The plan lists the presses backwards, from the last one made to the first; the sync presses stay where they are.
#[test]
fn a_plan_may_list_its_presses_in_any_order() {
    let rows = BASE.0.input.planned.len();
    let other = |row: usize| {
        if row < SYNC {
            row
        } else {
            rows - 1 - (row - SYNC)
        }
    };
    Relation {
        name: "plan reversed",
        change: &|session| {
            rename(session, |id| other(id as usize) as u32);
            let input = &mut session.input;
            input.planned[SYNC..].reverse();
            input.outcomes[SYNC..].reverse();
            input.hold_forces_n[SYNC..].reverse();
        },
        expect: &|path, figure| {
            let moved = |start: &str, path: &str| -> Option<String> {
                let (index, rest) = path.strip_prefix(start)?.split_once(']')?;
                let row = other(index.parse().ok()?);
                Some(format!("{start}{row}]{rest}"))
            };
            if let Some(path_there) = moved("presses[", path) {
                *path = path_there;
            }
            if ["presses[].press", "warnings[].presses[]"].contains(&kind(path).as_str()) {
                number(figure, |n| (other(n as usize - 1) + 1) as f64);
            }
        },
        // Lists by press, texts with their numbers, and random choices by press or in the order of the plan.
        silent: &|kind| {
            let lists = [
                "pictures",
                "zooms",
                "indentation",
                "latency.onsets",
                "locator.model.learnt",
                "warnings[].text",
            ];
            let random = [
                "reduction.curves[].rows",
                "latency.reduced",
                "latency.backgrounds",
            ];
            begins(kind, &lists) || begins(kind, &random)
        },
        digits: &[],
    }
    .holds();
}

#[test]
fn repetitions_may_be_numbered_in_any_order() {
    let other = [0, 1, 4, 2, 3];
    Relation {
        name: "scored repetitions renumbered",
        change: &|session| {
            for planned in &mut session.input.planned {
                let index = planned.repetition.index() as usize;
                planned.repetition = RepetitionId::from_index(other[index]);
            }
        },
        expect: &|path, figure| {
            if kind(path) == "presses[].repetition" {
                number(figure, |n| f64::from(other[n as usize - 1] + 1));
            }
        },
        silent: &|_| false,
        digits: &[],
    }
    .holds();
}

/// The scored presses of every location are those of another one by name; intervals and folds draw locations in the order of
/// their names.
#[test]
fn locations_may_have_any_numbers() {
    Relation {
        name: "locations renumbered",
        change: &|session| {
            for planned in &mut session.input.planned {
                let location = PLACES - 1 - planned.location.index();
                planned.location = skinrig_model::LocationId::from_index(location);
            }
        },
        expect: &|path, figure| {
            if kind(path) == "presses[].location" {
                number(figure, |n| f64::from(PLACES) + 1.0 - n);
            }
        },
        silent: &|kind| {
            let drawn = kind.ends_with(".low") || kind.ends_with(".high");
            let folds = [
                "calibration.compared",
                "calibration.bound",
                "locator",
                "threshold",
            ];
            let learnt = ["indentation", "presses[].region", "pictures", "zooms"];
            drawn || begins(kind, &folds) || begins(kind, &learnt)
        },
        digits: &[],
    }
    .holds();
}

/// A robot that is off by 0.3 mm and -0.2 mm at every scored press.
#[test]
fn an_offset_of_the_truth_is_a_bias_and_no_scatter() {
    let (dx, dy) = (0.3, -0.2);
    Relation {
        name: "truth of scored presses shifted",
        change: &|session| {
            let input = &mut session.input;
            let scored = input.planned.iter().zip(&mut input.outcomes);
            let scored = scored.filter(|(p, _)| p.role == PressRole::Score);
            for outcome in scored.filter_map(|(_, o)| o.as_mut()) {
                let moved = |p: Point2| Point2::new(p.x_mm + dx, p.y_mm + dy);
                outcome.measured_at = outcome.measured_at.map(moved);
            }
        },
        expect: &|path, figure| {
            let is_end = !path.ends_with(".n");
            if is_end && path.contains("bias_x_mm") || is_scored_truth(path, ".truth.x_mm") {
                number(figure, |x| {
                    if path.contains("bias") {
                        x - dx
                    } else {
                        x + dx
                    }
                });
            } else if is_end && path.contains("bias_y_mm") || is_scored_truth(path, ".truth.y_mm") {
                number(figure, |y| {
                    if path.contains("bias") {
                        y - dy
                    } else {
                        y + dy
                    }
                });
            }
        },
        silent: &|kind| {
            let errors = ["rmse", "median_mm", "p95_mm", "within"];
            let of = |metrics: &str| kind.starts_with(metrics);
            let scored = of("scored.") || of("scored_without") || of("penalised") || of("depths");
            let studies = ["reduction", "warnings", "locator.reliability", "cmre"];
            let areas = [
                "coverage.probed",
                "coverage.places",
                "coverage.taxels",
                "coverage.cell",
            ];
            scored && errors.iter().any(|e| kind.contains(e))
                || begins(kind, &studies)
                || begins(kind, &areas)
        },
        digits: &[],
    }
    .holds();
}

fn is_scored_truth(path: &str, end: &str) -> bool {
    let index = path
        .strip_prefix("presses[")
        .and_then(|p| p.split(']').next());
    let index = index.and_then(|i| i.parse::<usize>().ok());
    path.ends_with(end) && index.is_some_and(|i| i >= row(2, 0))
}

/// Sum of squared errors, mm², of an RMSE.
fn squares(rmse: &Estimate) -> f64 {
    f64::from(rmse.n) * rmse.value.unwrap().powi(2)
}

fn sum(mean: &Estimate) -> f64 {
    f64::from(mean.n) * mean.value.unwrap()
}

/// What adds up over presses: squares of errors, errors, located presses, presses within the limit.
fn totals(a: &Analysis) -> Vec<(&'static str, f64)> {
    let m = &a.scored;
    vec![
        ("presses", f64::from(m.rmse_mm.n)),
        ("squares", squares(&m.rmse_mm)),
        ("squares in x", squares(&m.rmse_x_mm)),
        ("squares in y", squares(&m.rmse_y_mm)),
        ("bias in x", sum(&m.bias_x_mm)),
        ("bias in y", sum(&m.bias_y_mm)),
        ("attempted", f64::from(m.located_rate.n)),
        ("located", sum(&m.located_rate)),
        ("within", sum(&m.within_rate)),
        (
            "all presses",
            f64::from(a.scored_without_exclusions.rmse_mm.n),
        ),
        ("all squares", squares(&a.scored_without_exclusions.rmse_mm)),
        (
            "squares by depth",
            a.depths.iter().map(|d| squares(&d.rmse_mm)).sum(),
        ),
        (
            "presses by depth",
            a.depths.iter().map(|d| f64::from(d.rmse_mm.n)).sum(),
        ),
        ("cells", sum(&a.cmre.as_ref().unwrap().percent)),
    ]
}

/// A session that scores every other press, and one that scores those between.
#[test]
fn two_halves_add_up_to_the_whole() {
    let half = |of: u32| {
        let mut session = BASE.0.clone();
        let input = &mut session.input;
        let scored = input.planned.iter().zip(&mut input.outcomes);
        let scored = scored.filter(|(p, _)| p.role == PressRole::Score);
        for (planned, outcome) in scored.filter(|(p, _)| p.id.index() % 2 != of) {
            if let Some(outcome) = outcome
                .as_mut()
                .filter(|o| o.verdict == PressVerdict::Valid)
            {
                let presses_used = planned.id.to_string();
                outcome.verdict = PressVerdict::Excluded(ExcludedReason::NotUsed { presses_used });
            } else {
                *outcome = None;
            }
        }
        session.analysis()
    };
    let (whole, halves) = (BASE.0.analysis(), [half(0), half(1)]);
    for half in &halves {
        assert_eq!(half.calibration, whole.calibration);
        assert_eq!(half.clocks, whole.clocks);
    }
    let [one, two] = halves.each_ref().map(totals);
    for ((name, whole), ((_, one), (_, two))) in
        totals(&whole).into_iter().zip(one.into_iter().zip(two))
    {
        let error = (one + two - whole).abs() / whole.abs().max(1.0);
        println!("halves, {name}: {one} + {two} = {whole}, error {error:e}");
        assert!(error < 1e-12, "{name}: {one} + {two} is not {whole}");
    }
}

/// A scored press is made again at the end, with the same events and measurements.
#[test]
fn a_press_made_twice_counts_twice() {
    let of = row(2, 6);
    let last = BASE.0.input.planned.len() - 1;
    // A whole number of seconds is a whole number of microseconds of both clocks.
    let after_s = (contact_s(last + 1) - contact_s(of)).ceil();
    let mut session = BASE.0.clone();
    let input = &mut session.input;
    let id = PressId::from_index(last as u32 + 1);
    let planned = skinrig_model::PlannedPress {
        id,
        ..input.planned[of]
    };
    let mut outcome = input.outcomes[of].clone().unwrap();
    outcome.attempt = AttemptId {
        press: id,
        number: 1,
    };
    outcome.timing = outcome
        .timing
        .map(|t| t.after(HostDuration::from_secs_f64(after_s)));
    let moves_us = CLOCKS.map(|(_, ppm)| (after_s * (1e6 + ppm)).round() as u64);
    let original = input.planned[of].id;
    for i in 0..input.marks.len() {
        let sent = input.marks[i];
        if sent.mark.press == original {
            let mark = (sent.mark.kind, id);
            let t = sent.t + HostDuration::from_secs_f64(after_s);
            let seen = [0, 1].map(|k| {
                let edges = &input.edges[k];
                edges[i * (edges.len() / input.marks.len())].t_us + moves_us[k]
            });
            skinrig_planted::mark(input, mark, t, sent.uncertainty_ns, |k| seen[k]);
        }
    }
    input.planned.push(planned);
    input.outcomes.push(Some(outcome));
    input.hold_forces_n.push(input.hold_forces_n[of]);
    for (k, events) in session.events.iter_mut().enumerate() {
        let from = skinrig_planted::grid::camera_us(k, contact_s(of) - 0.7) as u64;
        // The background of the base session ends before.
        events.retain(|e| e.t_us < from + moves_us[k]);
        let copies: Vec<_> = events
            .iter()
            .filter(|e| (from..from + 1_600_000).contains(&e.t_us))
            .map(|e| skinrig_model::CdEvent {
                t_us: e.t_us + moves_us[k],
                ..*e
            })
            .collect();
        events.extend(copies);
    }
    let (before, after) = (BASE.0.analysis(), session.analysis());
    let (one, two) = (&after.presses[of], &after.presses[last + 1]);
    assert_eq!(
        (one.views, one.location_outcome, one.region),
        (two.views, two.location_outcome, two.region)
    );
    let (dx, dy) = one.error_mm().unwrap();
    let added = |name: &str| match name {
        "presses" | "attempted" | "located" | "within" | "all presses" | "presses by depth" => 1.0,
        "squares" | "all squares" | "squares by depth" => dx * dx + dy * dy,
        "squares in x" => dx * dx,
        "squares in y" => dy * dy,
        "bias in x" => dx,
        "bias in y" => dy,
        _ => f64::NAN,
    };
    for ((name, before), (_, after)) in totals(&before).into_iter().zip(totals(&after)) {
        if name != "cells" {
            let error = (before + added(name) - after).abs() / after.abs().max(1.0);
            println!(
                "press twice, {name}: {before} + {} = {after}, error {error:e}",
                added(name)
            );
            assert!(
                error < 1e-9,
                "{name}: {before} + {} is not {after}",
                added(name)
            );
        }
    }
}

//! Presses that find the surface by touch, on a simulated rig whose skin is off the frame's surface.

use skinrig_controller::{ControlHandle, Resume, Run};
use skinrig_model::*;
use skinrig_protocol::plan::{Plan, Step};
use skinrig_protocol::{Route, Surface, SurfaceCheck, TouchSearch};
use skinrig_sim::config::SimConfig;
use skinrig_sim::rig::simulated_rig;

use crate::mock::{Sink, header};
use crate::simulated::paced_plan;

const SEARCH: TouchSearch = TouchSearch {
    threshold_n: 0.15,
    samples: 5,
    speed_mm_s: 4.0,
    band_mm: 1.0,
    tare: HostDuration::from_millis(200),
};

fn touching_plan() -> Plan {
    let mut plan = paced_plan();
    for step in &mut plan.steps {
        if let Step::Press(p) = step {
            p.surface = Surface::Touch(SEARCH);
            p.start_after_begin = None;
            p.deadline = HostDuration::from_millis(6_000);
        }
    }
    plan
}

/// Runs the plan with the skin `off_mm` above the frame's surface.
fn run(off_mm: f64, plan: &Plan) -> (RunEnd, Vec<PressOutcome>, Vec<PoseSample>) {
    let config = SimConfig::new(5, SimLevel::Kinematic);
    let mut rig = simulated_rig(&config);
    rig.robot_from_skin.translation_mm[2] -= off_mm;
    let header = RunHeader {
        robot_from_skin: rig.robot_from_skin,
        ..header(plan)
    };
    let mut sink = Sink::default();
    let report = Run::new(plan, header, rig, &ControlHandle::new(), &mut sink).execute();
    assert!(report.retracted && report.disarmed, "{report:?}");
    let (mut outcomes, mut poses) = (Vec::new(), Vec::new());
    for record in sink.records {
        match record {
            Record::Outcome(o) => outcomes.push(o),
            Record::Poses(p) => poses.extend(p),
            _ => {}
        }
    }
    (report.end, outcomes, poses)
}

#[test]
fn the_depth_counts_from_the_touched_surface() {
    for off_mm in [-0.5, 0.0, 0.6] {
        let (end, outcomes, poses) = run(off_mm, &touching_plan());
        assert_eq!(end, RunEnd::Completed);
        assert_eq!(outcomes.len(), 3);
        for o in outcomes {
            assert_eq!(o.verdict, PressVerdict::Valid, "{off_mm}: {o:?}");
            // 0.15 N are 0.25 mm of a skin of 0.6 N/mm, plus or minus noise and viscosity.
            let touched = o.touched_mm.unwrap();
            let late = off_mm - touched;
            assert!((0.1..0.3).contains(&late), "{off_mm}: {touched}");
            let depth = o.measured_depth_mm.unwrap();
            assert!((depth - 2.0).abs() < 0.03, "{depth}");
            // The contact is the time of the touch, on the way down at the touched height.
            let contact = o.timing.unwrap().contact;
            let at = poses.iter().find(|p| p.t == contact).unwrap();
            assert_eq!(at.measured.z_mm, touched);
        }
    }
}

#[test]
fn a_surface_outside_its_band_is_rejected_and_the_run_continues() {
    for (off_mm, words) in [
        (1.5, "found contact immediately"),
        (-1.5, "found none down to"),
    ] {
        let (end, outcomes, poses) = run(off_mm, &touching_plan());
        assert_eq!(end, RunEnd::Completed);
        assert_eq!(outcomes.len(), 3);
        for o in outcomes {
            let reason = o.verdict.reason().unwrap_or_default();
            assert!(reason.contains(words), "{off_mm}: {reason}");
            assert_eq!((o.touched_mm, o.measured_depth_mm), (None, None));
        }
        let lowest = poses.iter().map(|p| p.measured.z_mm).fold(9.0, f64::min);
        assert!(lowest > -1.1, "no indentation: {lowest}");
    }
}

#[test]
fn a_touched_surface_does_not_move_the_floor() {
    let mut plan = touching_plan();
    plan.limits.max_depth_mm = 2.5;
    let (end, outcomes, poses) = run(-0.6, &plan);
    assert_eq!(end, RunEnd::Completed);
    for o in outcomes {
        let reason = o.verdict.reason().unwrap_or_default();
        assert!(reason.contains("above the floor at -2.5 mm"), "{reason}");
    }
    let lowest = poses.iter().map(|p| p.measured.z_mm).fold(9.0, f64::min);
    assert!(lowest > -1.1, "{lowest}");
}

#[test]
fn an_invalid_search_never_moves() {
    for spoil in [
        (|s: &mut TouchSearch| s.band_mm = 5.0) as fn(&mut TouchSearch),
        |s| s.threshold_n = 9.0,
        |s| s.samples = 0,
        |s| s.speed_mm_s = f64::NAN,
    ] {
        let mut plan = touching_plan();
        for step in &mut plan.steps {
            if let Step::Press(p) = step
                && let Surface::Touch(search) = &mut p.surface
            {
                spoil(search);
            }
        }
        let (end, outcomes, _) = run(0.0, &plan);
        assert!(matches!(end, RunEnd::Faulted(_)), "{end:?}");
        assert_eq!(outcomes.len(), 0);
    }
}

fn checked_plan(each_repetition: bool) -> Plan {
    let mut plan = paced_plan();
    plan.surface_check = Some(SurfaceCheck {
        points: vec![Point2::new(9.0, 3.0), Point2::new(12.0, 2.0)],
        tolerance_mm: 0.4,
        each_repetition,
        search: SEARCH,
    });
    plan
}

/// Records of a run with a surface check, with the skin `off_mm` above the frame's surface.
fn checked(off_mm: f64, each_repetition: bool) -> (RunEnd, Vec<Record>) {
    let plan = checked_plan(each_repetition);
    let mut rig = simulated_rig(&SimConfig::new(5, SimLevel::Kinematic));
    rig.robot_from_skin.translation_mm[2] -= off_mm;
    let header = RunHeader {
        robot_from_skin: rig.robot_from_skin,
        ..header(&plan)
    };
    let mut sink = Sink::default();
    let report = Run::new(&plan, header, rig, &ControlHandle::new(), &mut sink).execute();
    assert!(report.retracted && report.disarmed, "{report:?}");
    (report.end, sink.records)
}

fn rows(records: &[Record]) -> Vec<&PreflightCheck> {
    let surface = records.iter().filter_map(|r| match r {
        Record::Preflight(rows) => Some(rows),
        _ => None,
    });
    surface
        .flatten()
        .filter(|row| row.check.starts_with("surface at"))
        .collect()
}

#[test]
fn a_surface_that_moved_ends_the_run_before_any_press() {
    // A touch lies 0.1 to 0.3 mm below this soft skin, tolerance 0.4 mm.
    for (off_mm, found) in [
        (-0.6, "-0."),
        (0.8, "0.5"),
        (-3.0, "found none"),
        (1.5, "immediately"),
    ] {
        let (end, records) = checked(off_mm, false);
        let RunEnd::Faulted(causes) = &end else {
            panic!("{off_mm}: {end:?}");
        };
        let reason = causes.to_string();
        for words in [
            "surface check",
            "(9, 3) mm",
            "(12, 2) mm",
            "0 +- 0.4 mm",
            "touch off again",
        ] {
            assert!(reason.contains(words), "{off_mm}: {words} in {reason}");
        }
        let pressed = records.iter().any(|r| matches!(r, Record::Intent { .. }));
        assert!(!pressed, "{off_mm}");
        let rows = rows(&records);
        assert_eq!(rows.len(), 2, "{off_mm}");
        assert!(
            rows.iter().all(|r| r.verdict == CheckVerdict::Failed),
            "{rows:?}"
        );
        assert!(
            rows.iter().all(|r| r.found.contains(found)),
            "{off_mm}: {rows:?}"
        );
    }
}

#[test]
fn a_surface_in_place_is_checked_and_pressed() {
    for (each_repetition, times) in [(false, 1), (true, 2)] {
        let (end, records) = checked(0.15, each_repetition);
        assert_eq!(end, RunEnd::Completed);
        let rows = rows(&records);
        assert_eq!(rows.len(), 2 * times, "{rows:?}");
        assert!(
            rows.iter().all(|r| r.verdict == CheckVerdict::Passed),
            "{rows:?}"
        );
        let valid = records
            .iter()
            .filter(|r| matches!(r, Record::Outcome(o) if o.verdict == PressVerdict::Valid));
        assert_eq!(valid.count(), 3);
    }
}

#[test]
fn a_further_leg_checks_the_surface_before_it_presses() {
    // The operator may have remounted the skin: 0.8 mm higher than at the start of the session.
    for (off_mm, ends_well) in [(0.15, true), (0.8, false)] {
        let plan = checked_plan(false);
        let cut_off = PressHistory {
            attempts: 1,
            spent: 0,
            verdict: None,
            ..PressHistory::default()
        };
        let done = PressHistory {
            attempts: 1,
            spent: 0,
            verdict: Some(PressVerdict::Valid),
            ..PressHistory::default()
        };
        let histories = vec![done, cut_off, PressHistory::default()];
        let pending = plan.pending(&histories);
        let rest = plan.remaining(|id| pending[id.index() as usize], Route::Straight);
        let mut rig = simulated_rig(&SimConfig::new(5, SimLevel::Kinematic));
        rig.robot_from_skin.translation_mm[2] -= off_mm;
        let header = RunHeader {
            robot_from_skin: rig.robot_from_skin,
            ..header(&plan)
        };
        let (control, mut sink) = (ControlHandle::new(), Sink::default());
        let report = Run::new(&rest, header, rig, &control, &mut sink)
            .resumed(Resume {
                header: ResumeHeader {
                    operator: "o".into(),
                    started_at: String::new(),
                    host: String::new(),
                    software: String::new(),
                    command_line: String::new(),
                },
                histories,
            })
            .execute();
        let at = |is: fn(&Record) -> bool| sink.records.iter().position(is);
        let pressed = at(|r| matches!(r, Record::Intent { .. }));
        let rows = rows(&sink.records);
        assert_eq!(rows.len(), 2, "{report:?}");
        if ends_well {
            assert_eq!((report.end, report.valid), (RunEnd::Completed, 3));
            let checked = at(
                |r| matches!(r, Record::Preflight(rows) if rows.iter().any(|r| r.check.starts_with("surface at"))),
            );
            assert!(checked.is_some() && checked < pressed);
        } else {
            assert!(matches!(report.end, RunEnd::Faulted(_)), "{report:?}");
            assert_eq!(pressed, None);
        }
    }
}

#[test]
fn invalid_presses_in_a_row_end_the_run() {
    let mut plan = touching_plan();
    plan.max_consecutive_invalid = 2;
    let (end, outcomes, _) = run(1.5, &plan);
    let RunEnd::Faulted(causes) = end else {
        panic!("{end:?}");
    };
    let reason = causes.to_string();
    assert!(reason.contains("fewer than 2 in a row"), "{reason}");
    assert!(reason.contains("found contact immediately"), "{reason}");
    assert_eq!(outcomes.len(), 2);
}

#[test]
fn a_robot_that_cannot_reach_the_deepest_touch_is_rejected() {
    let mut plan = touching_plan();
    let (end, ..) = run(0.0, &plan);
    assert_eq!(end, RunEnd::Completed);
    // The presses alone would fit: 2 mm below a surface up to 1 mm below the frame's require 3 mm.
    let mut rig = simulated_rig(&SimConfig::new(5, SimLevel::Kinematic));
    let low_mm = rig.indenter.capabilities().workspace_min_mm[2];
    plan.limits.max_depth_mm = 3.0;
    rig.robot_from_skin.translation_mm[2] = low_mm + 2.5;
    let header = RunHeader {
        robot_from_skin: rig.robot_from_skin,
        ..header(&plan)
    };
    let mut sink = Sink::default();
    let report = Run::new(&plan, header, rig, &ControlHandle::new(), &mut sink).execute();
    let RunEnd::Faulted(causes) = report.end else {
        panic!("{report:?}");
    };
    let reason = causes.to_string();
    assert!(reason.contains("expected a target from"), "{reason}");
}

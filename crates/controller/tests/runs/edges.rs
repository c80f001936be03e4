//! Runs that never arm, and runs dropped by their caller.

use skinrig_model::*;
use skinrig_protocol::plan::{Plan, Step};

use crate::course::{START, faults, run_plan};
use crate::mock::*;

#[test]
fn inconsistent_plans_never_arm() {
    type Change = fn(&mut Plan);
    let broken: [(&str, Change); 7] = [
        ("no travel", |p| {
            p.steps.retain(|s| !matches!(s, Step::Travel { .. }));
        }),
        ("a press less", |p| {
            p.steps.pop();
            p.steps.pop();
        }),
        ("too fast", |p| p.limits.max_speed_mm_s = 10.0),
        ("too deep", |p| p.limits.max_depth_mm = 1.0),
        ("outside", |p| p.limits.workspace_max_mm[0] = 12.0),
        ("beyond the robot", |p| {
            p.limits.max_speed_mm_s = 500.0;
            if let Some(Step::Travel { speed_mm_s, .. }) = p.steps.get_mut(1) {
                *speed_mm_s = 201.0;
            }
        }),
        ("low travel", |p| {
            if let Some(Step::Travel { to, .. }) = p.steps.get_mut(1) {
                to.z_mm = 1.0;
            }
        }),
    ];
    for (case, change) in broken {
        let mut plan = plan();
        change(&mut plan);
        let result = run_plan(&plan, faults(), START, Sink::default());
        assert!(matches!(result.report.end, RunEnd::Faulted(_)), "{case}");
        assert_eq!(result.report.missed, 3, "{case}");
        let w = lock(&result.world);
        assert!(!w.ever_armed && w.commands.is_empty(), "{case}");
        drop(w);
        result.check(case);
    }
}

#[test]
fn notes_of_a_camera_are_recorded() {
    let remark = Some((CameraId::Two, "the time base jumped".to_owned()));
    let faults = Faults { remark, ..faults() };
    let result = run_plan(&plan(), faults, START, Sink::default());
    let notes: Vec<&str> = (result.records.iter())
        .filter_map(|r| match r {
            Record::Note { text, .. } if text.contains("camera") => Some(text.as_str()),
            _ => None,
        })
        .collect();
    assert_eq!(notes, ["camera 2: the time base jumped"]);
}

#[test]
fn notes_of_the_trigger_box_are_recorded() {
    let box_remark = Some("2 edges were late".to_owned());
    let faults = Faults {
        box_remark,
        ..faults()
    };
    let result = run_plan(&plan(), faults, START, Sink::default());
    let is_note = |r: &&Record| matches!(r, Record::Note { text, .. } if text == "trigger box: 2 edges were late");
    assert_eq!(result.records.iter().filter(is_note).count(), 1);
}

//! Invalid presses, and motion faults that end the run.

use crate::course::*;
use crate::mock::*;
use skinrig_controller::Run;
use skinrig_model::*;
use skinrig_protocol::plan::Step;

#[test]
fn a_press_that_does_not_arrive_is_invalid_and_the_next_one_is_done() {
    // An obstacle 1.2 mm below the surface during the second press.
    let result = run(Faults {
        floor_mm: Some((700, -1.2, 1900)),
        ..faults()
    });
    result.check("floor");
    assert_eq!(result.verdicts(), ["valid", "invalid", "valid"]);
    let reason = result.invalid_reason(1);
    assert!(
        reason.contains("expected to settle within 0.05 mm of (10.000, 2.000, -2.000) mm"),
        "{reason}"
    );
    assert!(
        reason.contains("found (10.000, 2.000, -1.200) mm"),
        "{reason}"
    );
    assert_eq!(result.report.end, RunEnd::Completed);
    // Never at depth: no ground truth is reported.
    assert!(result.outcomes()[1].measured_at.is_none() && result.outcomes()[1].timing.is_none());
}

#[test]
fn a_tip_that_gives_way_during_the_hold_is_invalid() {
    let good = run(faults());
    let at_depth = good.outcomes()[1]
        .timing
        .map(|t| t.at_depth.0 / MS)
        .unwrap_or_default();
    let result = run(Faults {
        floor_mm: Some((at_depth + 10, -1.9, at_depth + 15)),
        ..faults()
    });
    result.check("gives way");
    assert_eq!(result.verdicts(), ["valid", "invalid", "valid"]);
    assert!(
        result
            .invalid_reason(1)
            .starts_with("hold: expected within 0.05 mm")
    );
}

#[test]
fn lost_bytes_invalidate_their_press() {
    let good = run(faults());
    let second = good.records.iter().position(
        |r| matches!(r, Record::Intent { attempt, .. } if attempt.press == PressId::from_index(1)),
    );
    let chunk = good
        .records
        .iter()
        .skip(second.unwrap_or(0))
        .find_map(|r| match r {
            Record::Chunk(c) if c.camera == CameraId::Two => Some(c.seq),
            _ => None,
        });
    let result = run(Faults {
        loss: chunk.map(|seq| (CameraId::Two, seq, 7)),
        ..faults()
    });
    result.check("loss");
    assert_eq!(result.verdicts(), ["valid", "invalid", "valid"]);
    assert_eq!(result.invalid_reason(1), "camera 2 lost 7 bytes");
}

/// End of the hold of a press and time at which the tip was clear, ms.
fn hold_and_clear(result: &RunResult, n: usize) -> (i64, i64) {
    let timing = result.outcomes()[n].timing.expect("a completed press");
    (timing.retract.0 / MS, timing.clear.0 / MS)
}

/// Data in transit for 300 ms: losses become known after the end of their press, and invalidate this press and not the next.
#[test]
fn a_loss_reported_late_invalidates_its_own_press() {
    let slow = Faults {
        delay: Some((0, 300)),
        ..faults()
    };
    let good = run(slow.clone());
    good.check("late data");
    assert_eq!(good.verdicts(), ["valid", "valid", "valid"]);
    let (retract, clear) = hold_and_clear(&good, 1);
    assert!(clear - retract < 300, "{retract}..{clear}");
    let result = run(Faults {
        lost_at_ms: Some(clear - 10),
        ..slow
    });
    result.check("late loss");
    assert_eq!(result.verdicts(), ["valid", "invalid", "valid"]);
    assert_eq!(result.invalid_reason(1), "camera 2 lost 8 bytes");
    // At the time when the tip is clear, the loss has not arrived.
    let arrival = result.records.iter().find_map(|r| match r {
        Record::Chunk(c) if c.lost_before > 0 => Some(c.host_time.0 / MS),
        _ => None,
    });
    assert!(arrival.is_some_and(|t| t >= clear + 250), "{arrival:?}");
}

#[test]
fn late_data_differ_from_lost_data() {
    let result = run(Faults {
        delay: Some((0, 3_000)),
        ..faults()
    });
    result.check("too late");
    for n in 0..result.outcomes().len() {
        let reason = result.invalid_reason(n);
        assert!(
            reason.starts_with("data late: camera 2: expected data up to")
                && reason.contains("within 1.000000 s"),
            "{reason}"
        );
    }
}

#[test]
fn a_slow_recorder_only_delays() {
    let mut plan = plan();
    for step in &mut plan.steps {
        if let Step::Press(p) = step {
            p.deadline = HostDuration::from_millis(20_000);
        }
    }
    let world = World::shared(faults(), START);
    let control = lock(&world).control.clone();
    let mut sink = Sink {
        slow: Some((world.clone(), 150)), // longer than the age limit of a pose
        ..Sink::default()
    };
    let report = Run::new(&plan, header(&plan), rig(&world), &control, &mut sink).execute();
    assert_eq!(
        (report.valid, &report.end),
        (3, &RunEnd::Completed),
        "{report:?}"
    );
}

#[test]
fn too_much_force_ends_the_run() {
    let result = run(Faults {
        stiffness_n_mm: 4.5,
        ..faults()
    });
    result.check("force");
    assert_eq!(result.verdicts(), ["invalid"]);
    assert!(
        result
            .end_reason()
            .starts_with("force: expected at most 8 N, found 8."),
        "{}",
        result.end_reason()
    );
    assert_eq!((result.report.invalid, result.report.missed), (1, 2));
}

#[test]
fn an_obstructed_travel_ends_the_run() {
    let result = run(Faults {
        stuck_sideways_ms: Some(50),
        ..faults()
    });
    result.check("stuck");
    assert!(
        result
            .end_reason()
            .starts_with("travel (step 1): expected to settle"),
        "{}",
        result.end_reason()
    );
    assert_eq!(result.report.missed, 3);
}

#[test]
fn a_silent_pose_stream_stops_all_motion() {
    let result = run(Faults {
        poses_end_ms: Some(400),
        ..faults()
    });
    assert!(
        result
            .end_reason()
            .contains("expected a pose sample no older than 0.100000 s"),
        "{}",
        result.end_reason()
    );
    let w = lock(&result.world);
    assert!(!w.armed && result.report.disarmed && !result.report.retracted);
    let last = w.commands.last().map_or(0, |c| c.2);
    assert!(last <= 501 * MS, "commanded blindly at {last}");
}

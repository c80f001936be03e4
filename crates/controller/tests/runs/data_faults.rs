//! Presses that do not count, and faults of motion that end the run.

use crate::course::*;
use crate::mock::*;
use skinrig_controller::Run;
use skinrig_model::*;
use skinrig_protocol::plan::Step;

#[test]
fn a_press_that_does_not_arrive_is_invalid_and_the_next_one_is_done() {
    // Something hard 1.2 mm below the surface during the second press.
    let told = run(Faults {
        floor_mm: Some((700, -1.2, 1900)),
        ..faults()
    });
    told.check("floor");
    assert_eq!(told.verdicts(), ["valid", "invalid", "valid"]);
    let reason = told.invalid_reason(1);
    assert!(
        reason.contains("expected to settle within 0.05 mm of (10.000, 2.000, -2.000) mm"),
        "{reason}"
    );
    assert!(
        reason.contains("found (10.000, 2.000, -1.200) mm"),
        "{reason}"
    );
    assert_eq!(told.report.end, RunEnd::Completed);
    // Never at depth: no truth is reported.
    assert!(told.outcomes()[1].measured_at.is_none() && told.outcomes()[1].timing.is_none());
}

#[test]
fn a_tip_that_gives_way_during_the_hold_is_invalid() {
    let good = run(faults());
    let at_depth = good.outcomes()[1]
        .timing
        .map(|t| t.at_depth.0 / MS)
        .unwrap_or_default();
    let told = run(Faults {
        floor_mm: Some((at_depth + 10, -1.9, at_depth + 15)),
        ..faults()
    });
    told.check("gives way");
    assert_eq!(told.verdicts(), ["valid", "invalid", "valid"]);
    assert!(
        told.invalid_reason(1)
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
    let told = run(Faults {
        loss: chunk.map(|seq| (CameraId::Two, seq, 7)),
        ..faults()
    });
    told.check("loss");
    assert_eq!(told.verdicts(), ["valid", "invalid", "valid"]);
    assert_eq!(told.invalid_reason(1), "camera 2 lost 7 bytes");
}

/// When the hold of a press ended and when the tip was clear, ms.
fn hold_and_clear(told: &Told, n: usize) -> (i64, i64) {
    let timing = told.outcomes()[n].timing.expect("a press that was made");
    (timing.retract.0 / MS, timing.clear.0 / MS)
}

/// Data on their way for 300 ms: what is lost of a press becomes known after its end, and spoils this press and not the next.
#[test]
fn a_loss_that_is_told_late_spoils_the_press_that_it_was_in() {
    let slow = Faults {
        delay: Some((0, 300)),
        ..faults()
    };
    let good = run(slow.clone());
    good.check("late data");
    assert_eq!(good.verdicts(), ["valid", "valid", "valid"]);
    let (retract, clear) = hold_and_clear(&good, 1);
    assert!(clear - retract < 300, "{retract}..{clear}");
    let told = run(Faults {
        lost_at_ms: Some(clear - 10),
        ..slow
    });
    told.check("late loss");
    assert_eq!(told.verdicts(), ["valid", "invalid", "valid"]);
    assert_eq!(told.invalid_reason(1), "camera 2 lost 8 bytes");
    // Nothing is known of it by the clock of arrival alone when the tip is clear.
    let arrival = told.records.iter().find_map(|r| match r {
        Record::Chunk(c) if c.lost_before > 0 => Some(c.host_time.0 / MS),
        _ => None,
    });
    assert!(arrival.is_some_and(|t| t >= clear + 250), "{arrival:?}");
}

#[test]
fn data_that_come_too_late_are_told_from_lost_ones() {
    let told = run(Faults {
        delay: Some((0, 3_000)),
        ..faults()
    });
    told.check("too late");
    for n in 0..told.outcomes().len() {
        let reason = told.invalid_reason(n);
        assert!(
            reason.starts_with("data late: camera 2: expected data up to")
                && reason.contains("within 1.000000 s"),
            "{reason}"
        );
    }
}

#[test]
fn a_slow_recorder_delays_but_breaks_nothing() {
    let mut plan = plan();
    for step in &mut plan.steps {
        if let Step::Press(p) = step {
            p.deadline = HostDuration::from_millis(20_000);
        }
    }
    let world = World::shared(faults(), START);
    let control = lock(&world).control.clone();
    let mut sink = Sink {
        slow: Some((world.clone(), 150)), // longer than a pose may be old
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
    let told = run(Faults {
        stiffness_n_mm: 4.5,
        ..faults()
    });
    told.check("force");
    assert_eq!(told.verdicts(), ["invalid"]);
    assert!(
        told.end_reason()
            .starts_with("force: expected at most 8 N, found 8."),
        "{}",
        told.end_reason()
    );
    assert_eq!((told.report.invalid, told.report.missed), (1, 2));
}

#[test]
fn an_obstructed_travel_ends_the_run() {
    let told = run(Faults {
        stuck_sideways_ms: Some(50),
        ..faults()
    });
    told.check("stuck");
    assert!(
        told.end_reason()
            .starts_with("travel (step 1): expected to settle"),
        "{}",
        told.end_reason()
    );
    assert_eq!(told.report.missed, 3);
}

#[test]
fn a_silent_pose_stream_stops_all_motion() {
    let told = run(Faults {
        poses_end_ms: Some(400),
        ..faults()
    });
    assert!(
        told.end_reason()
            .contains("expected a pose sample no older than 0.100000 s"),
        "{}",
        told.end_reason()
    );
    let w = lock(&told.world);
    assert!(!w.armed && told.report.disarmed && !told.report.retracted);
    let last = w.commands.last().map_or(0, |c| c.2);
    assert!(last <= 501 * MS, "commanded blindly at {last}");
}

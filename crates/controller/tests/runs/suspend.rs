//! Suspensions: no chatter, one record per transition, and a limit on the wait.

use proptest::prelude::*;
use skinrig_controller::suspend::{Hysteresis, Transition};
use skinrig_controller::{RecordSink, Run, SinkFault};
use skinrig_model::{HostDuration, HostTime, InterruptionKind, Record, RunEnd};
use skinrig_protocol::{PressHandling, Suspend, Threshold};

use crate::course::{START, faults, run_plan};
use crate::mock::*;

const STORM: Threshold = Threshold {
    trip: 100.0,
    resume: 60.0,
    lasting: HostDuration::from_millis(300),
};
const RESUME_AFTER: HostDuration = HostDuration::from_millis(500);

proptest! {
    /// For any values: transitions alternate, a trip needs `lasting` beyond the first level and a clearing needs `resume_after`
    /// on the safe side of the second, both without interruption.
    #[test]
    fn turns_alternate_and_last(values in prop::collection::vec(
        prop_oneof![4 => 0.0..200.0f64, 1 => Just(f64::NAN), 4 => 90.0..110.0f64, 4 => 50.0..70.0f64], 1..200,
    ), hold in 1usize..12) {
        let mut follow = Hysteresis::new(STORM, RESUME_AFTER);
        let values: Vec<f64> = values.into_iter().flat_map(|v| std::iter::repeat_n(v, hold)).collect();
        let mut last: Option<(usize, Transition)> = None;
        for (i, value) in values.iter().enumerate() {
            let t = HostTime(i as i64 * 100 * MS);
            let Some(turn) = follow.feed(t, *value) else { continue };
            let (span, side): (usize, fn(f64) -> bool) = match turn {
                Transition::Tripped => (3, |v| v > 100.0),
                Transition::Cleared => (5, |v| v <= 60.0),
            };
            prop_assert!(i >= span && values[i - span..=i].iter().all(|v| side(*v)), "{turn:?} at {i}");
            prop_assert_eq!(follow.is_tripped(), turn == Transition::Tripped);
            let expected = last.is_none_or(|(_, before)| before != turn);
            prop_assert!(expected && (last.is_some() || turn == Transition::Tripped));
            prop_assert!(last.is_none_or(|(before, _)| i - before > span), "chatter");
            last = Some((i, turn));
        }
    }

    /// Between the two levels nothing changes, for any duration.
    #[test]
    fn the_band_is_quiet(values in prop::collection::vec(60.01..=100.0f64, 1..200), begin in any::<bool>()) {
        let mut follow = Hysteresis::new(STORM, RESUME_AFTER);
        let mut t = 0;
        while begin && !follow.is_tripped() {
            follow.feed(HostTime(t), 1000.0);
            t += 100 * MS;
        }
        for value in values {
            prop_assert_eq!(follow.feed(HostTime(t), value), None);
            t += 100 * MS;
        }
    }
}

#[test]
fn small_values_can_trip() {
    let dark = Threshold {
        trip: 5.0,
        resume: 6.0,
        lasting: HostDuration::ZERO,
    };
    let mut follow = Hysteresis::new(dark, HostDuration::ZERO);
    let turns = [7.0, 5.0, 4.9, 5.5, 6.0].map(|v| follow.feed(HostTime(0), v));
    assert_eq!(
        turns,
        [
            None,
            None,
            Some(Transition::Tripped),
            None,
            Some(Transition::Cleared)
        ]
    );
}

/// A sink on a disk whose free space is scripted, by the rig's time in ms.
struct Disk {
    sink: Sink,
    world: Shared,
    low: std::ops::Range<i64>,
}

impl RecordSink for Disk {
    fn accept(&mut self, record: Record) -> Result<(), SinkFault> {
        self.sink.accept(record)
    }
    fn free_bytes(&mut self) -> Option<u64> {
        let ms = lock(&self.world).t / MS;
        Some(if self.low.contains(&ms) {
            4_000_000_000
        } else {
            7_000_000_000
        })
    }
}

/// A run whose disk is full for some time: records of interruptions, its end, and the number of valid presses.
fn run(
    low_ms: std::ops::Range<i64>,
    press: PressHandling,
    operator: Option<(u64, OperatorAction)>,
) -> (Vec<(InterruptionKind, i64, String)>, RunEnd, usize) {
    let mut plan = plan();
    plan.suspend = Suspend {
        disk_free: Some(Threshold {
            trip: 5e9,
            resume: 6e9,
            lasting: HostDuration::ZERO,
        }),
        press,
        resume_after: HostDuration::from_millis(2_000),
        give_up_after: HostDuration::from_millis(20_000),
        ..Suspend::default()
    };
    let world = World::shared(
        Faults {
            operator,
            ..faults()
        },
        START,
    );
    let control = lock(&world).control.clone();
    let mut disk = Disk {
        sink: Sink::default(),
        world: world.clone(),
        low: low_ms,
    };
    let report = Run::new(&plan, header(&plan), rig(&world), &control, &mut disk).execute();
    let rows = disk.sink.records.into_iter().filter_map(|r| match r {
        Record::Interruption { kind, t, reason } => Some((kind, t.0 / MS, reason.to_string())),
        _ => None,
    });
    (rows.collect(), report.end, report.valid)
}

#[test]
fn a_full_disk_suspends_and_the_run_continues() {
    let (rows, end, valid) = run(500..5_000, PressHandling::Finish, None);
    assert_eq!((end, valid), (RunEnd::Completed, 3), "{rows:?}");
    let [(pause, at, why), (resume, then, because)] = rows.as_slice() else {
        panic!("{rows:?}");
    };
    assert_eq!(
        (*pause, *resume),
        (InterruptionKind::Pause, InterruptionKind::Resume)
    );
    assert_eq!(
        why,
        "suspended: free space: expected at least 5000000000 B, found 4000000000 B"
    );
    assert!(
        because.starts_with("no longer suspended: free space"),
        "{because}"
    );
    assert!(
        (1_000..2_600).contains(at) && (7_000..9_000).contains(then),
        "{rows:?}"
    );
}

#[test]
fn a_disk_that_stays_full_ends_the_run() {
    let (rows, end, valid) = run(500..i64::MAX, PressHandling::BreakOff, None);
    let RunEnd::Faulted(causes) = end else {
        panic!("{end:?}");
    };
    let reason = causes.to_string();
    assert!(reason.starts_with("suspended: free space"), "{reason}");
    assert!(reason.contains("20.000000 s"), "{reason}");
    assert_eq!(rows[0].0, InterruptionKind::PauseNow);
    assert!(valid < 3);
}

/// A condition that begins during the operator's pause still applies when they resume.
#[test]
fn a_condition_that_began_during_a_pause_suspends_after_it() {
    let pause = Some((100, OperatorAction::Pause)); // at 0.5 s; resumes a second later
    let (rows, end, valid) = run(600..8_000, PressHandling::Finish, pause);
    assert_eq!((end, valid), (RunEnd::Completed, 3), "{rows:?}");
    let words: Vec<&str> = rows.iter().map(|(_, _, why)| why.as_str()).collect();
    assert_eq!(words[..2], ["operator: pause", "operator: resume"]);
    assert!(words[2].starts_with("suspended: free space"), "{rows:?}");
    assert!(words[3].starts_with("no longer suspended"), "{rows:?}");
}

/// A camera with a thermometer is monitored once a second; one without is read once, and the session notes it.
#[test]
fn a_hot_camera_suspends_until_it_is_cool() {
    let mut plan = plan();
    plan.suspend = Suspend {
        temperature: Some(Threshold {
            trip: 60.0,
            resume: 50.0,
            lasting: HostDuration::ZERO,
        }),
        resume_after: HostDuration::from_millis(2_000),
        ..Suspend::default()
    };
    let hot = Faults {
        hot_ms: Some(500..6_000),
        ..faults()
    };
    let result = run_plan(&plan, hot, START, Sink::default());
    let mut rows = Vec::new();
    let mut notes = Vec::new();
    for record in &result.records {
        match record {
            Record::Interruption { kind, t, reason } => {
                rows.push((*kind, t.0 / MS, reason.to_string()))
            }
            Record::Note { text, .. } if text.contains("temperature") => notes.push(text),
            _ => {}
        }
    }
    assert_eq!(result.report.end, RunEnd::Completed, "{rows:?}");
    let [
        (InterruptionKind::Pause, at, why),
        (InterruptionKind::Resume, then, because),
    ] = &rows[..]
    else {
        panic!("{rows:?}");
    };
    assert_eq!(
        why,
        "suspended: camera 1: temperature: expected at most 60 °C, found 70 °C"
    );
    assert!(because.starts_with("no longer suspended: camera 1: temperature"));
    assert!(
        (1_000..2_600).contains(at) && (8_000..10_000).contains(then),
        "{rows:?}"
    );
    assert_eq!(
        notes,
        ["suspend.temperature: camera 2 cannot measure its temperature: not monitored"]
    );
    let world = lock(&result.world);
    let seconds = u32::try_from(world.t / (1_000 * MS)).unwrap();
    assert_eq!(world.temperature_reads[1], 1);
    assert!((2..=seconds + 1).contains(&world.temperature_reads[0]));
}

#[test]
fn a_camera_without_a_limit_is_not_read() {
    let hot = Faults {
        hot_ms: Some(0..i64::MAX),
        ..faults()
    };
    let result = run_plan(&plan(), hot, START, Sink::default());
    assert_eq!(result.report.end, RunEnd::Completed);
    assert_eq!(lock(&result.world).temperature_reads, [0, 0]);
}

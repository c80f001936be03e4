//! Press times and roles of recordings made without skinrig.

use crate::common::shipped;
use skinrig_model::{HostDuration, HostTime, Point2, PressRole};
use skinrig_protocol::Schedule;

fn schedule(name: &str, overrides: &[&str]) -> Schedule {
    let overrides: Vec<String> = overrides.iter().map(|s| (*s).to_owned()).collect();
    Schedule::parse(name, shipped(name).as_bytes(), &overrides).unwrap_or_else(|e| panic!("{e}"))
}

/// A time in integer nanoseconds.
fn ns(t: HostTime) -> i64 {
    t.0
}

#[test]
fn times_of_the_published_recording() {
    let schedule = schedule("paper-recording.schedule.yaml", &[]);
    let positions: Vec<Point2> = (0..289).map(|k| Point2::new(f64::from(k), 0.0)).collect();
    let (planned, times) = schedule.planned(&positions).unwrap();
    assert_eq!(planned.len(), 3 + 2890);
    let used = planned.iter().filter(|p| schedule.is_used(p)).count();
    assert_eq!(used, 3 + 2500);
    // The first downward motion begins at 0; sync presses 1 s apart; the path 3 s after the last.
    assert_eq!(ns(times[0]), 450_000_000);
    assert_eq!(ns(times[2]) - ns(times[0]), 2_000_000_000);
    assert_eq!(ns(times[3]) - ns(times[2]), 3_000_000_000);
    assert_eq!(schedule.phases.at(times[0]).approach, HostTime::ZERO);
    // 17 periods are 868 / 17 s; a repetition takes 868 s and pauses 3 s, however many of its presses are used.
    assert_eq!(ns(times[3 + 17]) - ns(times[3]), 51_058_823_529);
    assert_eq!(ns(times[3 + 289]) - ns(times[3]), 871_000_000_000);
    assert_eq!(ns(times[3 + 9 * 289]) - ns(times[3]), 9 * 871_000_000_000);
    let press = planned[3 + 289];
    assert_eq!(
        (
            press.repetition.number(),
            press.location.number(),
            press.role
        ),
        (2, 1, PressRole::Score)
    );
    assert_eq!(planned[3].role, PressRole::Calibrate);
    assert!(
        planned
            .iter()
            .enumerate()
            .all(|(k, p)| p.id.index() as usize == k)
    );
    let timing = schedule.phases.at(times[3]);
    assert_eq!(
        (timing.release - timing.contact),
        HostDuration::from_millis(550)
    );
    assert_eq!(schedule.csv_unit_mm, 1000.0);
}

#[test]
fn one_key_selects_the_other_sync_interval() {
    let schedule = schedule("paper-recording.schedule.yaml", &["sync.interval=2 s"]);
    let (_, times) = schedule.planned(&[Point2::default(); 289]).unwrap();
    assert_eq!(ns(times[3]) - ns(times[0]), 7_000_000_000);
}

#[test]
fn alternating_presses_never_do_both() {
    let schedule = schedule(
        "single-repetition.schedule.yaml",
        &["evaluation.alternate.first=2"],
    );
    let (planned, _) = schedule.planned(&[Point2::default(); 289]).unwrap();
    let roles: Vec<PressRole> = planned[3..7].iter().map(|p| p.role).collect();
    use PressRole::{Calibrate, Score};
    assert_eq!(roles, [Score, Calibrate, Score, Calibrate]);
    assert_eq!(planned.iter().filter(|p| p.role == Calibrate).count(), 144);
}

#[test]
fn the_number_of_positions_must_fit() {
    let error = schedule("ten-presses.schedule.yaml", &[])
        .planned(&[Point2::default(); 9])
        .unwrap_err();
    assert_eq!(
        error.to_string(),
        "expected 10 press positions, `presses_per_repetition` of ten-presses.schedule.yaml, found 9; correct the key or use the recording's own CSV"
    );
}

#[test]
fn overlapping_presses_are_refused() {
    for (key, path) in [
        ("period=800 ms", "period"),
        ("sync.interval=800 ms", "sync.interval"),
        ("sync.pause_after=0.8 s", "sync.pause_after"),
    ] {
        let text = shipped("ten-presses.schedule.yaml");
        let error = Schedule::parse("x", text.as_bytes(), &[key.to_owned()]).unwrap_err();
        assert_eq!(error.list().len(), 1, "{error}");
        assert_eq!(error.list()[0].path, path);
        assert_eq!(error.list()[0].message, "the presses overlap");
    }
}

#[test]
fn a_schedule_has_time_at_depth_and_on_the_way_up() {
    let shipped = shipped("paper-recording.schedule.yaml");
    let read = |from: &str, to: &str| {
        let text = shipped.replace(from, to);
        assert_ne!(text, shipped);
        Schedule::parse("s.yaml", text.as_bytes(), &[])
    };
    for (from, to, expected) in [
        (
            "retract: 50 ms",
            "retract: -91 ms",
            "at least -90 ms, 10 ms after `at_depth`",
        ),
        (
            "release: 275 ms",
            "release: 59 ms",
            "at least 60 ms, 10 ms after `retract`",
        ),
    ] {
        let error = read(from, to).unwrap_err();
        assert_eq!(error.list().len(), 1, "{error}");
        assert!(error.to_string().contains("too close together"), "{error}");
        assert!(
            error.render(false).contains(expected),
            "{}",
            error.render(false)
        );
    }
    assert!(read("retract: 50 ms", "retract: -90 ms").is_ok());
    assert!(read("release: 275 ms", "release: 60 ms").is_ok());
}

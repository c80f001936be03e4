//! Whole runs on a scripted rig: a run without faults, and the checks for every run.

use crate::mock::*;
use skinrig_controller::{Run, RunReport};
use skinrig_device::SyncMode;
use skinrig_model::*;
use skinrig_protocol::plan::Plan;

pub(crate) const START: [f64; 3] = [-5.0, 3.0, 20.0];

pub(crate) struct RunResult {
    pub world: Shared,
    pub records: Vec<Record>,
    pub report: RunReport,
}

pub(crate) fn run_plan(plan: &Plan, faults: Faults, start: [f64; 3], sink: Sink) -> RunResult {
    let world = World::shared(faults, start);
    let control = lock(&world).control.clone();
    let mut sink = sink;
    let report = Run::new(plan, header(plan), rig(&world), &control, &mut sink).execute();
    RunResult {
        world,
        records: sink.records,
        report,
    }
}

pub(crate) fn run(faults: Faults) -> RunResult {
    run_plan(&plan(), faults, START, Sink::default())
}

pub(crate) fn faults() -> Faults {
    Faults {
        train_ms: 9,
        stiffness_n_mm: 0.5,
        ..Faults::default()
    }
}

impl RunResult {
    pub(crate) fn outcomes(&self) -> Vec<&PressOutcome> {
        let mut found = Vec::new();
        for r in &self.records {
            if let Record::Outcome(o) = r {
                found.push(o);
            }
        }
        found
    }

    pub(crate) fn verdicts(&self) -> Vec<&'static str> {
        self.outcomes().iter().map(|o| o.verdict.name()).collect()
    }

    pub(crate) fn invalid_reason(&self, n: usize) -> String {
        let outcome = self.outcomes()[n];
        let reason = outcome.verdict.reason();
        reason.unwrap_or_else(|| "valid".to_owned())
    }

    pub(crate) fn end_reason(&self) -> String {
        let reason = self.report.end.reason();
        reason.unwrap_or_else(|| "completed".to_owned())
    }

    /// Invariants of every run whose sink accepted all records.
    pub(crate) fn check(&self, case: &str) {
        self.check_rig(case);
        let n = self.report.planned as u32;
        for press in 0..n {
            let ends = self.records.iter().filter(|r| match r {
                Record::Outcome(o) => o.attempt.press.index() == press,
                Record::Missed(a, MissedReason::RunEnded(_)) => a.press.index() == press,
                _ => false,
            });
            assert_eq!(ends.count(), 1, "{case}: press {press} ends once");
        }
        let position = |matches: &dyn Fn(&Record) -> bool| self.records.iter().position(matches);
        for press in 0..n {
            let outcome =
                position(&|r| matches!(r, Record::Outcome(o) if o.attempt.press.index() == press));
            let intent = position(
                &|r| matches!(r, Record::Intent { attempt, .. } if attempt.press.index() == press),
            );
            assert_eq!(outcome.is_some(), intent.is_some(), "{case}: press {press}");
            assert!(intent <= outcome, "{case}: intent before outcome");
        }
        assert!(matches!(self.records[0], Record::Started(_)), "{case}");
        let ends = self
            .records
            .iter()
            .filter(|r| matches!(r, Record::Ended { .. }));
        assert_eq!(ends.count(), 1, "{case}: ends once");
        assert!(
            matches!(self.records.last(), Some(Record::Ended { end, .. }) if *end == self.report.end),
            "{case}: the end is the last record"
        );
        let result = |any: &[InterruptionKind]| {
            self.records
                .iter()
                .any(|r| matches!(r, Record::Interruption { kind, .. } if any.contains(kind)))
        };
        use InterruptionKind as K;
        if self.report.end == RunEnd::Completed {
            // A stop requested during the last press is recorded, too.
            assert!(!result(&[K::Abort, K::Halt, K::Fault]), "{case}");
        } else {
            assert!(result(&[K::Stop, K::Abort, K::Halt, K::Fault]), "{case}");
        }
        let mut last = HostTime(-1);
        for r in &self.records {
            let Record::Poses(block) = r else { continue };
            for p in block {
                assert!(p.t > last, "{case}: poses in order");
                last = p.t;
            }
        }
    }

    /// Invariants of the rig after every run.
    pub(crate) fn check_rig(&self, case: &str) {
        let w = lock(&self.world);
        let r = &self.report;
        assert_eq!(w.violations, Vec::<String>::new(), "{case}");
        assert_eq!(r.planned, r.valid + r.invalid + r.missed, "{case}: {r:?}");
        assert_eq!(w.streaming, [false; 2], "{case}: cameras stopped");
        assert_eq!(r.disarmed, w.confirmed, "{case}: {r:?}");
        if r.disarmed {
            assert!(!w.armed, "{case}: disarmed");
            let halted = r.end == RunEnd::Stopped(StopReason::Halt);
            assert!(r.retracted || halted, "{case}: {r:?}");
            assert!(
                halted || !w.ever_armed || w.tip[2] >= 4.94,
                "{case}: off the skin, at {:?}",
                w.tip
            );
        } else {
            assert_eq!(w.dead, Some(DeviceRole::Indenter), "{case}");
            assert!(matches!(r.end, RunEnd::Faulted(_)), "{case}");
        }
    }
}

#[test]
fn a_good_run() {
    let result = run(faults());
    result.check("good");
    assert_eq!(result.report.end, RunEnd::Completed, "{:?}", result.report);
    assert_eq!(result.verdicts(), ["valid"; 3], "{:?}", result.outcomes());
    assert_eq!(result.report.problems, Vec::new());
    let w = lock(&result.world);
    let limits = w.limits.as_ref().map(|l| (l.min_mm, l.max_mm));
    // Skin x -40..60, y -50..55, z -3..40, each 0.05 wider, rotated by 90 degrees and shifted.
    let (min, max) = limits.unwrap_or_default();
    for (found, expected) in min
        .iter()
        .chain(&max)
        .zip([-50.05, -43.05, 8.95, 55.05, 57.05, 52.05])
    {
        assert!((found - expected).abs() < 1e-9, "{min:?} {max:?}");
    }
    for (o, planned) in result.outcomes().iter().zip(plan().presses) {
        let t = o.timing.as_ref().map(|t| {
            [
                t.approach, t.contact, t.at_depth, t.retract, t.release, t.clear,
            ]
        });
        let t = t.unwrap_or_default();
        assert!(t.is_sorted_by(|a, b| a < b), "{t:?}");
        let at = o.measured_at.unwrap_or_default();
        assert!(at.distance_mm(planned.at) < 1e-9);
        assert!((o.measured_depth_mm.unwrap_or_default() - 2.0).abs() < 1e-9);
        assert!((o.peak_force_n.unwrap_or_default() - 1.0).abs() < 1e-9);
        // Up at 70 mm/s from 2 mm deep: out of the skin after 28.6 ms (sampled each ms).
        let up = (t[4] - t[3]).as_secs_f64();
        assert!((up - 2.0 / 70.0).abs() < 1.6e-3, "{up}");
        // Hold 30 ms after settling, on the tick; then the set point moves within a sample.
        let hold = (t[3] - t[2]).0;
        assert!((30 * MS..=32 * MS).contains(&hold), "{hold}");
    }
    // Each downward motion begins in its slot.
    let slots: Vec<i64> = result
        .records
        .iter()
        .filter_map(|r| match r {
            Record::Intent { t, .. } => Some(t.0),
            _ => None,
        })
        .collect();
    assert_eq!(slots[1] - slots[0], 503 * MS);
    assert_eq!(slots[2] - slots[1], 503 * MS);
}

#[test]
fn a_run_is_a_function_of_its_rig() {
    let (one, two) = (run(faults()), run(faults()));
    assert!(one.records.len() > 30);
    assert!(one.records == two.records);
}

#[test]
fn bytes_poses_and_marks_precede_the_outcome() {
    for train_ms in [9, 250] {
        check_order(train_ms);
    }
}

fn check_order(train_ms: i64) {
    let result = run(Faults {
        train_ms,
        ..faults()
    });
    assert_eq!(result.report.valid, 3);
    let mut line_until = HostTime::ZERO;
    let mut counts = [0; 3];
    let mut seen_to = HostTime::ZERO;
    let mut bytes_to = [HostTime::ZERO; 2];
    let mut moved_for = None;
    for r in &result.records {
        match r {
            Record::Poses(block) => seen_to = block.last().map_or(seen_to, |p| p.t),
            Record::Chunk(c) => bytes_to[c.camera.index()] = c.host_time,
            Record::MarkSent(sent) => {
                counts[sent.mark.press.index() as usize] += 1;
                line_until = sent.t + HostDuration::from_millis(train_ms);
            }
            Record::Intent { attempt, .. } => moved_for = Some(attempt.press),
            Record::Command { command, .. } => {
                assert!(command.target.z_mm >= 5.0 || moved_for.is_some());
            }
            Record::Outcome(o) => {
                let clear = o.timing.map(|t| t.clear).unwrap_or_default();
                // Every edge of the last mark is in the bytes.
                assert!(bytes_to.iter().all(|t| *t >= line_until));
                assert!(seen_to >= clear && bytes_to.iter().all(|t| *t >= clear));
                assert_eq!(
                    counts[o.attempt.press.index() as usize],
                    3,
                    "marks of {}",
                    o.attempt
                );
                moved_for = None;
            }
            _ => {}
        }
    }
}

#[test]
fn marks_wait_for_a_busy_line() {
    let result = run(Faults {
        train_ms: 120,
        ..faults()
    });
    result.check("busy line"); // the mock calls a mark on a busy line a violation
    let kinds: Vec<MarkKind> = result
        .records
        .iter()
        .filter_map(|r| match r {
            Record::MarkSent(s) => Some(s.mark.kind),
            _ => None,
        })
        .collect();
    assert_eq!(
        kinds,
        [MarkKind::Contact, MarkKind::AtDepth, MarkKind::Release].repeat(3)
    );
    assert_eq!(result.verdicts(), ["valid"; 3]);
}

#[test]
fn the_tip_rises_first_from_an_unknown_start() {
    let result = run_plan(&plan(), faults(), [20.0, 30.0, -1.0], Sink::default());
    result.check("low start");
    assert_eq!(result.report.valid, 3);
    let w = lock(&result.world);
    let (target, speed, _) = w.commands[0];
    assert!((target[0] - 20.0).abs() < 1e-9 && (target[1] - 30.0).abs() < 1e-9);
    assert!((target[2] - 5.0).abs() < 1e-9 && speed <= 20.0);
}

#[test]
fn a_camera_that_follows_another_starts_first() {
    let started = |modes: [SyncMode; 2]| {
        let plan = plan();
        let world = World::shared(faults(), START);
        let control = lock(&world).control.clone();
        let mut rig = rig(&world);
        for (settings, sync) in rig.camera_settings.iter_mut().zip(modes) {
            settings.sync = sync;
        }
        let report = Run::new(&plan, header(&plan), rig, &control, &mut Sink::default()).execute();
        assert_eq!(report.end, RunEnd::Completed);
        let w = lock(&world);
        w.started.clone()
    };
    let (one, two) = (CameraId::One, CameraId::Two);
    assert_eq!(started([SyncMode::Master, SyncMode::Slave]), [two, one]);
    assert_eq!(started([SyncMode::Slave, SyncMode::Master]), [one, two]);
    assert_eq!(started([SyncMode::Standalone; 2]), [one, two]);
}

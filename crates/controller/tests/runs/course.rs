//! Whole runs on a scripted rig: the good course, and every way it can break off.

use crate::mock::*;
use skinrig_controller::{RunReport, execute};
use skinrig_device::SyncMode;
use skinrig_model::*;
use skinrig_protocol::plan::{Plan, Step};

pub const START: [f64; 3] = [-5.0, 3.0, 20.0];

pub struct Told {
    pub world: Shared,
    pub records: Vec<Record>,
    pub report: RunReport,
}

pub fn run_plan(plan: &Plan, faults: Faults, start: [f64; 3], sink: Sink) -> Told {
    let world = World::shared(faults, start);
    let control = lock(&world).control.clone();
    let mut sink = sink;
    let report = execute(plan, header(plan), rig(&world), &control, &mut sink);
    Told {
        world,
        records: sink.records,
        report,
    }
}

pub fn run(faults: Faults) -> Told {
    run_plan(&plan(), faults, START, Sink::default())
}

pub fn faults() -> Faults {
    Faults {
        train_ms: 9,
        stiffness_n_mm: 0.5,
        ..Faults::default()
    }
}

impl Told {
    fn outcomes(&self) -> Vec<&PressOutcome> {
        let mut found = Vec::new();
        for r in &self.records {
            if let Record::Outcome(o) = r {
                found.push(o);
            }
        }
        found
    }

    fn verdicts(&self) -> Vec<&'static str> {
        self.outcomes().iter().map(|o| o.verdict.name()).collect()
    }

    fn invalid_reason(&self, n: usize) -> &str {
        self.outcomes()[n].verdict.reason().unwrap_or("valid")
    }

    fn end_reason(&self) -> &str {
        match &self.report.end {
            RunEnd::Completed => "completed",
            RunEnd::Stopped(r) | RunEnd::Faulted(r) => r,
        }
    }

    /// What must hold after every run whose sink took all records.
    pub fn check(&self, case: &str) {
        self.check_rig(case);
        let n = self.report.planned as u32;
        for press in 0..n {
            let ends = self.records.iter().filter(|r| match r {
                Record::Outcome(o) => o.attempt.press.0 == press,
                Record::Missed(a, reason) => a.press.0 == press && !reason.is_empty(),
                _ => false,
            });
            assert_eq!(ends.count(), 1, "{case}: press {press} ends once");
        }
        let position = |wanted: &dyn Fn(&Record) -> bool| self.records.iter().position(wanted);
        for press in 0..n {
            let outcome =
                position(&|r| matches!(r, Record::Outcome(o) if o.attempt.press.0 == press));
            let intent = position(
                &|r| matches!(r, Record::Intent { attempt, .. } if attempt.press.0 == press),
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
        let told = |any: &[InterruptionKind]| {
            self.records
                .iter()
                .any(|r| matches!(r, Record::Interruption { kind, .. } if any.contains(kind)))
        };
        use InterruptionKind as K;
        if self.report.end == RunEnd::Completed {
            // A stop that came during the last press is told, too.
            assert!(!told(&[K::Abort, K::Halt, K::Fault]), "{case}");
        } else {
            assert!(told(&[K::Stop, K::Abort, K::Halt, K::Fault]), "{case}");
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

    /// What must hold of the rig after every run.
    pub fn check_rig(&self, case: &str) {
        let w = lock(&self.world);
        let r = &self.report;
        assert_eq!(w.violations, Vec::<String>::new(), "{case}");
        assert_eq!(r.planned, r.valid + r.invalid + r.missed, "{case}: {r:?}");
        assert_eq!(w.streaming, [false; 2], "{case}: cameras stopped");
        assert_eq!(r.disarmed, w.confirmed, "{case}: {r:?}");
        if r.disarmed {
            assert!(!w.armed, "{case}: disarmed");
            let halted = matches!(&r.end, RunEnd::Stopped(why) if why.contains("halt"));
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
    let told = run(faults());
    told.check("good");
    assert_eq!(told.report.end, RunEnd::Completed, "{:?}", told.report);
    assert_eq!(told.verdicts(), ["valid"; 3], "{:?}", told.outcomes());
    assert_eq!(told.report.problems, Vec::<String>::new());
    let w = lock(&told.world);
    let limits = w.limits.as_ref().map(|l| (l.min_mm, l.max_mm));
    // Skin x -40..60, y -50..55, z -3..40, each 0.05 wider, turned by a quarter and shifted.
    let (min, max) = limits.unwrap_or_default();
    for (found, wanted) in min
        .iter()
        .chain(&max)
        .zip([-50.05, -43.05, 8.95, 55.05, 57.05, 52.05])
    {
        assert!((found - wanted).abs() < 1e-9, "{min:?} {max:?}");
    }
    for (o, planned) in told.outcomes().iter().zip(plan().presses) {
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
    let slots: Vec<i64> = told
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
    let told = run(Faults {
        train_ms,
        ..faults()
    });
    assert_eq!(told.report.valid, 3);
    let mut line_until = HostTime::ZERO;
    let mut counts = [0; 3];
    let mut seen_to = HostTime::ZERO;
    let mut bytes_to = [HostTime::ZERO; 2];
    let mut moved_for = None;
    for r in &told.records {
        match r {
            Record::Poses(block) => seen_to = block.last().map_or(seen_to, |p| p.t),
            Record::Chunk(c) => bytes_to[c.camera.index()] = c.host_time,
            Record::MarkSent(sent) => {
                counts[sent.mark.press.0 as usize] += 1;
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
                    counts[o.attempt.press.0 as usize], 3,
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
    let told = run(Faults {
        train_ms: 120,
        ..faults()
    });
    told.check("busy line"); // the mock calls a mark on a busy line a violation
    let kinds: Vec<MarkKind> = told
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
    assert_eq!(told.verdicts(), ["valid"; 3]);
}

#[test]
fn every_device_call_may_fail() {
    let total = lock(&run(faults()).world).calls;
    assert!(total > 500, "{total}");
    let hook = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |info| {
        let text = info.payload().downcast_ref::<String>();
        if !text.is_some_and(|t| t.starts_with("mock ") || t.starts_with("sink ")) {
            hook(info); // what no mock intends stays visible
        }
    }));
    for failure in [Failure::Once, Failure::Forever, Failure::Panic] {
        for k in 1..=total {
            let told = run(Faults {
                at_call: Some((k, failure)),
                ..faults()
            });
            let case = format!("call {k} of {total}, {failure:?}");
            told.check(&case);
            let told_of =
                matches!(told.report.end, RunEnd::Faulted(_)) || !told.report.problems.is_empty();
            assert!(told_of, "{case}: a failure is told: {:?}", told.report);
        }
    }
}

#[test]
fn every_record_may_be_refused() {
    let total = run(faults()).records.len();
    for failure in [SinkFailure::Once, SinkFailure::Forever, SinkFailure::Panic] {
        for k in 0..total {
            let sink = Sink {
                fail: Some((k, failure)),
                ..Sink::default()
            };
            let told = run_plan(&plan(), faults(), START, sink);
            let case = format!("record {k} of {total}, {failure:?}");
            told.check_rig(&case);
            assert!(
                matches!(told.report.end, RunEnd::Faulted(_)) || !told.report.problems.is_empty(),
                "{case}: {:?}",
                told.report
            );
            // A sink that recovers has every press once; a lost outcome is told again as invalid.
            let ends = told.records.iter();
            let ends = ends.filter(|r| matches!(r, Record::Outcome(_) | Record::Missed(..)));
            let ends = ends.count();
            if failure == SinkFailure::Forever {
                assert!(ends <= 3 && told.records.len() == k, "{case}");
            } else {
                assert_eq!(ends, 3, "{case}");
            }
        }
    }
}

#[test]
fn the_operator_may_interrupt_at_every_tick() {
    let ticks = lock(&run(faults()).world).ticks;
    assert!(ticks > 200, "{ticks}");
    let (mut broken_off, mut halted_in_skin) = (0, 0);
    for tick in 1..=ticks {
        for press in [
            Press::Pause,
            Press::PauseNow,
            Press::Stop,
            Press::Abort,
            Press::Halt,
        ] {
            let told = run(Faults {
                operator: Some((tick, press)),
                ..faults()
            });
            let case = format!("{press:?} at tick {tick} of {ticks}");
            told.check(&case);
            match press {
                Press::Pause => {
                    assert_eq!(told.report.end, RunEnd::Completed, "{case}");
                    assert_eq!(told.report.valid, 3, "{case}");
                }
                Press::PauseNow => {
                    assert_eq!(told.report.end, RunEnd::Completed, "{case}");
                    assert_eq!(told.report.missed, 0, "{case}");
                    let broken = told
                        .outcomes()
                        .into_iter()
                        .filter_map(|o| match &o.verdict {
                            PressVerdict::Valid => None,
                            other => Some(format!("{other:?}")),
                        });
                    let broken: Vec<String> = broken.collect();
                    broken_off += broken.len();
                    assert!(
                        broken.len() <= 1
                            && broken.iter().all(|b| b.contains("paused by the operator")),
                        "{case}: {broken:?}"
                    );
                }
                Press::Halt => {
                    if told.report.end == RunEnd::Completed {
                        assert!(tick >= ticks - 1, "{case}");
                        continue;
                    }
                    let w = lock(&told.world);
                    halted_in_skin += usize::from(w.tip[2] < -1.0);
                    assert!(told.report.disarmed && told.report.invalid <= 1, "{case}");
                    assert!(
                        w.ticks <= tick + 1,
                        "{case}: motors off within a tick, found {}",
                        w.ticks
                    );
                }
                Press::Stop => {
                    // The press under way is finished, none is broken off.
                    assert_eq!(told.report.invalid, 0, "{case}: {:?}", told.outcomes());
                    if told.report.end == RunEnd::Completed {
                        assert_eq!(told.report.valid, 3, "{case}");
                    }
                }
                Press::Note => unreachable!("has a test of its own"),
                Press::Abort => {
                    let wanted = RunEnd::Stopped("operator: abort".to_owned());
                    // At the very last ticks nothing is left to abort.
                    if told.report.end != RunEnd::Completed {
                        assert_eq!(told.report.end, wanted, "{case}");
                        assert!(told.report.invalid <= 1, "{case}");
                    }
                }
            }
        }
    }
    assert!(broken_off > 50, "{broken_off}");
    assert!(halted_in_skin > 20, "{halted_in_skin}");
}

#[test]
fn a_pause_does_not_shorten_the_period_after_it() {
    let told = run(Faults {
        operator: Some((130, Press::Pause)),
        ..faults()
    });
    let intents: Vec<i64> = told
        .records
        .iter()
        .filter_map(|r| match r {
            Record::Intent { t, .. } => Some(t.0 / MS),
            _ => None,
        })
        .collect();
    let kinds: Vec<InterruptionKind> = told
        .records
        .iter()
        .filter_map(|r| match r {
            Record::Interruption { kind, .. } => Some(*kind),
            _ => None,
        })
        .collect();
    assert_eq!(kinds, [InterruptionKind::Pause, InterruptionKind::Resume]);
    assert_eq!(told.report.valid, 3);
    let gaps = [intents[1] - intents[0], intents[2] - intents[1]];
    assert_eq!(gaps[1], 503, "{gaps:?}");
    assert!(gaps[0] > 1000, "{gaps:?}");
}

#[test]
fn a_halt_breaks_off_the_retraction_of_an_abort() {
    let kinds = |told: &Told| -> Vec<InterruptionKind> {
        let kind = |r: &Record| match r {
            Record::Interruption { kind, .. } => Some(*kind),
            _ => None,
        };
        told.records.iter().filter_map(kind).collect()
    };
    // Before the plan's first press nothing retracts, so the first tick whose abort finds the tip in the skin is sought.
    let ticks = lock(&run(faults()).world).ticks;
    let mut ended = Vec::new();
    for tick in (1..ticks).step_by(20) {
        let abort = Faults {
            operator: Some((tick, Press::Abort)),
            ..faults()
        };
        let rises = lock(&run(abort.clone()).world).ticks - tick;
        if rises < 10 {
            continue;
        }
        let told = run(Faults {
            halt_after: Some(5),
            ..abort
        });
        let case = format!("abort at tick {tick}, halt 5 ticks later");
        told.check_rig(&case);
        assert!(told.report.disarmed && !told.report.retracted, "{case}");
        assert!(lock(&told.world).ticks <= tick + 6, "{case}");
        ended.push(kinds(&told));
    }
    let both = [InterruptionKind::Abort, InterruptionKind::Halt];
    assert!(
        ended.len() > 3 && ended.iter().all(|k| k[..] == both),
        "{ended:?}"
    );
}

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
    let second = good
        .records
        .iter()
        .position(|r| matches!(r, Record::Intent { attempt, .. } if attempt.press == PressId(1)));
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
    let report = execute(&plan, header(&plan), rig(&world), &control, &mut sink);
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

#[test]
fn from_an_unknown_start_it_goes_up_first() {
    let told = run_plan(&plan(), faults(), [20.0, 30.0, -1.0], Sink::default());
    told.check("low start");
    assert_eq!(told.report.valid, 3);
    let w = lock(&told.world);
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
        let report = execute(&plan, header(&plan), rig, &control, &mut Sink::default());
        assert_eq!(report.end, RunEnd::Completed);
        let w = lock(&world);
        w.started.clone()
    };
    let (one, two) = (CameraId::One, CameraId::Two);
    assert_eq!(started([SyncMode::Master, SyncMode::Slave]), [two, one]);
    assert_eq!(started([SyncMode::Slave, SyncMode::Master]), [one, two]);
    assert_eq!(started([SyncMode::Standalone; 2]), [one, two]);
}

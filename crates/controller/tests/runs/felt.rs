//! Presses that react to being felt: they stop or lift, never deeper than planned, and a wrong sense changes nothing else.

use skinrig_controller::{Run, RunReport, SenseAnswer, SenseFault, SensedTouch, TouchSense};
use skinrig_model::*;
use skinrig_protocol::plan::{Plan, Step};
use skinrig_protocol::{Online, React};

use crate::course::{START, faults};
use crate::mock::*;

/// When the mock sense feels.
#[derive(Clone, Copy, PartialEq)]
enum Feels {
    /// While the tip is deeper than this, mm.
    Below(f64),
    /// Without end, since before the first press.
    Always,
    /// Anew at every poll.
    AtEveryPoll,
    Never,
    /// It could not learn.
    Fails,
}

struct MockSense {
    world: Shared,
    feels: Feels,
    region_mm: Option<f64>,
    /// Whether it says how deep the tip is.
    depths: bool,
    learning: bool,
    touching: bool,
    answered: HostTime,
}

impl MockSense {
    fn answer(&mut self, now: HostTime, kind: TouchKind) -> SenseAnswer {
        self.answered = now;
        let region = self.region_mm.filter(|_| kind == TouchKind::Position);
        let located = self.depths && kind == TouchKind::Position;
        let mm = -lock(&self.world).tip[2];
        let within_mm = 0.2;
        SenseAnswer::Felt(SensedTouch {
            until: now,
            until_sd_ns: 0,
            kind,
            at_mm: Some([1.0, 2.0]),
            region: region.map(|mm| TouchRegion {
                semi_axes_mm: [mm, mm],
                angle_deg: 0.0,
            }),
            depth: located.then_some(TouchDepth { mm, within_mm }),
            llr: None,
        })
    }
}

impl TouchSense for MockSense {
    fn learn(&mut self) {
        self.learning = true;
    }

    fn feed(&mut self, _: CameraId, _: u64, _: &[u8]) {}

    fn poll(&mut self, now: HostTime) -> Option<SenseAnswer> {
        if std::mem::take(&mut self.learning) && self.feels == Feels::Fails {
            let why = "too few presses".to_owned();
            return Some(SenseAnswer::Off(SenseFault::NotLearnt(why)));
        }
        if now == self.answered {
            return None;
        }
        let z_mm = lock(&self.world).tip[2];
        let touches = match self.feels {
            Feels::Below(depth_mm) => z_mm < -depth_mm,
            Feels::Always | Feels::AtEveryPoll => true,
            Feels::Never | Feels::Fails => false,
        };
        let was = std::mem::replace(&mut self.touching, touches);
        match (was && self.feels != Feels::AtEveryPoll, touches) {
            (false, true) => Some(self.answer(now, TouchKind::Onset)),
            (true, true) => Some(self.answer(now, TouchKind::Position)),
            (true, false) => Some(self.answer(now, TouchKind::Release)),
            (false, false) => None,
        }
    }
}

fn reacting_plan(react: React) -> Plan {
    let mut plan = plan();
    plan.online = Some(Online {
        false_alarms_hz: 0.1,
        position_every: HostDuration::from_millis(10),
        react: Some(react),
    });
    for step in &mut plan.steps {
        if let Step::Press(press) = step {
            press.react = Some(react);
        }
    }
    plan.steps.insert(0, Step::Learn);
    plan
}

struct Felt {
    report: RunReport,
    records: Vec<Record>,
}

impl Felt {
    fn outcomes(&self) -> Vec<&PressOutcome> {
        let outcomes = self.records.iter().filter_map(|r| match r {
            Record::Outcome(outcome) => Some(outcome),
            _ => None,
        });
        outcomes.collect()
    }

    fn depths_mm(&self) -> Vec<f64> {
        let depths = self.outcomes().into_iter();
        depths.filter_map(|o| o.measured_depth_mm).collect()
    }

    fn touches(&self, kind: TouchKind) -> Vec<TouchEstimate> {
        let touch = |r: &Record| match r {
            Record::Touch(touch) if touch.kind == kind => Some(*touch),
            _ => None,
        };
        self.records.iter().filter_map(touch).collect()
    }

    fn notes(&self) -> String {
        let note = |r: &Record| match r {
            Record::Note { text, .. } => Some(text.clone()),
            _ => None,
        };
        let notes: Vec<String> = self.records.iter().filter_map(note).collect();
        notes.join("\n")
    }
}

const fn react(then: Reaction) -> React {
    React {
        then,
        region_mm: None,
        depth_mm: None,
    }
}

/// Runs three presses to 2 mm, with a sense that states regions of this size, or depths if `depths`, and checks that they are valid and
/// that the robot was never deeper than planned.
fn run_with(react: React, feels: Feels, seen_mm: Option<f64>, depths: bool) -> Felt {
    let world = World::shared(faults(), START);
    let control = lock(&world).control.clone();
    let (plan, mut sink) = (reacting_plan(react), Sink::default());
    let sense = MockSense {
        world: world.clone(),
        feels,
        region_mm: seen_mm,
        depths,
        learning: false,
        touching: false,
        answered: HostTime::ZERO,
    };
    let report = Run::new(&plan, header(&plan), rig(&world), &control, &mut sink)
        .feeling(Box::new(sense))
        .execute();
    assert_eq!((&report.end, report.valid), (&RunEnd::Completed, 3));
    assert!(report.retracted && report.disarmed);
    assert!(lock(&world).violations.is_empty());
    let deepest = lock(&world)
        .commands
        .iter()
        .map(|c| c.0[2])
        .fold(0.0, f64::min);
    assert!(deepest >= -2.0 - 1e-9, "{deepest}");
    Felt {
        report,
        records: sink.records,
    }
}

fn run(then: Reaction, feels: Feels, seen_mm: Option<f64>) -> Felt {
    run_with(react(then), feels, seen_mm, false)
}

fn holds_ms(felt: &Felt) -> Vec<i64> {
    let timings = felt.outcomes().into_iter().filter_map(|o| o.timing);
    timings
        .map(|t| (t.retract - t.at_depth).0 / 1_000_000)
        .collect()
}

#[test]
fn a_press_stops_where_it_is_felt_and_holds_there() {
    let felt = run(Reaction::Stop, Feels::Below(0.5), None);
    for depth_mm in felt.depths_mm() {
        assert!((0.5..0.9).contains(&depth_mm), "{depth_mm}");
    }
    let stopped = felt.touches(TouchKind::Stopped);
    assert_eq!(stopped.len(), 3);
    for (touch, outcome) in stopped.iter().zip(felt.outcomes()) {
        let timing = outcome.timing.unwrap();
        assert_eq!(touch.attempt, Some(outcome.attempt));
        assert!(timing.contact < touch.t && touch.t < timing.at_depth);
        assert!(timing.retract - timing.at_depth >= HostDuration::from_millis(30));
        // Within a tick of feeling it.
        assert!(touch.t - touch.until <= HostDuration::from_millis(10));
    }
    assert_eq!(felt.report.press_faults, []);
}

#[test]
fn a_press_that_is_felt_ends_its_hold() {
    let usual = run(Reaction::Lift, Feels::Never, None);
    let felt = run(Reaction::Lift, Feels::Below(1.0), None);
    let (usually, holds) = (holds_ms(&usual), holds_ms(&felt));
    assert!(usually.iter().all(|ms| *ms >= 30), "{usually:?}");
    assert!(holds.iter().all(|ms| *ms < 20), "{holds:?}");
    assert!(felt.depths_mm().iter().all(|mm| (mm - 2.0).abs() < 0.1));
    assert_eq!(felt.touches(TouchKind::Lifted).len(), 3);
    assert_eq!(usual.touches(TouchKind::Lifted), []);
}

#[test]
fn a_reaction_waits_for_a_small_region() {
    for (seen_mm, count) in [(None, 0), (Some(2.5), 0), (Some(1.5), 3)] {
        let small = React {
            region_mm: Some(2.0),
            ..react(Reaction::Stop)
        };
        let felt = run_with(small, Feels::Below(0.5), seen_mm, false);
        assert_eq!(felt.touches(TouchKind::Stopped).len(), count, "{seen_mm:?}");
        let full = felt.depths_mm().iter().filter(|mm| **mm > 1.9).count();
        assert_eq!(full, 3 - count);
    }
}

#[test]
fn a_reaction_waits_for_a_depth_and_a_press_lifts_from_it() {
    for (then, kind) in [
        (Reaction::Stop, TouchKind::Stopped),
        (Reaction::Lift, TouchKind::Lifted),
    ] {
        let deep = React {
            depth_mm: Some(1.0),
            ..react(then)
        };
        let felt = run_with(deep, Feels::Below(0.2), None, true);
        let (depths, holds) = (felt.depths_mm(), holds_ms(&felt));
        assert!(
            depths.iter().all(|mm| (1.0..1.4).contains(mm)),
            "{depths:?}"
        );
        assert!(
            holds
                .iter()
                .all(|ms| (*ms < 20) == (then == Reaction::Lift)),
            "{holds:?}"
        );
        // One that lifts has braked before.
        let both = [TouchKind::Stopped, TouchKind::Lifted].map(|k| felt.touches(k).len());
        assert_eq!(both, [3, 3 * usize::from(then == Reaction::Lift)]);
        let reacted = felt.touches(kind)[0].depth.unwrap();
        assert!((0.5..1.2).contains(&reacted.mm), "{reacted:?}");
        // Never said how deep: the press goes on.
        let blind = run_with(deep, Feels::Below(0.2), None, false);
        assert!(blind.depths_mm().iter().all(|mm| (mm - 2.0).abs() < 0.1));
        assert_eq!(blind.touches(kind), []);
    }
}

/// The first press shows how far a press goes on after it was told to brake; the others brake so much earlier.
#[test]
fn presses_learn_to_come_to_rest_at_the_depth_stated() {
    let deep = React {
        depth_mm: Some(1.2),
        ..react(Reaction::Stop)
    };
    let depths = run_with(deep, Feels::Below(0.2), None, true).depths_mm();
    let [first, rest @ ..] = &depths[..] else {
        panic!("{depths:?}")
    };
    for mm in rest {
        assert!((mm - 1.2).abs() < 0.5 * (first - 1.2), "{depths:?}");
    }
}

#[test]
fn a_touch_that_began_before_the_press_is_none_of_it() {
    let felt = run(Reaction::Stop, Feels::Always, Some(0.1));
    assert!(felt.depths_mm().iter().all(|mm| (mm - 2.0).abs() < 0.1));
    assert_eq!(felt.touches(TouchKind::Stopped), []);
}

#[test]
fn false_alarms_without_end_stop_presses_near_the_surface_and_harm_nothing() {
    let felt = run(Reaction::Stop, Feels::AtEveryPoll, None);
    assert!(felt.depths_mm().iter().all(|mm| (-0.1..0.5).contains(mm)));
    assert_eq!(felt.touches(TouchKind::Stopped).len(), 3);
}

#[test]
fn without_a_sense_presses_go_on_as_planned_and_the_session_says_why() {
    let felt = run(Reaction::Stop, Feels::Fails, None);
    assert!(felt.depths_mm().iter().all(|mm| (mm - 2.0).abs() < 0.1));
    assert!(
        felt.notes().contains(
            "touches are not felt: learning from the calibration presses failed: too few presses"
        ),
        "{}",
        felt.notes()
    );
}

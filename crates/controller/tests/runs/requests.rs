//! Acknowledgement of requests, recording of notes, and the visible state of a run.

use skinrig_controller::{Run, State};
use skinrig_model::{Record, RunEnd};

use crate::course::{START, faults, run, run_plan};
use crate::mock::*;

fn with(tick: u64, press: OperatorAction) -> crate::course::RunResult {
    let asking = Faults {
        operator: Some((tick, press)),
        ..faults()
    };
    run_plan(&plan(), asking, START, Sink::default())
}

#[test]
fn a_note_at_any_tick_is_recorded_once_and_changes_nothing() {
    let good = run(faults());
    let ticks = lock(&good.world).ticks;
    for tick in 1..=ticks {
        let result = with(tick, OperatorAction::Note);
        assert_eq!(result.report, good.report, "tick {tick}");
        let of_operator = |r: &&Record| matches!(r, Record::Note { text, .. } if text == NOTE);
        let notes: Vec<_> = result.records.iter().filter(of_operator).collect();
        assert_eq!(notes.len(), 1, "tick {tick}");
        assert_eq!(result.records.len(), good.records.len() + 1, "tick {tick}");
        assert_eq!(
            lock(&result.world).control.notes_recorded(),
            1,
            "tick {tick}"
        );
    }
}

#[test]
fn a_note_to_a_run_that_fails_immediately_is_recorded() {
    let failing = Faults {
        at_call: Some((1, Failure::Once)),
        ..faults()
    };
    let world = World::shared(failing, START);
    let control = lock(&world).control.clone();
    assert_eq!(control.note(NOTE.into()), Ok(1));
    let (plan, mut sink) = (plan(), Sink::default());
    let report = Run::new(&plan, header(&plan), rig(&world), &control, &mut sink).execute();
    assert!(matches!(report.end, RunEnd::Faulted(_)), "{report:?}");
    let is_note = |r: &Record| matches!(r, Record::Note { text, .. } if text == NOTE);
    assert!(sink.records.iter().any(is_note) && control.notes_recorded() == 1);
}

#[test]
fn every_request_is_acknowledged_at_any_time() {
    let ticks = lock(&run(faults()).world).ticks;
    for tick in (1..=ticks).step_by(7) {
        for press in OperatorAction::REQUESTS {
            let result = with(tick, press);
            let control = lock(&result.world).control.clone();
            assert_eq!(control.state(), State::Finished, "{press:?} at {tick}");
            // Once the motors are off, there is nothing left to acknowledge.
            let late = tick + 10 > lock(&result.world).ticks;
            assert!(
                late || control.requests_acknowledged() == control.requests_made(),
                "{press:?} at {tick}: {} of {}",
                control.requests_acknowledged(),
                control.requests_made()
            );
        }
    }
}

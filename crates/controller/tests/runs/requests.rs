//! What the operator's hand learns: that a request was heard, that a remark was written, where the run is.

use skinrig_controller::{Run, State};
use skinrig_model::{Record, RunEnd};

use crate::course::{START, faults, run, run_plan};
use crate::mock::*;

fn with(tick: u64, press: Press) -> crate::course::Told {
    let asking = Faults {
        operator: Some((tick, press)),
        ..faults()
    };
    run_plan(&plan(), asking, START, Sink::default())
}

#[test]
fn a_remark_at_any_tick_is_written_once_and_changes_nothing() {
    let good = run(faults());
    let ticks = lock(&good.world).ticks;
    for tick in 1..=ticks {
        let told = with(tick, Press::Note);
        assert_eq!(told.report, good.report, "tick {tick}");
        let of_operator = |r: &&Record| matches!(r, Record::Note { text, .. } if text == NOTE);
        let notes: Vec<_> = told.records.iter().filter(of_operator).collect();
        assert_eq!(notes.len(), 1, "tick {tick}");
        assert_eq!(told.records.len(), good.records.len() + 1, "tick {tick}");
        assert_eq!(lock(&told.world).control.notes_recorded(), 1, "tick {tick}");
    }
}

#[test]
fn a_remark_to_a_run_that_fails_at_once_is_written() {
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
fn every_request_is_heard_whenever_it_comes() {
    let ticks = lock(&run(faults()).world).ticks;
    for tick in (1..=ticks).step_by(7) {
        for press in Press::REQUESTS {
            let told = with(tick, press);
            let control = lock(&told.world).control.clone();
            assert_eq!(control.state(), State::Finished, "{press:?} at {tick}");
            // Once the motors are off there is nothing left to hear.
            let late = tick + 10 > lock(&told.world).ticks;
            assert!(
                late || control.requests_acknowledged() == control.requests_made(),
                "{press:?} at {tick}: {} of {}",
                control.requests_acknowledged(),
                control.requests_made()
            );
        }
    }
}

//! A sink that loses its records: detected within half a second of the rig's time, at every stage of a run.

use crate::course::{START, faults};
use crate::mock::*;
use skinrig_controller::{RecordSink, Run, RunFault, RunReport, SinkFault};
use skinrig_model::*;

/// A sink whose records vanish at some time, which only `check` reports. ms of the rig's clock.
struct VanishingSink {
    sink: Sink,
    world: Shared,
    gone_ms: i64,
    checked_ms: Vec<i64>,
}

impl RecordSink for VanishingSink {
    fn accept(&mut self, record: Record) -> Result<(), SinkFault> {
        self.sink.accept(record)
    }

    fn check(&mut self) -> Result<(), SinkFault> {
        let ms = lock(&self.world).t / MS;
        self.checked_ms.push(ms);
        if ms < self.gone_ms {
            return Ok(());
        }
        Err(SinkFault::Rejected("the file is gone".into()))
    }
}

fn run(gone_ms: i64, operator: Option<(u64, OperatorAction)>) -> (VanishingSink, RunReport) {
    let plan = plan();
    let world = World::shared(
        Faults {
            operator,
            ..faults()
        },
        START,
    );
    let control = lock(&world).control.clone();
    let mut sink = VanishingSink {
        sink: Sink::default(),
        world: world.clone(),
        gone_ms,
        checked_ms: Vec::new(),
    };
    let report = Run::new(&plan, header(&plan), rig(&world), &control, &mut sink).execute();
    (sink, report)
}

/// Longest time between two checks: 0.5 s and one tick.
const WITHIN_MS: i64 = 500 + 10;

#[test]
fn lost_records_are_detected_within_half_a_second() {
    let (whole, report) = run(i64::MAX, None);
    assert_eq!(report.end, RunEnd::Completed);
    let end_ms = report.ended_at.0 / MS;
    assert!(whole.checked_ms.len() as i64 > end_ms / WITHIN_MS - 2);
    for operator in [
        None,
        Some((150, OperatorAction::Pause)),
        Some((150, OperatorAction::PauseNow)),
    ] {
        for gone_ms in (0..end_ms - WITHIN_MS).step_by(20) {
            let (sink, report) = run(gone_ms, operator);
            let case = format!("gone at {gone_ms} ms, {operator:?}");
            let fault = SinkFault::Rejected("the file is gone".into());
            assert_eq!(report.end.faults(), [RunFault::Sink(fault)], "{case}");
            assert!(report.retracted && report.disarmed, "{case}: {report:?}");
            // One failed check ends the run; its last records are still written.
            let noticed_ms = *sink.checked_ms.last().unwrap();
            assert!(noticed_ms - gone_ms <= WITHIN_MS, "{case}: {noticed_ms}");
            let records = &sink.sink.records;
            assert!(
                matches!(records.last(), Some(Record::Ended { .. })),
                "{case}"
            );
            let later = records
                .iter()
                .filter(|r| matches!(r, Record::Intent { t, .. } if t.0 / MS > gone_ms));
            assert!(later.count() <= 1, "{case}: presses after that");
            let ends = records
                .iter()
                .filter(|r| matches!(r, Record::Outcome(_) | Record::Missed(..)));
            assert_eq!(ends.count(), 3, "{case}");
        }
    }
}

//! Contract of trigger boxes.

use skinrig_model::{HostDuration, HostTime, Mark, PressId, SentMark};

use super::{TICK, answered, pass};
use crate::{Clock, DeviceError, TriggerBox};

/// Verifies the contract of [`TriggerBox`]. `make` returns a new box and its clock; `marks` are at least two different marks in the order
/// of sending.
pub fn trigger_box(
    make: &mut dyn FnMut() -> (Box<dyn TriggerBox>, Box<dyn Clock>),
    marks: &[Mark],
) {
    assert!(marks.len() >= 2, "trigger box: give at least two marks");
    let (mut device, mut clock) = make();
    assert!(
        !device.identity().model.is_empty(),
        "trigger box: expected a model name"
    );
    let train = device.capabilities().train_duration;
    assert!(
        train > HostDuration::ZERO,
        "trigger box: a train takes time"
    );
    let mut impossible = marks[0];
    impossible.press = PressId::from_index(skinrig_model::pulse::MAX_MARKED_PRESS + 1);
    expect_error!(
        answered(clock.as_mut(), || device.send(impossible)),
        DeviceError::Refused { .. },
        "trigger box: a press id that does not fit must be refused"
    );
    let mut last: Option<HostTime> = None;
    for &mark in marks {
        let before = clock.now();
        let sent =
            answered(clock.as_mut(), || device.send(mark)).expect("trigger box: a good mark");
        assert_eq!(sent.mark, mark, "trigger box: sent another mark");
        assert!(
            sent.uncertainty_ns >= 0,
            "trigger box: negative uncertainty"
        );
        assert!(
            sent.t + HostDuration(sent.uncertainty_ns) >= before,
            "trigger box: the edge rose at {} before it was asked for at {before}",
            sent.t
        );
        assert!(
            last.is_none_or(|l| l < sent.t),
            "trigger box: instants out of order"
        );
        last = Some(sent.t);
        let mut free = over_for_certain(sent, train);
        match answered(clock.as_mut(), || device.send(mark)) {
            Err(DeviceError::State { .. }) => {}
            // On a real clock the train may end before the request reaches the box.
            Ok(retry) if clock.now() >= sent.t + train + HostDuration(-sent.uncertainty_ns) => {
                last = Some(retry.t);
                free = over_for_certain(retry, train);
            }
            other => {
                panic!("trigger box: a mark during a train must be a State error: found {other:?}")
            }
        }
        let wait = free - clock.now() + TICK;
        pass(clock.as_mut(), wait, || {});
    }
}

/// Latest end of the train of `sent`.
fn over_for_certain(sent: SentMark, train: HostDuration) -> HostTime {
    sent.t + train + HostDuration(sent.uncertainty_ns)
}

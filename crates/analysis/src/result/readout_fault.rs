//! What is wrong with how a camera's events were read out, stamped or converted, for warnings.

use serde::{Deserialize, Serialize};
use skinrig_model::PressId;

/// A fault on the way from the pixels to the recording.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, thiserror::Error)]
#[serde(tag = "fault", rename_all = "snake_case")]
pub enum ReadoutFault {
    /// Events come once more.
    #[error(
        "{:.0} % of the events are those of an earlier time once more, pixel by pixel and to the microsecond, first {from_s:.0} s into the \
         camera's time: no press repeats another one so, and the scatter between repetitions is too small; find out whether driver, buffer or \
         converter sent data twice, and record again",
        100.0 * .share
    )]
    EventsAgain {
        /// Their share.
        share: f64,
        /// The first of them, s.
        from_s: f64,
    },
    /// Events that equal the one before.
    #[error(
        "{repeated} of {events} events equal the one before them (pixel, time, polarity): the recording holds events twice, and event \
         rates are too high; convert the camera's file again"
    )]
    EventsTwice {
        /// Repeated events.
        repeated: u64,
        /// All events.
        events: u64,
    },
    /// Timestamps lie far apart.
    #[error(
        "timestamps come in steps of {step_ms:.0} ms, many events to each: no latency, onset or depth is known better; find out which driver \
         or converter rounded them"
    )]
    CoarseStamps {
        /// Smallest distance of two usual stamps, ms.
        step_ms: f64,
    },
    /// A column holds events of others.
    #[error(
        "column {column} has {times:.0} times the events of those beside it: a driver or converter may have written other columns as this one \
         (expected 0 to 639), or its readout is broken"
    )]
    CrowdedColumn {
        /// The column, px.
        column: u16,
        /// Events, relative to the columns beside it.
        times: f64,
    },
    /// A row holds events of others.
    #[error(
        "row {row} has {times:.0} times the events of those beside it: a driver or converter may have written other rows as this one (expected \
         0 to 479), or its readout is broken"
    )]
    CrowdedRow {
        /// The row, px.
        row: u16,
        /// Events, relative to the rows beside it.
        times: f64,
    },
    /// The event rate reaches a ceiling.
    #[error(
        "the event rate stops at {per_ms:.0} events per ms in {presses} presses, first {first}: readout or cable carry no more, and events were \
         lost; lower the rate by a region of interest or the biases, and record again"
    )]
    Ceiling {
        /// The ceiling, events/ms.
        per_ms: f64,
        /// Presses that reach it.
        presses: usize,
        /// The first of them.
        first: PressId,
    },
}

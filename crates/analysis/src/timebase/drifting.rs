//! Distinguishes implausibly drifting clocks from wires that lose edges.

use skinrig_model::AlignmentSettings;

use super::base::TimeBase;
use super::edges::{NEAR_US, OffLineTrains};
use crate::result::Alignment;

impl TimeBase {
    /// Trains that camera `k` saw away from the line of its clock, in all legs.
    pub(super) fn off_line(&self, k: usize) -> OffLineTrains {
        let each = self.pieces.iter().filter_map(|p| p.cameras[k].as_ref());
        each.fold(OffLineTrains::default(), |sum, c| sum.and(c.off_line))
    }
}

/// True if most of the trains that camera `k` misses did arrive, away from the line: the wire works, but a clock does not.
pub(super) fn drifts(
    k: usize,
    off_line: OffLineTrains,
    alignment: &Alignment,
    limits: &AlignmentSettings,
) -> bool {
    alignment.lines.get(k).is_some_and(|line| {
        let missing = line.trains_sent - line.trains_seen;
        line.share(line.lost) > limits.max_lost && 2 * off_line.trains > missing
    })
}

/// The drifting clock: if both cameras agree it is the box's.
pub(super) fn drifting(
    drifts: [bool; 2],
    off_line: [OffLineTrains; 2],
    alignment: &Alignment,
) -> Option<String> {
    let (clock, k) = match drifts {
        [true, true] => ("trigger box", 0),
        [true, false] => ("camera 1", 0),
        [false, true] => ("camera 2", 1),
        [false, false] => return None,
    };
    Some(format!(
        "{clock}, clock drift: expected the trains that camera {} saw within {:.0} µs of a clock's line, found {} of \
         {} up to {:.0} µs off it: they arrived, but this clock drifts faster than plausible, or jumps",
        k + 1,
        NEAR_US[1],
        off_line[k].trains,
        alignment.lines[k].trains_sent,
        off_line[k].most_us
    ))
}

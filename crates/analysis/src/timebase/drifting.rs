//! Distinguishes implausibly drifting clocks from wires that lose edges.

use skinrig_model::{AlignmentSettings, CameraId, DeviceRole};

use super::base::TimeBase;
use super::edges::{NEAR_US, OffLineTrains};
use crate::result::{Alignment, AlignmentViolation};

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
) -> Option<AlignmentViolation> {
    let (clock, camera) = match drifts {
        [true, true] => (DeviceRole::TriggerBox, CameraId::One),
        [true, false] => (DeviceRole::Camera1, CameraId::One),
        [false, true] => (DeviceRole::Camera2, CameraId::Two),
        [false, false] => return None,
    };
    let OffLineTrains { trains, most_us } = off_line[camera.index()];
    Some(AlignmentViolation::ClockDrifts {
        clock,
        camera,
        near_us: NEAR_US[1],
        off_line: trains,
        sent: alignment.lines[camera.index()].trains_sent,
        furthest_us: most_us,
    })
}

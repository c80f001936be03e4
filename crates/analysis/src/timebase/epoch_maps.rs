//! Maps of one epoch of the box's clock.

use skinrig_model::CameraId;

use super::edges::{CameraFromBox, Edges};
use super::epochs::Epoch;
use super::host::HostFromBox;
use super::reading::Reading;
use super::smooth::{FLOOR_US, Figure, Point, STEP_US, SmoothMap};
use crate::result::AlignmentViolation;

/// Maps of one epoch.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct EpochMaps {
    pub(super) leg: usize,
    pub(super) reference_us: u64,
    pub(super) span_us: (f64, f64),
    pub(super) host: HostFromBox,
    pub(super) cameras: [Option<CameraFromBox>; 2],
    /// Camera 2's clock over camera 1's, both relative to their references.
    pub(super) between: Option<SmoothMap>,
}

impl EpochMaps {
    /// An instant on the box's clock relative to its reference, µs.
    pub(super) fn relative(&self, box_us: u64) -> f64 {
        box_us.wrapping_sub(self.reference_us) as i64 as f64
    }

    /// Camera time of a host time.
    pub(super) fn camera_us(&self, k: usize, host_us: f64) -> Option<Reading> {
        let camera = self.cameras[k].as_ref()?;
        let box_us = self.host.box_us(host_us);
        let (seen, host) = (camera.at(box_us), self.host.at(box_us));
        let both = seen.less(host);
        Some(Reading {
            us: camera.reference_us as f64 + seen.value,
            se_us: both.se,
            free: both.free,
            bound_us: self.host.bound_us(box_us) + camera.bound_us(box_us),
        })
    }

    /// Camera time of a box time.
    pub(super) fn camera_us_of_box(&self, k: usize, box_us: f64) -> Option<Reading> {
        let camera = self.cameras[k].as_ref()?;
        let at = camera.at(box_us);
        let bound_us = camera.bound_us(box_us);
        Some(Reading::new(at, bound_us).later(camera.reference_us))
    }

    /// Host time of a box time.
    pub(super) fn host_us_of_box(&self, box_us: f64) -> Reading {
        Reading::new(self.host.at(box_us), self.host.bound_us(box_us))
    }

    /// Camera 2's time for a time of camera 1, relative to its reference: the box clock cancels, but not each camera's own
    /// delay.
    pub(super) fn camera_2_of_camera_1(&self, at: f64) -> Option<Reading> {
        let ([Some(one), Some(two)], Some(between)) = (&self.cameras, &self.between) else {
            return None;
        };
        // For a bound the deviation is nearly the same at both times.
        let box_us = at - (one.map.value(at) - at);
        let figure = Figure {
            value: between.value(at),
            se: between.standard_error(at),
            free: between.free,
        };
        let bound_us = one.bound_us(box_us).max(two.bound_us(box_us));
        Some(Reading::new(figure, bound_us).later(two.reference_us))
    }
}

/// Edges of a camera in one leg, and its recording periods.
pub(super) type Line = (Edges, Vec<(u64, u64)>);

pub(super) fn map_epoch(
    epoch: &Epoch,
    lines: &mut [Line; 2],
    violations: &mut Vec<AlignmentViolation>,
) -> Option<EpochMaps> {
    let Some(host) = HostFromBox::new(&epoch.ties) else {
        let exchanges = epoch.ties.len();
        violations.push(AlignmentViolation::ExchangesFitNoClock { exchanges });
        return None;
    };
    if !host.consistent {
        violations.push(AlignmentViolation::ExchangesInconsistent);
    }
    let (first, last) = (epoch.ties.first()?, epoch.ties.last()?);
    let [one, two] = lines;
    let cameras = [(CameraId::One, one), (CameraId::Two, two)].map(|(camera, line)| {
        let (edges, recorded) = line;
        edges
            .map(epoch, recorded)
            .map_err(|why| violations.push(AlignmentViolation::NoTrainsClock { camera, why }))
            .ok()
    });
    let between = SmoothMap::fit(&pairs(&cameras), STEP_US, FLOOR_US);
    Some(EpochMaps {
        leg: epoch.leg,
        reference_us: epoch.reference_us,
        span_us: (first.sent_us, last.received_us),
        host,
        cameras,
        between,
    })
}

/// Instants of the trains that a camera saw over those on the box.
pub(super) fn trains(piece: &EpochMaps, k: usize) -> Option<Vec<Point>> {
    let camera = piece.cameras[k].as_ref()?;
    let each = camera.sent_us.iter().zip(&camera.instants);
    Some(
        each.filter_map(|(from_us, at)| Some(Point::new(*from_us, (*at)?)))
            .collect(),
    )
}

/// Instants of the trains that both cameras saw, relative to each camera's reference.
pub(super) fn pairs(cameras: &[Option<CameraFromBox>; 2]) -> Vec<Point> {
    let [Some(one), Some(two)] = cameras else {
        return Vec::new();
    };
    let each = one.instants.iter().zip(&two.instants);
    each.filter_map(|(from, to)| Some(Point::new((*from)?, (*to)?)))
        .collect()
}

pub(super) fn shared(piece: &EpochMaps) -> Vec<(f64, f64)> {
    let references = [0, 1].map(|k| {
        let camera = piece.cameras[k].as_ref();
        camera.map_or(0.0, |c| c.reference_us as f64)
    });
    let each = pairs(&piece.cameras).into_iter();
    each.map(|p| (references[0] + p.from_us, references[1] + p.to_us))
        .collect()
}

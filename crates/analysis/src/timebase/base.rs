//! Time base of a session: all its epochs, and conversions between clocks.

use skinrig_model::{AlignmentSettings, BoxReport, CameraId, HostTime, TriggerEdge};

use super::edges::Edges;
use super::epoch_maps::{EpochMaps, map_epoch, shared};
use super::epochs::epochs;
use super::line::{best_drift, clock};
use super::reading::{Drift, Reading};
use crate::leg::{LegLine, LegStart, edges_of, leg_at, recorded_of};
use crate::result::{Alignment, AlignmentStatus, AlignmentViolation, ClockFit};
use crate::tie::Tie;

/// Input of the time base.
#[derive(Debug, Clone, Copy)]
pub struct TimeBaseInput<'a> {
    /// Reports of the trigger box, in order.
    pub reports: &'a [BoxReport],
    /// Trigger edges of each camera, all channels.
    pub edges: [&'a [TriggerEdge]; 2],
    /// The channel that carries the trains.
    pub channel: u8,
    /// Camera-time intervals in which each camera was recording, µs; empty if unknown.
    pub recorded: [&'a [(u64, u64)]; 2],
    /// Start of further legs of the session.
    pub legs: &'a [LegStart],
    /// Host times at which the time base is used, µs: contacts and releases.
    pub used_at_us: &'a [f64],
}

/// The time base of a session.
#[derive(Debug, Clone, PartialEq)]
pub struct TimeBase {
    /// Quality of the time base.
    pub alignment: Alignment,
    /// One line of camera time over host time each; `None` if that camera's clock is unknown.
    pub clocks: [Option<ClockFit>; 2],
    pub(super) pieces: Vec<EpochMaps>,
}

impl TimeBase {
    /// Builds the time base from box reports and camera edges; `None` without any report.
    #[must_use]
    pub fn new(ties: &TimeBaseInput<'_>, limits: &AlignmentSettings) -> Option<Self> {
        if ties.reports.is_empty() {
            return None;
        }
        let resets = ties.reports.iter();
        // A further leg is not a fault of the box.
        let begins_leg = |t: HostTime| ties.legs.iter().any(|leg| leg.origin == t);
        let resets = resets
            .filter(|r| matches!(r, BoxReport::Reset { noticed } if !begins_leg(*noticed)))
            .count() as u32;
        let mut violations = Vec::new();
        let mut pieces = Vec::new();
        let used = |leg: usize| {
            let at = |us: &f64| leg_at(ties.legs, HostTime((us * 1e3) as i64)) == leg;
            ties.legs.is_empty() || ties.used_at_us.iter().any(at)
        };
        let mut lines = Vec::new();
        for leg in 0..=ties.legs.len() {
            // Edges of one leg do not inform trains of another.
            let edges = |k: usize| edges_of(ties.edges[k], ties.legs, leg, k);
            let recorded = |k: usize| recorded_of(ties.recorded[k], ties.legs, leg, k);
            lines.push([0, 1].map(|k| (Edges::new(edges(k), ties.channel), recorded(k))));
        }
        for epoch in epochs(ties.reports, ties.legs) {
            let mut found = Vec::new();
            if let Some(piece) = map_epoch(&epoch, &mut lines[epoch.leg], &mut found) {
                pieces.push(piece);
            }
            // A leg that ended before its first press has no trains, and needs no clock.
            if used(epoch.leg) {
                violations.extend(found);
            }
        }
        pieces.sort_by(|a, b| a.span_us.0.total_cmp(&b.span_us.0));
        if pieces.is_empty() && violations.is_empty() {
            violations.push(AlignmentViolation::NoExchanges);
        }
        let mut base = Self {
            alignment: Alignment::default(),
            clocks: [0, 1].map(|k| Some(clock(pieces.iter(), k)?.fit)),
            pieces,
        };
        let mut alignment = Alignment {
            status: AlignmentStatus::Valid,
            violations: Vec::new(),
            warnings: Vec::new(),
            rates: None,
            maps: base.maps(&base.timed(ties.used_at_us, limits), limits),
            lines: [0, 1].map(|k| base.counts(k)).to_vec(),
            resets,
            camera_from_host: [0, 1].map(|k| base.knots(k)),
            residuals: base.residuals(),
        };
        // A missing map matters only where the session has presses.
        for k in 0..2 {
            let unknown = |at: &&f64| base.at(**at).is_none_or(|p| p.cameras[k].is_none());
            if let Some(at) = ties.used_at_us.iter().find(unknown) {
                violations.push(AlignmentViolation::NoMap {
                    camera: CameraId::ALL[k],
                    at_s: at * 1e-6,
                });
            }
        }
        if !ties.used_at_us.is_empty() {
            violations.extend(base.beyond(&alignment, limits));
            for camera in CameraId::ALL {
                base.judge_untimed(
                    camera,
                    ties,
                    limits,
                    &mut alignment.warnings,
                    &mut violations,
                );
            }
        }
        if !violations.is_empty() {
            alignment.status = if ties.used_at_us.is_empty() {
                AlignmentStatus::NotCertified
            } else {
                AlignmentStatus::Invalid
            };
        }
        alignment.violations = violations;
        base.alignment = alignment;
        Some(base)
    }

    /// Camera time of a host time; `None` if that camera's clock is unknown then.
    #[must_use]
    pub fn camera_us(&self, camera: usize, host_us: f64) -> Option<Reading> {
        self.at(host_us)?.camera_us(camera, host_us)
    }

    /// Distance from a host time to the nearest exchange with the box, or to the nearest train that the camera saw if that
    /// is further, µs; `None` if that camera's clock is unknown then.
    #[must_use]
    pub fn tie_distance_us(&self, camera: usize, host_us: f64) -> Option<(Tie, f64)> {
        let piece = self.at(host_us)?;
        let box_us = piece.host.box_us(host_us);
        let train = piece.cameras[camera].as_ref()?.tie_distance_us(box_us);
        let exchange = piece.host.tie_distance_us(box_us);
        Some(if train > exchange {
            (Tie::Train, train)
        } else {
            (Tie::Exchange, exchange)
        })
    }

    /// Mean rate of a camera's clock over the host's from its first train to its last, with its error. Same rate as in
    /// [`Self::clocks`], whose standard error is valid only for 95 %.
    #[must_use]
    pub fn drift(&self, camera: usize) -> Option<Drift> {
        best_drift(self.pieces.iter(), camera).map(Drift::new)
    }

    /// One line of camera time over host time at the trains of one leg (0: the first).
    pub(crate) fn leg_line(&self, leg: usize, camera: usize) -> Option<LegLine> {
        clock(self.pieces.iter().filter(|p| p.leg == leg), camera)
    }

    /// Camera time of an instant on the box's clock in its first epoch.
    #[must_use]
    pub fn camera_us_of_box(&self, camera: usize, box_us: u64) -> Option<Reading> {
        let piece = self.pieces.first()?;
        piece.camera_us_of_box(camera, piece.relative(box_us))
    }

    /// Host time of an instant on the box's clock in its first epoch. It is certainly within the bound; the 95 % interval
    /// assumes that both directions of an exchange take equally long on average.
    #[must_use]
    pub fn host_us_of_box(&self, box_us: u64) -> Option<Reading> {
        let piece = self.pieces.first()?;
        Some(piece.host_us_of_box(piece.relative(box_us)))
    }

    /// Camera 2's time for a time of camera 1 in the box's first epoch, µs.
    #[must_use]
    pub fn camera_2_of_camera_1(&self, camera_1_us: f64) -> Option<Reading> {
        let piece = self.pieces.first()?;
        let reference_us = piece.cameras[0].as_ref()?.reference_us as f64;
        piece.camera_2_of_camera_1(camera_1_us - reference_us)
    }

    /// Instants of all trains that both cameras saw, µs: (camera 1, camera 2), each on its own clock.
    #[must_use]
    pub fn shared_trains(&self) -> Vec<(f64, f64)> {
        self.pieces.iter().flat_map(shared).collect()
    }

    /// Epoch that contains a host time, or the nearest one.
    pub(super) fn at(&self, host_us: f64) -> Option<&EpochMaps> {
        let off = |p: &&EpochMaps| {
            let (from, to) = p.span_us;
            (from - host_us).max(host_us - to).max(0.0)
        };
        self.pieces.iter().min_by(|a, b| off(a).total_cmp(&off(b)))
    }
}

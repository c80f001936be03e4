//! One time base: host, trigger box, both cameras and the robot on one another, and the certificate of it.
//!
//! `host` bounds the host's clock by the exchanges with the box, `edges` finds the trains that the box sent among what
//! each camera saw, `smooth` fits both. Camera time over host time is the two together. `docs/time-base.md` has the
//! formulae and the limits.

mod edges;
mod epochs;
mod held_out;
mod host;
mod reading;
mod residuals;
mod smooth;
mod wire;

pub(crate) use self::edges::distance_us;
pub use self::reading::{Drift, Reading};
pub(crate) use self::smooth::{Point, Smooth};
pub use self::wire::{Wire, WireTrain, wire};

use skinrig_model::{AlignmentSettings, BoxReport, HostTime, TriggerEdge};

use self::edges::{CameraFromBox, Edges, NEAR_US, OffLine};
use self::epochs::{Epoch, epochs};
use self::held_out::coverage;
use self::host::HostFromBox;
use self::smooth::Figure;
use crate::clock::line::{self, Pair};
use crate::legs::{LegLine, LegStart, edges_of, leg_at, recorded_of};
use crate::metrics::quantile;
use crate::result::{
    Alignment, AlignmentStatus, ClockFit, ClockMap, ClockMethod, Knot, LineCounts, MapName,
};

/// Steps of maps are at least this long, µs: a rate that changes by 6 ppm per hour bends a clock by 0.02 µs in it.
pub(crate) const STEP_US: f64 = 10e6;
/// Instants of trains are never judged finer than this, µs.
const FLOOR_US: f64 = 0.5;
/// Coverage is judged from this many held-out points on: of fewer, two misses are no evidence.
const LEAST_HELD_OUT: u32 = 40;

/// What the time base is made of.
#[derive(Debug, Clone, Copy)]
pub struct Ties<'a> {
    /// Reports of the trigger box, in order.
    pub reports: &'a [BoxReport],
    /// Trigger edges of each camera, all channels.
    pub edges: [&'a [TriggerEdge]; 2],
    /// The channel that carries the trains.
    pub channel: u8,
    /// Camera-time intervals in which each camera was recording, µs; empty where that is not known.
    pub recorded: [&'a [(u64, u64)]; 2],
    /// Where further legs of the session begin.
    pub legs: &'a [LegStart],
    /// Host instants at which the time base is used, µs: contacts and releases.
    pub used_at_us: &'a [f64],
}

/// What ties one clock to another at an instant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tie {
    /// The host asked the trigger box for its time.
    Exchange,
    /// A camera saw a train that the box reports.
    Train,
    /// A camera saw a mark that the host sent.
    Mark,
}

/// The time base of a session.
#[derive(Debug, Clone, PartialEq)]
pub struct TimeBase {
    /// How good it is.
    pub alignment: Alignment,
    /// One line through camera over host time each; `None` when that camera's clock is not known.
    pub clocks: [Option<ClockFit>; 2],
    pieces: Vec<Piece>,
}

/// The maps of one epoch.
#[derive(Debug, Clone, PartialEq)]
struct Piece {
    leg: usize,
    reference_us: u64,
    span_us: (f64, f64),
    host: HostFromBox,
    cameras: [Option<CameraFromBox>; 2],
    /// Camera 2's clock over camera 1's, both relative to their references.
    between: Option<Smooth>,
}

impl Piece {
    /// An instant on the box's clock, relative to its reference, µs.
    fn relative(&self, box_us: u64) -> f64 {
        box_us.wrapping_sub(self.reference_us) as i64 as f64
    }

    /// Camera time of a host time.
    fn camera_us(&self, k: usize, host_us: f64) -> Option<Reading> {
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
    fn camera_us_of_box(&self, k: usize, box_us: f64) -> Option<Reading> {
        let camera = self.cameras[k].as_ref()?;
        let at = camera.at(box_us);
        let bound_us = camera.bound_us(box_us);
        Some(Reading::new(at, bound_us).later(camera.reference_us))
    }

    /// Host time of a box time.
    fn host_us_of_box(&self, box_us: f64) -> Reading {
        Reading::new(self.host.at(box_us), self.host.bound_us(box_us))
    }

    /// Camera 2's time of a camera 1's, relative to its reference: what the box shows cancels, each camera's own delay does not.
    fn camera_2_of_camera_1(&self, at: f64) -> Option<Reading> {
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

impl TimeBase {
    /// From what the box told and the cameras saw; `None` without any report of the box.
    #[must_use]
    pub fn new(ties: &Ties<'_>, limits: &AlignmentSettings) -> Option<Self> {
        if ties.reports.is_empty() {
            return None;
        }
        let resets = ties.reports.iter();
        // A further leg is no fault of the box.
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
            // Edges of one leg say nothing of trains of another.
            let edges = |k: usize| edges_of(ties.edges[k], ties.legs, leg, k);
            let recorded = |k: usize| recorded_of(ties.recorded[k], ties.legs, leg, k);
            lines.push([0, 1].map(|k| (Edges::new(edges(k), ties.channel), recorded(k))));
        }
        for epoch in epochs(ties.reports, ties.legs) {
            let mut found = Vec::new();
            if let Some(piece) = piece(&epoch, &mut lines[epoch.leg], &mut found) {
                pieces.push(piece);
            }
            // A leg that was cut off before its first press has no trains, and needs no clock.
            if used(epoch.leg) {
                violations.extend(found);
            }
        }
        pieces.sort_by(|a, b| a.span_us.0.total_cmp(&b.span_us.0));
        if pieces.is_empty() && violations.is_empty() {
            violations.push("host from box: expected exchanges of time, found none".to_owned());
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
        // What could not be mapped matters where the session has presses.
        for k in 0..2 {
            let unknown = |at: &&f64| base.at(**at).is_none_or(|p| p.cameras[k].is_none());
            if let Some(at) = ties.used_at_us.iter().find(unknown) {
                violations.push(format!(
                    "camera {} from host: expected a map at {:.3} s, found none",
                    k + 1,
                    at * 1e-6
                ));
            }
        }
        if !ties.used_at_us.is_empty() {
            let off_line = [0, 1].map(|k| base.off_line(k));
            violations.extend(beyond(&alignment, off_line, limits));
            for k in 0..2 {
                base.judge_untimed(k, ties, limits, &mut alignment.warnings, &mut violations);
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

    /// Camera time of a host time; `None` when that camera's clock is not known then.
    #[must_use]
    pub fn camera_us(&self, camera: usize, host_us: f64) -> Option<Reading> {
        self.at(host_us)?.camera_us(camera, host_us)
    }

    /// From a host time to the nearest exchange with the box, or to the nearest train that the camera saw when that is further, µs;
    /// `None` when that camera's clock is not known then.
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

    /// Mean rate of a camera's clock over the host's from its first train to its last, with its error: that of [`Self::clocks`],
    /// whose standard error is made for 95 % alone.
    #[must_use]
    pub fn drift(&self, camera: usize) -> Option<Drift> {
        best_drift(self.pieces.iter(), camera).map(Drift::new)
    }

    /// One line through camera over host time at the trains of one leg, 0 for the first.
    pub(crate) fn leg_line(&self, leg: usize, camera: usize) -> Option<LegLine> {
        clock(self.pieces.iter().filter(|p| p.leg == leg), camera)
    }

    /// Camera time of an instant on the box's clock in its first epoch.
    #[must_use]
    pub fn camera_us_of_box(&self, camera: usize, box_us: u64) -> Option<Reading> {
        let piece = self.pieces.first()?;
        piece.camera_us_of_box(camera, piece.relative(box_us))
    }

    /// Host time of an instant on the box's clock in its first epoch. It certainly lies within the bound; the 95 % interval takes both
    /// ways of an exchange to last equally long on average.
    #[must_use]
    pub fn host_us_of_box(&self, box_us: u64) -> Option<Reading> {
        let piece = self.pieces.first()?;
        Some(piece.host_us_of_box(piece.relative(box_us)))
    }

    /// Camera 2's time of a camera 1's in the box's first epoch, µs.
    #[must_use]
    pub fn camera_2_of_camera_1(&self, camera_1_us: f64) -> Option<Reading> {
        let piece = self.pieces.first()?;
        let reference_us = piece.cameras[0].as_ref()?.reference_us as f64;
        piece.camera_2_of_camera_1(camera_1_us - reference_us)
    }

    /// Instants on camera 2's and on camera 1's clock of all trains that both saw, µs: (camera 1, camera 2).
    #[must_use]
    pub fn shared_trains(&self) -> Vec<(f64, f64)> {
        self.pieces.iter().flat_map(shared).collect()
    }

    /// The epoch that a host time belongs to: the one that holds it, or else the nearest.
    fn at(&self, host_us: f64) -> Option<&Piece> {
        let off = |p: &&Piece| {
            let (from, to) = p.span_us;
            (from - host_us).max(host_us - to).max(0.0)
        };
        self.pieces.iter().min_by(|a, b| off(a).total_cmp(&off(b)))
    }

    /// The instants that no clock is too far from to time them.
    fn timed(&self, used_at_us: &[f64], limits: &AlignmentSettings) -> Vec<f64> {
        let far = |k: usize, at: f64| self.is_untimed(k, at, limits);
        let each = used_at_us.iter().copied();
        each.filter(|at| !far(0, *at) && !far(1, *at)).collect()
    }

    fn is_untimed(&self, k: usize, host_us: f64, limits: &AlignmentSettings) -> bool {
        let tie = self.tie_distance_us(k, host_us);
        tie.is_some_and(|(_, distance)| distance > limits.max_tie_distance_us)
    }

    /// Warns of contacts and releases that the clock of camera `k` does not time. Too many while it was recording make the session
    /// invalid; that it was not recording is no fault of a clock.
    fn judge_untimed(
        &self,
        k: usize,
        ties: &Ties<'_>,
        limits: &AlignmentSettings,
        warnings: &mut Vec<String>,
        violations: &mut Vec<String>,
    ) {
        let is_recorded = |host_us: f64| {
            let leg = leg_at(ties.legs, HostTime((host_us * 1e3) as i64));
            let spans = recorded_of(ties.recorded[k], ties.legs, leg, k);
            let at = self.camera_us(k, host_us).map_or(f64::NAN, |r| r.us);
            let holds = |(from, to): &(u64, u64)| (*from as f64..=*to as f64).contains(&at);
            ties.recorded[k].is_empty() || spans.iter().any(holds)
        };
        let far = ties.used_at_us.iter().copied();
        let far: Vec<f64> = far.filter(|at| self.is_untimed(k, *at, limits)).collect();
        if far.is_empty() {
            return;
        }
        let all = ties.used_at_us.len();
        let limit_s = limits.max_tie_distance_us * 1e-6;
        warnings.push(format!(
            "camera {}: {} of {all} contacts and releases are more than {limit_s} s from the nearest train that it saw or the nearest \
             exchange with the box: their presses are not timed",
            k + 1,
            far.len()
        ));
        let lost = far.iter().filter(|at| is_recorded(**at)).count() as f64 / all as f64;
        if lost > limits.max_lost {
            violations.push(format!(
                "camera {} from host, contacts and releases without a tie within {limit_s} s: expected at most {} %, found {:.1} %",
                k + 1,
                (1e5 * limits.max_lost).round() / 1e3,
                100.0 * lost
            ));
        }
    }

    fn counts(&self, k: usize) -> LineCounts {
        let each = self.pieces.iter().filter_map(|p| p.cameras[k].as_ref());
        each.fold(LineCounts::default(), |sum, c| LineCounts {
            trains_sent: sum.trains_sent + c.counts.trains_sent,
            trains_seen: sum.trains_seen + c.counts.trains_seen,
            trains_unrecorded: sum.trains_unrecorded + c.counts.trains_unrecorded,
            sent: sum.sent + c.counts.sent,
            seen: sum.seen + c.counts.seen,
            lost: sum.lost + c.counts.lost,
            doubled: sum.doubled + c.counts.doubled,
            spurious: sum.spurious + c.counts.spurious,
        })
    }

    fn off_line(&self, k: usize) -> OffLine {
        let each = self.pieces.iter().filter_map(|p| p.cameras[k].as_ref());
        each.fold(OffLine::default(), |sum, c| sum.and(c.off_line))
    }

    fn knots(&self, k: usize) -> Vec<Knot> {
        let mut out = Vec::new();
        for piece in &self.pieces {
            let Some(camera) = &piece.cameras[k] else {
                continue;
            };
            let mut at = piece.host.knots_us.clone();
            at.extend(camera.map.knots());
            at.sort_by(f64::total_cmp);
            at.dedup();
            out.extend(at.into_iter().map(|box_us| Knot {
                host_us: piece.host.host_us(box_us),
                camera_us: camera.reference_us as f64 + camera.map.value(box_us),
            }));
        }
        out
    }

    fn maps(&self, used_at_us: &[f64], limits: &AlignmentSettings) -> Vec<ClockMap> {
        let mut maps = Vec::new();
        if self.pieces.is_empty() {
            return maps;
        }
        let read = |map: ClockMap, of: &dyn Fn(&Piece, f64) -> Option<Reading>| {
            let each = used_at_us.iter();
            let all: Vec<Reading> = each.filter_map(|at| of(self.at(*at)?, *at)).collect();
            let usual = |of: &dyn Fn(&Reading) -> f64| {
                let mut widths: Vec<f64> = all.iter().map(of).collect();
                let largest = widths.iter().copied().reduce(f64::max)?;
                Some((quantile(&mut widths, 0.5)?, largest))
            };
            ClockMap {
                interval_us: usual(&|r| r.half_width_us(0.95)),
                bound_us: usual(&|r| r.bound_us),
                ..map
            }
        };
        let fits: Vec<&Smooth> = self.pieces.iter().map(|p| &p.host.fit).collect();
        maps.push(read(summary(MapName::HostFromBox, &fits), &|p, at| {
            Some(p.host_us_of_box(p.host.box_us(at)))
        }));
        for (k, name) in [(0, MapName::Camera1FromBox), (1, MapName::Camera2FromBox)] {
            let cameras = self.pieces.iter().filter_map(|p| p.cameras[k].as_ref());
            let fits: Vec<&Smooth> = cameras.map(|c| &c.map).collect();
            if fits.is_empty() {
                continue;
            }
            let held_out: Vec<(u32, u32)> = self
                .pieces
                .iter()
                .filter_map(|p| coverage(&trains(p, k)?))
                .collect();
            let map = covered(summary(name, &fits), &held_out);
            maps.push(read(map, &|p, at| p.camera_us_of_box(k, p.host.box_us(at))));
        }
        let between = self.pieces.iter().filter_map(|p| p.between.as_ref());
        let fits: Vec<&Smooth> = between.collect();
        if !fits.is_empty() {
            let pairs = self.pieces.iter().map(|p| pairs(&p.cameras));
            let held_out: Vec<(u32, u32)> = pairs.filter_map(|p| coverage(&p)).collect();
            let map = covered(summary(MapName::Camera2FromCamera1, &fits), &held_out);
            maps.push(read(map, &|p, at| {
                let one = p.cameras[0].as_ref()?;
                p.camera_2_of_camera_1(one.map.value(p.host.box_us(at)))
            }));
        }
        maps.push(ClockMap {
            bound_us: (!used_at_us.is_empty())
                .then_some((limits.robot_delay_us, limits.robot_delay_us)),
            ..summary(MapName::RobotFromHost, &[])
        });
        for (k, name) in [(0, MapName::Camera1FromHost), (1, MapName::Camera2FromHost)] {
            let Some(fit) = self.clocks[k] else { continue };
            let map = ClockMap {
                pieces: (self.knots(k).len().max(2) - 1) as u32,
                ..ClockMap::of_line(name, &fit)
            };
            maps.push(read(map, &|p, at| p.camera_us(k, at)));
        }
        maps
    }
}

/// The edges of a camera in one leg, and when it was recording.
type Line = (Edges, Vec<(u64, u64)>);

fn piece(epoch: &Epoch, lines: &mut [Line; 2], violations: &mut Vec<String>) -> Option<Piece> {
    let Some(host) = HostFromBox::new(&epoch.ties) else {
        violations.push(format!(
            "host from box: expected exchanges of time to fit a clock, found {} that do not",
            epoch.ties.len()
        ));
        return None;
    };
    if !host.consistent {
        violations.push("host from box: expected exchanges that agree on one clock, found some that exclude each other".to_owned());
    }
    let (first, last) = (epoch.ties.first()?, epoch.ties.last()?);
    let [one, two] = lines;
    let mut number = 0;
    let cameras = [one, two].map(|(line, recorded)| {
        number += 1;
        line.map(epoch, recorded)
            .map_err(|why| {
                violations.push(format!(
                    "camera {number} from box: expected a clock, found none: {why}"
                ));
            })
            .ok()
    });
    let between = Smooth::fit(&pairs(&cameras), STEP_US, FLOOR_US);
    Some(Piece {
        leg: epoch.leg,
        reference_us: epoch.reference_us,
        span_us: (first.sent_us, last.received_us),
        host,
        cameras,
        between,
    })
}

/// One line through camera over host time at all trains. Its slope is the mean rate from the first train to the last, of the leg in which
/// it is known best.
fn clock<'a>(pieces: impl Iterator<Item = &'a Piece> + Clone, k: usize) -> Option<LegLine> {
    let reference_us = pieces
        .clone()
        .find_map(|p| p.cameras[k].as_ref())?
        .reference_us;
    let mut trains = Vec::new();
    let mut contradicted = 0;
    for piece in pieces.clone() {
        let Some(camera) = &piece.cameras[k] else {
            continue;
        };
        contradicted += camera.contradicted;
        let ahead = camera.reference_us.wrapping_sub(reference_us) as i64 as f64;
        for (box_us, at) in camera.sent_us.iter().zip(&camera.instants) {
            if let Some(at) = at {
                trains.push(Pair {
                    host_us: piece.host.host_us(*box_us),
                    camera_us: ahead + at,
                });
            }
        }
    }
    let line = line::fit(&trains, 1.0)?;
    let drift = best_drift(pieces, k)?;
    let off = |t: &Pair| t.camera_us - t.host_us - drift.value * t.host_us;
    let used = || trains.iter().zip(&line.used).filter(|(_, used)| **used);
    let n = line.n() as f64;
    let offset_us = used().map(|(t, _)| off(t)).sum::<f64>() / n;
    let residuals = || used().map(|(t, _)| off(t) - offset_us);
    let fit = ClockFit {
        method: ClockMethod::TimeBase,
        offset_us: reference_us as f64 + offset_us,
        drift_ppm: drift.value * 1e6,
        drift_se_ppm: drift.stated_se() * 1e6,
        residual_rms_us: (residuals().map(|r| r * r).sum::<f64>() / n).sqrt(),
        residual_max_us: residuals().fold(0.0, |m, r| r.abs().max(m)),
        n: line.n() as u32,
        rejected: (trains.len() - line.n()) as u32 + contradicted,
    };
    let sum: f64 = trains.iter().map(|t| t.host_us).sum();
    Some(LegLine {
        fit,
        middle_us: sum / trains.len() as f64,
    })
}

/// The mean rate of camera over host time, of the leg in which it is known best.
fn best_drift<'a>(pieces: impl Iterator<Item = &'a Piece>, k: usize) -> Option<Figure> {
    let mut legs: Vec<Vec<&Piece>> = Vec::new();
    for piece in pieces.filter(|p| p.cameras[k].is_some()) {
        match legs.last_mut().filter(|of| of[0].leg == piece.leg) {
            Some(of) => of.push(piece),
            None => legs.push(vec![piece]),
        }
    }
    let drifts = legs.iter().filter_map(|leg| drift(leg, k));
    drifts.min_by(|a, b| a.stated_se().total_cmp(&b.stated_se()))
}

/// Mean rate of camera over host time in a leg, from the first train to the last. What the host's slope may be wrong by is most of it; a
/// delay that is longer one way than the other shifts both ends alike.
fn drift(leg: &[&Piece], k: usize) -> Option<Figure> {
    let (first, last) = (leg.first()?, leg.last()?);
    let (from, to) = (first.cameras[k].as_ref()?, last.cameras[k].as_ref()?);
    let (x0, x1) = (from.map.span_us().0, to.map.span_us().1);
    let ahead = to.reference_us.wrapping_sub(from.reference_us) as i64 as f64;
    let camera_us = ahead + to.map.value(x1) - from.map.value(x0);
    let host_us = last.host.host_us(x1) - first.host.host_us(x0);
    let value = (camera_us - host_us) / host_us;
    if host_us.is_nan() || host_us <= 0.0 {
        return None;
    }
    let both = if leg.len() == 1 {
        from.map.drift.less(first.host.drift((x0, x1))?)
    } else {
        // Each end errs by itself.
        let ends = from.at(x0).less(first.host.at(x0));
        let ends = ends.less(to.at(x1).less(last.host.at(x1)));
        Figure {
            se: ends.se / host_us,
            ..ends
        }
    };
    Some(Figure { value, ..both })
}

/// The instants of the trains that a camera saw over those on the box.
fn trains(piece: &Piece, k: usize) -> Option<Vec<Point>> {
    let camera = piece.cameras[k].as_ref()?;
    let each = camera.sent_us.iter().zip(&camera.instants);
    Some(
        each.filter_map(|(from_us, at)| Some(Point::new(*from_us, (*at)?)))
            .collect(),
    )
}

/// The instants of the trains that both cameras saw, relative to each camera's reference.
fn pairs(cameras: &[Option<CameraFromBox>; 2]) -> Vec<Point> {
    let [Some(one), Some(two)] = cameras else {
        return Vec::new();
    };
    let each = one.instants.iter().zip(&two.instants);
    each.filter_map(|(from, to)| Some(Point::new((*from)?, (*to)?)))
        .collect()
}

fn shared(piece: &Piece) -> Vec<(f64, f64)> {
    let references = [0, 1].map(|k| {
        let camera = piece.cameras[k].as_ref();
        camera.map_or(0.0, |c| c.reference_us as f64)
    });
    let each = pairs(&piece.cameras).into_iter();
    each.map(|p| (references[0] + p.from_us, references[1] + p.to_us))
        .collect()
}

fn covered(map: ClockMap, held_out: &[(u32, u32)]) -> ClockMap {
    let (inside, n) = held_out.iter().fold((0, 0), |s, h| (s.0 + h.0, s.1 + h.1));
    ClockMap {
        coverage: (n > 0).then(|| f64::from(inside) / f64::from(n)),
        coverage_n: n,
        ..map
    }
}

fn summary(map: MapName, fits: &[&Smooth]) -> ClockMap {
    let n: usize = fits.iter().map(|f| f.n()).sum();
    let all: usize = fits.iter().map(|f| f.used.len()).sum();
    let squares: f64 = fits
        .iter()
        .map(|f| f.rms_us * f.rms_us * f.n() as f64)
        .sum();
    let largest = fits.iter().map(|f| f.max_us).reduce(f64::max);
    ClockMap {
        map,
        pieces: fits
            .iter()
            .map(|f| f.knots().len() as u32 - 1)
            .sum::<u32>()
            .max(1),
        n: n as u32,
        rejected: (all - n) as u32,
        // Of the epoch with the most points.
        drift_ppm: fits
            .iter()
            .max_by_key(|f| f.n())
            .map(|f| f.drift.value * 1e6),
        residual_rms_us: largest.map(|_| (squares / n as f64).sqrt()),
        residual_max_us: largest,
        interval_us: None,
        bound_us: None,
        coverage: None,
        coverage_n: 0,
    }
}

/// What is beyond its limit, in words.
fn beyond(
    alignment: &Alignment,
    off_line: [OffLine; 2],
    limits: &AlignmentSettings,
) -> Vec<String> {
    // Most of what is missing came: the wire is well, and a clock is not. What both cameras see is the box's.
    let is_drifting = |k: usize| {
        alignment.lines.get(k).is_some_and(|line| {
            let missing = line.trains_sent - line.trains_seen;
            line.share(line.lost) > limits.max_lost && 2 * off_line[k].trains > missing
        })
    };
    let words = |clock: &str, k: usize| {
        format!(
            "{clock}, clock drift: expected the trains that camera {} saw within {:.0} µs of the line of a clock, found {} of {} up to \
             {:.0} µs off it: they came, and this clock drifts faster than a clock may, or jumps",
            k + 1,
            NEAR_US[1],
            off_line[k].trains,
            alignment.lines[k].trains_sent,
            off_line[k].most_us
        )
    };
    let mut drifting = match [is_drifting(0), is_drifting(1)] {
        [true, true] => vec![words("trigger box", 0)],
        [true, false] => vec![words("camera 1", 0)],
        [false, true] => vec![words("camera 2", 1)],
        [false, false] => Vec::new(),
    };
    let mut out = Vec::new();
    let mut judge = |what: String, limit: f64, found: f64, unit: &str| {
        if found > limit {
            out.push(format!(
                "{what}: expected at most {} {unit}, found {found:.1} {unit}",
                (limit * 1e3).round() / 1e3
            ));
        }
    };
    for map in &alignment.maps {
        let name = map.map.name();
        let by_trains = matches!(
            map.map,
            MapName::Camera1FromBox | MapName::Camera2FromBox | MapName::Camera2FromCamera1
        );
        if by_trains {
            if let Some(rms) = map.residual_rms_us {
                judge(
                    format!("{name}, residual rms"),
                    limits.max_residual_us,
                    rms,
                    "µs",
                );
            }
            if let (Some((_, noise)), Some((_, bound))) = (map.interval_us, map.bound_us) {
                judge(
                    format!("{name}, 95 % interval at the presses and the bound on top of it"),
                    limits.max_camera_interval_us,
                    noise + bound,
                    "µs",
                );
            }
            if let Some(share) = map.coverage.filter(|_| map.coverage_n >= LEAST_HELD_OUT) {
                // Chance alone leaves some outside.
                let least = limits.min_coverage;
                let error = (least * (1.0 - least) / f64::from(map.coverage_n)).sqrt();
                judge(
                    format!("{name}, share outside the stated interval"),
                    100.0 * (1.0 - least + 3.0 * error),
                    100.0 * (1.0 - share),
                    "%",
                );
            }
        }
        if map.map == MapName::HostFromBox
            && let Some((_, largest)) = map.bound_us
        {
            judge(
                format!("{name}, bound at the presses"),
                limits.max_host_interval_us,
                largest,
                "µs",
            );
        }
        if let Some(drift) = map.drift_ppm {
            judge(
                format!("{name}, drift"),
                limits.max_drift_ppm,
                drift.abs(),
                "ppm",
            );
        }
    }
    for (k, line) in alignment.lines.iter().enumerate() {
        let camera = format!("camera {}, trigger input", k + 1);
        // What came away from the line is neither lost nor spurious.
        if is_drifting(k) {
            continue;
        }
        judge(
            format!("{camera}, lost edges"),
            100.0 * limits.max_lost,
            100.0 * line.share(line.lost),
            "%",
        );
        let extra = line.doubled + line.spurious;
        judge(
            format!("{camera}, doubled and spurious edges"),
            100.0 * limits.max_spurious,
            100.0 * line.share(extra),
            "%",
        );
    }
    drifting.extend(out);
    drifting
}

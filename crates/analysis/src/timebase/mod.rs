//! One time base: host, trigger box, both cameras and the robot on one another, and the certificate of it.
//!
//! `host` bounds the host's clock by the exchanges with the box, `edges` finds the trains that the box sent among what
//! each camera saw, `piecewise` fits both. Camera time over host time is the two together. `docs/time-base.md` has the
//! formulae and the limits.

mod edges;
mod epochs;
mod held_out;
mod host;
mod piecewise;
mod residuals;
mod wire;

pub(crate) use self::edges::distance_us;
pub use self::wire::{Wire, WireTrain, wire};

use skinrig_model::{AlignmentSettings, BoxReport, HostTime, TriggerEdge};

use self::edges::{CameraFromBox, Edges};
use self::epochs::{Epoch, epochs};
use self::held_out::coverage;
use self::host::HostFromBox;
use self::piecewise::{Piecewise, Point};
use crate::clock::line::{self, Pair};
use crate::legs::{LegLine, LegStart, edges_of, leg_at, recorded_of};
use crate::metrics::quantile;
use crate::result::{
    Alignment, AlignmentStatus, ClockFit, ClockMap, ClockMethod, Knot, LineCounts, MapName,
};

/// Knots of maps of trains are at least this far apart, µs.
const SPACING_US: f64 = 60e6;
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
}

impl Piece {
    /// Camera time of a host time, and the 95 % half width, µs.
    fn camera_us(&self, k: usize, host_us: f64) -> Option<(f64, f64)> {
        let camera = self.cameras[k].as_ref()?;
        let box_us = self.host.box_us(host_us);
        Some((
            camera.reference_us as f64 + camera.map.value(box_us),
            self.host.half_width_us(box_us) + camera.interval_us(box_us),
        ))
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
            violations.extend(beyond(&alignment, limits));
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

    /// Camera time of a host time, and the half width of its 95 % interval, both µs; `None` when that camera's clock is not
    /// known then.
    #[must_use]
    pub fn camera_us(&self, camera: usize, host_us: f64) -> Option<(f64, f64)> {
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

    /// One line through camera over host time at the trains of one leg, 0 for the first.
    pub(crate) fn leg_line(&self, leg: usize, camera: usize) -> Option<LegLine> {
        clock(self.pieces.iter().filter(|p| p.leg == leg), camera)
    }

    /// Camera time of an instant on the box's clock in its first epoch, and the half width of its 95 % interval, µs.
    #[must_use]
    pub fn camera_us_of_box(&self, camera: usize, box_us: u64) -> Option<(f64, f64)> {
        let piece = self.pieces.first()?;
        let found = piece.cameras[camera].as_ref()?;
        let at = box_us.wrapping_sub(piece.reference_us) as i64 as f64;
        let camera_us = found.reference_us as f64 + found.map.value(at);
        Some((camera_us, found.interval_us(at)))
    }

    /// Host time of an instant on the box's clock in its first epoch, and the half width of the interval that certainly
    /// holds it, µs.
    #[must_use]
    pub fn host_us_of_box(&self, box_us: u64) -> Option<(f64, f64)> {
        let piece = self.pieces.first()?;
        let at = box_us.wrapping_sub(piece.reference_us) as i64 as f64;
        Some((piece.host.host_us(at), piece.host.half_width_us(at)))
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
            let at = self.camera_us(k, host_us).map_or(f64::NAN, |(at, _)| at);
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

    fn knots(&self, k: usize) -> Vec<Knot> {
        let mut out = Vec::new();
        for piece in &self.pieces {
            let Some(camera) = &piece.cameras[k] else {
                continue;
            };
            let mut at: Vec<f64> = piece.host.knots.iter().map(|k| k.0).collect();
            at.extend_from_slice(camera.map.knots());
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
        let interval = |of: &dyn Fn(&Piece, f64) -> Option<f64>| {
            let each = used_at_us.iter();
            let mut widths: Vec<f64> = each.filter_map(|at| of(self.at(*at)?, *at)).collect();
            let largest = widths.iter().copied().reduce(f64::max)?;
            Some((quantile(&mut widths, 0.5)?, largest))
        };
        let fits: Vec<&Piecewise> = self.pieces.iter().map(|p| &p.host.fit).collect();
        maps.push(ClockMap {
            interval_us: interval(&|p, at| Some(p.host.half_width_us(p.host.box_us(at)))),
            ..summary(MapName::HostFromBox, &fits)
        });
        for (k, name) in [(0, MapName::Camera1FromBox), (1, MapName::Camera2FromBox)] {
            let cameras = self.pieces.iter().filter_map(|p| p.cameras[k].as_ref());
            let fits: Vec<&Piecewise> = cameras.map(|c| &c.map).collect();
            if fits.is_empty() {
                continue;
            }
            let held_out: Vec<(u32, u32)> = self
                .pieces
                .iter()
                .filter_map(|p| coverage(&trains(p, k)?))
                .collect();
            maps.push(ClockMap {
                interval_us: interval(&|p, at| {
                    Some(p.cameras[k].as_ref()?.interval_us(p.host.box_us(at)))
                }),
                ..covered(summary(name, &fits), &held_out)
            });
        }
        let both: Vec<Vec<Point>> = self.pieces.iter().map(pairs).collect();
        let fits: Vec<Piecewise> = both
            .iter()
            .filter_map(|p| Piecewise::fit(p, SPACING_US, FLOOR_US))
            .collect();
        if !fits.is_empty() {
            let held_out: Vec<(u32, u32)> = both.iter().filter_map(|p| coverage(p)).collect();
            let fits: Vec<&Piecewise> = fits.iter().collect();
            maps.push(ClockMap {
                interval_us: interval(&|p, at| {
                    // The same edges: what the box shows cancels; each camera's own delay does not.
                    let at = p.host.box_us(at);
                    let [one, two] = &p.cameras;
                    Some(one.as_ref()?.interval_us(at) + two.as_ref()?.interval_us(at) - 1.0)
                }),
                ..covered(summary(MapName::Camera2FromCamera1, &fits), &held_out)
            });
        }
        maps.push(ClockMap {
            interval_us: (!used_at_us.is_empty())
                .then_some((limits.robot_delay_us, limits.robot_delay_us)),
            ..summary(MapName::RobotFromHost, &[])
        });
        for (k, name) in [(0, MapName::Camera1FromHost), (1, MapName::Camera2FromHost)] {
            let Some(fit) = self.clocks[k] else { continue };
            maps.push(ClockMap {
                pieces: (self.knots(k).len().max(2) - 1) as u32,
                interval_us: interval(&|p, at| Some(p.camera_us(k, at)?.1)),
                ..ClockMap::of_line(name, &fit)
            });
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
    Some(Piece {
        leg: epoch.leg,
        reference_us: epoch.reference_us,
        span_us: (first.sent_us, last.received_us),
        host,
        cameras,
    })
}

/// One line through camera over host time at all trains.
fn clock<'a>(pieces: impl Iterator<Item = &'a Piece> + Clone, k: usize) -> Option<LegLine> {
    let reference_us = pieces
        .clone()
        .find_map(|p| p.cameras[k].as_ref())?
        .reference_us;
    let mut trains = Vec::new();
    let mut contradicted = 0;
    for piece in pieces {
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
    let fit = ClockFit {
        method: ClockMethod::TimeBase,
        offset_us: reference_us as f64 + line.offset_us,
        drift_ppm: line.drift * 1e6,
        drift_se_ppm: line.drift_se * 1e6,
        residual_rms_us: line.rms_us,
        residual_max_us: line.max_us,
        n: line.n() as u32,
        rejected: (trains.len() - line.n()) as u32 + contradicted,
    };
    let sum: f64 = trains.iter().map(|t| t.host_us).sum();
    Some(LegLine {
        fit,
        middle_us: sum / trains.len() as f64,
    })
}

/// The instants of the trains that a camera saw over those on the box.
fn trains(piece: &Piece, k: usize) -> Option<Vec<Point>> {
    let camera = piece.cameras[k].as_ref()?;
    let each = camera.sent_us.iter().zip(&camera.instants);
    Some(
        each.filter_map(|(from_us, at)| {
            Some(Point {
                from_us: *from_us,
                to_us: (*at)?,
            })
        })
        .collect(),
    )
}

/// The instants of the trains that both cameras saw, relative to each camera's reference.
fn pairs(piece: &Piece) -> Vec<Point> {
    let [Some(one), Some(two)] = &piece.cameras else {
        return Vec::new();
    };
    let each = one.instants.iter().zip(&two.instants);
    each.filter_map(|(from, to)| {
        Some(Point {
            from_us: (*from)?,
            to_us: (*to)?,
        })
    })
    .collect()
}

fn shared(piece: &Piece) -> Vec<(f64, f64)> {
    let references = [0, 1].map(|k| {
        let camera = piece.cameras[k].as_ref();
        camera.map_or(0.0, |c| c.reference_us as f64)
    });
    let each = pairs(piece).into_iter();
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

fn summary(map: MapName, fits: &[&Piecewise]) -> ClockMap {
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
        drift_ppm: fits.iter().max_by_key(|f| f.n()).map(|f| f.drift * 1e6),
        residual_rms_us: largest.map(|_| (squares / n as f64).sqrt()),
        residual_max_us: largest,
        interval_us: None,
        coverage: None,
        coverage_n: 0,
    }
}

/// What is beyond its limit, in words.
fn beyond(alignment: &Alignment, limits: &AlignmentSettings) -> Vec<String> {
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
            if let Some((_, largest)) = map.interval_us {
                judge(
                    format!("{name}, 95 % interval at the presses"),
                    limits.max_camera_interval_us,
                    largest,
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
            && let Some((_, largest)) = map.interval_us
        {
            judge(
                format!("{name}, interval at the presses"),
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
    out
}

//! `camera_from_box`: matches edges on a camera's trigger input with the edges that the box sent, and fits the map.
//!
//! First *anchors*: trains whose readable bits agree with one sent train and contradict every other one in at least
//! [`MIN_CONTRADICTED`] bits. Then every sent edge is searched at its position predicted by the anchors. The edges found
//! give each train an instant, and these give the map. Labels are never counted off, so lost, doubled or spurious edges
//! cannot shift those after them.

use std::collections::HashMap;

use skinrig_model::TriggerEdge;
use skinrig_model::pulse::{PulseTrain, ReceivedTrain, read_trains};

use super::epochs::{Epoch, SentTrain};
use super::error::CameraClockError;
use super::smooth::{FLOOR_US, Figure, Point, STEP_US, SmoothMap, WANDER};
use crate::clock::line::median;
use crate::result::LineCounts;

/// Maximum number of unreadable bits in an anchor: the others still identify it among the sent trains.
const MAX_ERASED: u32 = 12;
/// Minimum number of readable bits that contradict every other sent train.
const MIN_CONTRADICTED: u32 = 3;
/// Search radius around the positions predicted by anchors, and then by trains, µs. Edges of the same direction are at least
/// 300 µs apart.
pub(crate) const NEAR_US: [f64; 2] = [60.0, 25.0];
/// Maximum distance of a doubled edge from the first, µs.
const DOUBLE_US: u64 = 20;
/// Minimum number of rising edges to give a train an instant.
const MIN_RISES: usize = 4;
/// The first estimate of a train may use an edge that is off by this, µs.
const ANCHOR_FLOOR_US: f64 = 3.0;

/// A camera's clock over the box's.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct CameraFromBox {
    /// Map from box time to camera time, both relative to their references.
    pub map: SmoothMap,
    /// Reference of the camera times, µs.
    pub reference_us: u64,
    /// Box times of all sent trains, relative to the epoch's reference, µs.
    pub sent_us: Vec<f64>,
    /// For each sent train its instant on the camera's clock relative to the reference, if seen.
    pub instants: Vec<Option<f64>>,
    /// Standard deviation of a rising edge about the instant of its train, µs.
    pub edge_sigma_us: f64,
    /// For each sent train, the number of pulses with both edges.
    pub whole_pulses: Vec<u32>,
    /// Standard deviation of the rising edges about their own train's mean, µs, and the number of edges; no edge is
    /// rejected.
    pub jitter: Option<(f64, u64)>,
    /// Box times of the trains used by the map, ascending, µs.
    pub ties_us: Vec<f64>,
    /// Edges sent, seen, lost, doubled, spurious.
    pub counts: LineCounts,
    /// Anchors that contradict the others.
    pub contradicted: u32,
    /// Trains identified by their label away from the predicted position.
    pub off_line: OffLineTrains,
}

/// Trains that arrived at positions that no plausible clock map predicts.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct OffLineTrains {
    /// Number of trains.
    pub trains: u32,
    /// Largest distance, µs.
    pub most_us: f64,
}

impl OffLineTrains {
    fn of(points: &[Point], sent: &[SentTrain], instants: &[Option<f64>], map: &SmoothMap) -> Self {
        let missing = sent.iter().zip(instants).filter(|(_, at)| at.is_none());
        let missing: Vec<f64> = missing.map(|(sent, _)| sent.box_us).collect();
        let away = points.iter().filter(|p| {
            let k = missing.partition_point(|us| *us < p.from_us);
            missing.get(k) == Some(&p.from_us)
        });
        away.fold(Self::default(), |sum, p| Self {
            trains: sum.trains + 1,
            most_us: sum.most_us.max((p.to_us - map.value(p.from_us)).abs()),
        })
    }

    /// Combines both.
    pub(super) fn and(self, other: Self) -> Self {
        Self {
            trains: self.trains + other.trains,
            most_us: self.most_us.max(other.most_us),
        }
    }
}

impl CameraFromBox {
    /// Distance from a box time to the nearest train used by the map, µs.
    pub(super) fn tie_distance_us(&self, box_us: f64) -> f64 {
        distance_us(&self.ties_us, box_us)
    }

    /// Camera time of a box time, relative to the reference, µs.
    pub(super) fn at(&self, box_us: f64) -> Figure {
        Figure {
            value: self.map.value(box_us),
            se: self.map.standard_error(box_us),
            free: self.map.free,
        }
    }

    /// Systematic error, not reduced by more edges, µs: edges have an unknown mean delay of the size of their scatter (less
    /// than 2 standard deviations for any uniform or decaying delay), both clocks have a resolution of 1 µs, and before the
    /// first train and after the last the rate may have changed by [`WANDER`].
    pub(super) fn bound_us(&self, box_us: f64) -> f64 {
        2.0 * self.edge_sigma_us + 1.0 + WANDER * beyond_us(&self.ties_us, box_us)
    }
}

/// Distance from `at` to the nearest of `ties`, which ascend.
pub(crate) fn distance_us(ties: &[f64], at: f64) -> f64 {
    let k = ties.partition_point(|t| *t < at);
    let near = &ties[k.saturating_sub(1)..(k + 1).min(ties.len())];
    near.iter()
        .fold(f64::INFINITY, |d, t| d.min((t - at).abs()))
}

/// Distance of `at` before the first or after the last of `ties`, which ascend; 0 between them.
pub(crate) fn beyond_us(ties: &[f64], at: f64) -> f64 {
    match (ties.first(), ties.last()) {
        (Some(first), Some(last)) => (first - at).max(at - last).max(0.0),
        _ => f64::INFINITY,
    }
}

/// Edges of one channel, sorted; used ones are removed.
pub(super) struct Edges {
    all: Vec<TriggerEdge>,
    used: Vec<bool>,
    trains: Vec<ReceivedTrain>,
}

impl Edges {
    pub(super) fn new(edges: &[TriggerEdge], channel: u8) -> Self {
        let mut all: Vec<TriggerEdge> = edges
            .iter()
            .copied()
            .filter(|e| e.channel == channel)
            .collect();
        all.sort_by_key(|e| e.t_us);
        Self {
            trains: read_trains(&all),
            used: vec![false; all.len()],
            all,
        }
    }

    /// Map of one epoch, or why there is none. `recorded`: periods in which the camera was recording, on its own clock, µs;
    /// empty if unknown.
    pub(super) fn map(
        &mut self,
        epoch: &Epoch,
        recorded: &[(u64, u64)],
    ) -> Result<CameraFromBox, CameraClockError> {
        let anchors = anchors(&self.trains, &epoch.trains);
        let Some(reference_us) = anchors.first().map(|a| a.1) else {
            return Err(CameraClockError::Unidentified {
                sent: epoch.trains.len(),
                edges: self.all.len(),
            });
        };
        let points: Vec<Point> = anchors
            .iter()
            .map(|(box_us, t_us)| Point::new(*box_us, relative(*t_us, reference_us)))
            .collect();
        let mut map = SmoothMap::fit(&points, STEP_US, ANCHOR_FLOOR_US)
            .filter(|map| map.drift.value.abs() <= crate::clock::NO_CLOCK_DRIFT)
            .ok_or(CameraClockError::NoLine {
                identified: anchors.len(),
                sent: epoch.trains.len(),
            })?;
        let contradicted = (points.len() - map.n()) as u32;
        let mut matched = Vec::new();
        let mut instants = Vec::new();
        let mut seen_us = Vec::new();
        for near_us in NEAR_US {
            matched = self.match_trains(&epoch.trains, &map, reference_us, near_us);
            instants = matched.iter().map(TrainMatch::instant).collect::<Vec<_>>();
            let seen: Vec<Point> = epoch
                .trains
                .iter()
                .zip(&instants)
                .filter_map(|(sent, at)| Some(Point::new(sent.box_us, (*at)?)))
                .collect();
            map = SmoothMap::fit(&seen, STEP_US, FLOOR_US)
                .ok_or(CameraClockError::FewSeen { seen: seen.len() })?;
            seen_us = seen.iter().map(|p| p.from_us).collect();
        }
        let used = seen_us.into_iter().zip(&map.used).filter(|(_, u)| **u);
        let ties_us = used.map(|(at, _)| at).collect();
        let edge_sigma_us = edge_sigma_us(&matched);
        let whole_pulses = matched.iter().map(|m| m.whole_pulses).collect();
        let jitter = jitter(&matched);
        let spans: Vec<(f64, f64)> = recorded
            .iter()
            .map(|(from, to)| (relative(*from, reference_us), relative(*to, reference_us)))
            .collect();
        let counts = self.count(&matched, &spans, reference_us);
        let off_line = OffLineTrains::of(&points, &epoch.trains, &instants, &map);
        Ok(CameraFromBox {
            map,
            reference_us,
            sent_us: epoch.trains.iter().map(|t| t.box_us).collect(),
            instants,
            edge_sigma_us,
            whole_pulses,
            jitter,
            ties_us,
            counts,
            contradicted,
            off_line,
        })
    }

    /// Searches every sent edge at its position predicted by the map.
    fn match_trains(
        &self,
        sent: &[SentTrain],
        map: &SmoothMap,
        reference_us: u64,
        near_us: f64,
    ) -> Vec<TrainMatch> {
        sent.iter()
            .map(|train| {
                let start = map.value(train.box_us);
                let end = train.box_us + PulseTrain::DURATION_US as f64;
                let mut out = TrainMatch {
                    start_us: start,
                    end_us: map.value(end),
                    ..TrainMatch::default()
                };
                let mut rose = false;
                for (offset, rising) in train.train.edges() {
                    let at = map.value(train.box_us + offset as f64);
                    let found = self.nearest(at, rising, reference_us, near_us);
                    if let Some((index, off)) = found {
                        out.edges.push(index);
                        if rising {
                            out.rises.push(off);
                        }
                    }
                    // A falling edge follows its rising edge.
                    out.whole_pulses += u32::from(!rising && rose && found.is_some());
                    rose = rising && found.is_some();
                }
                out
            })
            .collect()
    }

    /// The edge nearest to a time relative to the reference, and how much later it is.
    fn nearest(
        &self,
        at_us: f64,
        rising: bool,
        reference_us: u64,
        near_us: f64,
    ) -> Option<(usize, f64)> {
        let from = self
            .all
            .partition_point(|e| relative(e.t_us, reference_us) < at_us - near_us);
        self.all[from..]
            .iter()
            .enumerate()
            .map(|(k, e)| (k, e.rising, relative(e.t_us, reference_us) - at_us))
            .take_while(|(_, _, off)| *off <= near_us)
            .filter(|(_, up, _)| *up == rising)
            .map(|(k, _, off)| (from + k, off))
            .min_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
    }

    /// Counts all trains that were seen, or sent while the camera was recording, and removes their edges. Trains before the
    /// first seen one, or after the last, count as lost.
    fn count(
        &mut self,
        matched: &[TrainMatch],
        recorded: &[(f64, f64)],
        reference_us: u64,
    ) -> LineCounts {
        let seen = |m: &&TrainMatch| m.rises.len() >= MIN_RISES;
        let is_recorded = |m: &&TrainMatch| {
            let holds = |(from, to): &(f64, f64)| *from <= m.start_us && m.end_us <= *to;
            recorded.is_empty() || recorded.iter().any(holds)
        };
        let counted = || matched.iter().filter(|m| seen(m) || is_recorded(m));
        let trains = counted().count();
        let mut counts = LineCounts {
            trains_sent: trains as u32,
            trains_seen: counted().filter(seen).count() as u32,
            trains_unrecorded: (matched.len() - trains) as u32,
            sent: trains as u64 * EDGES_PER_TRAIN,
            ..LineCounts::default()
        };
        let (Some(first), Some(last)) = (counted().next(), counted().next_back()) else {
            return counts;
        };
        for index in counted().flat_map(|m| &m.edges) {
            if !std::mem::replace(&mut self.used[*index], true) {
                counts.seen += 1;
            }
        }
        counts.lost = counts.sent - counts.seen;
        // An unreported train may begin after the pause that follows the last one.
        let within = first.start_us - NEAR_US[0]..=last.end_us - NEAR_US[0];
        let (mut rise, mut fall) = (None, None);
        for (edge, used) in self.all.iter().zip(&mut self.used) {
            let at_us = relative(edge.t_us, reference_us);
            let before = if edge.rising { &mut rise } else { &mut fall };
            let double = before.is_some_and(|t| edge.t_us - t <= DOUBLE_US);
            if within.contains(&at_us) && !*used {
                *used = true;
                *(if double {
                    &mut counts.doubled
                } else {
                    &mut counts.spurious
                }) += 1;
            }
            *before = Some(edge.t_us);
        }
        counts
    }
}

/// Edges of a train.
const EDGES_PER_TRAIN: u64 = 2 * skinrig_model::pulse::PULSES_PER_TRAIN;

/// Edges found for one train.
#[derive(Debug, Default)]
struct TrainMatch {
    /// Earliest position of its first edge, and latest of its last.
    start_us: f64,
    end_us: f64,
    /// Edges found.
    edges: Vec<usize>,
    /// Delay of each rising edge; falling edges may have another delay.
    rises: Vec<f64>,
    /// Pulses with both edges found.
    whole_pulses: u32,
}

impl TrainMatch {
    /// Instant of the train: the median of its rising edges.
    fn instant(&self) -> Option<f64> {
        if self.rises.len() < MIN_RISES {
            return None;
        }
        Some(self.start_us + median(&mut self.rises.clone())?)
    }
}

/// Robust standard deviation of rising edges about the instants of their trains.
fn edge_sigma_us(matched: &[TrainMatch]) -> f64 {
    let mut off: Vec<f64> = matched
        .iter()
        .filter_map(|m| Some((m, m.instant()? - m.start_us)))
        .flat_map(|(m, middle)| m.rises.iter().map(move |r| (r - middle).abs()))
        .collect();
    1.482_602_218_505_602 * median(&mut off).unwrap_or(0.0)
}

/// Standard deviation of rising edges about the means of their trains, pooled over trains (each takes one degree of
/// freedom), and the number of edges.
fn jitter(matched: &[TrainMatch]) -> Option<(f64, u64)> {
    let (mut squares, mut free, mut n) = (0.0, 0, 0);
    for rises in matched.iter().map(|m| &m.rises) {
        if rises.len() >= MIN_RISES {
            let mean = rises.iter().sum::<f64>() / rises.len() as f64;
            squares += rises.iter().map(|r| (r - mean) * (r - mean)).sum::<f64>();
            free += rises.len() - 1;
            n += rises.len() as u64;
        }
    }
    (free > 0).then(|| ((squares / free as f64).sqrt(), n))
}

/// (box time, camera time) of the identified trains, in order of box time.
fn anchors(read: &[ReceivedTrain], sent: &[SentTrain]) -> Vec<(f64, u64)> {
    let by_word: HashMap<u32, usize> = sent
        .iter()
        .enumerate()
        .map(|(k, s)| (s.train.bits(), k))
        .collect();
    let name = |r: &ReceivedTrain| {
        let k = match r.erased {
            0 => by_word.get(&r.bits).copied(),
            _ => named(r, sent),
        };
        k.map(|k| &sent[k]).filter(|s| s.unique)
    };
    let mut found: Vec<(f64, u64)> = read
        .iter()
        .filter(|r| r.erased.count_ones() <= MAX_ERASED)
        .filter_map(|r| Some((name(r)?.box_us, r.t_us)))
        .collect();
    found.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    // A doubled start edge gives a train twice.
    found.dedup_by_key(|a| a.0);
    found
}

/// The only sent train with which all readable bits agree, if they contradict all others.
fn named(read: &ReceivedTrain, sent: &[SentTrain]) -> Option<usize> {
    let contradicted =
        |s: &SentTrain| ((s.train.bits() ^ read.bits) & !read.erased & WORD).count_ones();
    let mut found = None;
    for (k, train) in sent.iter().enumerate() {
        match contradicted(train) {
            0 if found.is_none() => found = Some(k),
            n if n < MIN_CONTRADICTED => return None,
            _ => {}
        }
    }
    found
}

/// All bits of a train.
const WORD: u32 = (1 << 31) - 1;

fn relative(t_us: u64, reference_us: u64) -> f64 {
    t_us.wrapping_sub(reference_us) as i64 as f64
}

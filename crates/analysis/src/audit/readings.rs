//! Owns the readings of a session, and how well each explains what the cameras saw.
//!
//! A reading assigns streams to cameras, states whether an image is mirrored, and where each press was. Its cost is that of
//! the best-fitting cameras near the nominal ones ([`super::resection`]): low if the columns match the viewing angles of
//! cameras at their nominal positions. The difference of two costs is the log odds between the readings.

use std::collections::BTreeSet;

use skinrig_model::{CameraId, CameraModel, Point2, PressRole, RigGeometry, SENSOR_WIDTH};

use super::frames::Frame;
use super::observed_press::ObservedPress;
use super::resection::{MEDIAN_TO_SIGMA, Resection, resect, residual_deg};
use super::statistics::median;
use crate::result::{Fault, OtherReading};

/// Maximum number of presses for the comparison; of more, every n-th is used.
const MAX_PRESSES: usize = 600;
/// Median scatter of the angles above which columns must move, degrees.
pub(super) const MIN_SPREAD_DEG: f64 = 5.0;
/// Largest shift of the press list to consider.
pub(crate) const MAX_SHIFT: i32 = 5;
/// Cost of a fitted displacement, nats: two free parameters anywhere on the skin.
const FREE_DISPLACEMENT: f64 = 4.0;
/// Cost of a shift of each stream, nats: one of eleven each.
const FREE_SHIFTS: f64 = 4.8;
/// Maximum evidence of the sync presses against a reading, nats per camera: they share one location, which may be poorly
/// visible.
const MAX_SYNC: f64 = 8.0;
/// A line of the path ends where the direction turns by more than 45 degrees.
const SAME_DIRECTION: f64 = 0.7;

/// One reading of the session.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Reading {
    /// Fault that this reading implies; `None` for the session as recorded.
    pub fault: Option<Fault>,
    /// What it is.
    pub what: OtherReading,
    /// Nominal camera of each stream.
    pub cameras: [usize; 2],
    /// Streams with mirrored columns.
    pub mirrored: [bool; 2],
    /// Position of each press of the path; `None` if the reading does not define it.
    pub at: Vec<Option<Point2>>,
    /// Rows by which each stream is late: its columns are those of the presses so many rows later.
    pub rows: [i32; 2],
    /// Added to the cost, nats.
    pub penalty: f64,
}

/// A reading with its best fit.
#[derive(Debug, Clone)]
pub(crate) struct ScoredReading<'a> {
    pub reading: &'a Reading,
    /// Cameras that explain the streams best.
    pub fits: [Option<Resection>; 2],
    /// Robust standard deviation of the viewing angles about their median: the error of a blind guess.
    pub ignorance_deg: [f64; 2],
    /// Negative log likelihood, nats.
    pub cost: f64,
}

impl ScoredReading<'_> {
    /// True if the streams follow the presses: residual below this share of the ignorance residual.
    pub(super) fn follows(&self, share: f64) -> bool {
        let each = self.fits.iter().zip(self.ignorance_deg);
        each.clone().any(|(fit, _)| fit.is_some())
            && each
                .filter_map(|(fit, ignorance)| Some((fit.as_ref()?, ignorance)))
                .all(|(fit, ignorance)| fit.spread_deg < share * ignorance)
    }
}

/// Presses of the path in order, and the sync presses.
pub(super) struct Path<'a> {
    pub rig: &'a RigGeometry,
    /// All presses of the path with a column in at least one camera.
    pub presses_seen: Vec<&'a ObservedPress<'a>>,
    /// Number of distinct locations.
    pub places: usize,
    /// Median column and stated position of the sync presses for each stream, if it has another source than the positions of
    /// the path.
    sync: [Option<(f64, Point2)>; 2],
    stride: usize,
}

impl<'a> Path<'a> {
    pub(super) fn new(rig: &'a RigGeometry, presses_seen: &'a [ObservedPress<'a>]) -> Self {
        let is_sighted = |t: &&ObservedPress<'_>| t.sights.iter().any(|s| s.column.is_some());
        let path: Vec<&ObservedPress<'_>> = presses_seen
            .iter()
            .filter(|t| t.role != PressRole::Sync)
            .collect();
        let places: BTreeSet<(u64, u64)> = path
            .iter()
            .copied()
            .filter(|t| is_sighted(t))
            .map(|t| (t.planned.x_mm.to_bits(), t.planned.y_mm.to_bits()))
            .collect();
        // In an imported recording positions come from a table, those of sync presses from the schedule.
        let sync = CameraId::ALL.map(|camera| {
            let own = || {
                presses_seen
                    .iter()
                    .filter(|t| t.role == PressRole::Sync && t.outcome.scheduled)
            };
            let columns = own().filter_map(|t| t.sights[camera.index()].column);
            Some((median(columns.collect())?, own().next()?.at()))
        });
        let stride = path.len().div_ceil(MAX_PRESSES).max(1);
        Self {
            rig,
            presses_seen: path,
            places: places.len(),
            sync,
            stride,
        }
    }

    fn positions(&self) -> Vec<Option<Point2>> {
        self.presses_seen.iter().map(|t| Some(t.at())).collect()
    }

    /// The session as recorded.
    pub(crate) fn as_it_is(&self) -> Reading {
        Reading {
            fault: None,
            what: OtherReading::AsRecorded,
            cameras: [0, 1],
            mirrored: [false; 2],
            at: self.positions(),
            rows: [0; 2],
            penalty: 0.0,
        }
    }

    /// All other known readings.
    pub(crate) fn alternatives(&self) -> Vec<Reading> {
        let base = self.as_it_is();
        let mut all = Vec::new();
        let both = |camera| OtherReading::BothStreams { camera };
        for (cameras, fault, what) in [
            (
                [1, 0],
                Fault::CamerasSwapped,
                OtherReading::CamerasExchanged,
            ),
            ([0, 0], Fault::OneCameraTwice, both(CameraId::One)),
            ([1, 1], Fault::OneCameraTwice, both(CameraId::Two)),
        ] {
            all.push(Reading {
                fault: Some(fault),
                what,
                cameras,
                ..base.clone()
            });
        }
        let picture = |camera| OtherReading::PictureMirrored { camera };
        for (mirrored, what) in [
            ([true, false], picture(CameraId::One)),
            ([false, true], picture(CameraId::Two)),
            ([true, true], OtherReading::PicturesMirrored),
        ] {
            all.push(Reading {
                fault: Some(Fault::PictureTurned),
                what,
                mirrored,
                ..base.clone()
            });
        }
        for frame in Frame::all(&self.rig.outline) {
            all.push(self.in_frame(&frame));
        }
        for by in (1..=MAX_SHIFT)
            .flat_map(|k| [k, -k])
            .filter(|_| self.bends())
        {
            let at = (0..self.presses_seen.len()).map(|i| self.shifted(i, by));
            all.push(Reading {
                fault: Some(Fault::IndexShifted),
                what: OtherReading::ListShifted { rows: by },
                at: at.collect(),
                ..base.clone()
            });
        }
        all.extend(self.reordered(&base));
        all
    }

    /// The same path, of which only about `presses` are compared.
    pub(super) fn thinned(&self, presses: usize) -> Self {
        Self {
            presses_seen: self.presses_seen.clone(),
            stride: self.presses_seen.len().div_ceil(presses).max(1),
            ..*self
        }
    }

    /// The positions of a table given in `frame`.
    pub(crate) fn in_frame(&self, frame: &Frame) -> Reading {
        let base = self.as_it_is();
        Reading {
            fault: Some(frame.fault),
            what: OtherReading::Frame {
                frame: frame.change,
            },
            at: base.at.iter().map(|p| p.map(|p| frame.skin(p))).collect(),
            ..base
        }
    }

    /// Positions displaced opposite to the common displacement of both cameras.
    pub(super) fn displaced(&self, as_is: &ScoredReading<'_>) -> Option<Reading> {
        let [Some(one), Some(two)] = as_is.fits else {
            return None;
        };
        let by = [0, 1].map(|k| -0.5 * (one.off[k] + two.off[k]));
        Some(Reading {
            what: OtherReading::Displaced { by_mm: by },
            penalty: FREE_DISPLACEMENT,
            ..self.in_frame(&Frame::displaced(by))
        })
    }

    /// The planned positions, if the measured ones differ.
    pub(crate) fn as_planned(&self) -> Reading {
        Reading {
            fault: Some(Fault::RobotOff),
            what: OtherReading::AsPlanned,
            at: self.presses_seen.iter().map(|t| Some(t.planned)).collect(),
            ..self.as_it_is()
        }
    }

    /// Each stream shifted by rows of its own, as if its clock were whole presses off: the likeliest shift of each, if they
    /// differ. The cost of a stream does not depend on the other one.
    pub(crate) fn streams_apart(&self) -> Option<Reading> {
        if !self.bends() {
            return None;
        }
        let base = self.as_it_is();
        let shifts = (-MAX_SHIFT..=MAX_SHIFT).map(|by| {
            let shifted = Reading {
                rows: [by; 2],
                ..base.clone()
            };
            (by, self.score(&shifted).fits)
        });
        let shifts: Vec<_> = shifts.collect();
        let likeliest = |k: usize| {
            let costs = shifts
                .iter()
                .filter_map(|(by, fits)| Some((fits[k].as_ref()?.cost, *by)));
            costs.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, by)| by)
        };
        let rows = [likeliest(0)?, likeliest(1)?];
        (rows[0] != rows[1]).then_some(Reading {
            fault: Some(Fault::ClockWrong),
            what: OtherReading::StreamsShifted { presses: rows },
            rows,
            penalty: FREE_SHIFTS,
            ..base
        })
    }

    /// Position of the press `by` rows after press `i`, in the same repetition or another one.
    pub(super) fn shifted(&self, i: usize, by: i32) -> Option<Point2> {
        let there = usize::try_from(i as i64 + i64::from(by)).ok()?;
        Some(self.presses_seen.get(there)?.at())
    }

    /// The list reversed, and with every second line of the path reversed, which converts between a raster and a meander.
    fn reordered(&self, base: &Reading) -> Vec<Reading> {
        let n = self.presses_seen.len();
        let reading = |what: OtherReading, at: Vec<Option<Point2>>| Reading {
            fault: Some(Fault::OrderOfPresses),
            what,
            at,
            ..base.clone()
        };
        let mut all = Vec::new();
        let (mut reversed, mut odd, mut even) = (base.at.clone(), base.at.clone(), base.at.clone());
        for repetition in self.repetitions() {
            reversed[repetition.clone()].reverse();
            for (i, line) in self.lines(repetition).into_iter().enumerate() {
                let turned = if i % 2 == 0 { &mut even } else { &mut odd };
                turned[line].reverse();
            }
        }
        if n > 2 {
            all.push(reading(OtherReading::ListReversed, reversed));
            all.push(reading(OtherReading::LinesReversed, odd));
            all.push(reading(OtherReading::LinesReversed, even));
        }
        all
    }

    /// Consecutive presses of each repetition.
    pub(super) fn repetitions(&self) -> Vec<std::ops::Range<usize>> {
        let mut from = 0;
        let mut all = Vec::new();
        for i in 1..=self.presses_seen.len() {
            let ends = self
                .presses_seen
                .get(i)
                .is_none_or(|t| t.repetition != self.presses_seen[from].repetition);
            if ends {
                all.push(from..i);
                from = i;
            }
        }
        all
    }

    /// On a single straight line, a shift of the list displaces all locations alike, just as displaced cameras would.
    fn bends(&self) -> bool {
        let mut repetitions = self.repetitions().into_iter();
        repetitions.any(|r| self.lines(r).len() > 1)
    }

    /// Straight lines of the path within `range`.
    fn lines(&self, range: std::ops::Range<usize>) -> Vec<std::ops::Range<usize>> {
        let step = |i: usize| {
            let (a, b) = (self.presses_seen[i - 1].at(), self.presses_seen[i].at());
            (b.x_mm - a.x_mm, b.y_mm - a.y_mm)
        };
        let (mut all, mut from) = (Vec::new(), range.start);
        for i in range.start + 2..range.end {
            if i < from + 2 {
                continue;
            }
            let (a, b) = (step(i - 1), step(i));
            let product = a.0 * b.0 + a.1 * b.1;
            let sizes = libm::hypot(a.0, a.1) * libm::hypot(b.0, b.1);
            if product < SAME_DIRECTION * sizes {
                all.push(from..i);
                from = i;
            }
        }
        all.push(from..range.end);
        all
    }

    /// Fits the cameras to `reading`.
    pub(super) fn score<'r>(&self, reading: &'r Reading) -> ScoredReading<'r> {
        let mut judged = ScoredReading {
            reading,
            fits: [None; 2],
            ignorance_deg: [0.0; 2],
            cost: reading.penalty,
        };
        for k in 0..2 {
            let drawn = &self.rig.nominal.cameras[reading.cameras[k]];
            let pairs = self.pairs(reading, k);
            let Some(fit) = resect(drawn, &pairs, self.places) else {
                continue;
            };
            judged.ignorance_deg[k] = scatter_deg(drawn, &pairs);
            judged.cost += fit.cost;
            if let Some((column, at)) = self.sync[k] {
                let column = mirrored(column, reading.mirrored[k]);
                let off = residual_deg(&fit.camera, column, at) / fit.spread_deg;
                judged.cost += (0.5 * off * off).min(MAX_SYNC);
            }
            judged.fits[k] = Some(fit);
        }
        judged
    }

    /// True if most columns of the presses that `other` moves lie closer to their viewing angles by it. The spreads of two
    /// readings are medians: they cannot tell what a small part of the presses says, and the fit of the rest leaves them out.
    pub(super) fn moved_presses_prefer(
        &self,
        as_is: &ScoredReading<'_>,
        other: &ScoredReading<'_>,
    ) -> bool {
        let (mut closer, mut moved) = (0, 0);
        for (i, touch) in self.presses_seen.iter().enumerate() {
            let (Some(here), Some(there)) = (as_is.reading.at[i], other.reading.at[i]) else {
                continue;
            };
            if here == there {
                continue;
            }
            for k in 0..2 {
                let (Some(column), Some(own), Some(theirs)) =
                    (touch.sights[k].column, &as_is.fits[k], &other.fits[k])
                else {
                    continue;
                };
                let off = residual_deg(&own.camera, column, here).abs();
                moved += 1;
                closer += usize::from(residual_deg(&theirs.camera, column, there).abs() < off);
            }
        }
        2 * closer > moved
    }

    /// Columns of stream `k` and positions by `reading`.
    fn pairs(&self, reading: &Reading, k: usize) -> Vec<(f64, Point2)> {
        let presses = self.presses_seen.iter().enumerate().step_by(self.stride);
        presses
            .filter_map(|(i, touch)| {
                let column = mirrored(touch.sights[k].column?, reading.mirrored[k]);
                let row = usize::try_from(i as i64 + i64::from(reading.rows[k])).ok()?;
                Some((column, (*reading.at.get(row)?)?))
            })
            .collect()
    }
}

/// Robust standard deviation of the viewing angles of the positions about their median, degrees; 0 of none.
pub(super) fn scatter_deg(camera: &CameraModel, pairs: &[(f64, Point2)]) -> f64 {
    let angles = pairs.iter().map(|p| camera.angle_of_point_deg(p.1));
    let angles: Vec<f64> = angles.collect();
    let middle = median(angles.clone()).unwrap_or(0.0);
    let scatter = median(angles.iter().map(|a| (a - middle).abs()).collect());
    MEDIAN_TO_SIGMA * scatter.unwrap_or(0.0)
}

fn mirrored(column: f64, yes: bool) -> f64 {
    if yes {
        f64::from(SENSOR_WIDTH) - column
    } else {
        column
    }
}

//! Ways to read a session, and how well each explains what the cameras saw.
//!
//! A reading says which camera gave which stream, whether its picture is mirrored, and where each press was. Its cost is that of
//! the best cameras near the drawn ones ([`super::resection`]): a reading that lays the columns on the viewing angles with cameras
//! that stand where they are drawn costs little. The difference of two costs is the logarithm of the odds between them.

use std::collections::BTreeSet;

use skinrig_model::{CameraId, Point2, PressRole, RigGeometry, SENSOR_WIDTH};

use super::frames::Frame;
use super::resection::{Resection, resect, residual_deg};
use super::statistics::median;
use super::touch::Touch;
use crate::result::Fault;

/// Most presses that readings are compared on; of more, every n-th.
const MOST_PRESSES: usize = 600;
/// Largest shift of the press list that is looked for.
pub(crate) const MOST_SHIFT: i32 = 5;
/// What a displacement that is itself fitted costs, nats: two parameters that may be anywhere on the skin.
const FREE_DISPLACEMENT: f64 = 4.0;
/// Most that the sync presses say against a reading, nats per camera: they are one place, and may be badly seen.
const MOST_SYNC: f64 = 8.0;
/// A line of the path ends where the direction turns by more than 45 degrees.
const SAME_DIRECTION: f64 = 0.7;

/// One way to read the session.
#[derive(Debug, Clone, PartialEq)]
pub struct Reading {
    /// The fault of a session that has to be read like this; `None`: as it is.
    pub fault: Option<Fault>,
    /// In words.
    pub words: String,
    /// The drawn camera of each stream.
    pub cameras: [usize; 2],
    /// Streams whose columns count from the other side.
    pub mirrored: [bool; 2],
    /// Where each press of the path was; `None`: nothing is said of it.
    pub at: Vec<Option<Point2>>,
    /// Added to the cost, nats.
    penalty: f64,
}

/// What a reading makes of the session.
#[derive(Debug, Clone)]
pub struct Judged<'a> {
    pub reading: &'a Reading,
    /// The cameras that explain the streams best.
    pub fits: [Option<Resection>; 2],
    /// Robust standard deviation of the viewing angles of the presses about their median: of an answer that knows nothing.
    pub ignorance_deg: [f64; 2],
    /// Negative log likelihood, nats.
    pub cost: f64,
}

impl Judged<'_> {
    /// The streams follow the presses: within this share of what knowing nothing leaves.
    pub fn follows(&self, share: f64) -> bool {
        let each = self.fits.iter().zip(self.ignorance_deg);
        each.clone().any(|(fit, _)| fit.is_some())
            && each
                .filter_map(|(fit, ignorance)| Some((fit.as_ref()?, ignorance)))
                .all(|(fit, ignorance)| fit.spread_deg < share * ignorance)
    }
}

/// The presses of the path that readings are about, in order, and the sync presses.
pub struct Path<'a> {
    pub rig: &'a RigGeometry,
    /// All presses of the path with a column in at least one camera.
    pub touches: Vec<&'a Touch<'a>>,
    /// Different places among them.
    pub places: usize,
    /// For each stream the sync presses' usual column and where they are said to be, when that comes from elsewhere than the
    /// positions of the path.
    sync: [Option<(f64, Point2)>; 2],
    stride: usize,
}

impl<'a> Path<'a> {
    pub fn new(rig: &'a RigGeometry, touches: &'a [Touch<'a>]) -> Self {
        let seen = |t: &&Touch<'_>| t.sights.iter().any(|s| s.column.is_some());
        let path: Vec<&Touch<'_>> = touches
            .iter()
            .filter(|t| t.role != PressRole::Sync)
            .collect();
        let places: BTreeSet<(u64, u64)> = path
            .iter()
            .copied()
            .filter(|t| seen(t))
            .map(|t| (t.planned.x_mm.to_bits(), t.planned.y_mm.to_bits()))
            .collect();
        // Positions of a recording that was imported come from a table, those of its sync presses from the schedule.
        let sync = CameraId::ALL.map(|camera| {
            let own = || {
                touches
                    .iter()
                    .filter(|t| t.role == PressRole::Sync && t.outcome.scheduled)
            };
            let columns = own().filter_map(|t| t.sights[camera.index()].column);
            Some((median(columns.collect())?, own().next()?.at()))
        });
        let stride = path.len().div_ceil(MOST_PRESSES).max(1);
        Self {
            rig,
            touches: path,
            places: places.len(),
            sync,
            stride,
        }
    }

    fn positions(&self) -> Vec<Option<Point2>> {
        self.touches.iter().map(|t| Some(t.at())).collect()
    }

    /// The session as it is.
    pub(crate) fn as_it_is(&self) -> Reading {
        Reading {
            fault: None,
            words: "as it is".to_owned(),
            cameras: [0, 1],
            mirrored: [false; 2],
            at: self.positions(),
            penalty: 0.0,
        }
    }

    /// Every other reading that has a name.
    pub fn alternatives(&self) -> Vec<Reading> {
        let base = self.as_it_is();
        let mut all = Vec::new();
        for (cameras, fault, words) in [
            ([1, 0], Fault::CamerasSwapped, "cameras exchanged"),
            ([0, 0], Fault::OneCameraTwice, "both streams of camera 1"),
            ([1, 1], Fault::OneCameraTwice, "both streams of camera 2"),
        ] {
            all.push(Reading {
                fault: Some(fault),
                words: words.to_owned(),
                cameras,
                ..base.clone()
            });
        }
        for (mirrored, words) in [
            ([true, false], "the picture of camera 1 mirrored"),
            ([false, true], "the picture of camera 2 mirrored"),
            ([true, true], "the pictures of both cameras mirrored"),
        ] {
            all.push(Reading {
                fault: Some(Fault::PictureTurned),
                words: words.to_owned(),
                mirrored,
                ..base.clone()
            });
        }
        for frame in Frame::all(&self.rig.outline) {
            all.push(self.in_frame(&frame));
        }
        // On one straight line a shift of the list moves all places alike, as cameras that stand elsewhere do.
        let bends = self
            .repetitions()
            .into_iter()
            .any(|r| self.lines(r).len() > 1);
        for by in (1..=MOST_SHIFT).flat_map(|k| [k, -k]).filter(|_| bends) {
            let at = (0..self.touches.len()).map(|i| self.shifted(i, by));
            all.push(Reading {
                fault: Some(Fault::IndexShifted),
                words: format!("the press list shifted by {by:+}"),
                at: at.collect(),
                ..base.clone()
            });
        }
        all.extend(self.reordered(&base));
        all
    }

    /// The positions of a table that is in `frame`.
    pub(crate) fn in_frame(&self, frame: &Frame) -> Reading {
        let base = self.as_it_is();
        Reading {
            fault: Some(frame.fault),
            words: format!("the positions with {}", frame.words),
            at: base.at.iter().map(|p| p.map(|p| frame.skin(p))).collect(),
            ..base
        }
    }

    /// The positions displaced by what both cameras seem to be displaced by the other way.
    pub fn displaced(&self, as_is: &Judged<'_>) -> Option<Reading> {
        let [Some(one), Some(two)] = as_is.fits else {
            return None;
        };
        let by = [0, 1].map(|k| -0.5 * (one.off[k] + two.off[k]));
        let words = format!("({:+.0}, {:+.0}) mm added", by[0], by[1]);
        Some(Reading {
            penalty: FREE_DISPLACEMENT,
            ..self.in_frame(&Frame::displaced(by, words))
        })
    }

    /// The planned positions, where the measured ones are others.
    pub(crate) fn as_planned(&self) -> Reading {
        Reading {
            fault: Some(Fault::RobotOff),
            words: "the planned positions in place of the measured ones".to_owned(),
            at: self.touches.iter().map(|t| Some(t.planned)).collect(),
            ..self.as_it_is()
        }
    }

    /// Where the press `by` rows after press `i` was, in the same repetition or another.
    pub fn shifted(&self, i: usize, by: i32) -> Option<Point2> {
        let there = usize::try_from(i as i64 + i64::from(by)).ok()?;
        Some(self.touches.get(there)?.at())
    }

    /// The list from its end to its beginning, and every second line of the path the other way round: what a raster and a
    /// meander make of each other.
    fn reordered(&self, base: &Reading) -> Vec<Reading> {
        let n = self.touches.len();
        let reading = |words: &str, at: Vec<Option<Point2>>| Reading {
            fault: Some(Fault::OrderOfPresses),
            words: words.to_owned(),
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
            all.push(reading("the press list from its end", reversed));
            let words = "every second line of the press list the other way round";
            all.push(reading(words, odd));
            all.push(reading(words, even));
        }
        all
    }

    /// Consecutive presses of each repetition.
    fn repetitions(&self) -> Vec<std::ops::Range<usize>> {
        let mut from = 0;
        let mut all = Vec::new();
        for i in 1..=self.touches.len() {
            let ends = self
                .touches
                .get(i)
                .is_none_or(|t| t.repetition != self.touches[from].repetition);
            if ends {
                all.push(from..i);
                from = i;
            }
        }
        all
    }

    /// The straight lines of the path within `range`.
    fn lines(&self, range: std::ops::Range<usize>) -> Vec<std::ops::Range<usize>> {
        let step = |i: usize| {
            let (a, b) = (self.touches[i - 1].at(), self.touches[i].at());
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

    /// What `reading` makes of the session.
    pub fn judge<'r>(&self, reading: &'r Reading) -> Judged<'r> {
        let mut judged = Judged {
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
            let angles: Vec<f64> = pairs
                .iter()
                .map(|p| drawn.angle_of_point_deg(p.1))
                .collect();
            let middle = median(angles.clone()).unwrap_or(0.0);
            let scatter = median(angles.iter().map(|a| (a - middle).abs()).collect());
            judged.ignorance_deg[k] = 1.4826 * scatter.unwrap_or(0.0);
            judged.cost += fit.cost;
            if let Some((column, at)) = self.sync[k] {
                let column = mirrored(column, reading.mirrored[k]);
                let off = residual_deg(&fit.camera, column, at) / fit.spread_deg;
                judged.cost += (0.5 * off * off).min(MOST_SYNC);
            }
            judged.fits[k] = Some(fit);
        }
        judged
    }

    /// What stream `k` saw and where the press was by `reading`.
    fn pairs(&self, reading: &Reading, k: usize) -> Vec<(f64, Point2)> {
        let seen = self.touches.iter().zip(&reading.at).step_by(self.stride);
        seen.filter_map(|(touch, at)| {
            let column = mirrored(touch.sights[k].column?, reading.mirrored[k]);
            Some((column, (*at)?))
        })
        .collect()
    }
}

fn mirrored(column: f64, yes: bool) -> f64 {
    if yes {
        f64::from(SENSOR_WIDTH) - column
    } else {
        column
    }
}

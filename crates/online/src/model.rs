//! Model that the detector learns from calibration presses: the idle rate of every region, how a touch begins at each place, and
//! how a release fades.

use serde::{Deserialize, Serialize};

use crate::regions::REGIONS;

/// Length of the bins in which a fading release is described, slots: 50 ms.
pub(crate) const TAIL_BIN: u32 = 100;
/// Number of those bins: 3 s.
pub(crate) const TAIL_BINS: usize = 60;
/// Event rates at which touches are looked for, each twice the one before.
pub(crate) const LEVELS: usize = 7;

/// Start of a touch at a place: share of its events in each region.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Pattern {
    /// Mean measured position of its calibration presses, mm.
    pub at: [f64; 2],
    /// (camera, region, share of the events), by camera and region. The shares add up to at most 1.
    pub shares: Vec<(usize, usize, f64)>,
}

/// Everything learnt.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TouchModel {
    /// Events per slot of each camera's regions on an idle skin; above 0.
    pub(crate) idle: [Vec<f64>; 2],
    /// One per place.
    pub(crate) patterns: Vec<Pattern>,
    /// OFF and ON events per slot in a region after a release, for each event of the press in that block of pixels.
    pub(crate) tail: Vec<[f64; 2]>,
    /// Longest calibration press, slots.
    pub(crate) longest_press: i64,
    /// Lowest event rate at which touches are looked for, octaves of one event per slot.
    pub(crate) lowest_octave: i32,
}

impl TouchModel {
    /// The same for a stream that holds this share (above 0, at most 1) of the events.
    #[must_use]
    pub fn thinned(&self, share: f64) -> Self {
        let octaves = libm::round(libm::log2(share)) as i32;
        Self {
            idle: [0, 1].map(|k| self.idle[k].iter().map(|rate| rate * share).collect()),
            lowest_octave: self.lowest_octave + octaves,
            ..self.clone()
        }
    }

    /// Number of places at which a touch is known.
    #[must_use]
    pub fn places(&self) -> usize {
        self.patterns.len()
    }

    /// Events per second of both cameras on an idle skin.
    #[must_use]
    pub fn idle_per_s(&self) -> f64 {
        let per_slot: f64 = self.idle.iter().flatten().sum();
        per_slot * 1e6 / crate::clock::SLOT_US as f64
    }

    pub(crate) fn idle_of_regions(&self, camera: usize) -> &[f64] {
        debug_assert_eq!(self.idle[camera].len(), REGIONS);
        &self.idle[camera]
    }
}

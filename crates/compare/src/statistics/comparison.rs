//! Owns the answer: values, difference, tests, verdict, and what would decide.

use serde::{Deserialize, Serialize};

use super::question::{Better, Pairing};
use super::{Kind, Side};

/// A number with its interval (1 - alpha).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    /// The number.
    pub value: f64,
    /// Lower end; `None` when there is none (misses reach into it).
    pub low: Option<f64>,
    /// Upper end; `None` when there is none.
    pub high: Option<f64>,
}

/// What the data say.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The two differ by less than the margin, whether or not they differ at all.
    Equivalent,
    /// B is better than A.
    Better,
    /// B is worse than A.
    Worse,
    /// None of these can be claimed.
    Undecided,
}

/// Two one-sided tests of equivalence (Schuirmann 1987).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Tost {
    /// Differences up to this are equivalent.
    pub margin: f64,
    /// The difference with an interval of 1 - 2 alpha: equivalent when it lies between -margin and +margin.
    pub interval: Interval,
    /// The larger of the two one-sided p values.
    pub p: f64,
}

/// Which data a comparison stands on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Design {
    /// Shared or independent locations.
    pub pairing: Pairing,
    /// Locations of A and of B that are compared.
    pub locations: [u32; 2],
    /// Presses (trials, exposures) of A and of B there.
    pub presses: [u32; 2],
    /// Locations of A and of B that the other has no value at: not compared.
    pub left_out: [u32; 2],
}

/// Where the variance of a difference comes from, in squared units of the metric. With `k` locations pressed `r` times
/// each by both, the difference has variance `between / k + (within[0] + within[1]) / (k r)`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Components {
    /// Of the difference between locations, beyond what repetitions explain; with all of it where nothing was repeated.
    pub between: f64,
    /// Of A and of B between repetitions at one location; `None` when one of them was nowhere pressed twice.
    pub within: Option<[f64; 2]>,
    /// Repetitions per location on average (harmonic mean) of A and of B.
    pub repetitions: [f64; 2],
}

/// How many presses would decide, if the difference is what it seems.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "status", rename_all = "snake_case")]
pub enum Needed {
    /// It is decided.
    Nothing,
    /// This would, with the power of the settings.
    More(Enough),
    /// The difference is so close to the border that no sensible number of presses decides.
    OutOfReach,
}

/// What would be enough, each in total and for each of the two.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Enough {
    /// What it would be enough for.
    pub towards: Verdict,
    /// Locations, with as many repetitions as now.
    pub locations: u32,
    /// Repetitions at the locations of now; `None` when repetitions alone cannot decide.
    pub repetitions: Option<u32>,
    /// Presses more than now with further locations.
    pub more_presses_by_locations: u32,
    /// Presses more than now with further repetitions.
    pub more_presses_by_repetitions: Option<u32>,
}

/// Something that a reader must know.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "note", rename_all = "snake_case")]
pub enum Note {
    /// So few locations that the interval leans on a normal distribution.
    FewLocations {
        /// How many.
        locations: u32,
    },
    /// Standard deviations of few repetitions are too small on average; the two have different numbers.
    UnequalRepetitions,
    /// Trials were missed; they count as later than every time.
    Missed {
        /// Whose.
        side: Side,
        /// How many.
        missed: u32,
        /// Of how many.
        trials: u32,
    },
    /// A share of 0 or 1, or a count of 0: its interval counts each location (or the whole exposure) once.
    AtTheBorder {
        /// Whose.
        side: Side,
    },
}

/// Two samples compared. Differences are B - A.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Comparison {
    /// Of what.
    pub kind: Kind,
    /// A, over the locations compared.
    pub a: Interval,
    /// B, over the locations compared.
    pub b: Interval,
    /// B - A.
    pub difference: Interval,
    /// Two-sided p value of no difference.
    pub p_difference: f64,
    /// The test of equivalence, when there is a margin.
    pub tost: Option<Tost>,
    /// The verdict on B.
    pub verdict: Verdict,
    /// True when the whole interval of the difference lies beyond the margin.
    pub beyond_margin: bool,
    /// What it stands on.
    pub design: Design,
    /// Where the variance comes from.
    pub components: Components,
    /// What would decide.
    pub needed: Needed,
    /// What to keep in mind.
    pub notes: Vec<Note>,
}

/// Better or worse by the values alone.
pub(super) fn direction(a: f64, b: f64, better: Better) -> Verdict {
    let gain = match better {
        Better::Lower => a - b,
        Better::Higher => b - a,
        Better::NearerZero => a.abs() - b.abs(),
    };
    if gain > 0.0 {
        Verdict::Better
    } else {
        Verdict::Worse
    }
}

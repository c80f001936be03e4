//! Owns the result of comparing two samples: values, difference, tests, verdict and required presses.

use serde::{Deserialize, Serialize};

use super::question::{ImprovementDirection, Pairing};
use super::sessions::SessionSpread;
use super::{Kind, Side};

/// A value with its 1 - alpha interval.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    /// Point estimate.
    pub value: f64,
    /// Lower end; `None` when open, for instance because misses reach into it.
    pub low: Option<f64>,
    /// Upper end; `None` when open.
    pub high: Option<f64>,
}

/// Conclusion of a comparison.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The skins differ by less than the margin; they may still differ significantly.
    Equivalent,
    /// B is better than A.
    Better,
    /// B is worse than A.
    Worse,
    /// None of these is supported.
    Undecided,
}

/// Two one-sided tests of equivalence (Schuirmann 1987).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Tost {
    /// Differences up to this size are equivalent.
    pub margin: f64,
    /// Difference with its 1 - 2 alpha interval: equivalent if it lies within ± margin.
    pub interval: Interval,
    /// The larger of the two one-sided p values.
    pub p: f64,
}

/// Data that a comparison uses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Design {
    /// Shared or independent locations.
    pub pairing: Pairing,
    /// Compared locations of A and B.
    pub locations: [u32; 2],
    /// Presses (trials, exposures) of A and B at these locations.
    pub presses: [u32; 2],
    /// Locations of A and B without a value in the other skin, not compared.
    pub left_out: [u32; 2],
}

/// Variance components of a difference, in squared units of the metric. With `k` locations pressed `r` times each by both,
/// the difference has variance `between / k + (within[0] + within[1]) / (k r)`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Components {
    /// Between locations, beyond what repetitions explain; includes everything when nothing was repeated.
    pub between: f64,
    /// Between repetitions at one location, of A and B; `None` without repetitions in one of them.
    pub within: Option<[f64; 2]>,
    /// Harmonic mean of repetitions per location, of A and B.
    pub repetitions: [f64; 2],
    /// Between sessions; `None` with one of each, whose mounting, light and calibration count as the skin's.
    pub sessions: Option<SessionSpread>,
}

/// Presses required for a decision, if the measured difference is the true one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "status", rename_all = "snake_case")]
pub enum PressesNeeded {
    /// The comparison is decided.
    Nothing,
    /// This design would decide with the power of the settings.
    More(RequiredDesign),
    /// Presses alone would not decide: so many sessions of each skin would, with the present presses in each.
    Sessions {
        /// Verdict that they would reach.
        towards: Verdict,
        /// Sessions of each skin.
        each: u32,
    },
    /// The difference is too close to the border for any practical number of presses.
    OutOfReach,
    /// The values do not vary, as when every press was located, so the required number of presses
    /// is unknown.
    Unknown,
}

/// A design that would decide. Counts are per skin.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct RequiredDesign {
    /// Verdict that it would reach.
    pub towards: Verdict,
    /// Total locations, with the present number of repetitions.
    pub locations: u32,
    /// Total repetitions at the present locations; `None` if repetitions alone cannot decide.
    pub repetitions: Option<u32>,
    /// Additional presses when adding locations.
    pub more_presses_by_locations: u32,
    /// Additional presses when adding repetitions.
    pub more_presses_by_repetitions: Option<u32>,
}

/// A caveat for the reader.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "note", rename_all = "snake_case")]
pub enum Note {
    /// Too few locations for the bootstrap: the interval assumes a normal distribution.
    FewLocations {
        /// Number of locations.
        locations: u32,
    },
    /// The skins have different numbers of repetitions, and the std of few repetitions is biased low.
    UnequalRepetitions,
    /// Some trials were missed; they count as later than every time.
    Missed {
        /// Side with misses.
        side: Side,
        /// Missed trials.
        missed: u32,
        /// All trials.
        trials: u32,
    },
    /// A share of 0 or 1, or a count of 0: the interval counts each location (or the whole exposure) once.
    AtTheBorder {
        /// Side at the border.
        side: Side,
    },
}

/// Result of comparing two samples. Differences are B - A.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Comparison {
    /// Kind of both samples.
    pub kind: Kind,
    /// Value of A over the compared locations.
    pub a: Interval,
    /// Value of B over the compared locations.
    pub b: Interval,
    /// B - A.
    pub difference: Interval,
    /// Two-sided p value of no difference.
    pub p_difference: f64,
    /// Equivalence test; `None` without a margin.
    pub tost: Option<Tost>,
    /// Verdict on B.
    pub verdict: Verdict,
    /// True if the whole interval of the difference lies beyond the margin.
    pub beyond_margin: bool,
    /// Data behind the comparison.
    pub design: Design,
    /// Variance components of the difference.
    pub components: Components,
    /// Presses required for a decision.
    pub needed: PressesNeeded,
    /// Caveats.
    pub notes: Vec<Note>,
}

/// [`Verdict::Better`] or [`Verdict::Worse`] by the values alone.
pub(super) fn direction(a: f64, b: f64, better: ImprovementDirection) -> Verdict {
    let gain = match better {
        ImprovementDirection::Lower => a - b,
        ImprovementDirection::Higher => b - a,
        ImprovementDirection::NearerZero => a.abs() - b.abs(),
    };
    if gain > 0.0 {
        Verdict::Better
    } else {
        Verdict::Worse
    }
}

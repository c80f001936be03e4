//! Owns the results of the data-reduction study.

use serde::{Deserialize, Serialize};

use super::Estimate;

/// Localisation on thinned events.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Reduction {
    /// DBSCAN radius used at all factors, px.
    pub eps_px: f64,
    /// DBSCAN core threshold used at all factors.
    pub min_samples: u32,
    /// Seeds per factor and kind.
    pub seeds: u32,
    /// Presses in the study.
    pub presses: u32,
    /// Error below which a press passes: the 95th percentile at factor 1, mm; `None` when nothing is located there.
    pub pass_threshold_mm: Option<f64>,
    /// Largest error of a press that is "within", mm.
    pub within_mm: f64,
    /// One curve per kind of thinning.
    pub curves: Vec<ReductionCurve>,
}

/// How events are thinned.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Thinning {
    /// Exactly max(1, n / k) of the n events of a press in a camera, without replacement (public code).
    Exact,
    /// Each event with probability 1 / k (paper); a press can be left with none.
    Bernoulli,
}

/// The study with one kind of thinning.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ReductionCurve {
    /// Kind of thinning.
    pub thinning: Thinning,
    /// One row per factor, ascending.
    pub rows: Vec<ReductionRow>,
}

/// Results at one factor, over all presses and seeds. Intervals are over locations, so they include the spread between
/// presses; see [`Estimate`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ReductionRow {
    /// k.
    pub factor: u32,
    /// Mean number of remaining events per press and camera.
    pub events_per_view: f64,
    /// RMSE over the located presses of all seeds, mm; n: presses located by at least one seed.
    pub rmse_mm: Estimate,
    /// Lowest and highest RMSE of a single seed, mm.
    pub rmse_of_seeds_mm: Option<(f64, f64)>,
    /// Share of all presses with an error below the pass threshold; presses that are not located fail.
    pub pass_rate: Estimate,
    /// Share of all presses within `within_mm`.
    pub within_rate: Estimate,
    /// Share of located presses: with an estimate that no location rule of the settings excludes.
    pub located_rate: Estimate,
    /// Bytes per second of both cameras during a press, at the stated bits per event.
    pub press_bytes_per_s: Estimate,
    /// Same while idle, over the presses with idle time before them; no value if there are none.
    pub idle_bytes_per_s: Estimate,
}

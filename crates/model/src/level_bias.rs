//! How far each simulation level is from the optical one, as measured, and the tolerances that a scene sets on that.

use serde::{Deserialize, Serialize};

use crate::frame::Point2;
use crate::scene::{SceneNeed, SimLevel};
use crate::settings::AnalysisSettings;

/// A figure of a session that a scene can set a tolerance on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SceneFigure {
    /// RMSE of the scored presses, mm.
    LocalisationRmse,
    /// Median delay from contact to detection, ms.
    Latency,
    /// Events per second in the press windows, percent of those of the optical level.
    EventRate,
    /// Events per second between presses, percent of those of the optical level.
    IdleRate,
}

impl SceneFigure {
    /// All figures.
    pub const ALL: [Self; 4] = [
        Self::LocalisationRmse,
        Self::Latency,
        Self::EventRate,
        Self::IdleRate,
    ];

    /// The name used in protocols.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::LocalisationRmse => "localisation_rmse",
            Self::Latency => "latency",
            Self::EventRate => "event_rate",
            Self::IdleRate => "idle_rate",
        }
    }

    /// The name in reports.
    #[must_use]
    pub const fn label(self) -> &'static str {
        match self {
            Self::LocalisationRmse => "RMSE",
            Self::Latency => "median latency",
            Self::EventRate => "event rate of presses",
            Self::IdleRate => "event rate between presses",
        }
    }

    /// Its unit in protocols.
    #[must_use]
    pub const fn unit(self) -> &'static str {
        match self {
            Self::LocalisationRmse => "mm",
            Self::Latency => "ms",
            Self::EventRate | Self::IdleRate => "%",
        }
    }
}

/// Difference of a level from the optical one, in the figure's unit: the mean over simulated skins and paths, and the interval that holds
/// the difference of another session with 95 % probability.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LevelBias {
    /// Mean difference.
    pub mean: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl LevelBias {
    const fn new(mean: f64, low: f64, high: f64) -> Self {
        Self { mean, low, high }
    }

    /// Whether the whole interval lies within `tolerance` of zero.
    #[must_use]
    pub const fn is_within(self, tolerance: f64) -> bool {
        self.low >= -tolerance && self.high <= tolerance
    }
}

/// The geometric level against the optical one, by [`SceneFigure::ALL`]: 40 simulated skins, each on a square of its own of 25 locations
/// 10 to 14 mm apart, three times, 2 mm deep, both levels with the same seeds. How far the levels differ depends on where the path lies.
///
/// `cargo test --release -p skinrig-tests --test system level_bias -- --ignored --nocapture`
const GEOMETRIC: [LevelBias; 4] = [
    LevelBias::new(-0.20, -1.59, 1.20),
    LevelBias::new(-36.82, -51.37, -22.26),
    LevelBias::new(-14.95, -70.30, 40.41),
    LevelBias::new(-66.15, -68.01, -64.29),
];

/// Where the differences between levels are measured: `motion` by default, depth 2 mm, the published skin and cameras. A shallow press
/// is visible to the geometric level long before the optical one sees it, so that they hold for nothing else.
pub const CONDITIONS: &str = "2 mm deep, indented at 20 mm/s, held 150 ms, over 40 mm or more of the published skin, analysed as by default";

/// Least extent of a measured path along x and y, mm.
const MIN_EXTENT_MM: f64 = 40.0;

/// Whether a path extends as far as the measured ones.
#[must_use]
pub fn is_measured_over(locations: &[Point2]) -> bool {
    let extent = |of: fn(&Point2) -> f64| {
        let ends = locations
            .iter()
            .map(of)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), at| {
                (low.min(at), high.max(at))
            });
        ends.1 - ends.0
    };
    extent(|p| p.x_mm) >= MIN_EXTENT_MM && extent(|p| p.y_mm) >= MIN_EXTENT_MM
}

/// Whether presses are made under [`CONDITIONS`], within a tenth of each: depths in mm, speed in mm/s, hold in ms.
#[must_use]
pub fn is_measured_for(depths_mm: &[f64], indent_mm_s: f64, hold_ms: f64) -> bool {
    let near = |found: f64, measured: f64| (found - measured).abs() <= 0.1 * measured;
    depths_mm.iter().all(|depth| near(*depth, 2.0))
        && near(indent_mm_s, 20.0)
        && near(hold_ms, 150.0)
}

/// Core thresholds of the measured analyses and of the default one, events.
const MIN_SAMPLES: std::ops::RangeInclusive<u32> = 10..=20;

/// Whether a session is analysed as the measured ones: by default, except for settings that change neither positions nor rates nor
/// latency.
#[must_use]
pub fn is_measured_with(analysis: &AnalysisSettings) -> bool {
    let as_measured = AnalysisSettings {
        min_samples: analysis.min_samples,
        failure_penalty_mm: analysis.failure_penalty_mm,
        within_mm: analysis.within_mm,
        bits_per_event: analysis.bits_per_event,
        study_presses: analysis.study_presses,
        reduction: analysis.reduction,
        cmre: analysis.cmre,
        bootstrap_resamples: analysis.bootstrap_resamples,
        seed: analysis.seed,
        rate_bin_ms: analysis.rate_bin_ms,
        ..AnalysisSettings::default()
    };
    MIN_SAMPLES.contains(&analysis.min_samples) && *analysis == as_measured
}

/// How far `level` is from the optical one in `figure`; `None` if it does not model what the figure needs.
#[must_use]
pub const fn level_bias(level: SimLevel, figure: SceneFigure) -> Option<LevelBias> {
    match level {
        SimLevel::Kinematic => None,
        SimLevel::Geometric => Some(GEOMETRIC[figure as usize]),
        SimLevel::Optical => Some(LevelBias::new(0.0, 0.0, 0.0)),
    }
}

/// A tolerance: the level may be at most so far from the optical one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Tolerance {
    /// The figure.
    pub figure: SceneFigure,
    /// In its unit.
    pub most: f64,
}

impl Tolerance {
    /// Whether `level` is certainly within it.
    #[must_use]
    pub const fn allows(self, level: SimLevel) -> bool {
        match level_bias(level, self.figure) {
            Some(bias) => bias.is_within(self.most),
            None => false,
        }
    }
}

/// The cheapest level that satisfies every need and tolerance; [`SimLevel::Kinematic`] without any.
#[must_use]
pub fn cheapest_level(needs: &[SceneNeed], tolerances: &[Tolerance]) -> SimLevel {
    let is_enough = |level: &SimLevel| {
        needs.iter().all(|n| n.level() <= *level) && tolerances.iter().all(|t| t.allows(*level))
    };
    SimLevel::ALL
        .into_iter()
        .find(is_enough)
        .unwrap_or(SimLevel::Optical)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_optical_level_meets_every_tolerance_and_the_kinematic_one_none() {
        for figure in SceneFigure::ALL {
            let tolerance = Tolerance { figure, most: 0.0 };
            assert!(tolerance.allows(SimLevel::Optical));
            let tolerance = Tolerance { figure, most: 1e9 };
            assert!(!tolerance.allows(SimLevel::Kinematic));
            assert!(tolerance.allows(SimLevel::Geometric));
        }
    }

    #[test]
    fn the_whole_interval_has_to_lie_within_the_tolerance() {
        let bias = LevelBias::new(-1.0, -1.5, -0.5);
        assert!(bias.is_within(1.5) && !bias.is_within(1.4));
        let bias = LevelBias::new(1.0, 0.5, 1.5);
        assert!(bias.is_within(1.5) && !bias.is_within(1.4));
    }

    #[test]
    fn measured_intervals_contain_their_means() {
        for bias in GEOMETRIC {
            assert!(bias.low <= bias.mean && bias.mean <= bias.high);
        }
    }
}

//! Alpha spending: the level of each look of a sequential comparison, and how many repetitions are still to be expected.
//!
//! The levels of all looks add up to at most alpha. By the union bound the intervals of all looks then hold together with
//! probability 1 - alpha, whatever the dependence between looks and whenever somebody stops: a confidence sequence.

use serde::{Deserialize, Serialize};

use super::comparison::{Comparison, Verdict};
use super::question::Settings;
use crate::distributions::student_quantile;

/// Most looks. Further ones would need millions of draws each.
pub const MOST_LOOKS: u32 = 100;
/// Draws that lie outside an interval on each side, at least.
const DRAWS_OUTSIDE: f64 = 4.0;

/// How alpha is spent over the looks of a sequential comparison.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct AlphaSpending {
    /// Number of looks, declared before the first: equal shares. `None`: look k spends alpha / (k (k + 1)), without end.
    pub planned_looks: Option<u32>,
}

/// What to expect of further repetitions, if the measured difference is the true one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "status", rename_all = "snake_case")]
pub enum Outlook {
    /// A look decided.
    Decided,
    /// So many more repetitions of both would decide with the power of the settings.
    More {
        /// Repetitions beyond the last look.
        repetitions: u32,
    },
    /// Repetitions at these locations would not decide: the difference varies between locations, or the planned looks end
    /// before.
    NotByRepetitions,
    /// All planned looks were taken.
    Spent,
    /// A single repetition does not tell how much repetitions scatter.
    Unknown,
}

impl AlphaSpending {
    /// Level of a look, counted from 1; 0 beyond the last.
    #[must_use]
    pub fn at(&self, alpha: f64, look: u32) -> f64 {
        if look == 0 || look > self.most() {
            return 0.0;
        }
        let k = f64::from(look);
        match self.planned_looks {
            Some(looks) => alpha / f64::from(looks),
            None => alpha / (k * (k + 1.0)),
        }
    }

    /// Number of the last look.
    #[must_use]
    pub fn most(&self) -> u32 {
        self.planned_looks.unwrap_or(MOST_LOOKS)
    }

    /// Settings of the comparison at a look; `None` beyond the last.
    #[must_use]
    pub fn settings(&self, settings: &Settings, look: u32) -> Option<Settings> {
        let alpha = self.at(settings.alpha, look);
        (alpha > 0.0).then(|| Settings {
            alpha,
            resamples: settings
                .resamples
                .max((2.0 * DRAWS_OUTSIDE / alpha).ceil() as u32),
            ..*settings
        })
    }

    /// Outlook after look number `look`, which gave `last`. `settings` are those of the whole comparison.
    #[must_use]
    pub fn outlook(&self, last: &Comparison, look: u32, settings: &Settings) -> Outlook {
        if last.verdict != Verdict::Undecided {
            return Outlook::Decided;
        }
        let most = self.most();
        if look >= most {
            return Outlook::Spent;
        }
        let Some(within) = last.components.within else {
            return Outlook::Unknown;
        };
        let locations = f64::from(last.design.locations[0].min(last.design.locations[1]));
        // Presses at a location per repetition: several depths are pressed in each.
        let each = last.components.repetitions.map(|r| r / f64::from(look));
        let apart = last.difference.value.abs();
        // Repetitions leave what varies between sessions.
        let sessions = |p: &dyn Fn(f64) -> f64| {
            let spread = last.components.sessions;
            spread.map_or(0.0, |s| p(s.df) * s.error())
        };
        let room = last.tost.map_or(0.0, |t| t.margin - apart);
        let decides = |future: u32| {
            let alpha = self.at(settings.alpha, future);
            let noise = within[0] / each[0] + within[1] / each[1];
            let error = ((last.components.between + noise / f64::from(future)) / locations).sqrt();
            let reach = |level: f64, power: f64| {
                let t = |df: f64| student_quantile(level, df) + student_quantile(power, df);
                libm::hypot(t(locations - 1.0) * error, sessions(&t))
            };
            apart >= reach(1.0 - 0.5 * alpha, settings.power)
                || room >= reach(1.0 - alpha, 0.5 * (1.0 + settings.power))
        };
        let found = (look + 1..=most).find(|future| decides(*future));
        found.map_or(Outlook::NotByRepetitions, |future| Outlook::More {
            repetitions: future - look,
        })
    }
}

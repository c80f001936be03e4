//! Selection of a choice, confirmed on presses that did not select it.
//!
//! The best of many choices looks too good on the presses that chose it. Therefore a third of the locations ranks the choices,
//! and the others confirm. For a target the session's own settings and the front go through a sequence of tests that the ranking
//! locations fix, from the most accurate to the cheapest, each at the full level, up to the first that fails: a choice beyond the
//! target passes in at most 2.5 % of the sessions, however many were tried (Maurer, Hothorn and Lehmacher 1995).

use std::collections::BTreeSet;

use skinrig_statistics::seeded;

use super::front::pareto;
use super::rows::{Cost, Row, Tradeoff};
use crate::metrics::rms_over_locations;
use crate::result::Estimate;
use crate::sums;

/// One location in so many ranks the choices.
const RANKING: usize = 3;
/// Fewer locations select nothing.
const LEAST_LOCATIONS: usize = 9;
/// Stream of the seed that draws the locations that rank.
const STREAM: u64 = 0x7769_6e6e;

/// Errors of the counting presses under one choice: (location, length in mm).
pub(super) type PressErrors = Vec<(u32, f64)>;

/// Condition that selects a choice.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Requirement {
    /// The cheapest choice whose RMSE, at the upper end of its interval, is at most this many mm.
    Target(f64, Cost),
    /// The most accurate choice that costs at most this.
    Budget(f64, Cost),
}

/// A measured tradeoff with the errors of its presses.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// The tradeoff.
    pub tradeoff: Tradeoff,
    /// Errors of each row.
    pub(super) errors: Vec<PressErrors>,
}

/// The selected choice.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Selection<'a> {
    /// Its row.
    pub row: &'a Row,
    /// Index of the row.
    pub index: usize,
    /// RMSE on the presses that did not rank the choices.
    pub confirmed_mm: Estimate,
    /// Locations that ranked the choices.
    pub ranked_by: usize,
}

/// Why no choice is selected.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum Unselected {
    /// Too few locations for ranking and confirming.
    #[error("expected at least {LEAST_LOCATIONS} locations with scored presses, found {0}")]
    Locations(usize),
    /// None of the choices costs so little and locates enough presses.
    #[error("no choice within the budget locates enough presses")]
    Budget,
    /// Even the most accurate choice is not below the target; its RMSE on the presses that did not rank.
    #[error("the most accurate choice does not meet the target on the presses that confirm")]
    Target(Estimate),
}

impl Measured {
    /// Selects a choice.
    ///
    /// # Errors
    /// [`Unselected`].
    pub fn select(&self, requirement: Requirement) -> Result<Selection<'_>, Unselected> {
        let ranking = self.ranking_locations()?;
        let (cost, most) = match requirement {
            Requirement::Target(_, cost) => (cost, f64::INFINITY),
            Requirement::Budget(most, cost) => (cost, most),
        };
        let sequence = match requirement {
            Requirement::Target(mm, _) => self.tests(mm, cost, &ranking),
            Requirement::Budget(..) => self.front(cost, most, &ranking),
        };
        let mut passed = Err(Unselected::Budget);
        for row in sequence {
            let confirmed_mm = self.confirm(row, &ranking);
            let selection = Ok(Selection {
                row: &self.tradeoff.rows[row],
                index: row,
                confirmed_mm,
                ranked_by: ranking.len(),
            });
            let Requirement::Target(mm, _) = requirement else {
                return selection;
            };
            if confirmed_mm.high.is_none_or(|high| high > mm) {
                return passed.map_err(|_| Unselected::Target(confirmed_mm));
            }
            passed = selection;
        }
        passed
    }

    /// Rows to test against a target, in order. If the ranking locations meet it with the session's own settings, those come first: of
    /// the many others, the one that ranks best may have ranked so by luck, and would end the search. Only cheaper rows follow.
    fn tests(&self, mm: f64, cost: Cost, ranking: &BTreeSet<u32>) -> Vec<usize> {
        let front = self.front(cost, f64::INFINITY, ranking);
        let rows = &self.tradeoff.rows;
        let own = (rows.first().zip(self.errors.first())).filter(|(own, errors)| {
            own.competes && ranked_mm(errors, ranking).is_some_and(|rmse| rmse <= mm)
        });
        let Some((own, _)) = own else {
            return front;
        };
        let cheaper = |row: &usize| cost.of(&rows[*row]) < cost.of(own);
        [0].into_iter()
            .chain(front.into_iter().filter(cheaper))
            .collect()
    }

    /// Competing rows at a cost of at most `most` that are on the front by the ranking locations; the most accurate first.
    fn front(&self, cost: Cost, most: f64, ranking: &BTreeSet<u32>) -> Vec<usize> {
        let point = |(row, errors): (&Row, &PressErrors)| {
            let rmse_mm = ranked_mm(errors, ranking)?;
            let is_allowed = row.competes && cost.of(row) <= most;
            is_allowed.then(|| (rmse_mm, cost.of(row)))
        };
        let rows = self.tradeoff.rows.iter().zip(&self.errors);
        let points: Vec<Option<(f64, f64)>> = rows.map(point).collect();
        let mut on: Vec<(f64, f64, usize)> = points
            .iter()
            .zip(pareto(&points))
            .enumerate()
            .filter_map(|(i, (point, is_on))| point.filter(|_| is_on).map(|(e, c)| (e, c, i)))
            .collect();
        on.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        on.into_iter().map(|(.., row)| row).collect()
    }

    /// RMSE of a row on the locations that do not rank.
    fn confirm(&self, row: usize, ranking: &BTreeSet<u32>) -> Estimate {
        let settings = &self.tradeoff.settings;
        let others = self.errors[row].iter().filter(|e| !ranking.contains(&e.0));
        let errors: PressErrors = others.copied().collect();
        rms_over_locations(&errors, settings.bootstrap_resamples, settings.seed)
    }

    /// The locations that rank, drawn by the session's seed.
    fn ranking_locations(&self) -> Result<BTreeSet<u32>, Unselected> {
        let all: BTreeSet<u32> = self.errors.iter().flatten().map(|e| e.0).collect();
        if all.len() < LEAST_LOCATIONS {
            return Err(Unselected::Locations(all.len()));
        }
        let mut left: Vec<u32> = all.into_iter().collect();
        let mut rng = seeded::generator(self.tradeoff.settings.seed, STREAM);
        let count = left.len() / RANKING;
        let mut draw = || left.swap_remove(seeded::index(&mut rng, left.len()));
        Ok((0..count).map(|_| draw()).collect())
    }
}

/// RMSE on the ranking locations.
fn ranked_mm(errors: &PressErrors, ranking: &BTreeSet<u32>) -> Option<f64> {
    let inside = errors.iter().filter(|e| ranking.contains(&e.0));
    sums::root_mean_square(inside.map(|e| e.1))
}

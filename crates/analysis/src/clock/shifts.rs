//! Owns the choice among all alignments of both cameras: the likeliest pair of shifts, and its odds against all others.

use super::bursts::Bursts;
use super::error::RatesError;
use super::tally::{Counter, NEAR_US, Plan, Tally};

/// Cell width for differences between bursts and presses, µs.
const CELL_US: f64 = 0.5 * NEAR_US;
/// Closer shifts are the same alignment, µs.
pub(super) const SAME_US: f64 = 2.0 * NEAR_US;
/// Shifts of one camera to consider: those with the most presses that have a burst.
const MAX_SHIFTS: usize = 2000;
/// Likeliest shifts of each camera to pair.
const MAX_PAIRED: usize = 400;
/// Likeliest shifts of a camera to transfer to the other via coinciding bursts, and the number of ways.
const TRANSFERRED: usize = 12;
/// Pairs to score in full.
const MAX_PAIRS: usize = 1000;
/// Assumed weight of a burst seen by both cameras when choosing pairs.
const COINCIDENCE: f64 = 5.0;
/// Maximum number of burst-press comparisons.
const MAX_WORK: u64 = 1 << 32;

/// The likeliest alignment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ShiftChoice {
    /// Delay of the planned presses in each camera relative to its clock fit, µs.
    pub shift_us: [f64; 2],
    /// Its tally.
    pub tally: Tally,
    /// Log odds against all other alignments together, and against none being right.
    pub log_odds: f64,
    /// Second likeliest; `None` if there is none, or if a plan unrelated to the recording is likelier.
    pub runner_up_us: Option<[f64; 2]>,
}

/// Chooses among all shifts of both cameras, or of the only one.
///
/// # Errors
/// When there are too many bursts to consider all shifts.
pub(super) fn choose(plan: &Plan, trains: [Option<&Bursts>; 2]) -> Result<ShiftChoice, RatesError> {
    let mut shifts: [Vec<(f64, f64)>; 2] = [Vec::new(), Vec::new()];
    for k in 0..2 {
        if let Some(train) = trains[k] {
            shifts[k] = likeliest(plan, train, k)?;
        }
    }
    let mut pairs = match trains {
        [Some(first), Some(second)] => paired(plan, first, second, &mut shifts)?,
        _ => {
            let one = |k: usize| {
                let each = shifts[k].iter();
                each.map(move |s| std::array::from_fn(|i| if i == k { s.0 } else { 0.0 }))
            };
            one(0).chain(one(1)).collect()
        }
    };
    if pairs.is_empty() {
        pairs.push([0.0; 2]);
    }
    let mut counter = Counter::new(plan, trains);
    let tallies: Vec<Tally> = pairs.iter().map(|shift| counter.tally(*shift)).collect();
    let likelihoods = tallies.iter().map(|t| t.log_likelihood).enumerate();
    let best = likelihoods
        .clone()
        .fold((0, f64::NEG_INFINITY), |b, t| if t.1 > b.1 { t } else { b });
    let shift_us = pairs[best.0];
    let is_other = |other: &[f64; 2]| (0..2).any(|k| (other[k] - shift_us[k]).abs() > SAME_US);
    let foreign = counter.without_plan(shift_us);
    let mut others: Vec<([f64; 2], f64)> = Vec::new();
    let mut in_order: Vec<(usize, f64)> = likelihoods.collect();
    in_order.sort_by(|a, b| b.1.total_cmp(&a.1));
    for (i, likelihood) in in_order {
        // The same alignment is found several times; keep its likeliest instance.
        let again = |o: &([f64; 2], f64)| (0..2).all(|k| (o.0[k] - pairs[i][k]).abs() <= SAME_US);
        if is_other(&pairs[i]) && !others.iter().any(again) {
            others.push((pairs[i], likelihood));
        }
    }
    let sum: f64 = others
        .iter()
        .map(|o| o.1)
        .chain([foreign])
        .map(|l| libm::exp(l - best.1))
        .sum();
    let runner_up_us = others.first().filter(|o| o.1 > foreign).map(|o| o.0);
    Ok(ShiftChoice {
        shift_us,
        tally: tallies[best.0],
        log_odds: -libm::log(sum.max(f64::MIN_POSITIVE)),
        runner_up_us,
    })
}

/// Likeliest shifts of one camera alone with their log likelihoods, likeliest first.
fn likeliest(plan: &Plan, train: &Bursts, k: usize) -> Result<Vec<(f64, f64)>, RatesError> {
    let differences = Differences::new(&train.at_us, plan.contacts_us())?;
    let mut found = differences.peaks();
    found.sort_by(|a, b| b.1.cmp(&a.1).then(a.0.total_cmp(&b.0)));
    found.truncate(MAX_SHIFTS);
    let mut alone = [None; 2];
    alone[k] = Some(train);
    let mut counter = Counter::new(plan, alone);
    let mut judged: Vec<(f64, f64)> = found
        .into_iter()
        .map(|(shift_us, _)| (shift_us, counter.tally([shift_us; 2]).log_likelihood))
        .collect();
    judged.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.total_cmp(&b.0)));
    judged.truncate(MAX_PAIRED);
    Ok(judged)
}

/// Pairs of shifts to score in full.
fn paired(
    plan: &Plan,
    first: &Bursts,
    second: &Bursts,
    shifts: &mut [Vec<(f64, f64)>; 2],
) -> Result<Vec<[f64; 2]>, RatesError> {
    let coincidences = Differences::new(&second.at_us, first.at_us.iter().copied())?;
    let mut between = coincidences.peaks();
    between.sort_by(|a, b| b.1.cmp(&a.1).then(a.0.total_cmp(&b.0)));
    between.truncate(TRANSFERRED);
    // Transfer candidates to the other camera via bursts that both saw.
    let mut carried: [Vec<(f64, f64)>; 2] = [Vec::new(), Vec::new()];
    for (difference_us, _) in between {
        for (k, sign) in [(0, 1.0), (1, -1.0)] {
            let to = 1 - k;
            let train = [first, second][to];
            let mut alone = [None; 2];
            alone[to] = Some(train);
            let mut counter = Counter::new(plan, alone);
            for (shift_us, _) in shifts[k].iter().take(TRANSFERRED) {
                let there = shift_us + sign * difference_us;
                let known = |s: &(f64, f64)| (s.0 - there).abs() < CELL_US;
                if !shifts[to].iter().chain(&carried[to]).any(known) {
                    carried[to].push((there, counter.tally([there; 2]).log_likelihood));
                }
            }
        }
    }
    for (shifts, carried) in shifts.iter_mut().zip(carried) {
        shifts.extend(carried);
    }
    let mut pairs: Vec<([f64; 2], f64)> = Vec::new();
    for one in &shifts[0] {
        for two in &shifts[1] {
            let together = coincidences.at(two.0 - one.0);
            let score = one.1 + two.1 + COINCIDENCE * f64::from(together);
            pairs.push(([one.0, two.0], score));
        }
    }
    if pairs.len() > MAX_PAIRS {
        pairs.select_nth_unstable_by(MAX_PAIRS, |a, b| b.1.total_cmp(&a.1));
        pairs.truncate(MAX_PAIRS);
    }
    pairs.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0[0].total_cmp(&b.0[0])));
    Ok(pairs.into_iter().map(|p| p.0).collect())
}

/// Histogram of differences between the times of two lists.
struct Differences {
    first_cell: i64,
    counts: Vec<u32>,
    sums_us: Vec<f64>,
}

impl Differences {
    /// Each of `later` minus each of `earlier`, both in order, µs.
    fn new(later: &[f64], earlier: impl Iterator<Item = f64> + Clone) -> Result<Self, RatesError> {
        let n = earlier.clone().count();
        let work = later.len() as u64 * n as u64;
        if work > MAX_WORK {
            return Err(RatesError::TooManyBursts {
                most: MAX_WORK,
                bursts: later.len(),
                presses: n,
            });
        }
        let cell = |us: f64| (us / CELL_US).floor() as i64;
        let ends = |f: fn(f64, f64) -> f64, start: f64| earlier.clone().fold(start, f);
        let (low, high) = (
            ends(f64::min, f64::INFINITY),
            ends(f64::max, f64::NEG_INFINITY),
        );
        let (Some(first), Some(last)) = (later.first(), later.last()) else {
            return Ok(Self {
                first_cell: 0,
                counts: Vec::new(),
                sums_us: Vec::new(),
            });
        };
        let first_cell = cell(first - high);
        // Without any `earlier` the ends are infinite, and there are no cells.
        let cells = cell(last - low)
            .saturating_sub(first_cell)
            .saturating_add(1)
            .max(0) as usize;
        let (mut counts, mut sums_us) = (vec![0; cells], vec![0.0; cells]);
        for one in earlier {
            for other in later {
                let difference_us = other - one;
                let i = cell(difference_us).saturating_sub(first_cell) as usize;
                if let (Some(count), Some(sum)) = (counts.get_mut(i), sums_us.get_mut(i)) {
                    *count += 1;
                    *sum += difference_us;
                }
            }
        }
        Ok(Self {
            first_cell,
            counts,
            sums_us,
        })
    }

    /// Count and sum of the three cells around `i`.
    fn about(&self, i: usize) -> (u32, f64) {
        let range = i.saturating_sub(1)..(i + 2).min(self.counts.len());
        let sum = self.sums_us[range.clone()].iter().sum();
        (self.counts[range].iter().sum(), sum)
    }

    /// Number of pairs that differ by about `us`.
    fn at(&self, us: f64) -> u32 {
        let i = ((us / CELL_US).floor() as i64).saturating_sub(self.first_cell);
        match usize::try_from(i) {
            Ok(i) if i < self.counts.len() => self.about(i).0,
            _ => 0,
        }
    }

    /// Local maxima of the histogram: difference, µs, and count.
    fn peaks(&self) -> Vec<(f64, u32)> {
        let all: Vec<u32> = (0..self.counts.len()).map(|i| self.about(i).0).collect();
        let is_peak = |i: usize| {
            let (from, to) = (i.saturating_sub(3), (i + 4).min(all.len()));
            all[i] > 0
                && all[from..i].iter().all(|n| *n < all[i])
                && all[i..to].iter().all(|n| *n <= all[i])
        };
        let mean = |i: usize| {
            let (n, sum) = self.about(i);
            (sum / f64::from(n), n)
        };
        (0..all.len()).filter(|i| is_peak(*i)).map(mean).collect()
    }
}

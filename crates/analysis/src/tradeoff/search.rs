//! Which choices to measure: curves of single options, random draws that show how well the curves compose, then the most
//! promising combinations. The order depends on errors and events alone, not on times: a session gives the same choices on
//! every computer.

use skinrig_model::Precision;
use skinrig_statistics::seeded;

use super::choice::{self, Choice};
use super::rule::{Point, Rule, class};

/// Competing draws that make the interval of the predictions: its ends are the smallest and the largest of their errors, so a
/// further draw lies inside in 58 of 60 sessions.
pub(super) const DRAWS: usize = 59;
/// Draws that do not compete are not counted; at most so many in all.
const MOST_DRAWS: usize = 2 * DRAWS;
/// Combinations measured because they promise a better front, at most.
pub(super) const PROMISING: usize = 160;
/// Stream of the seed that draws.
const STREAM: u64 = 0x6472_6177;
/// Halvings of both columns and rows that would leave no bits of an event.
const ADDRESS_STEPS: f64 = 10.5;
/// Weight of the rule itself against measured neighbours.
const PRIOR: f64 = 0.5;
/// Distances at which a neighbour counts 60 %: log2 of thinning and bin, log of the window, steps of rows.
const REACH: [f64; 4] = [3.0, 3.0, 1.2, 1.5];

/// All choices whose errors the curves predict, with their RMSE: those that should locate enough presses, and the others.
pub(super) fn pools(all: &[Choice], rule: &Rule<'_>) -> [Vec<(Choice, f64)>; 2] {
    let predicted = all.iter().filter_map(|c| Some((*c, rule.rmse_mm(*c)?)));
    let (likely, unlikely) = predicted.partition(|(c, _)| rule.locates(*c));
    [likely, unlikely]
}

/// Moves the neighbours of a choice that competes from the unlikely ones to the pool: the curves of single changes do not know how
/// few events suffice where several options change.
pub(super) fn admit(pools: &mut [Vec<(Choice, f64)>; 2], competing: Choice) {
    let [pool, unlikely] = pools;
    pool.extend(unlikely.extract_if(.., |(c, _)| {
        choice::are_neighbours(class(*c), class(competing))
    }));
}

/// The pool in random order, without what was measured.
pub(super) fn shuffled(pool: &[(Choice, f64)], measured: &[Point], seed: u64) -> Vec<Choice> {
    let fresh = pool.iter().map(|p| p.0);
    let mut order: Vec<Choice> = fresh.filter(|c| is_fresh(*c, measured)).collect();
    let mut rng = seeded::generator(seed, STREAM);
    for i in (1..order.len()).rev() {
        order.swap(i, seeded::index(&mut rng, i + 1));
    }
    order
}

/// True if no choice that measures the same was measured.
pub(super) fn is_fresh(choice: Choice, measured: &[Point]) -> bool {
    measured.iter().all(|p| class(p.choice) != class(choice))
}

/// Draws until `count` compete, or too many do not.
pub(super) fn draw(
    order: &mut impl Iterator<Item = Choice>,
    count: usize,
    mut competes: impl FnMut(Choice) -> bool,
) {
    let most = count * MOST_DRAWS / DRAWS;
    let mut found = 0;
    for choice in order.take(most) {
        found += usize::from(competes(choice));
        if found == count {
            return;
        }
    }
}

/// Position for distances.
fn place(choice: Choice) -> [f64; 4] {
    [
        f64::from(choice.thinning.trailing_zeros()),
        f64::from(choice.bin_px.trailing_zeros()),
        libm::log(choice.window_ms.unwrap_or(choice::LONG_MS)),
        f64::from(choice.region as u8),
    ]
}

/// Nearness of two choices, 0..=1.
fn nearness(a: Choice, b: Choice) -> f64 {
    let (at, to) = (place(a), place(b));
    let square: f64 = (0..4).map(|i| ((at[i] - to[i]) / REACH[i]).powi(2)).sum();
    let same = (a.estimator, a.centroid) == (b.estimator, b.centroid);
    libm::exp(-0.5 * square) * if same { 1.0 } else { 0.5 }
}

/// The most promising choice of the pool for one of the fronts, in turn: events per estimator, and delay. It is the one with the
/// largest predicted gain in log RMSE over everything measured that costs no more.
pub(super) fn promising(
    pool: &[(Choice, f64)],
    measured: &[Point],
    rule: &Rule<'_>,
    turn: usize,
) -> Option<Choice> {
    let competing: Vec<(&Point, f64, f64)> = measured
        .iter()
        .filter_map(|p| {
            let log = libm::log(p.rmse_mm?);
            let predicted = rule.rmse_mm(p.choice);
            let off = predicted.map_or(0.0, |rmse| log - libm::log(rmse));
            Some((p, log, off))
        })
        .collect();
    let worst = competing.iter().map(|c| c.1).fold(f64::MIN, f64::max);
    let estimators: Vec<Choice> = competing.iter().fold(Vec::new(), |mut seen, (p, ..)| {
        let same =
            |c: &Choice| (c.estimator, c.centroid) == (p.choice.estimator, p.choice.centroid);
        if !seen.iter().any(same) {
            seen.push(p.choice);
        }
        seen
    });
    let about = turn % (estimators.len() + 1);
    let of_front = |c: Choice| match estimators.get(about) {
        Some(e) => (c.estimator, c.centroid) == (e.estimator, e.centroid),
        None => true,
    };
    let cost = |c: Choice, events: f64| match estimators.get(about) {
        Some(_) => events * (1.0 - f64::from(c.bin_px.trailing_zeros()) / ADDRESS_STEPS),
        None => c.window_ms.unwrap_or(f64::INFINITY),
    };
    let front: Vec<(f64, f64)> = competing
        .iter()
        .filter(|(p, ..)| of_front(p.choice))
        .map(|(p, log, _)| (cost(p.choice, p.events), *log))
        .collect();
    let mut best: Option<(f64, Choice)> = None;
    for (choice, rmse) in pool.iter().filter(|(c, _)| of_front(*c)) {
        let is_variant = choice.precision == Precision::F64 && choice::has_f32(*choice);
        if is_variant || !is_fresh(*choice, measured) {
            continue;
        }
        let near = competing
            .iter()
            .map(|(p, _, off)| (nearness(p.choice, *choice), *off));
        let (weight, sum) = near.fold((PRIOR, 0.0), |(w, s), (n, off)| (w + n, s + n * off));
        let expected = libm::log(*rmse) + sum / weight;
        let Some(events) = rule.events(*choice) else {
            continue;
        };
        let limit = cost(*choice, events);
        let cheaper = front.iter().filter(|f| f.0 <= limit).map(|f| f.1);
        let gain = cheaper.fold(worst, f64::min) - expected;
        if best.is_none_or(|(most, _)| gain > most) {
            best = Some((gain, *choice));
        }
    }
    best.map(|(_, choice)| choice)
}

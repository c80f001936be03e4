//! Divides the events of one camera among touches: each has a place and width over columns and its own course over time
//! (expectation maximisation).

use super::profile::{Profile, moments};
use super::sight::{BINS, TouchSight, bin, column};

/// Places at which a component may start.
const STARTS: usize = 9;
/// Starts whose courses are followed.
const FOLLOWED: usize = 2;
const COARSE_STEPS: usize = 25;
const FINE_STEPS: usize = 60;
/// Courses are smoothed over this many ms on either side during the first steps.
const SMOOTHING_MS: usize = 3;
const SMOOTHED_STEPS: usize = 10;
/// A touch that has ended keeps at most this share of its rate.
const REST: f64 = 0.05;
/// Time before an end over which a rate is averaged, ms.
const RATE_MS: usize = 15;
/// Most change of a width in one step.
const WIDTH_STEP: f64 = 1.2;
/// Least share of events that keeps a component alive.
const LEAST_EVENTS: f64 = 5.0;

/// One touch in one camera.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Component {
    pub(super) mean: f64,
    pub(super) width: f64,
    /// Events per ms from the start of the window on.
    pub(super) course: Vec<f64>,
    /// Events attributed to it, and their mean column.
    pub(super) events: f64,
    pub(super) centroid: f64,
}

/// Touches in one camera.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Mixture {
    pub(super) components: Vec<Component>,
    /// Logarithm of the likelihood over columns alone.
    pub(super) column_nats: f64,
}

/// Where a division starts.
#[derive(Debug, Clone, Copy)]
pub(super) struct Start<'a> {
    /// Columns of the touches.
    pub(super) means: &'a [f64],
    /// Known ends of the touches, ms.
    pub(super) ends_ms: Option<[f64; 2]>,
}

/// Permitted widths of a component, px.
pub(super) type Widths = [f64; 2];

struct Cell {
    ms: usize,
    bin: usize,
    n: f64,
}

fn cells(sight: &TouchSight, by_time: bool) -> (Vec<Cell>, usize) {
    let length = if by_time {
        sight.length_ms().ceil().max(1.0) as usize
    } else {
        1
    };
    let mut grid = vec![0.0; BINS];
    let mut cells = Vec::new();
    let mut ms = 0;
    let mut close = |ms: usize, grid: &mut Vec<f64>| {
        for (bin, n) in grid.iter_mut().enumerate() {
            if *n > 0.0 {
                cells.push(Cell { ms, bin, n: *n });
                *n = 0.0;
            }
        }
    };
    for e in &sight.events {
        let at = if by_time {
            ((e.t_ms - sight.times.from_ms) as usize).min(length - 1)
        } else {
            0
        };
        if at != ms {
            close(ms, &mut grid);
            ms = at;
        }
        grid[bin(e.x)] += 1.0;
    }
    close(ms, &mut grid);
    (cells, length)
}

/// State of the expectation maximisation.
#[derive(Clone)]
struct State {
    mean: f64,
    width: f64,
    limits: Widths,
    course: Vec<f64>,
    /// It ends at this index of its course.
    end: Option<usize>,
}

/// Touches that have ended keep only their rest.
fn hold_ends(states: &mut [State]) {
    for state in states {
        let Some(end) = state.end.filter(|e| *e < state.course.len()) else {
            continue;
        };
        let before = &state.course[end.saturating_sub(RATE_MS)..end];
        let rest = REST * before.iter().sum::<f64>() / before.len().max(1) as f64;
        for n in &mut state.course[end..] {
            *n = n.min(rest);
        }
    }
}

/// One step; returns the log likelihood up to a constant.
fn step(
    profile: &Profile,
    cells: &[Cell],
    background: &[f64],
    states: &mut [State],
    smoothing: usize,
    wants_nats: bool,
) -> f64 {
    let templates: Vec<Vec<f64>> = states
        .iter()
        .map(|s| profile.template(s.mean, s.width))
        .collect();
    let length = states.first().map_or(0, |s| s.course.len());
    let mut courses = vec![vec![0.0; length]; states.len()];
    let mut columns = vec![vec![0.0; BINS]; states.len()];
    let mut nats = 0.0;
    let mut rates = vec![0.0; states.len()];
    for cell in cells {
        let mut all = background[cell.bin];
        for ((rate, s), t) in rates.iter_mut().zip(&*states).zip(&templates) {
            *rate = s.course[cell.ms] * t[cell.bin];
            all += *rate;
        }
        if wants_nats {
            nats += cell.n * libm::log(all);
        }
        for (k, rate) in rates.iter().enumerate() {
            let part = cell.n * rate / all;
            courses[k][cell.ms] += part;
            columns[k][cell.bin] += part;
        }
    }
    for (k, state) in states.iter_mut().enumerate() {
        nats -= state.course.iter().sum::<f64>();
        state.course = smoothed(&courses[k], smoothing);
        let (Some(found), Some(expected)) = (moments(&columns[k]), moments(&templates[k])) else {
            continue;
        };
        if found.events < LEAST_EVENTS {
            continue;
        }
        state.mean = (state.mean + found.mean - expected.mean).clamp(0.0, column(BINS - 1));
        let ratio = (found.width / expected.width).clamp(1.0 / WIDTH_STEP, WIDTH_STEP);
        state.width = (state.width * ratio).clamp(state.limits[0], state.limits[1]);
    }
    nats
}

fn smoothed(course: &[f64], by: usize) -> Vec<f64> {
    if by == 0 {
        return course.to_vec();
    }
    let near = |k: usize| &course[k.saturating_sub(by)..(k + by + 1).min(course.len())];
    (0..course.len())
        .map(|k| near(k).iter().sum::<f64>() / near(k).len() as f64)
        .collect()
}

/// Log likelihood of the events of each column with so many touches.
pub(super) fn column_nats(profile: &Profile, sight: &TouchSight, widths: &[Widths]) -> f64 {
    let found = over_columns(profile, sight, widths, None);
    found.first().map_or(f64::NEG_INFINITY, |f| f.0)
}

/// Divides the columns of the events, without regard to time, from every start; the likeliest first.
fn over_columns(
    profile: &Profile,
    sight: &TouchSight,
    widths: &[Widths],
    near: Option<Start<'_>>,
) -> Vec<(f64, Vec<State>)> {
    let (total, _) = cells(sight, false);
    let background: Vec<f64> = sight.idle.iter().map(|r| r * sight.length_ms()).collect();
    let count = sight.events.len() as f64;
    let coarse = |means: &[f64]| {
        let mut states: Vec<State> = means
            .iter()
            .zip(widths)
            .map(|(mean, limits)| State {
                mean: *mean,
                width: (limits[0] * limits[1]).sqrt(),
                limits: *limits,
                end: None,
                course: vec![count / means.len() as f64],
            })
            .collect();
        let mut nats = f64::NEG_INFINITY;
        for k in 0..COARSE_STEPS {
            nats = step(
                profile,
                &total,
                &background,
                &mut states,
                0,
                k + 1 == COARSE_STEPS,
            );
        }
        (nats, states)
    };
    let mut found: Vec<(f64, Vec<State>)> = match near {
        Some(start) => vec![coarse(start.means)],
        None => starts(sight, widths.len())
            .iter()
            .map(|m| coarse(m))
            .collect(),
    };
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    found
}

/// Divides the events among `widths.len()` touches; `near` are columns to start from instead of a search.
pub(super) fn divide(
    profile: &Profile,
    sight: &TouchSight,
    widths: &[Widths],
    near: Option<Start<'_>>,
) -> Mixture {
    let mut found = over_columns(profile, sight, widths, near);
    let column_nats = found.first().map_or(f64::NEG_INFINITY, |f| f.0);
    found.truncate(FOLLOWED);
    if let Some(ends_ms) = near.and_then(|n| n.ends_ms) {
        for (state, end_ms) in found.iter_mut().flat_map(|f| f.1.iter_mut().zip(ends_ms)) {
            state.end = Some((end_ms - sight.times.from_ms).max(0.0).round() as usize);
        }
    }
    let (by_time, length) = cells(sight, true);
    let best = found
        .into_iter()
        .map(|(_, states)| follow(profile, sight, &by_time, length, states))
        .max_by(|a, b| a.0.total_cmp(&b.0));
    let states = best.map(|b| b.1).unwrap_or_default();
    Mixture {
        components: attribute(profile, sight, &states),
        column_nats,
    }
}

fn follow(
    profile: &Profile,
    sight: &TouchSight,
    cells: &[Cell],
    length: usize,
    mut states: Vec<State>,
) -> (f64, Vec<State>) {
    let mut all = vec![0.0; length];
    for cell in cells {
        all[cell.ms] += cell.n;
    }
    let all = smoothed(&all, SMOOTHING_MS);
    let count: f64 = all.iter().sum();
    for s in &mut states {
        let share = s.course.iter().sum::<f64>() / count.max(1.0);
        s.course = all.iter().map(|n| share * n + 1e-3).collect();
    }
    hold_ends(&mut states);
    let mut nats = f64::NEG_INFINITY;
    for k in 0..FINE_STEPS {
        let smoothing = if k < SMOOTHED_STEPS { SMOOTHING_MS } else { 1 };
        nats = step(
            profile,
            cells,
            &sight.idle,
            &mut states,
            smoothing,
            k + 1 == FINE_STEPS,
        );
        hold_ends(&mut states);
    }
    (nats, states)
}

/// Columns to start from: quantiles of the events, in all combinations.
fn starts(sight: &TouchSight, touches: usize) -> Vec<Vec<f64>> {
    let net = sight.net_columns();
    let sum: f64 = net.iter().sum();
    let mut quantiles = Vec::new();
    let mut passed = 0.0;
    for (bin, n) in net.iter().enumerate() {
        passed += n;
        while quantiles.len() < STARTS
            && passed >= sum * (quantiles.len() as f64 + 0.5) / STARTS as f64
        {
            quantiles.push(column(bin));
        }
    }
    if touches == 1 {
        let middle = quantiles.get(STARTS / 2).copied();
        return vec![vec![middle.unwrap_or(column(BINS / 2))]];
    }
    let mut all = Vec::new();
    for (k, one) in quantiles.iter().enumerate() {
        all.extend(quantiles[k + 1..].iter().map(|two| vec![*one, *two]));
    }
    all
}

/// Attributes each event.
fn attribute(profile: &Profile, sight: &TouchSight, states: &[State]) -> Vec<Component> {
    let templates: Vec<Vec<f64>> = states
        .iter()
        .map(|s| profile.template(s.mean, s.width))
        .collect();
    let mut sums = vec![[0.0f64; 2]; states.len()];
    let mut rates = vec![0.0; states.len()];
    for e in &sight.events {
        let bin = bin(e.x);
        let mut all = sight.idle[bin];
        for ((rate, s), t) in rates.iter_mut().zip(states).zip(&templates) {
            let ms = ((e.t_ms - sight.times.from_ms) as usize).min(s.course.len() - 1);
            *rate = s.course[ms] * t[bin];
            all += *rate;
        }
        for (sum, rate) in sums.iter_mut().zip(&rates) {
            sum[0] += rate / all;
            sum[1] += rate / all * f64::from(e.x);
        }
    }
    states
        .iter()
        .zip(sums)
        .map(|(s, [events, columns])| Component {
            mean: s.mean,
            width: s.width,
            course: s.course.clone(),
            events,
            centroid: columns / events.max(1e-9),
        })
        .collect()
}

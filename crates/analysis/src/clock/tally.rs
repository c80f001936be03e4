//! Owns the likelihood of an alignment: expected presses, what each camera saw of them, and the remaining bursts.
//!
//! The model: the planned presses were executed, possibly with more before or after them in the same rhythm, and each was
//! seen by both cameras, one or none, with unknown probabilities. All other bursts came at any time or one press period
//! after another burst, in one camera or both, with unknown rates. Probabilities and rates are integrated out (Dirichlet
//! priors), so that the recording itself weights every count. `docs/explanation/time-base.md` has the formulae.

use super::bursts::Bursts;
use super::search::period_us;
use super::span::PressSpan;

/// A burst this close to a predicted contact is that press, µs.
pub(super) const NEAR_US: f64 = 150_000.0;
/// Length of the slots for counting unplanned bursts, µs.
const SLOT_US: f64 = 2.0 * NEAR_US;
/// Prior counts of presses seen by both cameras, by the first, by the second, by none.
const PATH_PRIOR: [f64; 4] = [4.0, 0.7, 0.7, 0.6];
/// The same for sync presses. They share one location: all are seen, or none.
const SYNC_PRIOR: [f64; 4] = [0.8, 0.06, 0.06, 0.08];
/// Prior counts of unplanned bursts in both cameras, in the first, in the second, and of slots without any.
const NOISE_PRIOR: [f64; 4] = [0.5, 0.5, 0.5, 100.0];
/// The same for bursts one press period after another; the last: bursts without a follower.
const REPEAT_PRIOR: [f64; 4] = [4.0, 0.7, 0.7, 1.0];
/// Probability of more presses than planned, before the first or after the last.
const MORE_PRIOR: f64 = 0.1;
/// Presses beyond the plan end after this many in a row that no camera saw.
const UNSEEN_IN_A_ROW: u32 = 5;

/// Planned presses in the form that the likelihood needs.
#[derive(Debug, Clone)]
pub(super) struct Plan {
    /// Contact, µs, and whether it is a sync press; in order.
    contacts: Vec<(f64, bool)>,
    /// Duration of a press, µs.
    span_us: f64,
    period_us: f64,
    /// First and last contact of the path, µs.
    ends_us: (f64, f64),
}

impl Plan {
    pub(super) fn new(presses: &[PressSpan]) -> Self {
        let contacts = presses.iter().map(|p| (p.contact_us, p.sync)).collect();
        let mut spans: Vec<f64> = presses
            .iter()
            .map(|p| p.release_us - p.contact_us)
            .collect();
        let mut path: Vec<PressSpan> = presses.iter().copied().filter(|p| !p.sync).collect();
        if path.is_empty() {
            path = presses.to_vec();
        }
        let end = |p: Option<&PressSpan>| p.map_or(0.0, |p| p.contact_us);
        Self {
            contacts,
            span_us: super::line::median(&mut spans).unwrap_or(0.0).max(0.0),
            period_us: period_us(&path),
            ends_us: (end(path.first()), end(path.last())),
        }
    }

    pub(super) fn contacts_us(&self) -> impl Iterator<Item = f64> + Clone {
        self.contacts.iter().map(|c| c.0)
    }

    pub(super) fn period_us(&self) -> f64 {
        self.period_us
    }

    fn is_planned(&self, at_us: f64) -> bool {
        let after = self.contacts.partition_point(|c| c.0 < at_us - NEAR_US);
        self.contacts
            .get(after)
            .is_some_and(|c| c.0 <= at_us + NEAR_US)
    }
}

/// Evidence for one alignment.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Tally {
    /// Log likelihood, up to a constant of the recording.
    pub log_likelihood: f64,
    /// Per camera: planned presses within the recording, seen presses, and bursts that no planned press explains.
    pub expected: [u32; 2],
    pub found: [u32; 2],
    pub unexplained: [u32; 2],
    /// Unexplained bursts between the first and the last planned press.
    pub strays: [u32; 2],
}

/// Presses by the cameras that saw them.
#[derive(Debug, Clone, Copy, Default)]
struct SightingCounts {
    /// Recorded by both cameras: seen by both, by the first, by the second, by none.
    both: [u32; 4],
    /// Recorded by one camera: seen, not seen.
    one: [[u32; 2]; 2],
}

impl SightingCounts {
    fn add(&mut self, seen: [Option<bool>; 2]) {
        match seen {
            [Some(a), Some(b)] => self.both[2 * usize::from(!a) + usize::from(!b)] += 1,
            [Some(a), None] => self.one[0][usize::from(!a)] += 1,
            [None, Some(b)] => self.one[1][usize::from(!b)] += 1,
            [None, None] => {}
        }
    }

    fn log_likelihood(&self, prior: [f64; 4]) -> f64 {
        let n = self.both.map(f64::from);
        let after: [f64; 4] = std::array::from_fn(|i| prior[i] + n[i]);
        // Observations of both cameras also inform single-camera ones.
        let first = [after[0] + after[1], after[2] + after[3]];
        let second = [after[0] + after[2], after[1] + after[3]];
        log_dirichlet(n, prior)
            + log_dirichlet(self.one[0].map(f64::from), first)
            + log_dirichlet(self.one[1].map(f64::from), second)
    }
}

/// Log probability of a sequence with these counts and Dirichlet-distributed shares.
fn log_dirichlet<const N: usize>(counts: [f64; N], prior: [f64; N]) -> f64 {
    let (n, a): (f64, f64) = (counts.iter().sum(), prior.iter().sum());
    let each = counts.iter().zip(&prior).filter(|(n, _)| **n > 0.0);
    let parts: f64 = each
        .map(|(n, a)| libm::lgamma(a + n) - libm::lgamma(*a))
        .sum();
    libm::lgamma(a) - libm::lgamma(a + n) + parts
}

/// Computes tallies, with buffers common to all alignments.
pub(super) struct Counter<'a> {
    plan: &'a Plan,
    trains: [Option<&'a Bursts>; 2],
    /// Bursts of each camera that a press explains.
    explained: [Vec<bool>; 2],
    /// Bursts of each camera one press period after another.
    repeats: [Vec<bool>; 2],
    /// Bursts without a follower after one press period, in the camera that has more of them.
    unrepeated: f64,
}

/// For each of these times, in order, whether another one precedes it by `by_us`.
fn repeats(at_us: &[f64], by_us: f64) -> Vec<bool> {
    let mut earlier = 0;
    let mut follows = |at: &f64| {
        while earlier < at_us.len() && at_us[earlier] < at - by_us - NEAR_US {
            earlier += 1;
        }
        by_us > SLOT_US
            && at_us
                .get(earlier)
                .is_some_and(|e| *e <= at - by_us + NEAR_US)
    };
    at_us.iter().map(&mut follows).collect()
}

impl<'a> Counter<'a> {
    pub(super) fn new(plan: &'a Plan, trains: [Option<&'a Bursts>; 2]) -> Self {
        let explained = trains.map(|t| vec![false; t.map_or(0, |t| t.at_us.len())]);
        let repeats = trains.map(|t| repeats(t.map_or(&[], |t| &t.at_us), plan.period_us));
        let fresh = |r: &Vec<bool>| r.iter().filter(|r| !**r).count();
        Self {
            plan,
            trains,
            explained,
            unrepeated: repeats.iter().map(fresh).max().unwrap_or(0) as f64,
            repeats,
        }
    }

    /// Tally for planned presses that come `shift_us` later in each camera than its clock fit predicts.
    pub(super) fn tally(&mut self, shift_us: [f64; 2]) -> Tally {
        let mut tally = Tally::default();
        let (mut path, mut sync) = (SightingCounts::default(), SightingCounts::default());
        self.clear();
        for &(contact_us, is_sync) in &self.plan.contacts {
            let seen = [0, 1].map(|k| self.responds_at(k, contact_us + shift_us[k]));
            for (k, seen) in seen.into_iter().enumerate() {
                tally.expected[k] += u32::from(seen.is_some());
                tally.found[k] += u32::from(seen == Some(true));
            }
            let group = if is_sync { &mut sync } else { &mut path };
            group.add(seen);
        }
        for (k, train) in self.trains.into_iter().enumerate() {
            tally.unexplained[k] = train.map_or(0, |t| t.at_us.len() as u32) - tally.found[k];
        }
        let mut more = 0.0;
        for (end_us, step_us) in [
            (self.plan.ends_us.0, -self.plan.period_us),
            (self.plan.ends_us.1, self.plan.period_us),
        ] {
            more += self.beyond(end_us, step_us, shift_us, &mut path);
        }
        let ends = [self.plan.contacts.first(), self.plan.contacts.last()];
        let [from, to] = ends.map(|c| c.map_or(0.0, |c| c.0));
        for (k, shift_us) in shift_us.into_iter().enumerate() {
            let within = |at: &f64| (from..=to + self.plan.span_us).contains(at);
            let rest = self.rest(k, shift_us, None);
            tally.strays[k] = rest.filter(|(at, _)| within(at)).count() as u32;
        }
        tally.log_likelihood = path.log_likelihood(PATH_PRIOR)
            + sync.log_likelihood(SYNC_PRIOR)
            + more
            + self.noise(shift_us, true);
        tally
    }

    /// Likelihood of the bursts if the plan is unrelated to the recording: neither its presses nor its rhythm occur.
    pub(super) fn without_plan(&mut self, shift_us: [f64; 2]) -> f64 {
        self.clear();
        self.noise(shift_us, false)
    }

    fn clear(&mut self) {
        self.explained.iter_mut().for_each(|e| e.fill(false));
    }

    /// Whether camera `k` saw a press at `at_us`; `None` if it was not recording.
    fn responds_at(&mut self, k: usize, at_us: f64) -> Option<bool> {
        let train = self.trains[k]?;
        if at_us < train.from_us - NEAR_US || at_us > train.to_us {
            return None;
        }
        let after = train.at_us.partition_point(|b| *b < at_us);
        let near = |i: usize| {
            let off = (train.at_us.get(i)? - at_us).abs();
            (off <= NEAR_US && !self.explained[k][i]).then_some((i, off))
        };
        let candidates = [after.checked_sub(1).and_then(near), near(after)];
        let nearest = candidates
            .into_iter()
            .flatten()
            .min_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((i, _)) = nearest {
            self.explained[k][i] = true;
            return Some(true);
        }
        let recorded = at_us >= train.from_us && at_us + self.plan.span_us <= train.to_us;
        recorded.then_some(false)
    }

    /// Adds presses beyond one end of the plan to `path`, as long as bursts follow the rhythm, and returns the log
    /// probability of that number.
    fn beyond(
        &mut self,
        end_us: f64,
        step_us: f64,
        shift_us: [f64; 2],
        path: &mut SightingCounts,
    ) -> f64 {
        let none = libm::log(1.0 - MORE_PRIOR);
        if step_us.abs() < SLOT_US {
            return none;
        }
        let mut found: Vec<(u32, [Option<bool>; 2])> = Vec::new();
        let (mut unseen, mut until) = (0, 0);
        for i in 1.. {
            let at_us = end_us + f64::from(i) * step_us;
            let reached = |k: usize| {
                self.trains[k].is_some_and(|t| {
                    let at_us = at_us + shift_us[k];
                    if step_us > 0.0 {
                        at_us <= t.to_us
                    } else {
                        at_us >= t.from_us
                    }
                })
            };
            if !(reached(0) || reached(1)) || unseen > UNSEEN_IN_A_ROW {
                break;
            }
            if self.plan.is_planned(at_us) {
                continue;
            }
            let responses = [0, 1].map(|k| self.responds_at(k, at_us + shift_us[k]));
            found.push((i, responses));
            if responses.contains(&Some(true)) {
                (unseen, until) = (0, found.len());
            } else if responses.contains(&Some(false)) {
                unseen += 1;
            }
        }
        found.truncate(until);
        let Some((more, _)) = found.last() else {
            return none;
        };
        let more = f64::from(*more);
        found.iter().for_each(|(_, responses)| path.add(*responses));
        let planned = (self.plan.contacts.len() as f64).max(1.0);
        libm::log(MORE_PRIOR / planned) - (more - 1.0) / planned
    }

    /// Unexplained bursts of camera `k`, on the plan's clock, and whether each repeats another; limited to `within`, if
    /// given.
    fn rest(
        &self,
        k: usize,
        shift_us: f64,
        within: Option<(f64, f64)>,
    ) -> impl Iterator<Item = (f64, bool)> {
        let at = self.trains[k].map_or(&[][..], |t| &t.at_us);
        let each = at.iter().zip(&self.explained[k]).zip(&self.repeats[k]);
        let rest = each.filter(|((_, explained), _)| !**explained);
        let on_plan = rest.map(move |((at, _), repeats)| (at - shift_us, *repeats));
        on_plan.filter(move |(at, _)| within.is_none_or(|(from, to)| (from..=to).contains(at)))
    }

    /// Likelihood of the unexplained bursts; `in_rhythm`: one may follow another after one press period.
    fn noise(&self, shift_us: [f64; 2], in_rhythm: bool) -> f64 {
        let span = |k: usize| {
            let train = self.trains[k]?;
            Some((train.from_us - shift_us[k], train.to_us - shift_us[k]))
        };
        let spans = [span(0), span(1)];
        let length = |(from, to): (f64, f64)| (to - from).max(0.0);
        let shared = match spans {
            [Some(a), Some(b)] => Some((a.0.max(b.0), a.1.min(b.1))),
            _ => None,
        };
        let shared_us = shared.map_or(0.0, length);
        // Fresh bursts and repeats: in both cameras, in the first, in the second.
        let mut counts = [[0.0; 3]; 2];
        if let Some(shared) = shared {
            let mut second = self.rest(1, shift_us[1], Some(shared)).peekable();
            for (at, repeats) in self.rest(0, shift_us[0], Some(shared)) {
                while let Some((_, repeats)) = second.next_if(|b| b.0 < at - NEAR_US) {
                    counts[usize::from(repeats && in_rhythm)][2] += 1.0;
                }
                let other = second.next_if(|b| b.0 <= at + NEAR_US);
                let repeats = repeats || other.is_some_and(|o| o.1);
                counts[usize::from(repeats && in_rhythm)][usize::from(other.is_none())] += 1.0;
            }
            for (_, repeats) in second {
                counts[usize::from(repeats && in_rhythm)][2] += 1.0;
            }
        }
        let slots = |us: f64, fresh: f64| (us / SLOT_US - fresh).max(0.0);
        let [[a, b, c], [d, e, f]] = counts;
        let mut sum = log_dirichlet([a, b, c, slots(shared_us, a + b + c)], NOISE_PRIOR)
            + log_dirichlet([d, e, f, self.unrepeated], REPEAT_PRIOR);
        for k in 0..2 {
            let Some(span) = spans[k] else {
                continue;
            };
            let mut alone = [0.0; 2];
            for (at, repeats) in self.rest(k, shift_us[k], None) {
                if !shared.is_some_and(|(from, to)| (from..=to).contains(&at)) {
                    alone[usize::from(repeats && in_rhythm)] += 1.0;
                }
            }
            let free = slots(length(span) - shared_us, alone[0]);
            sum += log_dirichlet([alone[0], free], [NOISE_PRIOR[0], NOISE_PRIOR[3]]);
            let seen = REPEAT_PRIOR[0] + d;
            sum += log_dirichlet([alone[1], 0.0], [seen, REPEAT_PRIOR[3] + self.unrepeated]);
        }
        sum
    }
}

//! Law: a camera's clock runs evenly: one offset explains its bursts from the first press to the last.
//!
//! A camera that restarts, or a recorder that loses or repeats data, moves all later events by the same time. Up to some
//! press the bursts then come at one offset from the presses, and from it on at another.
//!
//! Applies to steps longer than a burst is wide, in sessions with a single leg. A step by whole presses shows in the columns
//! instead ([`super::segments`]).

use skinrig_model::{CameraId, PressId};

use super::finding::finding;
use super::observed_press::ObservedPress;
use super::slow::burst_delay_s;
use super::statistics::median;
use crate::result::{ClockFit, Evidence, Fault, Finding, Law};

/// A burst this close to a press belongs to it, s.
const NEAR_S: f64 = 0.15;
/// Smaller steps cannot be told from the width of a burst, s; those of slow presses not from a burst that comes later in its press.
const MIN_STEP_S: f64 = 0.2;
/// Largest offset between a press and its burst, s,
const REACH_S: f64 = 120.0;
/// and distance of the offsets tried, s.
const GRID_S: f64 = 0.05;
/// Long sessions try fewer offsets: maximum number of presses times offsets.
const MAX_CELLS: f64 = 4e6;
/// Minimum number of presses with a burst on each side of the step,
const MIN_PRESSES: usize = 6;
/// and their minimum share of all presses on that side.
const MIN_SHARE: f64 = 0.7;
/// Minimum gain over one offset, in presses with a burst and in bursts with a press: number, and share of the presses.
const MIN_GAIN: usize = 6;
const MIN_GAIN_SHARE: f64 = 0.05;
/// If bursts fill more of the time than this, they match any offset.
const MAX_FILLED: f64 = 0.4;

pub(super) const ADVICE: &str = "the camera restarted, or its recorder lost or repeated data: check its cable, power and CPU load, and record \
                      again; or cut the recording at that time and analyse the parts separately";

const ADVICE_BOTH: &str = "the presses themselves may have paused: compare the pauses of the schedule, or the press list, with the \
                           recording; else both recordings lost or repeated data";

/// `contacts_s`: contacts detected in the counts of each camera, s on the host clock by `clocks`, ascending.
pub(super) fn findings(
    presses_seen: &[ObservedPress<'_>],
    contacts_s: [&[f64]; 2],
    clocks: [Option<ClockFit>; 2],
) -> Vec<Finding> {
    let mut listed: Vec<(f64, PressId)> = presses_seen
        .iter()
        .filter_map(|t| Some((t.timing?.contact.as_secs_f64(), t.press)))
        .collect();
    listed.sort_by(|a, b| a.0.total_cmp(&b.0));
    let times: Vec<f64> = listed.iter().map(|p| p.0).collect();
    let least_s = MIN_STEP_S.max(burst_delay_s(presses_seen) + NEAR_S);
    let steps = CameraId::ALL.map(|camera| {
        let drift = clocks[camera.index()]?.drift_ppm * 1e-6;
        let contacts = contacts_s[camera.index()];
        let found = step(&times, contacts, least_s).into_iter();
        let found = found.chain(step_for_drift(&times, contacts, drift, least_s));
        found.max_by_key(|s| s.explained)
    });
    let say = |camera: CameraId, both: bool, found: Step| {
        let evidence = Evidence::ClockStep {
            camera,
            both,
            last: listed.get(found.from.checked_sub(1)?)?.1,
            first: listed.get(found.from)?.1,
            at_s: listed.get(found.from)?.0,
            step_s: found.step_s,
            explained: found.explained,
            one_offset: found.one_offset,
            presses: times.len(),
        };
        let camera = (!both).then_some(camera);
        let mut found = finding(Law::BurstWithMotion, Fault::ClockWrong, camera, evidence);
        if both { ADVICE_BOTH } else { ADVICE }.clone_into(&mut found.advice);
        // On one side of the step, the events in the windows are not those of the presses.
        found.invalidates = true;
        Some(found)
    };
    match steps {
        [Some(one), Some(two)]
            if one.from.abs_diff(two.from) <= 1 && (one.step_s - two.step_s).abs() < NEAR_S =>
        {
            say(CameraId::One, true, one).into_iter().collect()
        }
        _ => CameraId::ALL
            .into_iter()
            .zip(steps)
            .filter_map(|(camera, found)| say(camera, false, found?))
            .collect(),
    }
}

/// A step of a camera's clock.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Step {
    /// First press after it.
    from: usize,
    /// Size, s; positive if later events have later times.
    step_s: f64,
    /// From a press before it to its burst, s.
    before_s: f64,
    /// Presses with a burst at the offset of their side,
    explained: usize,
    /// and at the best offset for all.
    one_offset: usize,
}

/// The likeliest step of at least `least_s`, if two offsets explain clearly more presses than one.
fn step(listed: &[f64], contacts: &[f64], least_s: f64) -> Option<Step> {
    let n = listed.len();
    let (first, last) = (listed.first()?, listed.last()?);
    let filled = contacts.len() as f64 * 2.0 * NEAR_S / (last - first).max(1.0);
    if n < 2 * MIN_PRESSES || filled > MAX_FILLED {
        return None;
    }
    let is_gain = |with: usize, without: usize| {
        let gain = with.saturating_sub(without);
        gain >= MIN_GAIN && gain as f64 >= MIN_GAIN_SHARE * n as f64
    };
    let as_fitted = listed.iter().filter(|at| is_near(contacts, **at)).count();
    if !is_gain(n, as_fitted) {
        return None;
    }
    let reach_s = REACH_S.min(0.5 * GRID_S * MAX_CELLS / n as f64);
    let offsets = (reach_s / GRID_S) as i64;
    // Per offset: presses with a burst up to each press.
    let sums: Vec<(f64, Vec<u32>)> = (-offsets..=offsets)
        .map(|k| {
            let offset_s = k as f64 * GRID_S;
            let mut sum = 0;
            let mut sums = vec![0];
            sums.extend(listed.iter().map(|at| {
                sum += u32::from(is_near(contacts, at + offset_s));
                sum
            }));
            (offset_s, sums)
        })
        .collect();
    let (one_offset_s, one_offset) = best(sums.iter().map(|(o, s)| (*o, s[n])), 0.0)?;
    let sides = (MIN_PRESSES..=n - MIN_PRESSES).filter_map(|from| {
        let (before_s, before) = best(sums.iter().map(|(o, s)| (*o, s[from])), 0.0)?;
        let (after_s, after) = best(sums.iter().map(|(o, s)| (*o, s[n] - s[from])), before_s)?;
        let is_seen = |found: u32, of: usize| {
            found as usize >= MIN_PRESSES && f64::from(found) >= MIN_SHARE * of as f64
        };
        let step_s = after_s - before_s;
        let is_step = step_s.abs() >= least_s && is_seen(before, from) && is_seen(after, n - from);
        is_step.then_some(Step {
            from,
            step_s,
            before_s,
            explained: (before + after) as usize,
            one_offset: one_offset as usize,
        })
    });
    // Presses in an even rhythm also fit bursts that are whole periods away; then other bursts have no press.
    let bursts = |found: &Step| {
        let (before, after) = listed.split_at(found.from);
        let offsets_s = [found.before_s, found.before_s + found.step_s];
        with_a_press(contacts, &[(before, offsets_s[0]), (after, offsets_s[1])])
    };
    let sides = sides.map(|found| (bursts(&found), found));
    let (bursts, found) = sides.max_by(|(a_bursts, a), (b_bursts, b)| {
        let fit = |bursts: &usize, step: &Step| bursts + step.explained;
        let by_fit = fit(a_bursts, a).cmp(&fit(b_bursts, b));
        by_fit.then(b.from.cmp(&a.from))
    })?;
    // A gap repeats no presses: the same bursts at another offset are no gain.
    let bursts_of_one = with_a_press(contacts, &[(listed, one_offset_s)]);
    (is_gain(found.explained, found.one_offset) && is_gain(bursts, bursts_of_one)).then_some(found)
}

/// Usual distance, s, of the presses from the bursts next to them, at the offset of their part: about the median of the part, as bursts
/// come later than presses.
fn distance_s(contacts: &[f64], parts: &[(&[f64], f64)]) -> f64 {
    let nearest = |at: f64| {
        let next = contacts.partition_point(|t| *t < at);
        let around = [next.checked_sub(1), Some(next)].into_iter().flatten();
        let apart = around.filter_map(|i| Some(contacts.get(i)? - at));
        apart.min_by(|a, b| a.abs().total_cmp(&b.abs()))
    };
    let of_part = |(presses, offset_s): &(&[f64], f64)| {
        let apart = presses.iter().filter_map(|at| nearest(at + offset_s));
        let apart: Vec<f64> = apart.collect();
        let middle = median(apart.clone()).unwrap_or(0.0);
        let from_middle = apart.into_iter().map(|s| (s - middle).abs());
        from_middle.collect::<Vec<f64>>()
    };
    median(parts.iter().flat_map(of_part).collect()).unwrap_or(f64::INFINITY)
}

/// The step that the fitted drift stands for, if any: a line through both sides of a step drifts. Then the presses are closer to
/// their bursts with the step instead of the line. Of a clock that does drift it is the other way round, however long the session.
fn step_for_drift(listed: &[f64], contacts: &[f64], drift: f64, least_s: f64) -> Option<Step> {
    let begin = *listed.first()?;
    let even: Vec<f64> = contacts.iter().map(|c| c + drift * (c - begin)).collect();
    let found = step(listed, &even, least_s)?;
    let (before, after) = listed.split_at(found.from);
    let after_s = found.before_s + found.step_s;
    let stepped = distance_s(&even, &[(before, found.before_s), (after, after_s)]);
    (stepped < distance_s(contacts, &[(listed, 0.0)])).then_some(found)
}

/// Number of bursts near a press of any part, at its offset.
fn with_a_press(contacts: &[f64], parts: &[(&[f64], f64)]) -> usize {
    let has_press = |c: &&f64| {
        let mut parts = parts.iter();
        parts.any(|(presses, offset_s)| is_near(presses, **c - offset_s))
    };
    contacts.iter().filter(has_press).count()
}

/// The middle of the offsets with the highest count; of several groups that nearest to `to_s`.
fn best(counts: impl Iterator<Item = (f64, u32)> + Clone, to_s: f64) -> Option<(f64, u32)> {
    let most = counts.clone().map(|c| c.1).max()?;
    let mut groups: Vec<(f64, f64)> = Vec::new();
    for (offset_s, _) in counts.filter(|c| c.1 == most) {
        match groups.last_mut() {
            Some((_, end)) if offset_s - *end < 1.5 * GRID_S => *end = offset_s,
            _ => groups.push((offset_s, offset_s)),
        }
    }
    let middles = groups.iter().map(|(from, to)| 0.5 * (from + to));
    let nearest = middles.min_by(|a, b| (a - to_s).abs().total_cmp(&(b - to_s).abs()))?;
    Some((nearest, most))
}

/// True if one of these ascending times is at `at`.
fn is_near(times: &[f64], at: f64) -> bool {
    let next = times.partition_point(|t| *t < at - NEAR_S);
    times.get(next).is_some_and(|t| *t <= at + NEAR_S)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::audit::even_path::path;

    fn step(listed: &[f64], contacts: &[f64]) -> Option<Step> {
        super::step(listed, contacts, MIN_STEP_S)
    }

    fn stepped(all: &[f64], from: usize, by_s: f64) -> Vec<f64> {
        let moved = |(i, t): (usize, &f64)| if i < from { *t } else { t + by_s };
        let mut contacts: Vec<f64> = all.iter().enumerate().map(moved).collect();
        contacts.sort_by(f64::total_cmp);
        contacts
    }

    #[test]
    fn a_step_is_found_with_its_place_and_size() {
        // Long steps near an end of a short session leave too few presses that others cannot explain.
        let (short, long) = ([0.35, -0.35, 0.6, -0.6, 5.4], [0.9, 50.9]);
        for n in [30, 100, 300] {
            let listed = path(n);
            for share in [0.2, 0.5, 0.8] {
                let from = (share * f64::from(n)) as usize;
                let more = if share == 0.5 { &long[..] } else { &[] };
                for by_s in short.iter().chain(more).copied() {
                    let found = step(&listed, &stepped(&listed, from, by_s));
                    let found = found.unwrap_or_else(|| panic!("{n} {share} {by_s}"));
                    assert!(
                        found.from.abs_diff(from) <= 1,
                        "{n} {share} {by_s} {found:?}"
                    );
                    // By whole presses more or less, bursts fit as well.
                    let off = (found.step_s - by_s) / 2.0;
                    assert!(
                        (off - off.round()).abs() < 0.06,
                        "{n} {share} {by_s} {found:?}"
                    );
                }
            }
        }
    }

    #[test]
    fn a_clock_that_drifts_for_hours_does_not_step() {
        let at = |i: i32, period_s: f64| period_s * f64::from(i);
        for (period_s, pause_s) in [(400.0, 0.0), (3.0, 35_000.0), (60.0, 7_000.0)] {
            for ppm in [-90.0, -40.0, 25.0, 40.0, 90.0] {
                let pause = |i: i32| if i < 50 { 0.0 } else { pause_s };
                let listed: Vec<f64> = (0..100).map(|i| at(i, period_s) + pause(i)).collect();
                // On the fitted clock bursts come up to 40 ms late.
                let late = (0..100).map(|i| 0.01 * f64::from(i * i % 5));
                let contacts: Vec<f64> = listed.iter().zip(late).map(|(t, by)| t + by).collect();
                let found = step_for_drift(&listed, &contacts, ppm * 1e-6, MIN_STEP_S);
                assert_eq!(found, None, "{period_s} s, pause {pause_s} s, {ppm} ppm");
            }
        }
    }

    #[test]
    fn a_line_through_both_sides_of_a_step_is_no_drift() {
        for by_s in [-0.9, -0.45, 0.45, 0.9] {
            let listed = path(100);
            let length_s = listed[99] - listed[0];
            // The least-squares line through a step in the middle.
            let drift = 1.5 * by_s / length_s;
            let fitted = |t: &f64| t - drift * (t - listed[0] - 0.5 * length_s) - 0.5 * by_s;
            let mut contacts: Vec<f64> = stepped(&listed, 50, by_s).iter().map(fitted).collect();
            contacts.sort_by(f64::total_cmp);
            let found = step_for_drift(&listed, &contacts, drift, MIN_STEP_S);
            let found = found.unwrap_or_else(|| panic!("{by_s}"));
            assert!(
                (found.step_s - by_s).abs() < 0.06 && found.from.abs_diff(50) <= 1,
                "{found:?}"
            );
        }
    }

    #[test]
    fn the_end_of_a_recording_or_a_gap_is_no_step() {
        let listed = path(100);
        for end in [60, 80, 90] {
            assert_eq!(step(&listed, &listed[..end]), None, "{end}");
            assert_eq!(step(&listed, &listed[103 - end..]), None, "{end}");
            let gap: Vec<f64> = listed[..30]
                .iter()
                .chain(&listed[103 - end + 30..])
                .copied()
                .collect();
            assert_eq!(step(&listed, &gap), None, "{end}");
        }
    }

    #[test]
    fn drift_jitter_weak_presses_and_noise_are_no_step() {
        let listed = path(200);
        for ppm in [-400.0, -100.0, 100.0, 400.0] {
            let contacts: Vec<f64> = listed.iter().map(|t| t * (1.0 + ppm * 1e-6)).collect();
            assert_eq!(step(&listed, &contacts), None, "{ppm} ppm");
        }
        for missing in 2..7 {
            let seen = listed.iter().enumerate().filter(|(i, _)| i % missing != 0);
            let mut contacts: Vec<f64> = seen.map(|(i, t)| t + 0.01 * (i % 5) as f64).collect();
            contacts.extend((0..60).map(|i| 1.3 + 6.7 * f64::from(i)));
            contacts.sort_by(f64::total_cmp);
            assert_eq!(step(&listed, &contacts), None, "every {missing}th");
        }
        for cut in [0, 50, 100, 150] {
            assert_eq!(step(&listed, &listed[cut..]), None);
            assert_eq!(step(&listed, &listed[..cut]), None);
        }
        assert_eq!(step(&[], &[]), None);
    }
}

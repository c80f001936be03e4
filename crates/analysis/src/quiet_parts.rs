//! Owns which parts of a camera's picture are quiet, or miss a polarity, while they are not at other times, or throughout.
//!
//! The camera is asked between presses, where the events of the noise tell which pixels are alive: in each idle time, the pixels that fire,
//! by strip of columns and by the polarity of their first event. A hot pixel counts once. Columns and rows without any event at all are
//! found over all idle times and presses together.

use std::ops::Range;

use skinrig_model::{Polarity, PressId, SENSOR_WIDTH};

use crate::crowded::beside;
use crate::metrics::quantile;
use crate::result::QuietPart;
use crate::stretch::prevailing;

/// Width of a strip, px; divides the width of the sensor.
const STRIP_PX: u16 = 40;
const STRIPS: usize = (SENSOR_WIDTH / STRIP_PX) as usize;
/// A part is quiet below this share of its rate at other times. Our choice: light and relaxing presses change it two- or threefold.
const QUIET: f64 = 0.2;
/// Idle times, at least, in which a part is quiet, and in which it is not;
const LEAST_SPANS: usize = 6;
/// and as a share of all.
const LEAST_SHARE: f64 = 0.1;
/// Weight of an idle time that is not quiet among quiet ones, which count 1.
const NOT_QUIET: i64 = 3;
/// Share of the idle times outside a quiet stretch that have less than the rate it is compared with: before presses far from a part, too.
const USUAL: f64 = 0.2;
/// Pixels that would have fired in a quiet stretch, at least.
const LEAST_EXPECTED: f64 = 60.0;
/// Columns or rows without events, at least,
const LEAST_EMPTY: usize = 8;
/// the events that they, or a polarity, would have had as the others have them,
const LEAST_MISSING: f64 = 200.0;
/// and the share of the others' mean that their busiest neighbours have: a picture that fades to its edge has none there.
const LEAST_BESIDE: f64 = 0.3;

/// Pixels that fire in an idle time, by strip and polarity of their first event.
#[derive(Debug, Clone)]
pub(crate) struct IdleTime {
    /// The press that follows.
    pub(crate) press: PressId,
    /// Length, s.
    pub(crate) seconds: f64,
    /// Pixels, by strip: OFF, ON.
    pub(crate) fired: Fired,
}

/// Number of pixels by strip: OFF, ON.
pub(crate) type Fired = [[u32; 2]; STRIPS];

/// Index of the strip of a column.
pub(crate) const fn strip_of(column: u16) -> usize {
    (column / STRIP_PX) as usize
}

/// Index of a polarity in [`Fired`].
pub(crate) const fn side_of(polarity: Polarity) -> usize {
    match polarity {
        Polarity::Off => 0,
        Polarity::On => 1,
    }
}

/// What is quiet during a part of the session: the whole picture, a polarity of it, or strips of columns. At most one.
pub(crate) fn quiet_for_a_time(idle: &[IdleTime]) -> Option<QuietPart> {
    // Without any event, the recording has a gap, which is told elsewhere.
    let idle: Vec<&IdleTime> = idle.iter().filter(|t| total(&t.fired) > 0).collect();
    let both = [0, 1];
    let part = |columns, polarity, stretch: &Stretch| QuietPart {
        columns,
        rows: None,
        polarity,
        presses: Some((idle[stretch.from].press, idle[stretch.to - 1].press)),
        share: stretch.share,
    };
    if let Some(found) = stretch(&idle, 0..STRIPS, &both) {
        return Some(part(None, None, &found));
    }
    for polarity in [Polarity::Off, Polarity::On] {
        if let Some(found) = stretch(&idle, 0..STRIPS, &[side_of(polarity)]) {
            return Some(part(None, Some(polarity), &found));
        }
    }
    // Few events tell of wide parts only, many also of narrow ones.
    let widest = [1, 2, 4, 8]
        .into_iter()
        .filter_map(|width| quiet_strips(&idle, width))
        .max_by_key(|(first, last, _)| last - first)?;
    let (first, last, found) = widest;
    let columns = (first as u16 * STRIP_PX, last as u16 * STRIP_PX - 1);
    Some(part(Some(columns), None, &found))
}

/// Parts of so many strips beside each other that are quiet for most of the same time: first strip, and the one after the last.
fn quiet_strips(idle: &[&IdleTime], width: usize) -> Option<(usize, usize, Stretch)> {
    let mut parts: Vec<Option<Stretch>> = (0..STRIPS / width)
        .map(|part| stretch(idle, part * width..(part + 1) * width, &[0, 1]))
        .collect();
    let (longest, found) = parts
        .iter_mut()
        .enumerate()
        .max_by_key(|(_, part)| part.as_ref().map_or(0, |s| s.to - s.from))?;
    let found = found.take()?;
    let alike = |part: &usize| parts[*part].as_ref().is_some_and(|p| p.shares(&found));
    let first = (0..longest).rev().take_while(alike).last();
    let last = (longest + 1..parts.len()).take_while(alike).last();
    let (first, last) = (first.unwrap_or(longest), last.unwrap_or(longest));
    Some((first * width, (last + 1) * width, found))
}

/// A polarity that never comes first, although the other does.
pub(crate) fn missing_polarity(idle: &[IdleTime]) -> Option<Polarity> {
    let pixels = |polarity| -> u32 {
        let all = idle.iter().flat_map(|t| &t.fired);
        all.map(|fired| fired[side_of(polarity)]).sum()
    };
    let (off, on) = (pixels(Polarity::Off), pixels(Polarity::On));
    match (off, on) {
        (0, _) if f64::from(on) >= LEAST_MISSING => Some(Polarity::Off),
        (_, 0) if f64::from(off) >= LEAST_MISSING => Some(Polarity::On),
        _ => None,
    }
}

/// The widest run of positions without any event beside busy ones: first and last. `events`: by column or row.
pub(crate) fn empty_run(events: &[u64]) -> Option<(usize, usize)> {
    let live = events.iter().filter(|n| **n > 0).count();
    let mean = events.iter().sum::<u64>() as f64 / live.max(1) as f64;
    let mut runs = Vec::new();
    let mut from = None;
    for (at, n) in events.iter().chain([&1]).enumerate() {
        match (*n, from) {
            (0, None) => from = Some(at),
            (1.., Some(first)) => {
                runs.push((first, at - 1));
                from = None;
            }
            _ => {}
        }
    }
    let wide = runs.into_iter().filter(|run| {
        let width = run.1 - run.0 + 1;
        width >= LEAST_EMPTY
            && width as f64 * mean >= LEAST_MISSING
            && beside(events, run.0..run.1 + 1, LEAST_EMPTY) >= LEAST_BESIDE * mean
    });
    wide.max_by_key(|run| run.1 - run.0)
}

fn total(fired: &Fired) -> u32 {
    fired.iter().flatten().sum()
}

/// Idle times in a row in which a part is quiet: first, and the one after the last.
struct Stretch {
    from: usize,
    to: usize,
    share: f64,
}

impl Stretch {
    /// Whether the other is quiet for most of the same time.
    fn shares(&self, other: &Self) -> bool {
        let common = self
            .to
            .min(other.to)
            .saturating_sub(self.from.max(other.from));
        10 * common >= 8 * (self.to - self.from).max(other.to - other.from)
    }
}

fn stretch(idle: &[&IdleTime], strips: Range<usize>, sides: &[usize]) -> Option<Stretch> {
    let count = |t: &&IdleTime| -> f64 {
        let fired = t.fired[strips.clone()].iter();
        f64::from(fired.flat_map(|f| sides.iter().map(|s| f[*s])).sum::<u32>())
    };
    let rates: Vec<f64> = idle.iter().map(|t| count(t) / t.seconds).collect();
    let least = LEAST_SPANS.max((LEAST_SHARE * rates.len() as f64).ceil() as usize);
    let level = QUIET * quantile(&mut rates.clone(), 0.75)?;
    let Range {
        start: from,
        end: to,
    } = prevailing(rates.iter().map(|r| *r <= level), NOT_QUIET).1;
    if to - from < least || rates.len() - (to - from) < least {
        return None;
    }
    let mut others = [&rates[..from], &rates[to..]].concat();
    let usual = quantile(&mut others, USUAL)?;
    let seconds: f64 = idle[from..to].iter().map(|t| t.seconds).sum();
    let fired: f64 = idle[from..to].iter().map(count).sum();
    let share = fired / (usual * seconds);
    (usual * seconds >= LEAST_EXPECTED && share <= QUIET).then_some(Stretch { from, to, share })
}

#[cfg(test)]
mod tests {
    use skinrig_statistics::seeded;

    use super::*;

    /// Idle times of half a second, with so many pixels a strip and polarity, up to half as many more after presses near it.
    fn idle(times: u32, each: u32) -> Vec<IdleTime> {
        let mut rng = seeded::generator(1, 1);
        let mut pixels = |strip: usize, time: u32| {
            let near = u32::from(time as usize / 3 % STRIPS == strip) * 4 * each;
            each + near + seeded::index(&mut rng, 1 + each as usize / 2) as u32
        };
        let at = |time: u32| IdleTime {
            press: PressId::from_index(time),
            seconds: 0.5,
            fired: std::array::from_fn(|strip| [pixels(strip, time), pixels(strip, time)]),
        };
        (0..times).map(at).collect()
    }

    fn press(index: u32) -> PressId {
        PressId::from_index(index)
    }

    #[test]
    fn a_camera_that_is_alive_everywhere_is_not_quiet() {
        for (times, each) in [(9, 20), (60, 1), (60, 20), (250, 200)] {
            assert_eq!(
                quiet_for_a_time(&idle(times, each)),
                None,
                "{times}, {each}"
            );
        }
        assert_eq!(quiet_for_a_time(&[]), None);
    }

    #[test]
    fn what_dies_from_some_press_on_is_named() {
        let dies = |strips: Range<usize>, sides: &[usize], from: usize, to: usize| {
            let mut all = idle(60, 20);
            for time in &mut all[from..to] {
                for fired in &mut time.fired[strips.clone()] {
                    sides.iter().for_each(|side| fired[*side] /= 40);
                }
            }
            quiet_for_a_time(&all).map(|q| (q.columns, q.polarity, q.presses.unwrap()))
        };
        let half = (press(30), press(59));
        assert_eq!(
            dies(8..16, &[0, 1], 30, 60),
            Some((Some((320, 639)), None, half))
        );
        assert_eq!(dies(0..16, &[0, 1], 30, 60), Some((None, None, half)));
        let on = Some(Polarity::On);
        assert_eq!(dies(0..16, &[1], 30, 60), Some((None, on, half)));
        let quarter = (press(0), press(14));
        assert_eq!(
            dies(3..5, &[0, 1], 0, 15),
            Some((Some((120, 199)), None, quarter))
        );
        // A moment is not.
        assert_eq!(dies(0..16, &[0, 1], 30, 34), None);
    }

    #[test]
    fn a_polarity_that_never_comes_is_named() {
        let mut all = idle(60, 20);
        assert_eq!(missing_polarity(&all), None);
        for fired in all.iter_mut().flat_map(|t| &mut t.fired) {
            fired[0] = 0;
        }
        assert_eq!(missing_polarity(&all), Some(Polarity::Off));
        assert_eq!(missing_polarity(&all[..0]), None);
    }

    #[test]
    fn columns_without_events_beside_busy_ones_are_named() {
        let mut events = vec![100_u64; 640];
        assert_eq!(empty_run(&events), None);
        events[251..330].fill(0);
        assert_eq!(empty_run(&events), Some((251, 329)));
        events[400..].fill(0);
        assert_eq!(empty_run(&events), Some((400, 639)));
        // One that fades, one that is sparse, and a narrow one.
        let fading: Vec<u64> = (0..640).map(|x| 500_u64.saturating_sub(x)).collect();
        assert_eq!(empty_run(&fading), None);
        let sparse: Vec<u64> = (0..640).map(|x| u64::from(x % 40 == 0)).collect();
        assert_eq!(empty_run(&sparse), None);
        let mut narrow = vec![1000_u64; 176];
        narrow[20..24].fill(0);
        assert_eq!(empty_run(&narrow), None);
        assert_eq!((empty_run(&[]), empty_run(&[0; 640])), (None, None));
    }
}

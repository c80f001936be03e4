//! Owns which column or row of a camera's picture holds far more events than those beside it: coordinates beyond it may have been written
//! as this one.

use std::ops::Range;

/// Events, relative to the mean of the busier neighbours, from which a line is crowded. Our choice: the brightest mark fades over
/// several pixels.
const TIMES: f64 = 8.0;
/// Neighbours on each side.
const BESIDE: usize = 8;
/// Events, at least.
const LEAST_EVENTS: u64 = 200;
/// The busiest pixels of a line do not count: hot ones.
const BUSIEST: usize = 8;

/// Index and relative events of the most crowded position. `events`: by column or row, without the busiest pixels of each.
pub(crate) fn crowded(events: &[u64]) -> Option<(usize, f64)> {
    let times = |(at, n): (usize, &u64)| {
        let beside = beside(events, at..at + 1, BESIDE).max(1.0);
        (*n >= LEAST_EVENTS).then_some((at, *n as f64 / beside))
    };
    let all = events.iter().enumerate().filter_map(times);
    let most = all.max_by(|a, b| a.1.total_cmp(&b.1));
    most.filter(|(_, times)| *times >= TIMES)
}

/// Mean events of the `width` positions on one side of a run, of the busier side.
pub(crate) fn beside(events: &[u64], run: Range<usize>, width: usize) -> f64 {
    let before = &events[run.start.saturating_sub(width)..run.start];
    let after = &events[run.end..events.len().min(run.end + width)];
    let mean = |n: &[u64]| n.iter().sum::<u64>() as f64 / n.len().max(1) as f64;
    mean(before).max(mean(after))
}

/// Sum of these events of a line's pixels without the busiest of them.
pub(crate) fn without_busiest(mut pixels: Vec<u64>) -> u64 {
    pixels.sort_unstable();
    let rest = pixels.len().saturating_sub(BUSIEST);
    pixels[..rest].iter().sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_that_holds_those_of_others_is_crowded() {
        let mut events: Vec<u64> = (0..640).map(|x| 1000 - x).collect();
        assert_eq!(crowded(&events), None);
        let beyond: u64 = events.drain(401..).sum();
        events.resize(640, 0);
        events[400] += beyond;
        let (column, times) = crowded(&events).unwrap();
        assert_eq!(column, 400);
        assert!(times > 100.0, "{times}");
        assert_eq!((crowded(&[]), crowded(&[0, 3, 0])), (None, None));
    }

    #[test]
    fn hot_pixels_crowd_no_line() {
        let mut pixels = vec![3; 176];
        pixels[5..10].fill(1_000_000);
        assert_eq!(without_busiest(pixels), 3 * 168);
        assert_eq!(without_busiest(vec![9; 4]), 0);
    }
}

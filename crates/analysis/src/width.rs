//! Width of a press in a camera's image, corrected for noise.

use crate::grid::PixelGrid;
use crate::segment::Window;

/// Minimum number of added events in standard errors of the count.
const MIN_SIGMAS: f64 = 10.0;

/// Width of the narrowest range of columns with half of the events that a press added to the idle rate, px.
///
/// Assumes an idle rate that is uniform over the columns. `None` if the press added fewer events than ten standard errors of
/// the count.
pub(crate) fn width_u(grid: &PixelGrid, idle_events: u64, window: &Window) -> Option<f64> {
    let idle = if window.idle_s() > 0.0 {
        idle_events as f64 * window.length_s() / window.idle_s()
    } else {
        0.0
    };
    let events = f64::from(grid.events());
    let added = events - idle;
    if added < MIN_SIGMAS * (events + idle).sqrt().max(1.0) {
        return None;
    }
    let each = idle / PixelGrid::WIDTH as f64;
    let columns = grid.columns().map(|count| f64::from(count) - each);
    shortest(&columns, added / 2.0).map(|columns| columns as f64)
}

/// Length of the shortest range whose sum is at least `target`, above 0.
///
/// Candidate starts are kept by increasing prefix sum: a later start with a smaller prefix sum beats every earlier one.
fn shortest(values: &[f64], target: f64) -> Option<usize> {
    let mut sums = Vec::with_capacity(values.len() + 1);
    let mut sum = 0.0;
    sums.push(sum);
    for value in values {
        sum += value;
        sums.push(sum);
    }
    let mut begins = std::collections::VecDeque::new();
    let mut best: Option<usize> = None;
    for (end, sum) in sums.iter().enumerate() {
        while let Some(&begin) = begins.front()
            && sum - sums[begin] >= target
        {
            best = Some(best.map_or(end - begin, |b| b.min(end - begin)));
            begins.pop_front();
        }
        while begins
            .back()
            .is_some_and(|&begin: &usize| sums[begin] >= *sum)
        {
            begins.pop_back();
        }
        begins.push_back(end);
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    fn window() -> Window {
        Window {
            row: 0,
            start_us: 1_000_000,
            end_us: 1_500_000,
            idle_start_us: 500_000,
        }
    }

    /// 2,000 events in columns 300..320, and noise in every fourth pixel of some rows.
    fn touched(noise: u32) -> PixelGrid {
        let mut grid = PixelGrid::new((100, 199));
        for column in 300..320 {
            assert!(grid.add_many(column, 150, 100));
        }
        for column in 0..640 {
            assert!(grid.add_many(column, 120, noise));
        }
        grid
    }

    #[test]
    fn noise_does_not_widen_a_touch() {
        assert_eq!(width_u(&touched(0), 0, &window()), Some(10.0));
        // As many additional events per column as the noise brings, in an idle time as long as the window.
        assert_eq!(width_u(&touched(20), 640 * 20, &window()), Some(10.0));
        // Without the idle rate the noise counts.
        assert!(width_u(&touched(20), 0, &window()).unwrap() > 100.0);
    }

    #[test]
    fn a_press_with_negligible_information_has_no_width() {
        let mut grid = PixelGrid::new((100, 199));
        (0..90).for_each(|k| assert!(grid.add(300 + k % 9, 150)));
        assert_eq!(width_u(&grid, 0, &window()), None);
        assert_eq!(width_u(&PixelGrid::new((1, 2)), 0, &window()), None);
    }

    #[test]
    fn the_shortest_stretch_is_found_past_negative_values() {
        let slow = |values: &[f64], target: f64| {
            let all = (0..values.len()).flat_map(|a| (a + 1..=values.len()).map(move |b| (a, b)));
            let enough = all.filter(|(a, b)| values[*a..*b].iter().sum::<f64>() >= target);
            enough.map(|(a, b)| b - a).min()
        };
        let mut state = 7u64;
        for _ in 0..200 {
            let values: Vec<f64> = (0..12)
                .map(|_| {
                    state = state
                        .wrapping_mul(6_364_136_223_846_793_005)
                        .wrapping_add(1);
                    ((state >> 60) as f64) - 5.0
                })
                .collect();
            assert_eq!(shortest(&values, 9.0), slow(&values, 9.0), "{values:?}");
        }
    }
}

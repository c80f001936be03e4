//! How long a chart runs before it raises an alarm: the Markov chain of a CUSUM, and the decision interval for a wanted run length.
//!
//! D. Brook and D. A. Evans, "An approach to the probability distribution of cusum run length", Biometrika 59 (1972) 539-549: the
//! sum is cut into cells, the mean run length from each solves a system of linear equations.

/// What a night adds to a sum beyond its score, in standard deviations: shifts of more than this are sought.
pub const ALLOWANCE: f64 = 1.0;

/// Cells of the sum: one more than a multiple of four, so that two clipped nights end in the last one and not beyond.
const CELLS: usize = 81;

/// Where scores are cut for a decision interval: two nights, however far off, end on the interval and not beyond it.
#[must_use]
pub fn clip(interval: f64) -> f64 {
    ALLOWANCE + interval / 2.0
}

/// Mean number of nights until a one-sided sum of normal scores with this mean exceeds `interval`, from a sum of zero.
#[must_use]
pub fn mean_run_length(interval: f64, shift: f64) -> f64 {
    let width = 2.0 * interval / (2 * CELLS - 1) as f64;
    let most = clip(interval);
    // Probability that a night adds at most `step`.
    let adds = |step: f64| {
        let score = step + ALLOWANCE;
        if score >= most {
            1.0
        } else {
            normal_below(score - shift)
        }
    };
    // Rows of (I - P) L = 1.
    let mut rows: Vec<Vec<f64>> = (0..CELLS)
        .map(|from| {
            let mut row: Vec<f64> = (0..CELLS)
                .map(|to| {
                    let step = (to as f64 - from as f64) * width;
                    let below = if to == 0 {
                        0.0
                    } else {
                        adds(step - width / 2.0)
                    };
                    let stay = if to == from { 1.0 } else { 0.0 };
                    stay - (adds(step + width / 2.0) - below)
                })
                .collect();
            row.push(1.0);
            row
        })
        .collect();
    // The matrix is an M-matrix with a dominant diagonal: elimination needs no pivots.
    for at in 0..CELLS {
        let (above, below) = rows.split_at_mut(at + 1);
        let pivot = &above[at];
        for row in below {
            let factor = row[at] / pivot[at];
            for (value, p) in row[at..].iter_mut().zip(&pivot[at..]) {
                *value -= factor * p;
            }
        }
    }
    let mut lengths = vec![0.0; CELLS];
    for at in (0..CELLS).rev() {
        let known: f64 = (at + 1..CELLS).map(|j| rows[at][j] * lengths[j]).sum();
        lengths[at] = (rows[at][CELLS] - known) / rows[at][at];
    }
    lengths[0]
}

/// The decision interval at which `series` charts, each with two sides, raise one false alarm in `nights` nights all together.
#[must_use]
pub fn interval_for(series: usize, nights: f64) -> f64 {
    let wanted = nights * 2.0 * series.max(1) as f64;
    let (mut low, mut high) = (1.0, 12.0);
    for _ in 0..40 {
        let middle = (low + high) / 2.0;
        if mean_run_length(middle, 0.0) < wanted {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

/// Probability that a standard normal variable lies below `z`.
fn normal_below(z: f64) -> f64 {
    0.5 * libm::erfc(-z / std::f64::consts::SQRT_2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn run_lengths_are_those_of_the_literature() {
        // Page's CUSUM with k = 1 and h = 2.52 runs 740 nights on one side (370 on two) where nothing is clipped: D. C. Montgomery,
        // Introduction to Statistical Quality Control, table 9.4. Clipped scores run longer, and alarms take three nights.
        let run = mean_run_length(2.52, 0.0);
        assert!(run > 740.0 && run < 3000.0, "{run}");
        assert!(mean_run_length(5.0, 20.0) >= 2.999);
        assert!(mean_run_length(5.0, 20.0) <= 3.001);
    }

    #[test]
    fn the_interval_gives_the_run_length_it_was_asked_for() {
        for series in [1, 80] {
            let interval = interval_for(series, 1000.0);
            let run = mean_run_length(interval, 0.0) / (2 * series) as f64;
            assert!((run / 1000.0 - 1.0).abs() < 1e-3, "{run}");
        }
        assert!(interval_for(80, 1000.0) > interval_for(8, 1000.0));
    }
}

//! Sums of many terms.

use skinrig_analysis::sums::{mean, root_mean_square, sum, variance};

use crate::problem::{Problem, Solution};

/// More terms take seconds to minutes.
const MOST: u64 = 10_000_000;

/// `long`: also sums of about 10^9 terms.
pub(crate) fn solve(problem: &Problem, long: bool) -> Solution {
    let n = problem.inputs["n"].as_u64().unwrap();
    if n > MOST && !long {
        return Solution::Skipped;
    }
    if problem.inputs.get("ramp").is_some() {
        let unit = problem.number("ramp");
        return sums((0..n).map(move |i| (i + 1) as f64 * unit));
    }
    let cycle = problem.numbers("cycle");
    let whole = usize::try_from(n).unwrap();
    sums(cycle.iter().copied().cycle().take(whole))
}

fn sums(values: impl Iterator<Item = f64> + Clone) -> Solution {
    Solution::Values(vec![
        ("sum", sum(values.clone())),
        ("mean", mean(values.clone()).unwrap()),
        ("rms", root_mean_square(values.clone()).unwrap()),
        ("variance", variance(values).unwrap()),
    ])
}

//! The stretch of a sequence in which something prevails, in spite of exceptions.

use std::ops::Range;

/// The stretch with the largest sum, the first of several, where a value that shows the thing counts 1 and another one
/// `-exception`: the sum, and the stretch (empty if no value shows it). Kadane's algorithm.
pub(crate) fn prevailing(
    shows: impl IntoIterator<Item = bool>,
    exception: i64,
) -> (i64, Range<usize>) {
    let (mut best, mut sum, mut from) = ((0, 0..0), 0, 0);
    for (at, shows) in shows.into_iter().enumerate() {
        sum += if shows { 1 } else { -exception };
        if sum <= 0 {
            (sum, from) = (0, at + 1);
        } else if sum > best.0 {
            best = (sum, from..at + 1);
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn no_other_stretch_has_a_larger_sum(
            shows in prop::collection::vec(any::<bool>(), 0..40),
            exception in 1i64..5,
        ) {
            let of = |r: Range<usize>| -> i64 {
                shows[r].iter().map(|s| if *s { 1 } else { -exception }).sum()
            };
            let ends = 0..=shows.len();
            let all = ends.clone().flat_map(|from| (from..=shows.len()).map(move |to| from..to));
            let (sum, stretch) = prevailing(shows.iter().copied(), exception);
            prop_assert_eq!(sum, of(stretch));
            prop_assert_eq!(Some(sum), all.map(of).max());
        }
    }
}

//! Sums that keep their precision for any number of terms.
//!
//! Compensated addition after Neumaier (1974): the error of a sum of n terms is at most `u |sum| + 2 n² u² Σ|x|` with u =
//! 2^-53, while plain addition loses up to `n u Σ|x|`.

/// A running sum and its accumulated rounding error.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Sum {
    sum: f64,
    lost: f64,
}

impl Sum {
    /// Adds one term.
    #[inline]
    pub(crate) fn add(&mut self, x: f64) {
        let next = self.sum + x;
        self.lost += if self.sum.abs() >= x.abs() {
            (self.sum - next) + x
        } else {
            (x - next) + self.sum
        };
        self.sum = next;
    }

    /// The sum. Infinite or NaN where plain addition is.
    #[must_use]
    pub(crate) fn total(self) -> f64 {
        if self.sum.is_finite() {
            self.sum + self.lost
        } else {
            self.sum
        }
    }
}

/// The sum of the values; 0 without values.
#[must_use]
pub fn sum(values: impl Iterator<Item = f64>) -> f64 {
    let mut sum = Sum::default();
    values.for_each(|v| sum.add(v));
    sum.total()
}

/// The mean; `None` without values.
#[must_use]
pub fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (mut sum, mut n) = (Sum::default(), 0u64);
    for value in values {
        sum.add(value);
        n += 1;
    }
    (n > 0).then(|| sum.total() / n as f64)
}

/// The root mean square; `None` without values.
#[must_use]
pub fn root_mean_square(values: impl Iterator<Item = f64>) -> Option<f64> {
    mean(values.map(|v| v * v)).map(f64::sqrt)
}

/// Mean square distance from the mean (variance with n), in two passes; `None` without values.
#[must_use]
pub fn variance(values: impl Iterator<Item = f64> + Clone) -> Option<f64> {
    let centre = mean(values.clone())?;
    mean(values.map(|v| (v - centre) * (v - centre)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn compensated_sums_keep_small_terms() {
        assert_eq!(sum([1.0, 1e100, 1.0, -1e100].into_iter()), 2.0);
        assert_eq!(sum(std::iter::empty()), 0.0);
        assert_eq!(sum([f64::INFINITY, 1.0].into_iter()), f64::INFINITY);
        assert!(sum([f64::NAN, 1.0].into_iter()).is_nan());
        assert_eq!(mean(std::iter::empty()), None);
        assert_eq!(
            root_mean_square([3.0, 4.0, 0.0, 0.0].into_iter()),
            Some(2.5)
        );
        assert_eq!(variance([1e9 + 1.0, 1e9 - 1.0].into_iter()), Some(1.0));
    }
}

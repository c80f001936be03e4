//! Smoothing of counts with a short Gaussian kernel.

/// Cut-off of the kernel in standard deviations (public code).
const REACH_SIGMAS: f64 = 4.0;

/// Assumption beyond the ends of a series.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Boundary {
    /// Unknown: the taps inside are scaled to a sum of 1, so that a constant stays constant.
    Renormalised,
    /// Zeros, as in the public code: the first and last bins are too low.
    ZeroPadded,
}

/// A symmetric kernel whose taps sum to 1.
#[derive(Debug, Clone, PartialEq)]
pub struct Kernel {
    /// Centre tap, then those to one side.
    taps: Vec<f64>,
}

impl Kernel {
    /// Gaussian of this standard deviation, sampled at the bins up to four standard deviations (at least one bin) to either
    /// side; 0.5 ms at 0.2 ms bins: 21 taps. A single tap if `sigma_ms` is 0.
    #[must_use]
    pub fn gaussian(sigma_ms: f64, bin_ms: f64) -> Self {
        if sigma_ms <= 0.0 {
            return Self { taps: vec![1.0] };
        }
        let half = (REACH_SIGMAS * sigma_ms / bin_ms).round().max(1.0) as usize;
        let raw: Vec<f64> = (0..=half)
            .map(|k| k as f64 * bin_ms / sigma_ms)
            .map(|z| libm::exp(-0.5 * z * z))
            .collect();
        let sum = raw[0] + 2.0 * raw[1..].iter().rev().sum::<f64>();
        Self {
            taps: raw.into_iter().map(|t| t / sum).collect(),
        }
    }

    /// Taps from the centre outwards.
    #[must_use]
    pub fn taps(&self) -> &[f64] {
        &self.taps
    }

    /// Bins on either side of the centre.
    #[must_use]
    pub const fn reach(&self) -> usize {
        self.taps.len() - 1
    }

    /// Smooths `counts`; the output has the same length, even if it is shorter than the kernel.
    #[must_use]
    pub fn smooth(&self, counts: &[u32], edges: Boundary) -> Vec<f64> {
        let n = counts.len();
        let input: Vec<f64> = counts.iter().map(|c| f64::from(*c)).collect();
        let mut out: Vec<f64> = input.iter().map(|x| self.taps[0] * x).collect();
        for (k, tap) in self.taps.iter().enumerate().skip(1).take(n) {
            // Processes bins k earlier and k later as whole slices: this is most of the study's time.
            let shared = n.saturating_sub(k);
            for (o, x) in out[n - shared..].iter_mut().zip(&input[..shared]) {
                *o += tap * x;
            }
            for (o, x) in out[..shared].iter_mut().zip(&input[n - shared..]) {
                *o += tap * x;
            }
        }
        if edges == Boundary::Renormalised {
            let reach = self.reach();
            for (i, o) in out.iter_mut().enumerate() {
                let (before, after) = (i, n - 1 - i);
                if before < reach || after < reach {
                    *o /= self.weight_inside(before, after);
                }
            }
        }
        out
    }

    /// Sum of the taps with `before` and `after` bins on the sides.
    fn weight_inside(&self, before: usize, after: usize) -> f64 {
        let side = |bins: usize| self.taps[1..=bins.min(self.reach())].iter().sum::<f64>();
        self.taps[0] + side(before) + side(after)
    }
}

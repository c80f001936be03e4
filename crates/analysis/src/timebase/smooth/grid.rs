//! Cubic B-splines on equal time steps.

/// Equal time steps and their cubic B-splines, which extend one step to the left and two to the right.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Grid {
    pub start_us: f64,
    pub step_us: f64,
    pub steps: usize,
}

impl Grid {
    pub(super) fn size(&self) -> usize {
        self.steps + 3
    }

    /// Index of the first of the four non-zero splines at `x`, and their values; beyond the ends the outer polynomials
    /// continue.
    pub(super) fn weights(&self, x: f64) -> (usize, [f64; 4]) {
        let at = (x - self.start_us) / self.step_us;
        let k = (at.floor().max(0.0) as usize).min(self.steps - 1);
        let u = at - k as f64;
        let v = 1.0 - u;
        let weights = [
            v * v * v / 6.0,
            (3.0 * u * u * u - 6.0 * u * u + 4.0) / 6.0,
            (3.0 * v * v * v - 6.0 * v * v + 4.0) / 6.0,
            u * u * u / 6.0,
        ];
        (k, weights)
    }

    pub(super) fn value(&self, coefficients: &[f64], x: f64) -> f64 {
        let (first, weights) = self.weights(x);
        let near = coefficients[first..first + 4].iter().zip(weights);
        near.map(|(c, w)| c * w).sum()
    }
}

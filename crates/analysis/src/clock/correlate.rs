//! Cross-correlation of long series by the fast Fourier transform.

use std::f64::consts::TAU;

type Complex = (f64, f64);

/// Roots of unity for a transform of length `n`, by falling angle.
fn roots(n: usize) -> Vec<Complex> {
    let root = |k| {
        let (sin, cos) = libm::sincos(-TAU * k as f64 / n as f64);
        (cos, sin)
    };
    (0..n / 2).map(root).collect()
}

/// In-place radix-2 transform (Cooley and Tukey 1965) of a power-of-two length, with its roots; unscaled. `inverse` flips
/// the sign of the exponent.
fn transform(data: &mut [Complex], roots: &[Complex], inverse: bool) {
    let n = data.len();
    let bits = n.trailing_zeros();
    for i in 0..n {
        let j = i.reverse_bits() >> (usize::BITS - bits);
        if i < j {
            data.swap(i, j);
        }
    }
    let sign = if inverse { -1.0 } else { 1.0 };
    let mut half = 1;
    while half < n {
        let stride = n / (2 * half);
        for block in data.chunks_exact_mut(2 * half) {
            let (low, high) = block.split_at_mut(half);
            let roots = roots.iter().step_by(stride);
            for ((a, b), root) in low.iter_mut().zip(high).zip(roots) {
                let t = product(*b, (root.0, sign * root.1));
                *b = (a.0 - t.0, a.1 - t.1);
                *a = (a.0 + t.0, a.1 + t.1);
            }
        }
        half *= 2;
    }
}

fn product(a: Complex, b: Complex) -> Complex {
    (a.0 * b.0 - a.1 * b.1, a.0 * b.1 + a.1 * b.0)
}

/// One series, transformed once, for correlation with several templates.
pub(crate) struct Correlator {
    transformed: Vec<Complex>,
    roots: Vec<Complex>,
    length: usize,
    longest_template: usize,
}

impl Correlator {
    /// For templates of up to `longest_template` values.
    pub(super) fn new(series: &[f64], longest_template: usize) -> Self {
        let size = (series.len() + longest_template).next_power_of_two().max(2);
        let mut transformed = vec![(0.0, 0.0); size];
        for (to, from) in transformed.iter_mut().zip(series) {
            to.0 = *from;
        }
        let roots = roots(size);
        transform(&mut transformed, &roots, false);
        Self {
            transformed,
            roots,
            length: series.len(),
            longest_template,
        }
    }

    /// For each of two templates, the lag (in `1 - template.len()..series.len()`) that maximises `sum series[i + lag] *
    /// template[i]`, and that sum. Values outside the series count 0. Longer templates are truncated.
    pub(crate) fn best_lags(&self, templates: [&[f64]; 2]) -> [(i64, f64); 2] {
        let templates = templates.map(|t| &t[..t.len().min(self.longest_template)]);
        // One transform serves both as real and imaginary parts, because the series is real.
        let mut work = vec![(0.0, 0.0); self.transformed.len()];
        for (to, from) in work.iter_mut().zip(templates[0]) {
            to.0 = *from;
        }
        for (to, from) in work.iter_mut().zip(templates[1]) {
            to.1 = *from;
        }
        transform(&mut work, &self.roots, false);
        for (w, s) in work.iter_mut().zip(&self.transformed) {
            *w = product(*s, (w.0, -w.1));
        }
        transform(&mut work, &self.roots, true);
        [
            self.largest(&work, templates[0].len(), |w| w.0),
            self.largest(&work, templates[1].len(), |w| -w.1),
        ]
    }

    /// First maximum of the unscaled sums for a template of this length, which `part` extracts from the transform, and its
    /// lag.
    fn largest(&self, work: &[Complex], template: usize, part: fn(&Complex) -> f64) -> (i64, f64) {
        let behind = template.saturating_sub(1);
        // Negative lags are at the end.
        let (ahead, late) = (&work[..self.length], &work[work.len() - behind..]);
        let mut best = (0, f64::NEG_INFINITY);
        for (lag, sum) in (-(behind as i64)..).zip(late.iter().chain(ahead).map(part)) {
            if sum > best.1 {
                best = (lag, sum);
            }
        }
        (best.0, best.1 / work.len() as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_best_lags_are_those_of_the_definition() {
        let value = |i: i64| ((i * i * 31 + i * 17) % 23) as f64 - 11.0;
        let series: Vec<f64> = (0..37).map(value).collect();
        let correlator = Correlator::new(&series, 21);
        let sum = |template: &[f64], lag: i64| -> f64 {
            let at = |i: usize| {
                usize::try_from(i as i64 + lag)
                    .ok()
                    .and_then(|k| series.get(k))
            };
            (0..template.len())
                .filter_map(|i| Some(at(i)? * template[i]))
                .sum()
        };
        for length in [0, 1, 5, 21] {
            for offset in [-3i64, 0, 9, 30] {
                let one: Vec<f64> = (0..length).map(|i| value(i + offset)).collect();
                let other: Vec<f64> = (0..9).map(|i| value(3 * i - offset)).collect();
                let found = correlator.best_lags([&one, &other]);
                for (template, (lag, best)) in [(&one, found[0]), (&other, found[1])] {
                    let behind = (template.len() as i64 - 1).max(0);
                    let lags = -behind..37;
                    let wanted = lags
                        .map(|lag| sum(template, lag))
                        .fold(f64::NEG_INFINITY, f64::max);
                    assert!((best - wanted).abs() < 1e-9);
                    assert!((sum(template, lag) - wanted).abs() < 1e-9);
                }
            }
        }
    }
}

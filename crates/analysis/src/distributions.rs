//! Normal, Student's and Poisson's distribution: probabilities, quantiles and the exact interval of a count.

/// P(Z <= z) of the standard normal distribution.
#[must_use]
pub(crate) fn normal_cdf(z: f64) -> f64 {
    0.5 * libm::erfc(-z * std::f64::consts::FRAC_1_SQRT_2)
}

/// The quantile `p` (0..1) of the standard normal distribution.
#[must_use]
pub fn normal_quantile(p: f64) -> f64 {
    invert(p, normal_cdf)
}

/// P(T <= t) of Student's distribution with `df` degrees of freedom (above 0, not necessarily an integer).
#[must_use]
pub fn student_cdf(t: f64, df: f64) -> f64 {
    if t.is_infinite() {
        return if t > 0.0 { 1.0 } else { 0.0 };
    }
    let outside = incomplete_beta(df / (df + t * t), 0.5 * df, 0.5);
    if t > 0.0 {
        1.0 - 0.5 * outside
    } else {
        0.5 * outside
    }
}

/// The quantile `p` (0..1) of Student's distribution with `df` degrees of freedom.
#[must_use]
pub fn student_quantile(p: f64, df: f64) -> f64 {
    invert(p, |t| student_cdf(t, df))
}

/// Inverse of an increasing `cdf` that is symmetric about 0, by bisection to the last bits.
fn invert(p: f64, cdf: impl Fn(f64) -> f64) -> f64 {
    if p == 0.5 {
        return 0.0;
    }
    // In the lower tail probabilities keep their digits.
    let tail = p.min(1.0 - p);
    let mut high = 1.0;
    while cdf(-high) > tail && high < 1e12 {
        high *= 2.0;
    }
    let mut low = 0.0;
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if cdf(-middle) > tail {
            low = middle;
        } else {
            high = middle;
        }
    }
    let at = 0.5 * (low + high);
    if p < 0.5 { -at } else { at }
}

/// P(X <= k) of a Poisson variable with this mean (at least 0): terms summed from the largest down.
#[must_use]
pub(crate) fn poisson_cdf(k: u64, mean: f64) -> f64 {
    if mean <= 0.0 {
        return 1.0;
    }
    let log_mean = libm::log(mean);
    let term = |i: u64| libm::exp(i as f64 * log_mean - mean - libm::lgamma(i as f64 + 1.0));
    // Terms that far below the mean and below k add nothing to a double.
    let from = (k.min(mean as u64) as f64 - 40.0 * (mean.sqrt() + 1.0)).max(0.0) as u64;
    (from..=k).rev().map(term).sum::<f64>().min(1.0)
}

/// Exact two-sided interval of a Poisson mean for an observed `count` (Garwood 1936): below its lower end `count` or more,
/// above its upper end `count` or fewer occur with a probability below `tail`.
#[must_use]
pub(crate) fn poisson_interval(count: u64, tail: f64) -> (f64, f64) {
    let spread = 10.0 * (count as f64 + 25.0).sqrt();
    let solve = |is_above: &dyn Fn(f64) -> bool| {
        let (mut low, mut high) = (0.0, count as f64 + spread);
        for _ in 0..100 {
            let middle = 0.5 * (low + high);
            if is_above(middle) {
                high = middle;
            } else {
                low = middle;
            }
        }
        0.5 * (low + high)
    };
    let low = count.checked_sub(1).map_or(0.0, |fewer| {
        solve(&|mean| 1.0 - poisson_cdf(fewer, mean) > tail)
    });
    (low, solve(&|mean| poisson_cdf(count, mean) < tail))
}

/// Regularised incomplete beta function I_x(a, b): continued fraction 8.17.22 of the NIST Digital Library of Mathematical
/// Functions by Lentz's method, on the side where it converges fast.
fn incomplete_beta(x: f64, a: f64, b: f64) -> f64 {
    if x <= 0.0 {
        return 0.0;
    }
    if x >= 1.0 {
        return 1.0;
    }
    if x > (a + 1.0) / (a + b + 2.0) {
        return 1.0 - incomplete_beta(1.0 - x, b, a);
    }
    let log_front = libm::lgamma(a + b) - libm::lgamma(a) - libm::lgamma(b)
        + a * libm::log(x)
        + b * libm::log1p(-x);
    let away = |v: f64| if v.abs() < 1e-300 { 1e-300 } else { v };
    let (mut c, mut d) = (1.0, 1.0 / away(1.0 - (a + b) * x / (a + 1.0)));
    let mut fraction = d;
    for m in 1..500 {
        let m = f64::from(m);
        for step in [
            m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m)),
            -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0)),
        ] {
            d = 1.0 / away(1.0 + step * d);
            c = away(1.0 + step / c);
            fraction *= c * d;
        }
        if (c * d - 1.0).abs() < 1e-15 {
            break;
        }
    }
    libm::exp(log_front) * fraction / a
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_the_tables() {
        for (p, z) in [
            (0.975, 1.959_963_985),
            (0.95, 1.644_853_627),
            (0.8, 0.841_621_234),
        ] {
            assert!((normal_quantile(p) - z).abs() < 1e-8);
            assert!((normal_quantile(1.0 - p) + z).abs() < 1e-8);
        }
        // Student's t, two-sided 95 %.
        for (df, t) in [
            (1.0, 12.706_204_74),
            (4.0, 2.776_445_105),
            (29.0, 2.045_229_642),
        ] {
            assert!((student_quantile(0.975, df) - t).abs() < 1e-7, "{df}");
        }
        assert!((student_quantile(0.975, 1e7) - 1.959_964).abs() < 1e-5);
        assert_eq!(student_quantile(0.5, 3.0), 0.0);
        assert!((student_cdf(-2.0, 7.3) + student_cdf(2.0, 7.3) - 1.0).abs() < 1e-14);
    }

    #[test]
    fn poisson_intervals_are_those_of_the_tables() {
        // Garwood 1936, two-sided 95 %.
        for (count, low, high) in [
            (0, 0.0, 3.6889),
            (1, 0.0253, 5.5716),
            (2, 0.2422, 7.2247),
            (10, 4.7954, 18.3904),
            (100, 81.3640, 121.6268),
        ] {
            let found = poisson_interval(count, 0.025);
            assert!((found.0 - low).abs() < 1e-4, "{count}: {found:?}");
            assert!((found.1 - high).abs() < 1e-4, "{count}: {found:?}");
        }
        // Large counts: normal approximation.
        let (low, high) = poisson_interval(1_000_000, 0.025);
        assert!(
            (low / (1e6 - 1960.0) - 1.0).abs() < 1e-5 && (high / (1e6 + 1961.0) - 1.0).abs() < 1e-5
        );
        assert!((poisson_cdf(3, 2.0) - 0.857_123_460_498_547).abs() < 1e-14);
        assert_eq!((poisson_cdf(0, 0.0), poisson_cdf(7, 0.0)), (1.0, 1.0));
    }
}

//! Normal, Student's and Poisson's distribution: probabilities, quantiles and the exact interval of a count.

/// P(Z <= z) of the standard normal distribution.
#[must_use]
pub fn normal_cdf(z: f64) -> f64 {
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
    let outside = outside_student(t * t / df, 0.5 * df);
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
pub fn poisson_cdf(k: u64, mean: f64) -> f64 {
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
pub fn poisson_interval(count: u64, tail: f64) -> (f64, f64) {
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

/// Probability beyond both tails of Student's distribution with `2 a` degrees of freedom at the square `2 a ratio`: the
/// regularised incomplete beta function I_x(a, 1/2) with x = 1 / (1 + ratio). For many degrees of freedom x is so near 1 that
/// only y = 1 - x knows how far.
fn outside_student(ratio: f64, a: f64) -> f64 {
    let (x, y) = (1.0 / (1.0 + ratio), ratio / (1.0 + ratio));
    if y <= 0.0 {
        return 1.0;
    }
    if x <= 0.0 {
        return 0.0;
    }
    // x^a y^(1/2) / B(a, 1/2)
    let (step, log) = gamma_step(a);
    let front = step
        * libm::exp(log - a * libm::log1p(ratio))
        * y.sqrt()
        * std::f64::consts::FRAC_2_SQRT_PI
        * 0.5;
    if y < 1.5 / (a + 2.5) {
        1.0 - front * inner_fraction(y, a)
    } else {
        front * outer_fraction(x, y, a)
    }
}

/// Gamma(a + 1/2) / Gamma(a) as a factor and the logarithm of another one. The difference of the logarithms loses the digits of
/// large ones; from 30 on the asymptotic series of Tricomi and Erdelyi (1951) has all digits.
fn gamma_step(a: f64) -> (f64, f64) {
    if a < 30.0 {
        return (1.0, libm::lgamma(a + 0.5) - libm::lgamma(a));
    }
    let inverse = 1.0 / a;
    let square = inverse * inverse;
    let series = [17.0 / 14336.0, -1.0 / 640.0, 1.0 / 192.0, -0.125];
    let sum = series.iter().fold(0.0, |sum, term| sum * square + term);
    (a.sqrt(), inverse * sum)
}

/// I_y(1/2, a) over its front factor: continued fraction 8.17.22 of the NIST Digital Library of Mathematical Functions. It converges
/// fast for y below 1.5 / (a + 2.5).
fn inner_fraction(y: f64, a: f64) -> f64 {
    let step = |k: u32| {
        let m = f64::from(k / 2);
        if k.is_multiple_of(2) {
            m * (a - m) * y / ((2.0 * m - 0.5) * (2.0 * m + 0.5))
        } else {
            -(0.5 + m) * (0.5 + a + m) * y / ((2.0 * m + 0.5) * (2.0 * m + 1.5))
        }
    };
    2.0 / lentz(1.0, |k| (step(k), 1.0))
}

/// I_x(a, 1/2) over its front factor, for x = 1 - y and y from 1.5 / (a + 2.5) on: the even part of that fraction, where no
/// difference of numbers near 1 remains (Didonato and Morris 1992).
fn outer_fraction(x: f64, y: f64, a: f64) -> f64 {
    let lambda = a * y - 0.5 * x;
    let whole = |m: f64| {
        m + m * (0.5 - m) * x / (a + 2.0 * m - 1.0)
            + (a + m) / (a + 2.0 * m + 1.0) * (lambda + 1.0 + m * (1.0 + y))
    };
    let first = a / (a + 1.0) * (lambda + 1.0);
    let fraction = lentz(first, |k| {
        let m = f64::from(k);
        let below = a + 2.0 * m - 1.0;
        let over = (a + m - 1.0) / below * ((a + m - 0.5) / below) * m * (0.5 - m) * x * x;
        (over, whole(m))
    });
    1.0 / fraction
}

/// The continued fraction `first + over(1) / (whole(1) + over(2) / (whole(2) + ...))` by Lentz's method; `terms` gives
/// (over, whole).
fn lentz(first: f64, terms: impl Fn(u32) -> (f64, f64)) -> f64 {
    let away = |v: f64| if v.abs() < 1e-300 { 1e-300 } else { v };
    let mut fraction = away(first);
    let (mut c, mut d) = (fraction, 0.0);
    for k in 1..1000 {
        let (over, whole) = terms(k);
        d = 1.0 / away(whole + over * d);
        c = away(whole + over / c);
        fraction *= c * d;
        if (c * d - 1.0).abs() < 3e-16 {
            break;
        }
    }
    fraction
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
        // Closed forms, near the middle and far out; the two branches meet near t² = 3.
        for t in [1e-9f64, 0.3, 1.0, 1.6, 1.7, 1.8, 2.0, 9.0, 1e5] {
            let one = libm::atan(1.0 / t) / std::f64::consts::PI;
            let two = 1.0 / (2.0 + t * t) / (1.0 + t / (2.0 + t * t).sqrt());
            for (df, tail) in [(1.0, one), (2.0, two)] {
                let found = student_cdf(-t, df);
                assert!(
                    (found / tail - 1.0).abs() < 1e-13,
                    "{t} {df}: {found} {tail}"
                );
            }
            // The limit of many degrees of freedom, to first order.
            for df in [1e12, 1e18, 1e300] {
                let (found, tail) = (student_cdf(-t, df), normal_cdf(-t));
                let far = (1.0 + t.powi(4)) / df;
                assert!(
                    (found - tail).abs() <= (1e-13 + far) * tail,
                    "{t} {df}: {found} {tail}"
                );
            }
        }
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

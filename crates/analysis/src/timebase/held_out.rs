//! Share of held-out trains within their stated interval.

use super::smooth::{FLOOR_US, Point, STEP_US, SmoothMap};

/// (inside, number): each half of the points against the fit to the other half, with the stated prediction interval; `None`
/// if a half allows no fit, or has too few points for such an interval.
pub(super) fn coverage(points: &[Point]) -> Option<(u32, u32)> {
    let halves = halves(points);
    let (mut inside, mut n) = (0, 0);
    for (half, other) in [(&halves[0], &halves[1]), (&halves[1], &halves[0])] {
        let fit = SmoothMap::fit(half, STEP_US, FLOOR_US)?;
        let width = width_us(&fit, 0.95)?;
        for p in other {
            n += 1;
            inside += u32::from((p.to_us - fit.value(p.from_us)).abs() <= width);
        }
    }
    Some((inside, n))
}

/// Half width of the prediction interval with this coverage, µs: the quantile of leave-one-out residuals of the used points
/// (Vovk, Gammerman and Shafer, "Algorithmic learning in a random world", 2005). It holds for any shape of the noise,
/// quantised or not; rejected points do not widen it. `None` with too few points: at least 19 for 95 %.
fn width_us(fit: &SmoothMap, share: f64) -> Option<f64> {
    let sigma2 = fit.sigma_us * fit.sigma_us;
    let without = |(at, residual): &(f64, f64)| {
        let se = fit.standard_error(*at);
        let leverage = if sigma2 > 0.0 { se * se / sigma2 } else { 0.0 };
        residual.abs() / (1.0 - leverage.min(0.9))
    };
    let points = fit.residuals.iter().zip(&fit.used);
    let used = points.filter(|(_, used)| **used);
    let mut sizes: Vec<f64> = used.map(|(p, _)| without(p)).collect();
    sizes.sort_by(f64::total_cmp);
    let k = (share * (sizes.len() + 1) as f64).ceil() as usize;
    sizes.get(k.max(1) - 1).copied()
}

/// Splits neighbouring points between the halves by the Thue-Morse sequence (parity of the ones of the index).
///
/// Periodic trains hit the microseconds of a camera in a pattern: at 100 ms and 25 ppm, alternately at the start and in the
/// middle. Taking every second point would put one kind into each half, and the fits would differ by half a microsecond; the
/// Thue-Morse sequence repeats no pattern.
fn halves(points: &[Point]) -> [Vec<Point>; 2] {
    let of = |parity: usize| {
        let each = points.iter().enumerate();
        let mine = each.filter(move |(i, _)| i.count_ones() as usize % 2 == parity);
        mine.map(|(_, p)| *p).collect()
    };
    [of(0), of(1)]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Trains every 100 ms, timestamped in whole microseconds by a camera with this drift.
    fn stamped(ppm: f64, phase_us: f64) -> Vec<Point> {
        (0..600)
            .map(|k| {
                let from_us = 1e5 * f64::from(k);
                let at = (from_us * (1.0 + ppm * 1e-6) + phase_us).floor() + 0.5;
                Point::new(from_us, at)
            })
            .collect()
    }

    #[test]
    fn trains_synchronous_with_camera_ticks_are_no_evidence_against_its_clock() {
        for half_ppm in -120..=120 {
            for phase_us in [0.05, 0.3, 0.55, 0.8] {
                let ppm = 0.5 * f64::from(half_ppm);
                let (inside, n) = coverage(&stamped(ppm, phase_us)).unwrap();
                assert!(
                    f64::from(inside) >= 0.88 * f64::from(n),
                    "{ppm} ppm, {phase_us} µs: {inside} of {n}"
                );
            }
        }
    }

    /// The purpose of the check: a clock that the model cannot follow.
    #[test]
    fn a_clock_that_jumps_about_is_found_out() {
        let mut points = stamped(23.6, 0.1);
        for (k, point) in points.iter_mut().enumerate() {
            // Most trains agree to a microsecond, every tenth is 8 µs off: the robust width is that of the others.
            if k % 10 == 3 {
                point.to_us += 8.0;
            }
        }
        let (inside, n) = coverage(&points).unwrap();
        assert!(f64::from(inside) < 0.92 * f64::from(n), "{inside} of {n}");
    }
}

//! A robust line through (host time, camera time minus host time).
//!
//! Times are differences from exact integer references, so that hours in µs lose no digits: the fit sees only the small
//! deviation of the camera clock from the host clock.

use super::error::LineError;

/// One pair of simultaneous times.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    /// Host time, µs.
    pub host_us: f64,
    /// Camera time, µs.
    pub camera_us: f64,
}

/// A line `camera = offset + (1 + drift) host` and its quality.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// Camera time at host time 0, µs.
    pub offset_us: f64,
    /// Relative rate of the camera clock minus 1.
    pub drift: f64,
    /// Standard error of the drift.
    pub drift_se: f64,
    /// RMS residual of the used pairs, µs.
    pub rms_us: f64,
    /// Largest absolute residual of the used pairs, µs.
    pub max_us: f64,
    /// For each pair, whether the fit uses it.
    pub used: Vec<bool>,
}

impl Line {
    /// Number of used pairs.
    #[must_use]
    pub fn n(&self) -> usize {
        self.used.iter().filter(|u| **u).count()
    }

    /// Camera time of `pair` minus the line, µs.
    #[must_use]
    pub fn residual_us(&self, pair: Pair) -> f64 {
        (pair.camera_us - pair.host_us) - self.offset_us - self.drift * pair.host_us
    }
}

/// Maximum number of iterations of fit and inlier selection.
const ROUNDS: usize = 8;
/// Residuals beyond this many robust standard deviations are outliers.
const OUTLIER_SIGMAS: f64 = 5.0;
/// Standard deviation of a normal distribution over its median absolute deviation.
const MAD_TO_SIGMA: f64 = 1.482_602_218_505_602;

/// Fits a line robustly: median of the slopes between pairs half the session apart (Theil 1950, with the pairing that keeps
/// it linear in time), then least squares on the pairs within five robust standard deviations, but at least `floor_us`, µs.
///
/// # Errors
/// [`LineError`] with fewer than 3 usable pairs, or no spread in time.
pub fn fit(pairs: &[Pair], floor_us: f64) -> Result<Line, LineError> {
    let n = pairs.len();
    if n < 3 {
        return Err(LineError::FewPairs { found: n });
    }
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|a, b| pairs[*a].host_us.total_cmp(&pairs[*b].host_us));
    let x0 = pairs[order[n / 2]].host_us;
    let y0 = pairs[order[n / 2]].camera_us;
    let points: Vec<(f64, f64)> = pairs
        .iter()
        .map(|p| {
            let x = p.host_us - x0;
            (x, (p.camera_us - y0) - x)
        })
        .collect();
    let half = n / 2;
    let mut slopes: Vec<f64> = (0..n - half)
        .map(|i| (points[order[i]], points[order[i + half]]))
        .filter(|(a, b)| b.0 > a.0)
        .map(|(a, b)| (b.1 - a.1) / (b.0 - a.0))
        .collect();
    let mut slope = median(&mut slopes).ok_or(LineError::NoSpread)?;
    let mut at: Vec<f64> = points.iter().map(|(x, y)| y - slope * x).collect();
    let mut intercept = median(&mut at).ok_or(LineError::NoSpread)?;
    let mut used = vec![false; n];
    for _ in 0..ROUNDS {
        let residual = |&(x, y): &(f64, f64)| y - intercept - slope * x;
        let mut sizes: Vec<f64> = points.iter().map(|p| residual(p).abs()).collect();
        let sigma = MAD_TO_SIGMA * median(&mut sizes).ok_or(LineError::NoSpread)?;
        let sigma = sigma.max(floor_us);
        let now: Vec<bool> = points
            .iter()
            .map(|p| residual(p).abs() <= OUTLIER_SIGMAS * sigma)
            .collect();
        if now == used {
            break;
        }
        used = now;
        (slope, intercept) = least_squares(&points, &used).ok_or(LineError::NoSpread)?;
    }
    let inliers: Vec<(f64, f64)> = points
        .iter()
        .zip(&used)
        .filter(|(_, u)| **u)
        .map(|(p, _)| *p)
        .collect();
    let count = inliers.len() as f64;
    let mean_x = inliers.iter().map(|p| p.0).sum::<f64>() / count;
    let spread: f64 = inliers.iter().map(|p| square(p.0 - mean_x)).sum();
    let residuals: Vec<f64> = inliers
        .iter()
        .map(|(x, y)| y - intercept - slope * x)
        .collect();
    let squares: f64 = residuals.iter().map(|r| r * r).sum();
    if inliers.len() < 3 {
        let found = inliers.len();
        return Err(LineError::FewPairs { found });
    }
    Ok(Line {
        offset_us: (y0 - x0) + intercept - slope * x0,
        drift: slope,
        drift_se: (squares / (count - 2.0) / spread).sqrt(),
        rms_us: (squares / count).sqrt(),
        max_us: residuals.iter().fold(0.0, |m, r| r.abs().max(m)),
        used,
    })
}

/// (slope, intercept) over the used points, centred; `None` without spread.
fn least_squares(points: &[(f64, f64)], used: &[bool]) -> Option<(f64, f64)> {
    let chosen = || points.iter().zip(used).filter(|(_, u)| **u).map(|(p, _)| p);
    let n = chosen().count() as f64;
    let mean_x = chosen().map(|p| p.0).sum::<f64>() / n;
    let mean_y = chosen().map(|p| p.1).sum::<f64>() / n;
    let sxx: f64 = chosen().map(|p| square(p.0 - mean_x)).sum();
    let sxy: f64 = chosen().map(|p| (p.0 - mean_x) * (p.1 - mean_y)).sum();
    (sxx > 0.0).then(|| (sxy / sxx, mean_y - sxy / sxx * mean_x))
}

fn square(x: f64) -> f64 {
    x * x
}

/// The median; `None` without values. Reorders the values.
pub(crate) fn median(values: &mut [f64]) -> Option<f64> {
    crate::metrics::quantile(values, 0.5)
}

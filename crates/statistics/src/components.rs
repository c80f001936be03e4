//! Variance components of a difference: between locations, and between repetitions at one location.

use super::comparison::Components;
use super::influence::{Measure, mean, variance};
use super::question::Pairing;
use super::sessions::SessionSpread;

/// Variance components by the method of moments (analysis of variance with locations as groups; Searle, Casella and
/// McCulloch 1992). A negative estimate between locations becomes 0.
pub(super) fn of(
    samples: &[Measure; 2],
    pairing: Pairing,
    sessions: Option<SessionSpread>,
) -> Components {
    let within = [within(&samples[0]), within(&samples[1])];
    let inverse = [0, 1].map(|i| inverse_repetitions(&samples[i]));
    let means = [means(&samples[0]), means(&samples[1])];
    let between = match pairing {
        Pairing::SharedLocations => {
            let pairs = means[0].iter().zip(&means[1]);
            let differences: Vec<f64> = pairs.map(|(a, b)| b - a).collect();
            variance(&differences)
        }
        Pairing::Independent => variance(&means[0]) + variance(&means[1]),
    };
    let noise = match within {
        [Some(a), Some(b)] => a * inverse[0] + b * inverse[1],
        _ => 0.0,
    };
    Components {
        between: (between - noise).max(0.0),
        within: within[0].zip(within[1]).map(|(a, b)| [a, b]),
        repetitions: inverse.map(|i| 1.0 / i),
        sessions,
    }
}

impl Components {
    /// Standard error of the difference over so many locations, without what varies between sessions.
    pub(super) fn error_over_locations(&self, locations: f64) -> f64 {
        let within = self.within.unwrap_or_default();
        let [a, b] = self.repetitions;
        ((self.between + within[0] / a + within[1] / b) / locations).sqrt()
    }
}

fn means(of: &Measure) -> Vec<f64> {
    of.by_location.iter().map(|(_, u)| mean(u)).collect()
}

/// Pooled variance between repetitions; `None` without repetitions.
fn within(of: &Measure) -> Option<f64> {
    let (mut squares, mut free) = (0.0, 0usize);
    for (_, values) in &of.by_location {
        let centre = mean(values);
        squares += values.iter().map(|v| (v - centre).powi(2)).sum::<f64>();
        free += values.len() - 1;
    }
    (free > 0).then(|| squares / free as f64)
}

/// Mean over locations of 1 / presses.
fn inverse_repetitions(of: &Measure) -> f64 {
    let each = of.by_location.iter().map(|(_, u)| 1.0 / u.len() as f64);
    each.sum::<f64>() / of.by_location.len() as f64
}

/// Variance of one sample between and within locations.
pub(super) fn alone(of: &Measure) -> (f64, Option<f64>) {
    let within = within(of);
    let noise = within.map_or(0.0, |w| w * inverse_repetitions(of));
    ((variance(&means(of)) - noise).max(0.0), within)
}

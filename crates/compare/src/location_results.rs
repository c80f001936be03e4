//! Owns the comparison per location: errors, vectors, ranks, and where a skin is better or worse than the first.

use serde::Serialize;
use skinrig_model::Point2;

use crate::locations::Locations;
use crate::subject::Subject;
use skinrig_statistics::{
    ComparisonTarget, ImprovementDirection, Interval, Pairing, Sample, Settings, compare,
};

/// Results of one skin at one location.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LocationComparison {
    /// Mean error length of the counting presses, mm.
    pub error_mm: Option<f64>,
    /// Mean error vector, skin frame, mm.
    pub vector_mm: Option<[f64; 2]>,
    /// Counting presses, and attempted presses.
    pub presses: [u32; 2],
    /// Rank of this location by mean error within the skin; 1 is the smallest.
    pub rank: Option<u32>,
    /// Mean error minus that of the first skin, mm, with a 95 % interval (Welch, presses as repetitions). The interval is
    /// open when a skin has fewer than two presses.
    pub difference_mm: Option<Interval>,
}

/// Results of all skins at one location.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Location {
    /// Planned position, skin frame.
    pub at: Point2,
    /// One entry per skin, in the order of the comparison.
    pub skins: Vec<LocationComparison>,
}

impl LocationComparison {
    /// -1 if better than the first skin, 1 if worse, 0 if the interval includes zero or is open.
    #[must_use]
    pub fn sign(&self) -> i8 {
        match self.difference_mm {
            Some(Interval {
                high: Some(high), ..
            }) if high < 0.0 => -1,
            Some(Interval { low: Some(low), .. }) if low > 0.0 => 1,
            _ => 0,
        }
    }
}

pub(crate) fn compare_locations(
    subjects: &[Subject],
    locations: &Locations,
    settings: &Settings,
) -> Vec<Location> {
    let mut lengths: Vec<Vec<Vec<f64>>> = vec![vec![Vec::new(); subjects.len()]; locations.len()];
    let mut all: Vec<Location> = (0..locations.len())
        .map(|i| Location {
            at: locations.at(i as u32),
            skins: vec![
                LocationComparison {
                    error_mm: None,
                    vector_mm: None,
                    presses: [0, 0],
                    rank: None,
                    difference_mm: None,
                };
                subjects.len()
            ],
        })
        .collect();
    for (k, subject) in subjects.iter().enumerate() {
        let mut sums = vec![[0.0; 2]; locations.len()];
        for attempt in locations.attempts(subject) {
            let i = attempt.location as usize;
            let skin_result = &mut all[i].skins[k];
            skin_result.presses[1] += 1;
            if let Some((x, y)) = attempt.error() {
                skin_result.presses[0] += 1;
                lengths[i][k].push(libm::hypot(x, y));
                sums[i][0] += x;
                sums[i][1] += y;
            }
        }
        for (i, location) in all.iter_mut().enumerate() {
            let n = lengths[i][k].len() as f64;
            if n > 0.0 {
                location.skins[k].error_mm = Some(lengths[i][k].iter().sum::<f64>() / n);
                location.skins[k].vector_mm = Some(sums[i].map(|s| s / n));
            }
        }
        let mut order: Vec<(f64, usize)> = all
            .iter()
            .enumerate()
            .filter_map(|(i, l)| Some((l.skins[k].error_mm?, i)))
            .collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (rank, (_, i)) in (1..).zip(order) {
            all[i].skins[k].rank = Some(rank);
        }
    }
    for (location, lengths) in all.iter_mut().zip(&lengths) {
        for k in 1..subjects.len() {
            location.skins[k].difference_mm = difference(&lengths[0], &lengths[k], settings);
        }
    }
    // Drop locations that no skin attempted at the shared depths.
    all.retain(|l| l.skins.iter().any(|s| s.presses[1] > 0));
    all
}

/// Mean of `b` minus mean of `a`; every press is independent here.
fn difference(a: &[f64], b: &[f64], settings: &Settings) -> Option<Interval> {
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    if a.is_empty() || b.is_empty() {
        return None;
    }
    let alone = Interval {
        value: mean(b) - mean(a),
        low: None,
        high: None,
    };
    let sample = |v: &[f64]| Sample::mean((0..).zip(v.iter().copied()));
    let question = ComparisonTarget {
        better: ImprovementDirection::Lower,
        margin: None,
    };
    let settings = Settings {
        pairing: Pairing::Independent,
        ..*settings
    };
    let compared = sample(a).ok().zip(sample(b).ok());
    let compared = compared.and_then(|(a, b)| compare(&a, &b, &question, &settings).ok());
    Some(compared.map_or(alone, |c| c.difference))
}

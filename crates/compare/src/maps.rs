//! Owns the comparison location by location: errors, vectors, ranks, and where one skin is better than the first.

use serde::Serialize;
use skinrig_model::Point2;

use crate::places::Places;
use crate::statistics::{Better, Interval, Pairing, Question, Sample, Settings, compare};
use crate::subject::Subject;

/// What one skin does at one location.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Here {
    /// Mean length of the errors of the presses that count, mm.
    pub error_mm: Option<f64>,
    /// Mean error vector, mm.
    pub vector_mm: Option<[f64; 2]>,
    /// Presses that count, and attempted ones.
    pub presses: [u32; 2],
    /// Its place among the locations of this skin by mean error, 1 the smallest.
    pub rank: Option<u32>,
    /// Mean error less that of the first skin with its 95 % interval (Welch, presses as repetitions), mm; without one where
    /// a skin has fewer than two presses.
    pub difference_mm: Option<Interval>,
}

/// A location.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Location {
    /// Planned position.
    pub at: Point2,
    /// Each skin.
    pub skins: Vec<Here>,
}

impl Here {
    /// -1 where better than the first skin, 1 where worse, 0 where the interval has zero in it.
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

pub(crate) fn locations(
    subjects: &[Subject],
    places: &Places,
    settings: &Settings,
) -> Vec<Location> {
    let mut lengths: Vec<Vec<Vec<f64>>> = vec![vec![Vec::new(); subjects.len()]; places.len()];
    let mut all: Vec<Location> = (0..places.len())
        .map(|i| Location {
            at: places.at(i as u32),
            skins: vec![
                Here {
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
        let mut sums = vec![[0.0; 2]; places.len()];
        for attempt in places.attempts(subject) {
            let i = attempt.place as usize;
            let here = &mut all[i].skins[k];
            here.presses[1] += 1;
            if let Some((x, y)) = attempt.error() {
                here.presses[0] += 1;
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
    // What no skin attempted at the shared depths is no location of this comparison.
    all.retain(|l| l.skins.iter().any(|s| s.presses[1] > 0));
    all
}

/// Mean of `b` less mean of `a`, each press on its own.
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
    let question = Question {
        better: Better::Lower,
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

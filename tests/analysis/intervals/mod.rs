//! Calibration of the intervals of the metrics: how often sessions drawn from a population cover its true values, by kind of
//! session. `README.md` has the table that the long battery prints.

mod populations;

use rayon::prelude::*;

use populations::{METRICS, Population};

/// Kinds of sessions.
const POPULATIONS: [Population; 8] = [
    Population::USUAL,
    Population {
        name: "25 locations, 2 repetitions",
        places: 25,
        ..Population::USUAL
    },
    Population {
        name: "10 locations, 3 repetitions",
        places: 10,
        repetitions: 3,
        ..Population::USUAL
    },
    Population {
        name: "5 locations, 3 repetitions",
        places: 5,
        repetitions: 3,
        ..Population::USUAL
    },
    Population {
        name: "25 locations, 1 repetition",
        places: 25,
        repetitions: 1,
        ..Population::USUAL
    },
    Population {
        name: "25 locations, a third fails",
        places: 25,
        failing: 0.33,
        ..Population::USUAL
    },
    Population {
        name: "25 locations, heavy tails",
        places: 25,
        outlying: 0.1,
        ..Population::USUAL
    },
    Population {
        name: "100 locations, heavy tails",
        outlying: 0.1,
        ..Population::USUAL
    },
];

/// Sessions of a population whose interval of one metric is above, below or about the true value.
#[derive(Debug, Clone, Copy, Default)]
struct Counts {
    /// The whole interval is above the true value.
    above: u32,
    below: u32,
    about: u32,
}

impl Counts {
    fn all(&self) -> u32 {
        self.above + self.below + self.about
    }

    fn coverage(&self) -> f64 {
        f64::from(self.about) / f64::from(self.all())
    }
}

/// Counts of every metric over `sessions` sessions; none for a metric without an interval.
fn measure(population: &Population, sessions: u64) -> [Counts; METRICS.len()] {
    let truth = population.truth();
    let each: Vec<_> = (0..sessions)
        .into_par_iter()
        .map(|number| population.session(number + 1))
        .collect();
    std::array::from_fn(|k| {
        let mut counts = Counts::default();
        for estimate in each.iter().map(|e| e[k]) {
            let (Some(truth), Some(low), Some(high)) = (truth[k], estimate.low, estimate.high)
            else {
                continue;
            };
            match (low > truth, high < truth) {
                (true, _) => counts.above += 1,
                (_, true) => counts.below += 1,
                _ => counts.about += 1,
            }
        }
        counts
    })
}

/// A sample of the battery: few locations, where percentiles of a bootstrap covered 82 % to 91 %.
#[test]
fn ten_locations_have_intervals_of_95_percent() {
    let found = measure(&POPULATIONS[2], 400);
    for (name, counts) in METRICS.iter().zip(found) {
        // Where hardly any press fails, shares have no spread and are cautious.
        let cautious = ["located", "within 5 mm", "RMSE with failures"];
        if *name == "95th percentile" {
            assert_eq!(counts.all(), 0);
            continue;
        }
        assert_eq!(counts.all(), 400, "{name}");
        let most = if cautious.contains(name) { 1.0 } else { 0.98 };
        let coverage = counts.coverage();
        assert!((0.91..=most).contains(&coverage), "{name}: {coverage}");
    }
}

#[test]
#[ignore = "half a minute: SKINRIG_CI_LONG=1 .ci/run, or cargo test --release -p skinrig-analysis-tests -- --ignored --nocapture table_of_metrics"]
fn table_of_metrics() {
    const SESSIONS: u64 = 500;
    println!("| sessions | {} |", METRICS.join(" | "));
    println!("|---|{}", "---|".repeat(METRICS.len()));
    // Below the least of these rows: what is known not to hold may not get worse.
    for population in &POPULATIONS {
        let found = measure(population, SESSIONS);
        for (name, counts) in METRICS.iter().zip(found).filter(|(_, c)| c.all() >= 100) {
            let outliers = name.starts_with("RMSE") && population.outlying > 0.0;
            let least = if outliers { 0.76 } else { 0.88 };
            let coverage = counts.coverage();
            assert!(coverage >= least, "{}: {name}: {coverage}", population.name);
        }
        let cells = found.map(|c| {
            if c.all() == 0 {
                return "-".to_owned();
            }
            let percent = |n: u32| 100.0 * f64::from(n) / f64::from(c.all());
            format!(
                "{:.1} ({:.1}/{:.1})",
                percent(c.about),
                percent(c.above),
                percent(c.below)
            )
        });
        println!("| {} | {} |", population.name, cells.join(" | "));
    }
}

//! Coverage of intervals and error rates of tests on simulated skins; treating presses as independent fails the same checks.

use skinrig_statistics::{ComparisonTarget, Kind, Pairing, Settings, Verdict, compare};

use crate::populations::{Draws, SimulatedPair};

/// Shares among the populations that could be compared.
#[derive(Debug, Default, Clone, Copy)]
pub(crate) struct Rates {
    /// The interval of the difference covers the truth.
    pub covered: f64,
    /// Claimed to differ.
    pub differ: f64,
    /// Claimed to be equivalent.
    pub equivalent: f64,
    /// Share of all populations that could not be compared.
    pub refused: f64,
}

/// How populations are drawn and compared.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Trial {
    pub pair: SimulatedPair,
    pub populations: u32,
    /// Treats presses as independent.
    pub naive: bool,
    pub pairing: Pairing,
    pub resamples: u32,
}

impl Trial {
    pub(crate) fn new(pair: SimulatedPair) -> Self {
        Self {
            pair,
            populations: 300,
            naive: false,
            pairing: Pairing::SharedLocations,
            resamples: 199,
        }
    }

    /// Compares pairs of skins. The margin equals the true difference, if there is one.
    pub(crate) fn rates(&self) -> Rates {
        let [a, b] = self.pair.truth();
        let truth = b - a;
        let question = ComparisonTarget {
            better: self.pair.better(),
            margin: (truth != 0.0).then_some(truth.abs()),
        };
        let settings = Settings {
            resamples: self.resamples,
            pairing: self.pairing,
            ..Settings::default()
        };
        let (mut rates, mut compared) = (Rates::default(), 0.0);
        for population in 0..self.populations {
            let mut draws = Draws::new(7, u64::from(population));
            let [a, mut b] = self.pair.draw(&mut draws, self.naive);
            if self.pairing == Pairing::Independent {
                [_, b] = self.pair.draw(&mut draws, self.naive);
            }
            let Ok(found) = compare(&a, &b, &question, &settings) else {
                rates.refused += 1.0 / f64::from(self.populations);
                continue;
            };
            compared += 1.0;
            let i = found.difference;
            if i.low.is_none_or(|l| l <= truth) && i.high.is_none_or(|h| h >= truth) {
                rates.covered += 1.0;
            }
            match found.verdict {
                Verdict::Better | Verdict::Worse => rates.differ += 1.0,
                Verdict::Equivalent => rates.equivalent += 1.0,
                Verdict::Undecided => {}
            }
        }
        for share in [&mut rates.covered, &mut rates.differ, &mut rates.equivalent] {
            *share /= compared;
        }
        rates
    }

    /// Three standard errors of a share of 5 % of the populations.
    fn band(&self) -> f64 {
        3.0 * (0.05 * 0.95 / f64::from(self.populations)).sqrt()
    }

    /// True if all error rates are nominal: without a difference, and with a difference as large as the margin.
    fn holds(&self, none: Rates, border: Rates) -> bool {
        let most = 0.05 + self.band();
        none.refused.max(border.refused) < 0.02
            && 1.0 - none.covered < most
            && 1.0 - border.covered < most
            && none.differ < most
            && border.equivalent < most
    }
}

fn levels_hold(trial: Trial) {
    let levels = |trial: Trial| {
        let pair = trial.pair.shifted();
        (trial.rates(), Trial { pair, ..trial }.rates())
    };
    let (none, border) = levels(trial);
    assert!(trial.holds(none, border), "{trial:?}\n{none:?}\n{border:?}");
    // A method that never claims anything must fail too.
    assert!(
        none.covered < 0.995 && border.differ > 0.1,
        "{none:?}\n{border:?}"
    );
    // Half of the populations suffice to show that the naive method fails.
    let naive = Trial {
        naive: true,
        populations: trial.populations / 2,
        ..trial
    };
    let (none, border) = levels(naive);
    assert!(
        !naive.holds(none, border),
        "{naive:?}\n{none:?}\n{border:?}"
    );
}

#[test]
fn of_a_mean() {
    levels_hold(Trial::new(SimulatedPair::new(Kind::Mean)));
}

#[test]
fn of_an_rmse() {
    levels_hold(Trial::new(SimulatedPair::new(Kind::Rms)));
}

#[test]
fn of_an_rmse_at_a_handful_of_locations() {
    levels_hold(Trial::new(SimulatedPair {
        locations: 7,
        ..SimulatedPair::new(Kind::Rms)
    }));
}

#[test]
fn of_an_rmse_at_different_places() {
    levels_hold(Trial {
        pairing: Pairing::Independent,
        ..Trial::new(SimulatedPair::new(Kind::Rms))
    });
}

#[test]
fn of_taxels() {
    levels_hold(Trial::new(SimulatedPair::new(Kind::Taxels)));
}

#[test]
fn of_the_std_between_repetitions() {
    levels_hold(Trial::new(SimulatedPair::new(Kind::RepeatStd)));
}

#[test]
fn of_a_share() {
    levels_hold(Trial::new(SimulatedPair::new(Kind::Share)));
}

#[test]
fn of_a_share_at_different_places() {
    levels_hold(Trial {
        pairing: Pairing::Independent,
        ..Trial::new(SimulatedPair::new(Kind::Share))
    });
}

#[test]
fn of_a_median_latency() {
    levels_hold(Trial::new(SimulatedPair::new(Kind::Median)));
}

#[test]
fn of_a_95th_percentile() {
    levels_hold(Trial::new(SimulatedPair {
        locations: 100,
        ..SimulatedPair::new(Kind::Percentile95)
    }));
}

#[test]
fn of_the_width_of_latencies() {
    levels_hold(Trial::new(SimulatedPair {
        locations: 40,
        ..SimulatedPair::new(Kind::Width)
    }));
}

#[test]
fn of_a_rate_of_counts() {
    levels_hold(Trial::new(SimulatedPair::new(Kind::CountRate)));
}

#[test]
fn of_a_rate_of_hardly_any_counts() {
    let trial = Trial::new(SimulatedPair {
        rate_per_s: 0.02,
        ..SimulatedPair::new(Kind::CountRate)
    });
    let none = trial.rates();
    assert!(none.differ < 0.05 + trial.band(), "{none:?}");
    assert!(1.0 - none.covered < 0.05 + trial.band(), "{none:?}");
}

/// The table of `docs/explanation/comparison.md`.
#[test]
#[ignore = "takes minutes: SKINRIG_CI_LONG=1 .ci/run, or cargo test -p skinrig-statistics -- --ignored --nocapture"]
fn table_of_levels() {
    println!(
        "| metric | locations | covered, no difference | covered | type I, differ | type I, equivalent | naive covered | naive type I |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for (kind, name) in [
        (Kind::Mean, "mean (bias)"),
        (Kind::Rms, "RMSE"),
        (Kind::Taxels, "taxels"),
        (Kind::RepeatStd, "std between repetitions"),
        (Kind::Share, "share"),
        (Kind::Median, "median latency"),
        (Kind::Width, "latency width"),
        (Kind::CountRate, "count rate"),
    ] {
        for locations in [8, 24, 60] {
            let pair = SimulatedPair {
                locations,
                ..SimulatedPair::new(kind)
            };
            let trial = Trial {
                populations: 1000,
                ..Trial::new(pair)
            };
            let none = trial.rates();
            let border = Trial {
                pair: pair.shifted(),
                ..trial
            }
            .rates();
            let naive = Trial {
                naive: true,
                populations: 200,
                ..trial
            }
            .rates();
            println!(
                "| {name} | {locations} | {:.3} | {:.3} | {:.3} | {:.3} | {:.3} | {:.3} |",
                none.covered,
                border.covered,
                none.differ,
                border.equivalent,
                naive.covered,
                naive.differ
            );
            assert!(none.covered > 0.92 && none.differ < 0.08, "{none:?}");
            assert!(
                border.covered > 0.92 && border.equivalent < 0.08,
                "{border:?}"
            );
        }
    }
}

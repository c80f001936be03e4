//! How often intervals cover and tests err on simulated skins, and that presses taken as independent fail the same checks.

use skinrig_compare::statistics::{Kind, Question, Settings, Verdict, compare};

use crate::populations::{Draws, World};

/// Shares of populations.
#[derive(Debug, Default, Clone, Copy)]
struct Rates {
    /// The interval of the difference covers the truth.
    covered: f64,
    /// Claimed to differ.
    differ: f64,
    /// Claimed to be equivalent.
    equivalent: f64,
    /// Nothing could be compared.
    refused: f64,
}

/// Compares `populations` pairs of skins. The margin is what they differ by, or (without a difference) nothing.
fn rates(world: World, populations: u32, naive: bool) -> Rates {
    let [a, b] = world.truth();
    let truth = b - a;
    let question = Question {
        better: world.better(),
        margin: (truth != 0.0).then_some(truth.abs()),
    };
    let settings = Settings {
        resamples: 399,
        ..Settings::default()
    };
    let mut rates = Rates::default();
    let share = 1.0 / f64::from(populations);
    for population in 0..populations {
        let mut draws = Draws::new(7, u64::from(population));
        let [a, b] = world.draw(&mut draws, naive);
        let Ok(found) = compare(&a, &b, &question, &settings) else {
            rates.refused += share;
            continue;
        };
        let i = found.difference;
        if i.low.is_none_or(|l| l <= truth) && i.high.is_none_or(|h| h >= truth) {
            rates.covered += share;
        }
        match found.verdict {
            Verdict::Better | Verdict::Worse => rates.differ += share,
            Verdict::Equivalent => rates.equivalent += share,
            Verdict::Undecided => {}
        }
    }
    rates
}

#[test]
fn print_them() {
    for kind in [
        Kind::Mean,
        Kind::Rms,
        Kind::Taxels,
        Kind::RepeatStd,
        Kind::Share,
        Kind::Median,
        Kind::Width,
        Kind::CountRate,
    ] {
        for k in [6, 12, 24, 60] {
            let world = World {
                locations: k,
                ..World::new(kind)
            };
            let n = 1000;
            let null = rates(world, n, false);
            let border = rates(world.shifted(), n, false);
            let naive = rates(world, n, true);
            println!(
                "{kind:?} {k}: covered {:.3} {:.3} type I {:.3} equivalent {:.3} power {:.3} refused {:.3}; naive {:.3} {:.3}",
                null.covered,
                border.covered,
                null.differ,
                border.equivalent,
                border.differ,
                border.refused,
                naive.covered,
                naive.differ
            );
        }
    }
}

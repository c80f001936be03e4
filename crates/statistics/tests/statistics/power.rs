//! Tests that proposed designs have the requested power.

use skinrig_statistics::power::{Target, measure, plan};
use skinrig_statistics::{
    ComparisonError, ComparisonTarget, ImprovementDirection, Kind, PressesNeeded, Sample, Settings,
    Verdict, compare,
};

use crate::levels::Trial;
use crate::populations::{Draws, NOISE, OWN, SHARED, SimulatedPair};

/// A session with enough locations to know its variances.
fn pilot(kind: Kind) -> Sample {
    let pair = SimulatedPair {
        locations: 2000,
        ..SimulatedPair::new(kind)
    };
    let [a, _] = pair.draw(&mut Draws::new(5, 0), false);
    a
}

fn target(difference: f64) -> Target {
    Target {
        difference,
        power: 0.8,
        alpha: 0.05,
        common: SHARED * SHARED / (SHARED * SHARED + OWN * OWN),
        scatter: 1.0,
        counting: 1.0,
        seconds_per_press: Some(7.0),
    }
}

#[test]
fn variance_components_are_recovered() {
    let found = measure(&pilot(Kind::Mean)).unwrap();
    let between = SHARED * SHARED + OWN * OWN;
    assert!((found.between - between).abs() < 0.1 * between, "{found:?}");
    let within = found.within.unwrap();
    assert!((within - NOISE * NOISE).abs() < 0.05 * within, "{found:?}");
}

#[test]
fn a_plan_has_the_requested_power() {
    for kind in [Kind::Mean, Kind::Rms] {
        let pair = SimulatedPair::new(kind).shifted();
        let [a, b] = pair.truth();
        let measured = measure(&pilot(kind)).unwrap();
        let difference = (b - a).abs();
        // B has larger errors and more scatter.
        let scatter = match kind {
            Kind::Rms => 1.0 + difference / measured.value,
            _ => 1.0,
        };
        let target = Target {
            scatter,
            ..target(difference)
        };
        let plan = plan(&measured, &target).unwrap();
        // Not all of the errors of B grow.
        let slack = if kind == Kind::Rms { 0.1 } else { 0.0 };
        for proposal in [plan.proposals[plan.cheapest], plan.proposals[3]] {
            let trial = Trial::new(SimulatedPair {
                locations: proposal.locations,
                repetitions: proposal.repetitions,
                ..pair
            });
            let power = trial.rates().differ;
            let band = 3.0 * (0.8 * 0.2 / f64::from(trial.populations)).sqrt();
            assert!(
                power > 0.8 - band && power < 0.8 + band + slack,
                "{kind:?} {proposal:?}: {power}"
            );
        }
    }
}

#[test]
fn proposals_trade_locations_for_repetitions() {
    let measured = measure(&pilot(Kind::Mean)).unwrap();
    let found = plan(&measured, &target(0.4)).unwrap();
    for pair in found.proposals.windows(2) {
        assert!(pair[0].repetitions < pair[1].repetitions);
        assert!(pair[0].locations >= pair[1].locations && pair[0].presses < pair[1].presses);
    }
    // A press at a new location always adds more information than a repetition.
    assert_eq!(found.cheapest, 0);
    let one = found.proposals[0];
    assert_eq!(one.seconds, Some(7.0 * f64::from(one.presses)));
    assert!(one.half_width < 0.4);
    // Where a fifth of the locations is lost, the rest is as many as needed.
    let lossy = Target {
        counting: 0.8,
        ..target(0.4)
    };
    let lossy = plan(&measured, &lossy).unwrap().proposals[0];
    assert_eq!(
        lossy.locations,
        (f64::from(one.locations) / 0.8).ceil() as u32
    );
    assert_eq!(lossy.half_width, one.half_width);
    let finer = plan(&measured, &target(0.2)).unwrap().proposals[0];
    assert!((3.5..4.2).contains(&(f64::from(finer.locations) / f64::from(one.locations))));
}

#[test]
fn a_target_out_of_range_is_refused() {
    let measured = measure(&pilot(Kind::Mean)).unwrap();
    for wrong in [
        Target {
            difference: 0.0,
            ..target(1.0)
        },
        Target {
            power: 1.0,
            ..target(1.0)
        },
        // As likely as a false alarm.
        Target {
            power: 0.05,
            ..target(1.0)
        },
        Target {
            alpha: 0.0,
            ..target(1.0)
        },
        Target {
            common: f64::NAN,
            ..target(1.0)
        },
        Target {
            counting: 0.0,
            ..target(1.0)
        },
        target(1e-6),
    ] {
        let found = plan(&measured, &wrong);
        assert!(
            matches!(found, Err(ComparisonError::Setting { .. })),
            "{found:?}"
        );
    }
}

/// `copies` times the same 10 locations: the same difference and variance, known more precisely.
fn copies(copies: u32, shift: f64) -> [Sample; 2] {
    let mut sides: [Vec<(u32, f64)>; 2] = [Vec::new(), Vec::new()];
    for copy in 0..copies {
        let mut draws = Draws::new(21, 0);
        for location in 0..10 {
            for (side, values) in [0.0, 1.0].into_iter().zip(&mut sides) {
                let place = draws.normal();
                let at = copy * 10 + location;
                values.extend((0..2).map(|_| (at, side * shift + place + 0.2 * draws.normal())));
            }
        }
    }
    sides.map(|v| Sample::mean(v).unwrap())
}

#[test]
fn a_required_design_decides() {
    let settings = Settings::default();
    for (shift, margin) in [(0.5, None), (-0.3, Some(1.0))] {
        let question = ComparisonTarget {
            better: ImprovementDirection::Lower,
            margin,
        };
        let ask = |n: u32| {
            let [a, b] = copies(n, shift);
            compare(&a, &b, &question, &settings).unwrap()
        };
        let now = ask(1);
        assert_eq!(now.verdict, Verdict::Undecided, "{now:?}");
        let PressesNeeded::More(enough) = now.needed else {
            panic!("{now:?}");
        };
        assert!(enough.locations > 10);
        assert_eq!(
            enough.more_presses_by_locations,
            2 * (enough.locations - 10)
        );
        let then = ask(enough.locations.div_ceil(10));
        assert_eq!(then.verdict, enough.towards, "{enough:?} {then:?}");
        assert_eq!(then.needed, PressesNeeded::Nothing);
    }
}

/// The present number of repetitions did not decide: the advice is never to make as many.
#[test]
fn more_repetitions_are_more_than_there_are() {
    let mut advised = 0;
    for seed in 0..60 {
        let mut draws = Draws::new(seed, 0);
        let [a, b] = [0.0, 0.4].map(|mean| {
            let presses = (0..10).flat_map(|location| [(location, mean); 2]);
            let noisy = presses.map(|(at, mean)| (at, mean + draws.normal()));
            Sample::mean(noisy.collect::<Vec<_>>()).unwrap()
        });
        let question = ComparisonTarget {
            better: ImprovementDirection::Lower,
            margin: None,
        };
        let found = compare(&a, &b, &question, &Settings::default()).unwrap();
        let PressesNeeded::More(needed) = found.needed else {
            continue;
        };
        let Some(repetitions) = needed.repetitions else {
            continue;
        };
        advised += 1;
        assert!(repetitions > 2, "{needed:?}");
        let more = 10 * (repetitions - 2);
        assert_eq!(needed.more_presses_by_repetitions, Some(more));
    }
    assert!(advised > 5, "{advised}");
}

/// If every press of both skins was located, the interval is too wide for the margin and no
/// difference can be shown.
#[test]
fn values_that_do_not_vary_promise_no_verdict() {
    let side = || {
        let presses = (0..20).flat_map(|location| [(location, true); 3]);
        Sample::share(presses)
    };
    let question = ComparisonTarget {
        better: ImprovementDirection::Higher,
        margin: Some(0.01),
    };
    let found = compare(&side(), &side(), &question, &Settings::default()).unwrap();
    assert_eq!(found.verdict, Verdict::Undecided, "{found:?}");
    assert_eq!(found.needed, PressesNeeded::Unknown, "{found:?}");
}

//! How often the intervals of twins hold, and how well they rank places: each simulated skin in turn is the session, the other ones
//! are the skins.

use skinrig_compare::scene::SessionFigure;
use skinrig_compare::twin::{
    CalibrationFigure, Interval, OUTCOMES, Observed, SkinDraw, Twin, TwinConstant, twin,
};

use super::skins::draw;
use crate::library::ProtocolSource;
use crate::scene::replicates::{Replicates, each};

const PROTOCOL: &str = "skinrig: 1
name: twins
operator: tests
prototype: {id: none}
sync: {count: 3, interval: 1.5 s, at: [10 mm, 2 mm], pause_after: 1 s}
path: {meander: {origin: [-24 mm, -24 mm], pitch: 12 mm, columns: 5, rows: 5, line_direction: y}}
repetitions: {count: 3, between: {return_to_start: true, pause: 1 s}}
depth: 2 mm
motion: {period: 3 s, hold: 150 ms}
limits:
  workspace: {min: [-40 mm, -48 mm, -4 mm], max: [60 mm, 52 mm, 30 mm]}
  max_depth: 3.5 mm
  max_speed: 100 mm/s
  max_force: 5 N
triggers: {marks: [contact, retract]}
evaluation: {calibrate: [1], score: [2, 3]}
analysis: {study_presses: 0}
";

/// Twins, unless `SKINRIG_TWINS` names another number.
const TWINS: u32 = 200;
/// Change of the protocol, unless `SKINRIG_CHANGES` names others, separated by `;`.
const CHANGES: &str = "depth=3mm";

fn variable(name: &str, otherwise: &str) -> String {
    std::env::var(name).unwrap_or_else(|_| otherwise.to_owned())
}

/// Counts of held intervals.
#[derive(Default)]
struct Held {
    held: u32,
    n: u32,
}

impl Held {
    fn add(&mut self, interval: Interval, value: f64) {
        self.held += u32::from((interval.low..=interval.high).contains(&value));
        self.n += 1;
    }

    fn percent(&self) -> f64 {
        100.0 * f64::from(self.held) / f64::from(self.n)
    }
}

fn observed(skin: &SkinDraw) -> Observed {
    Observed {
        figures: skin.figures.clone(),
        outcomes: skin.outcomes.clone(),
        places: skin.places.clone(),
    }
}

/// Prints the intervals of one kind of value, and adds them to those of all.
fn row(name: &str, held: &Held, all: &mut Held) {
    println!("{name}: {:.1} % of {}", held.percent(), held.n);
    all.held += held.held;
    all.n += held.n;
    // 95 % and three binomial standard errors of 200.
    assert!(
        held.n < 100 || (90.0..=99.7).contains(&held.percent()),
        "{name}"
    );
}

#[test]
#[ignore = "minutes: SKINRIG_CI_LONG=1 .ci/run, or cargo test --release -p skinrig --lib twin::calibration -- --ignored --nocapture"]
fn intervals_of_two_hundred_twins() {
    let changes: Vec<String> = variable("SKINRIG_CHANGES", CHANGES)
        .split(';')
        .map(str::to_owned)
        .collect();
    let n: u32 = variable("SKINRIG_TWINS", &TWINS.to_string())
        .parse()
        .expect("a number");
    let own = Replicates {
        protocol: ProtocolSource::Text(PROTOCOL.to_owned()),
        overrides: Vec::new(),
        changed: Vec::new(),
        level: None,
        folder: std::env::temp_dir(),
        command_line: "",
    };
    let seeds: Vec<u64> = (1..=u64::from(n)).collect();
    let simulated = each(&seeds, "simulating skins", |seed| {
        draw(&own, &changes, seed)
    });
    let simulated = simulated.expect("simulated skins");
    println!(
        "{} skins, {} failed",
        simulated.found.len(),
        simulated.failed.len()
    );
    let skins: Vec<SkinDraw> = simulated.found.into_iter().map(|(_, skin)| skin).collect();
    let twins: Vec<(&SkinDraw, Twin)> = skins
        .iter()
        .enumerate()
        .filter_map(|(k, skin)| {
            let others = skins.iter().enumerate().filter(|(other, _)| *other != k);
            let others: Vec<SkinDraw> = others.map(|(_, skin)| skin.clone()).collect();
            Some((skin, twin(&observed(skin), &others).ok()?))
        })
        .collect();
    let fitted = twins.len();
    let twins: Vec<_> = twins
        .into_iter()
        .filter(|(_, twin)| twin.is_like())
        .collect();
    let unlike = fitted - twins.len();
    println!("{} twins, {unlike} told to be unlike", twins.len());
    let mut all = Held::default();
    for constant in TwinConstant::ALL {
        let (mut held, mut explained, mut rank_sum) = (Held::default(), 0.0, 0.0);
        for (skin, twin) in &twins {
            let k = TwinConstant::ALL
                .iter()
                .position(|c| *c == constant)
                .expect("listed");
            let fit = twin
                .constants
                .iter()
                .find(|fit| fit.constant == constant)
                .expect("fitted");
            held.add(fit.value, constant.at(skin.shares[k]));
            explained += fit.explained / twins.len() as f64;
            let below = fit
                .draws
                .iter()
                .filter(|draw| **draw < skin.shares[k])
                .count();
            rank_sum += below as f64 / fit.draws.len() as f64 / twins.len() as f64;
        }
        let name = format!("{constant:?} (explained {explained:.2}, mean rank {rank_sum:.2})");
        row(&name, &held, &mut all);
    }
    let of_outcome = |figure: SessionFigure, changed: bool| {
        let mut held = Held::default();
        let mut widths = Vec::new();
        for (skin, twin) in &twins {
            let row = twin
                .outcomes
                .iter()
                .find(|row| row.figure == figure)
                .expect("listed");
            let truth = if changed {
                skin.changed.as_ref()
            } else {
                Some(&skin.outcomes)
            };
            let interval = if changed { row.changed } else { row.predicted };
            let truth = truth.and_then(|outcomes| outcomes.get(figure));
            if let (Some(interval), Some(truth)) = (interval, truth) {
                held.add(interval, truth);
                widths.push(interval.high / interval.low.max(1e-9));
            }
        }
        widths.sort_by(f64::total_cmp);
        (held, widths.get(widths.len() / 2).copied())
    };
    for figure in OUTCOMES {
        for (changed, words) in [(false, "held out"), (true, "changed")] {
            let (held, width) = of_outcome(figure, changed);
            let name = format!(
                "{figure:?}, {words} (median high / low {:.2})",
                width.unwrap_or(f64::NAN)
            );
            row(&name, &held, &mut all);
        }
    }
    let correlations = twins
        .iter()
        .filter_map(|(_, twin)| twin.places.as_ref()?.correlation);
    let mut correlations: Vec<f64> = correlations.collect();
    correlations.sort_by(f64::total_cmp);
    let at = |q: f64| correlations[((correlations.len() - 1) as f64 * q) as usize];
    println!(
        "rank correlation by place: median {:.2}, 10 to 90 % of {} skins: {:.2} to {:.2}",
        at(0.5),
        correlations.len(),
        at(0.1),
        at(0.9)
    );
    println!("all intervals: {:.1} % of {}", all.percent(), all.n);
    assert!((93.0..=97.5).contains(&all.percent()), "{}", all.percent());
    assert!(unlike * 20 <= twins.len(), "{unlike}");
    assert_eq!(skins[0].figures.values.len(), CalibrationFigure::ALL.len());
}

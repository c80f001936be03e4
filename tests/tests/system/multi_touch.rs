//! Two touches at once on optically simulated skins: how often they are separated, located, paired wrongly or left
//! ambiguous.
#![expect(clippy::print_stdout, reason = "shows the rates that docs state")]

use skinrig_analysis::locator::{Features, FittedLocator};
use skinrig_analysis::multi_touch::{
    Separation, Separator, SingleTouch, TouchEvent, TouchSight, TouchTimes,
};
use skinrig_analysis::result::Analysis;
use skinrig_analysis::{SessionInput, analyze};
use skinrig_model::{
    AnalysisSettings, CameraId, CdEvent, HostTime, MarkKind, Point2, Point3, PressRole,
    RigGeometry, SimLevel, Skin,
};
use skinrig_planted::{Memory, PlantedPress, mark, press, timing};
use skinrig_sim::SimConfig;
use skinrig_sim::optical::OpticalModel;
use skinrig_sim::scene::GRID_NS;
use skinrig_statistics::seeded;

const PERIOD_S: f64 = 2.5;
const HOLD_S: f64 = 0.15;
const DEPTH_MM: f64 = 2.0;
const SPEED_MM_S: f64 = 20.0;
/// Area of the published grid, mm.
const AREA: [[f64; 2]; 2] = [[-22.0, 34.0], [-30.0, 34.0]];
/// Least distance of a pair, mm.
const APART_MM: f64 = 15.0;
/// Onset differences of pairs, ms; spread evenly on a logarithmic scale.
const ONSETS_MS: [f64; 2] = [2.0, 25.0];
/// Touches farther than this from both true ones are ghosts, mm.
const GHOST_MM: f64 = 7.5;
/// Height of a tip that does not touch above the one that does, mm.
const OFF_MM: f64 = 5.0;
/// Permitted error in units of the single-touch RMSE.
const WITHIN: f64 = 1.5;

#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Calibrate,
    Score,
    /// Second touch after so many ms.
    Pair {
        at: [f64; 2],
        after_ms: f64,
    },
}

#[derive(Debug, Clone, Copy)]
struct Press {
    at: [f64; 2],
    kind: Kind,
    contact_s: f64,
}

/// Presses of one simulated session.
#[derive(Debug, Clone, Copy)]
struct Bench {
    seed: u64,
    calibrating: usize,
    scored: usize,
    pairs: usize,
    simultaneous: usize,
}

impl Bench {
    fn presses(&self) -> Vec<Press> {
        let mut rng = seeded::generator(self.seed, 47);
        let mut unit = move || 0.5 * (seeded::signed_unit(&mut rng) + 1.0);
        let place = |unit: &mut dyn FnMut() -> f64| AREA.map(|[a, b]| a + (b - a) * unit());
        let mut presses = Vec::new();
        let mut add = |at: [f64; 2], kind: Kind| {
            let contact_s = 2.0 + PERIOD_S * presses.len() as f64;
            presses.push(Press {
                at,
                kind,
                contact_s,
            });
        };
        let mut spread: Vec<[f64; 2]> = Vec::new();
        let mut spacing = 100.0 / (self.calibrating as f64).sqrt();
        while spread.len() < self.calibrating {
            let at = place(&mut unit);
            spacing *= 0.999;
            if spread.iter().all(|p| distance(*p, at) > spacing) {
                spread.push(at);
                add(at, Kind::Calibrate);
            }
        }
        for _ in 0..self.scored {
            add(place(&mut unit), Kind::Score);
        }
        for k in 0..self.pairs + self.simultaneous {
            let (one, two) = loop {
                let two = [place(&mut unit), place(&mut unit)];
                if distance(two[0], two[1]) >= APART_MM {
                    break (two[0], two[1]);
                }
            };
            let [least, most] = ONSETS_MS;
            let after_ms = if k < self.pairs {
                least * libm::pow(most / least, unit())
            } else {
                0.0
            };
            add(one, Kind::Pair { at: two, after_ms });
        }
        presses
    }
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    libm::hypot(a[0] - b[0], a[1] - b[1])
}

/// Height of the tip at `t` s.
fn height_mm(press: &Press, t: f64) -> f64 {
    let moving = DEPTH_MM / SPEED_MM_S;
    (SPEED_MM_S * (press.contact_s - t))
        .max(-DEPTH_MM)
        .max(SPEED_MM_S * (t - press.contact_s - 2.0 * moving - HOLD_S))
        .min(5.0)
}

/// Events of one camera in the rows of its crop.
fn events(config: &SimConfig, id: CameraId, presses: &[Press]) -> Vec<CdEvent> {
    let rows = AnalysisSettings::default().crop_v[id.index()];
    let mut model = OpticalModel::with_config(&config.scene(id), config.optical, 2)
        .expect("the default constants");
    let (mut all, mut some) = (Vec::new(), Vec::new());
    let end_s = presses.last().map_or(0.0, |p| p.contact_s + PERIOD_S - 1.0);
    let mut k = 0;
    for ms in 0..(end_s * 1e3) as i64 {
        let t = ms as f64 * 1e-3;
        while k + 1 < presses.len() && t > presses[k].contact_s + PERIOD_S - 1.0 {
            k += 1;
        }
        let press = &presses[k];
        let z = height_mm(press, t);
        let one = Point3::<Skin>::new(press.at[0], press.at[1], z);
        let two = match press.kind {
            Kind::Pair { at, after_ms } => {
                Point3::new(at[0], at[1], z + after_ms * 1e-3 * SPEED_MM_S)
            }
            _ => Point3::new(press.at[0], press.at[1], z + OFF_MM),
        };
        some.clear();
        model.advance_to(ms * GRID_NS, &[one, two], &mut some);
        let inside = some.iter().filter(|e| rows.0 <= e.y && e.y <= rows.1);
        all.extend(inside.map(|e| CdEvent {
            t_us: (e.t_ns / 1000) as u64,
            x: e.x,
            y: e.y,
            polarity: e.polarity,
        }));
    }
    all
}

fn plant(input: &mut SessionInput, at: usize, touch: &Press) {
    let moving = DEPTH_MM / SPEED_MM_S;
    let release = 2.0 * moving + HOLD_S;
    let role = if touch.kind == Kind::Score {
        PressRole::Score
    } else {
        PressRole::Calibrate
    };
    let planted = PlantedPress {
        timing: timing(
            touch.contact_s,
            [0.2, moving, moving + HOLD_S, release, release + 0.2],
        ),
        ..PlantedPress::new(role, 0, at as u32, Point2::new(touch.at[0], touch.at[1]))
    };
    let id = press(input, planted);
    for (kind, after) in [(MarkKind::Contact, 0.0), (MarkKind::Release, release)] {
        let t = touch.contact_s + after;
        mark(input, (kind, id), HostTime::from_secs_f64(t), 500, |_| {
            (t * 1e6).round() as u64
        });
    }
}

fn sight(events: &[CdEvent], press: &Press) -> TouchSight {
    let moving = DEPTH_MM / SPEED_MM_S * 1e3;
    let times = TouchTimes {
        idle_from_ms: -500.0,
        from_ms: -20.0,
        turn_ms: moving + HOLD_S * 1e3,
        to_ms: 2.0 * moving + HOLD_S * 1e3 + 40.0,
    };
    let zero_us = press.contact_s * 1e6;
    let us = |ms: f64| (zero_us + ms * 1e3) as u64;
    let at = |us: u64| events.partition_point(|e| e.t_us < us);
    let near: Vec<TouchEvent> = events[at(us(times.idle_from_ms))..at(us(times.to_ms))]
        .iter()
        .map(|e| TouchEvent {
            t_ms: (e.t_us as f64 - zero_us) * 1e-3,
            x: e.x,
            y: e.y,
        })
        .collect();
    TouchSight::new(times, &near)
}

/// What became of a press.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Outcome {
    Single,
    Ambiguous,
    /// Errors of both touches and their limit, mm; whether times decided, or geometry alone.
    Pair {
        errors: [f64; 2],
        limit_mm: f64,
        by_time: bool,
    },
}

/// Results of one session.
#[derive(Default)]
struct Tally {
    /// Errors of scored single touches located as usual.
    singles: Vec<f64>,
    /// Outcomes of scored single touches, pairs and simultaneous pairs.
    scored: Vec<Outcome>,
    pairs: Vec<Outcome>,
    simultaneous: Vec<Outcome>,
}

fn streams(config: &SimConfig, presses: &[Press]) -> [Vec<CdEvent>; 2] {
    std::thread::scope(|scope| {
        CameraId::ALL
            .map(|id| scope.spawn(move || events(config, id, presses)))
            .map(|camera| camera.join().expect("a camera"))
    })
}

/// Analysis of the single touches, which come first.
fn analysis(config: &SimConfig, presses: &[Press], events: &[Vec<CdEvent>; 2]) -> Analysis {
    let mut input = skinrig_planted::session(
        RigGeometry {
            outline: config.outline,
            nominal: config.nominal,
            trigger_channel: Some(0),
            trigger_delay_us: [0; 2],
        },
        AnalysisSettings {
            bootstrap_resamples: 200,
            study_presses: 1,
            // The figures are relative to the single-touch error, and stated for the published clustering.
            background_margin: 0.0,
            hot_pixel_ratio: 0.0,
            ..AnalysisSettings::default()
        },
    );
    let single = |p: &&Press| !matches!(p.kind, Kind::Pair { .. });
    let mut until_us = 0;
    for (k, touch) in presses.iter().filter(single).enumerate() {
        plant(&mut input, k, touch);
        until_us = ((touch.contact_s + 1.2) * 1e6) as u64;
    }
    let part = |events: &Vec<CdEvent>| {
        let end = events.partition_point(|e| e.t_us < until_us);
        events[..end].to_vec()
    };
    let memory = Memory {
        events: events.each_ref().map(part),
        slice: 4096,
    };
    analyze(&input, &memory).expect("an analysis")
}

fn run(bench: Bench) -> Tally {
    let config = SimConfig::new(bench.seed, SimLevel::Optical);
    let presses = bench.presses();
    let streams = streams(&config, &presses);
    let analysis = analysis(&config, &presses, &streams);
    let locator = FittedLocator::of(&analysis).expect("a locator");
    let sights: Vec<[TouchSight; 2]> = presses
        .iter()
        .map(|p| streams.each_ref().map(|events| sight(events, p)))
        .collect();
    let seen = || presses.iter().zip(&sights);
    let examples: Vec<SingleTouch<'_>> = seen()
        .filter(|(p, _)| p.kind == Kind::Calibrate)
        .map(|(p, sights)| SingleTouch {
            at: Point2::new(p.at[0], p.at[1]),
            sights: sights.each_ref(),
        })
        .collect();
    let separator = Separator::learn(&examples).expect("enough presses");
    let mut tally = Tally::default();
    let rows = analysis.presses.iter();
    for row in rows.filter(|p| p.role == PressRole::Score) {
        let found = Features::of_press(row).and_then(|f| locator.locate(&f));
        let planned = [row.planned.x_mm, row.planned.y_mm];
        tally.singles.extend(found.map(|f| distance(f.at, planned)));
    }
    let limit_mm = WITHIN * rms(&tally.singles);
    for (press, sights) in seen().filter(|(p, _)| p.kind != Kind::Calibrate) {
        let found = separator.separate(&locator, &config.outline, sights.each_ref());
        match press.kind {
            Kind::Pair { at, after_ms } => {
                let outcome = outcome(&found, [press.at, at], limit_mm);
                let of = if after_ms > 0.0 {
                    &mut tally.pairs
                } else {
                    &mut tally.simultaneous
                };
                of.push(outcome);
            }
            _ => tally.scored.push(outcome(&found, [press.at; 2], limit_mm)),
        }
    }
    tally
}

fn outcome(found: &Separation, truth: [[f64; 2]; 2], limit_mm: f64) -> Outcome {
    match found {
        Separation::Single => Outcome::Single,
        Separation::Ambiguous(_) => Outcome::Ambiguous,
        Separation::Pair { touches, nats } => {
            let at = touches.map(|t| [t.at.x_mm, t.at.y_mm]);
            let errors =
                |a: usize, b: usize| [distance(at[a], truth[0]), distance(at[b], truth[1])];
            let (one, two) = (errors(0, 1), errors(1, 0));
            let worst = |e: [f64; 2]| e[0].max(e[1]);
            Outcome::Pair {
                errors: if worst(one) < worst(two) { one } else { two },
                limit_mm,
                by_time: nats.is_some(),
            }
        }
    }
}

fn rms(errors: &[f64]) -> f64 {
    (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt()
}

/// A share with its 95 % Wilson interval, percent.
fn share(name: &str, of: &[Outcome], counts: impl Fn(&Outcome) -> bool) -> f64 {
    let (n, k) = (
        of.len() as f64,
        of.iter().filter(|o| counts(o)).count() as f64,
    );
    let (p, z) = (k / n, 1.96);
    let (middle, divisor) = (p + z * z / (2.0 * n), 1.0 + z * z / n);
    let half = z * (p * (1.0 - p) / n + z * z / (4.0 * n * n)).sqrt();
    let [low, high] = [(middle - half) / divisor, (middle + half) / divisor].map(|v| 100.0 * v);
    println!("{name}: {:.1} % ({low:.1} to {high:.1}) of {n}", 100.0 * p);
    p
}

/// Prints the rates; returns the shares of pairs within the limit and of ghosts, of ambiguous simultaneous pairs among those
/// with two pairings on the skin, and of single touches taken for more.
fn report(tally: &Tally) -> [f64; 4] {
    let rmse = rms(&tally.singles);
    println!(
        "single touches: RMSE {rmse:.2} mm of {}",
        tally.singles.len()
    );
    let judged = |o: &Outcome, holds: &dyn Fn([f64; 2], f64) -> bool| matches!(o, Outcome::Pair { errors, limit_mm, .. } if holds(*errors, *limit_mm));
    let within = |o: &Outcome| judged(o, &|errors, limit| rms(&errors) <= limit);
    let each = |o: &Outcome| judged(o, &|[one, two], limit| one.max(two) <= limit);
    let ghost = |o: &Outcome| judged(o, &|[one, two], _| one.max(two) > GHOST_MM);
    let pairs = &tally.pairs;
    let good = share("pairs, RMS of both errors within", pairs, within);
    share("pairs, each error within", pairs, each);
    let ghosts = share("pairs with a ghost", pairs, ghost);
    share("pairs, ambiguous", pairs, |o| *o == Outcome::Ambiguous);
    share("pairs taken for one touch", pairs, |o| {
        *o == Outcome::Single
    });
    let both = &tally.simultaneous;
    let ambiguous = |o: &Outcome| *o == Outcome::Ambiguous;
    share("simultaneous, ambiguous", both, ambiguous);
    share("simultaneous, geometry decides", both, |o| {
        matches!(o, Outcome::Pair { by_time: false, .. })
    });
    share("simultaneous, taken for one touch", both, |o| {
        *o == Outcome::Single
    });
    let guessed = share("simultaneous, guessed by time", both, |o| {
        matches!(o, Outcome::Pair { by_time: true, .. })
    });
    share("simultaneous with a ghost", both, ghost);
    let split = share("single touches taken for more", &tally.scored, |o| {
        *o != Outcome::Single
    });
    [good, ghosts, guessed, split]
}

#[test]
fn pairs_of_a_small_session_are_separated_and_none_is_guessed() {
    let tally = run(Bench {
        seed: 1,
        calibrating: 40,
        scored: 16,
        pairs: 16,
        simultaneous: 4,
    });
    let [good, ghosts, guessed, split] = report(&tally);
    assert!(good >= 0.4, "{good}");
    assert!(ghosts <= 0.13, "{ghosts}");
    assert!(guessed <= 0.25, "{guessed}");
    assert!(split <= 0.26, "{split}");
}

#[test]
#[ignore = "an hour: SKINRIG_CI_LONG=1 .ci/run, or cargo test --release -p skinrig-tests multi_touch -- --ignored --nocapture (figures of ADR 47)"]
fn two_thousand_pairs() {
    let number = |name: &str, default: usize| {
        std::env::var(name).map_or(default, |v| v.parse().expect("a number"))
    };
    let pairs = number("SKINRIG_PAIRS", 2000);
    let mut all = Tally::default();
    for seed in 2..2 + pairs.div_ceil(160) as u64 {
        let tally = run(Bench {
            seed,
            calibrating: 80,
            scored: 60,
            pairs: 160,
            simultaneous: 60,
        });
        all.singles.extend(tally.singles);
        all.scored.extend(tally.scored);
        all.pairs.extend(tally.pairs);
        all.simultaneous.extend(tally.simultaneous);
    }
    let [_, ghosts, guessed, _] = report(&all);
    assert!(ghosts <= 0.05 && guessed <= 0.05, "{ghosts} {guessed}");
}

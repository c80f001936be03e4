//! Calibration of every stated interval: how often it holds at each level, and whether ranks are uniform, over many benches.

use rayon::prelude::*;
use skinrig_analysis::result::AlignmentStatus;
use skinrig_analysis::timebase::Reading;
use skinrig_model::AlignmentSettings;

use crate::bench::{CLEAN, Conditions, Delay, NOISY, Wander, bench};

/// Readings that state an interval.
const READ: [&str; 6] = [
    "camera from box",
    "camera 2 from camera 1",
    "host from box",
    "camera from host",
    "drift",
    "drift of the box",
];

/// One bench: what its certificate states, and how it really was.
struct Judged {
    /// By the order of [`READ`]: what was read, and its error, µs (of the drift ppm).
    read: [(Reading, f64); 6],
    /// Held-out trains of all maps: within their interval, and all.
    held_out: (f64, f64),
    /// The certificate holds, errors lie within the bounds, no train has the name of another.
    valid: bool,
    bounded: bool,
    labelled: bool,
    violations: Vec<String>,
}

/// Levels that intervals are judged at.
const LEVELS: [f64; 5] = [0.5, 0.8, 0.9, 0.95, 0.99];

/// Bins of the rank histogram.
const BINS: usize = 20;

/// Error of each bench in one reading. Readings of a camera come late by a mean delay, the same on all benches: the
/// bound is for it, not the interval.
fn errors(judged: &[Judged], what: usize) -> Vec<(Reading, f64)> {
    let all = judged.iter().map(|j| j.read[what]);
    let mean = if matches!(what, 0 | 2 | 3) {
        all.clone().map(|(_, off)| off).sum::<f64>() / judged.len() as f64
    } else {
        0.0
    };
    all.map(|(r, off)| (r, off - mean)).collect()
}

/// Share of errors within the interval of each level.
fn shares(errors: &[(Reading, f64)]) -> [f64; 5] {
    LEVELS.map(|level| {
        let holds = |(r, off): &&(Reading, f64)| off.abs() <= r.half_width_us(level);
        errors.iter().filter(holds).count() as f64 / errors.len() as f64
    })
}

/// Chi-square of the ranks against evenness, with [`BINS`] - 1 degrees of freedom.
fn unevenness(errors: &[(Reading, f64)]) -> f64 {
    let mut counts = [0.0; BINS];
    for (r, off) in errors {
        counts[((r.rank(*off) * BINS as f64) as usize).min(BINS - 1)] += 1.0;
    }
    let expected = errors.len() as f64 / BINS as f64;
    let each = counts.iter().map(|n| (n - expected) * (n - expected));
    each.sum::<f64>() / expected
}

fn held_out(judged: &[Judged]) -> f64 {
    let each = judged.iter().map(|j| j.held_out);
    let (inside, n) = each.fold((0.0, 0.0), |s, h| (s.0 + h.0, s.1 + h.1));
    inside / n
}

fn judge(seed: u64, c: &Conditions) -> Judged {
    let b = bench(seed, c);
    let base = b.align(&AlignmentSettings::default());
    let a = &base.alignment;
    // A wrong label is wrong by a train's length at least.
    let is_right = |(one, two): &(f64, f64)| {
        (two - b.cameras[1].at(b.cameras[0].host_us(*one))).abs() < 1000.0
    };
    let labelled = base.shared_trains().iter().all(is_right);
    // One press of each bench, and one camera, so that readings err by themselves.
    let at = b.presses[seed as usize % b.presses.len()];
    let k = (seed / 7) as usize % 2;
    let camera = &b.cameras[k];
    let box_us = b.boxed.at(at);
    let shown_at = at - box_us.fract();
    let host = base.host_us_of_box(box_us as u64).unwrap();
    let host_off = host.us - shown_at;
    let mut bounded = host_off.abs() <= host.bound_us + 1.0;
    let between = base
        .camera_2_of_camera_1(b.cameras[0].at(shown_at))
        .unwrap();
    let of_host = base.camera_us(k, at).unwrap();
    let of_host_off = of_host.us - camera.at(at);
    let of_box = base.camera_us_of_box(k, box_us as u64).unwrap();
    let of_box_off = of_box.us - camera.at(shown_at);
    for (r, off) in [(of_host, of_host_off), (of_box, of_box_off)] {
        bounded &= off.abs() <= r.within_us();
    }
    let fit = base.clocks[k].unwrap();
    let (first, last) = b.seen_us[k];
    let rate = (camera.at(last) - camera.at(first)) / (last - first) - 1.0;
    let stated = Reading {
        us: fit.drift_ppm,
        se_us: fit.drift_se_ppm,
        free: 1e9,
        bound_us: 0.0,
    };
    let held_out = a.maps.iter().fold((0.0, 0.0), |sum, m| {
        let n = f64::from(m.coverage_n);
        (sum.0 + n * m.coverage.unwrap_or(0.0), sum.1 + n)
    });
    Judged {
        read: [
            (of_box, of_box_off),
            (between, between.us - b.cameras[1].at(shown_at)),
            (host, host_off),
            (of_host, of_host_off),
            (stated, fit.drift_ppm - 1e6 * rate),
            (stated, fit.drift_ppm - 1e6 * rate),
        ],
        held_out,
        valid: a.status == AlignmentStatus::Valid,
        bounded,
        labelled,
        violations: a.violations.clone(),
    }
}

fn conditions() -> Vec<(&'static str, Conditions)> {
    let decaying = Conditions {
        jitter_us: 1.0,
        decays: true,
        ..NOISY
    };
    let c = |span_s: f64| Conditions { span_s, ..NOISY };
    vec![
        ("noisy, 10 s", c(10.0)),
        ("noisy, 40 s", NOISY),
        ("nothing lost, 40 s", CLEAN),
        ("decaying edges, 40 s", decaying),
        (
            "a fifth of the trains lost, 40 s",
            Conditions {
                lost: 0.05,
                lost_trains: 0.2,
                ..NOISY
            },
        ),
        (
            "heavy-tailed exchanges, 40 s",
            Conditions {
                delay: Delay::Heavy,
                ..NOISY
            },
        ),
        (
            "exchanges polled, 40 s",
            Conditions {
                delay: Delay::Polled,
                ..NOISY
            },
        ),
        (
            "host busy for a third, 40 s",
            Conditions {
                delay: Delay::Loaded,
                ..NOISY
            },
        ),
        (
            "an exchange each 4 s, 40 s",
            Conditions {
                exchange_s: 4.0,
                ..NOISY
            },
        ),
        ("noisy, 5 min", c(300.0)),
        (
            "rates that swing, 5 min",
            Conditions {
                wander: Wander::Swings,
                ..c(300.0)
            },
        ),
        (
            "rates that walk, 5 min",
            Conditions {
                wander: Wander::Walks(0.05e-6),
                ..c(300.0)
            },
        ),
        (
            "a train each 4 s, 1 h",
            Conditions {
                sync_s: 4,
                exchange_s: 1.0,
                wander: Wander::Swings,
                ..c(3600.0)
            },
        ),
    ]
}

/// Prints the table of `docs/time-base.md`.
#[test]
#[ignore = "minutes"]
fn intervals_hold_in_every_condition() {
    let n: u64 = std::env::var("BENCHES").map_or(500, |n| n.parse().unwrap());
    let from: u64 = std::env::var("FROM").map_or(1000, |n| n.parse().unwrap());
    let only = std::env::var("ONLY").unwrap_or_default();
    for (name, c) in conditions() {
        if !name.contains(&only) {
            continue;
        }
        let n = if c.span_s > 1000.0 { n.min(500) } else { n };
        let judged: Vec<Judged> = (from..from + n)
            .into_par_iter()
            .map(|seed| judge(seed, &c))
            .collect();
        for (what, read) in READ.iter().enumerate() {
            let errors = errors(&judged, what);
            let words = shares(&errors).map(|s| format!("{:.1}", 100.0 * s));
            let mean = errors.iter().map(|e| e.1).sum::<f64>() / errors.len() as f64;
            let sd = (errors.iter().map(|e| e.1 * e.1).sum::<f64>() / errors.len() as f64).sqrt();
            let se = (errors.iter().map(|e| e.0.se_us * e.0.se_us).sum::<f64>()
                / errors.len() as f64)
                .sqrt();
            println!(
                "| {name} | {read} | {} | {:.0} | {mean:.3} {sd:.3} {se:.3}",
                words.join(" | "),
                unevenness(&errors)
            );
        }
        let count = |of: fn(&Judged) -> bool| judged.iter().filter(|j| !of(j)).count();
        println!(
            "{name}: invalid {}, beyond the bound {}, mislabelled {}",
            count(|j| j.valid),
            count(|j| j.bounded),
            count(|j| j.labelled)
        );
        println!(
            "| {name} | held-out trains | | | | {:.1} | | |",
            100.0 * held_out(&judged)
        );
    }
}

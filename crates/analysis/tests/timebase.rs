//! The time base on emulated benches: labels, errors, intervals and limits, from edges and exchanges alone.

#![expect(clippy::unwrap_used, reason = "tests")]

use rayon::prelude::*;
use skinrig_analysis::legs::{LegStart, align};
use skinrig_analysis::result::{AlignmentStatus, MapName};
use skinrig_analysis::timebase::{Reading, Tie, Ties, TimeBase};
use skinrig_analysis::{EventSource, SessionInput, analyze};
use skinrig_model::{
    AlignmentSettings, AnalysisSettings, BoxReport, BoxTime, CameraId, CdEvent, HostTime, Label,
    Mark, MarkKind, Point2, PressId, PressRole, PulseTrain, RigGeometry, SentMark, SkinOutline,
    StereoGeometry, TriggerEdge,
};
use skinrig_planted as planted;

/// SplitMix64 (public domain, S. Vigna).
struct Random(u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// A clock over host time, µs: an origin, a rate, and a rate that changes.
#[derive(Debug, Clone, Copy)]
struct Clock {
    origin_us: f64,
    drift: f64,
    /// Change of the rate per µs.
    wander: f64,
    /// Swing of the rate, and its angular frequency, per µs.
    swing: (f64, f64),
}

impl Clock {
    fn at(&self, host_us: f64) -> f64 {
        self.origin_us
            + host_us * (1.0 + self.drift)
            + 0.5 * self.wander * host_us * host_us
            + self.swing.0 / self.swing.1 * (self.swing.1 * host_us).sin()
    }

    /// The host time at which it shows this, but for its wander.
    fn host_us(&self, at_us: f64) -> f64 {
        (at_us - self.origin_us) / (1.0 + self.drift)
    }
}

/// What goes wrong, and how far clocks are apart.
#[derive(Debug, Clone, Copy)]
struct Conditions {
    span_s: f64,
    most_drift: f64,
    /// Edges come late by up to this, evenly; or by this on average, when `decays`.
    jitter_us: f64,
    decays: bool,
    /// The rates swing by 1 ppm within 200 to 900 s besides.
    swings: bool,
    lost: f64,
    doubled: f64,
    spurious: f64,
}

const CLEAN: Conditions = Conditions {
    span_s: 40.0,
    most_drift: 500e-6,
    jitter_us: 2.5,
    decays: false,
    swings: false,
    lost: 0.0,
    doubled: 0.0,
    spurious: 0.0,
};

const NOISY: Conditions = Conditions {
    lost: 0.2,
    doubled: 0.02,
    spurious: 0.05,
    ..CLEAN
};

struct Bench {
    boxed: Clock,
    cameras: [Clock; 2],
    reports: Vec<BoxReport>,
    edges: [Vec<TriggerEdge>; 2],
    /// When the cameras were recording; empty: all along.
    recorded: [Vec<(u64, u64)>; 2],
    /// Host times of the presses' contacts, µs.
    presses: Vec<f64>,
}

/// A press each 2 s with a mark at contact, at depth and release, a sync train each second, an exchange each 0.1 s.
fn bench(seed: u64, c: &Conditions) -> Bench {
    let mut r = Random(seed);
    let mut clock = |origin_us: f64| Clock {
        origin_us: r.between(0.0, origin_us),
        drift: r.between(-c.most_drift, c.most_drift),
        // Up to 3 ppm per hour.
        wander: r.between(-3e-6, 3e-6) / 3.6e9,
        swing: if c.swings {
            (1e-6, std::f64::consts::TAU / r.between(2e8, 9e8))
        } else {
            (0.0, 1.0)
        },
    };
    let boxed = clock(1e9);
    let cameras = [clock(1e12), clock(1e12)];
    run(r, boxed, cameras, c)
}

/// What a bench with these clocks records.
fn run(mut r: Random, boxed: Clock, cameras: [Clock; 2], c: &Conditions) -> Bench {
    let mut trains = Vec::new();
    let mut presses = Vec::new();
    let mut free_us = 0.0;
    let mut send = |at_us: f64, label: Label, trains: &mut Vec<(f64, Label)>| {
        let at_us = f64::max(at_us, free_us);
        free_us = at_us + 14_000.0;
        trains.push((at_us, label));
    };
    let seconds = c.span_s as u32;
    for second in 0..seconds {
        let begin = f64::from(second) * 1e6 + 20_000.0;
        send(begin, Label::Sync(second), &mut trains);
        if second.is_multiple_of(2) {
            let contact = begin + r.between(50_000.0, 300_000.0);
            presses.push(contact);
            for (after, kind) in [
                (0.0, MarkKind::Contact),
                (150_000.0, MarkKind::AtDepth),
                (500_000.0, MarkKind::Release),
            ] {
                let mark = Mark {
                    kind,
                    press: PressId::from_index(second / 2),
                };
                send(contact + after, Label::Mark(mark), &mut trains);
            }
        }
    }
    let mut reports = Vec::new();
    for k in 0..seconds * 10 {
        let sent = f64::from(k) * 1e5;
        // A serial line: 150 µs at least, mostly more, sometimes much more.
        let mut delay = || 150.0 - 100.0 * r.between(0.0, 1.0).max(1e-9).ln();
        let read = sent + delay();
        let received = read + delay();
        let at = BoxTime {
            us: boxed.at(read) as u64,
        };
        reports.push(BoxReport::Exchange {
            sent: HostTime((sent * 1e3) as i64),
            received: HostTime((received * 1e3) as i64),
            at,
        });
    }
    let mut edges = [Vec::new(), Vec::new()];
    for (at_us, label) in &trains {
        let start = boxed.at(*at_us);
        let at = BoxTime { us: start as u64 };
        reports.push(match *label {
            Label::Mark(mark) => BoxReport::Mark { mark, at },
            Label::Sync(count) => BoxReport::Sync { count, at },
        });
        for (camera, edges) in cameras.iter().zip(&mut edges) {
            let mut put = |host_us: f64, rising: bool| {
                edges.push(TriggerEdge {
                    t_us: camera.at(host_us) as u64,
                    channel: 0,
                    rising,
                });
            };
            for (offset, rising) in PulseTrain::of(*label).unwrap().edges() {
                // The box counts the offset on its own clock.
                let host_us = at_us + offset as f64 / (1.0 + boxed.drift);
                let late = if c.decays {
                    -c.jitter_us * r.between(1e-9, 1.0).ln()
                } else {
                    r.between(0.0, c.jitter_us)
                };
                if r.between(0.0, 1.0) >= c.lost {
                    put(host_us + late, rising);
                }
                if r.between(0.0, 1.0) < c.doubled {
                    put(host_us + late + r.between(1.0, 10.0), rising);
                }
                if r.between(0.0, 1.0) < c.spurious {
                    let up = r.between(0.0, 1.0) < 0.5;
                    put(at_us + r.between(0.0, PulseTrain::DURATION_US as f64), up);
                }
            }
        }
    }
    edges.iter_mut().for_each(|e| e.sort_by_key(|e| e.t_us));
    Bench {
        boxed,
        cameras,
        reports,
        edges,
        recorded: [Vec::new(), Vec::new()],
        presses,
    }
}

impl Bench {
    fn align(&self, limits: &AlignmentSettings) -> TimeBase {
        let ties = Ties {
            reports: &self.reports,
            edges: [&self.edges[0], &self.edges[1]],
            channel: 0,
            recorded: [&self.recorded[0], &self.recorded[1]],
            legs: &[],
            used_at_us: &self.presses,
        };
        TimeBase::new(&ties, limits).unwrap()
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// What is read off a bench.
const READ: [&str; 5] = [
    "camera from box",
    "camera 2 from camera 1",
    "host from box",
    "camera from host",
    "drift",
];

/// What one bench says of itself, and how it really was.
struct Judged {
    /// By the order of [`READ`]: what was read at one press, and its error, µs (of the drift ppm).
    read: Vec<(usize, Reading, f64)>,
    /// Held-out trains of all maps: within their interval, and all.
    held_out: (f64, f64),
}

/// The levels that intervals are judged at.
const LEVELS: [f64; 5] = [0.5, 0.8, 0.9, 0.95, 0.99];

/// For each of [`READ`] the share of errors within the interval of each level, about the mean error: what every bench has in common
/// is the mean delay of an edge, which is no noise.
fn calibration(judged: &[Judged]) -> [[f64; 5]; 5] {
    [0, 1, 2, 3, 4].map(|what| {
        let all = || judged.iter().flat_map(|j| &j.read).filter(|r| r.0 == what);
        let n = all().count() as f64;
        let mean = all().map(|(_, _, off)| off).sum::<f64>() / n;
        LEVELS.map(|level| {
            let holds =
                |(_, r, off): &&(usize, Reading, f64)| (off - mean).abs() <= r.half_width_us(level);
            all().filter(holds).count() as f64 / n
        })
    })
}

fn held_out(judged: &[Judged]) -> f64 {
    let sum = judged
        .iter()
        .fold((0.0, 0.0), |s, j| (s.0 + j.held_out.0, s.1 + j.held_out.1));
    sum.0 / sum.1
}

fn judge(seed: u64, c: &Conditions) -> Judged {
    let b = bench(seed, c);
    let base = b.align(&AlignmentSettings::default());
    let a = &base.alignment;
    assert_eq!(a.status, AlignmentStatus::Valid, "seed {seed}: {a:#?}");
    // A wrong label is wrong by a train's length at least.
    for (one, two) in base.shared_trains() {
        let host_us = b.cameras[0].host_us(one);
        let off = two - b.cameras[1].at(host_us);
        assert!(off.abs() < 1000.0, "seed {seed}: {off} µs");
    }
    for (k, line) in a.lines.iter().enumerate() {
        assert!(line.trains_seen > 90, "seed {seed}: {line:?}");
        let lost = line.share(line.lost);
        assert!(
            (lost - c.lost).abs() < 0.04,
            "seed {seed}, camera {k}: {line:?}"
        );
        let extra = line.share(line.doubled + line.spurious);
        assert!(
            (extra - c.doubled - c.spurious).abs() < 0.03,
            "seed {seed}, camera {k}: {line:?}"
        );
    }
    // One press of each bench, so that benches count, not presses.
    let at = b.presses[seed as usize % b.presses.len()];
    let box_us = b.boxed.at(at);
    let shown_at = at - box_us.fract();
    let host = base.host_us_of_box(box_us as u64).unwrap();
    assert!((host.us - shown_at).abs() <= host.bound_us + 1.0);
    let mut read = vec![(2, host, host.us - shown_at)];
    let between = base
        .camera_2_of_camera_1(b.cameras[0].at(shown_at))
        .unwrap();
    read.push((1, between, between.us - b.cameras[1].at(shown_at)));
    let (first, last) = (20_000.0, (c.span_s - 1.0) * 1e6 + 20_000.0);
    for (k, camera) in b.cameras.iter().enumerate() {
        let of_host = base.camera_us(k, at).unwrap();
        let off = of_host.us - camera.at(at);
        assert!(off.abs() <= of_host.within_us(), "seed {seed}: {off}");
        read.push((3, of_host, off));
        let of_box = base.camera_us_of_box(k, box_us as u64).unwrap();
        let off = of_box.us - camera.at(shown_at);
        assert!(off.abs() <= of_box.within_us(), "seed {seed}: {off}");
        read.push((0, of_box, off));
        let fit = base.clocks[k].unwrap();
        let rate = (camera.at(last) - camera.at(first)) / (last - first) - 1.0;
        let stated = Reading {
            us: fit.drift_ppm,
            se_us: fit.drift_se_ppm,
            free: 1e9,
            bound_us: 0.0,
        };
        read.push((4, stated, fit.drift_ppm - 1e6 * rate));
    }
    let held_out = a.maps.iter().fold((0.0, 0.0), |sum, m| {
        let n = f64::from(m.coverage_n);
        (sum.0 + n * m.coverage.unwrap_or(0.0), sum.1 + n)
    });
    Judged { read, held_out }
}

/// 500 benches with drifts up to 500 ppm, jitter, 20 % of the edges lost and 5 % spurious.
#[test]
fn labels_are_right_and_intervals_hold_as_often_as_they_say_on_500_noisy_benches() {
    let judged: Vec<Judged> = (0..500u64)
        .into_par_iter()
        .map(|seed| judge(seed, &NOISY))
        .collect();
    let found = calibration(&judged);
    for (name, shares) in READ.iter().zip(&found) {
        for (level, share) in LEVELS.iter().zip(shares) {
            // Both cameras of a bench share the host: benches count.
            let chance = 3.5 * (level * (1.0 - level) / 500.0).sqrt();
            assert!((share - level).abs() < chance, "{name}, {level}: {share}");
        }
    }
    let share = held_out(&judged);
    assert!((0.93..0.97).contains(&share), "held out: {share}");
    let off = judged.iter().flat_map(|j| &j.read).filter(|r| r.0 == 0);
    let (off, bounds): (Vec<f64>, Vec<f64>) = off.map(|r| (r.2.abs(), r.1.bound_us)).unzip();
    let typical = median(off);
    assert!(typical < 2.0, "median error {typical} µs");
    assert!(bounds.iter().all(|b| *b < 5.0));
}

/// Prints the table of `docs/time-base.md`.
#[test]
#[ignore = "minutes: cargo test -p skinrig-analysis --test timebase intervals_hold_in_every_condition -- --include-ignored --nocapture"]
fn intervals_hold_in_every_condition() {
    let decaying = Conditions {
        jitter_us: 1.0,
        decays: true,
        ..NOISY
    };
    let swinging = Conditions {
        span_s: 300.0,
        swings: true,
        ..NOISY
    };
    let conditions = [
        ("evenly late, 40 s", NOISY),
        ("nothing lost, 40 s", CLEAN),
        ("decaying delay, 40 s", decaying),
        (
            "120 s",
            Conditions {
                span_s: 120.0,
                ..NOISY
            },
        ),
        ("rates that swing, 300 s", swinging),
    ];
    for (name, c) in conditions {
        let judged: Vec<Judged> = (1000..1500u64)
            .into_par_iter()
            .map(|seed| judge(seed, &c))
            .collect();
        for (read, shares) in READ.iter().zip(calibration(&judged)) {
            let words = shares.map(|s| format!("{:.1}", 100.0 * s)).join(" | ");
            println!("| {name} | {read} | {words} |");
            assert!(
                (0.92..0.985).contains(&shares[3]),
                "{name}, {read}: {shares:?}"
            );
        }
        println!(
            "| {name} | held out | | | | {:.1} | |",
            100.0 * held_out(&judged)
        );
    }
}

fn status(b: &Bench, limits: &AlignmentSettings) -> (AlignmentStatus, String) {
    let a = b.align(limits).alignment;
    (a.status, a.violations.join("; "))
}

#[test]
fn a_session_beyond_any_limit_is_invalid_and_says_which() {
    let clean = bench(1, &CLEAN);
    let limits = AlignmentSettings::default();
    assert_eq!(
        status(&clean, &limits),
        (AlignmentStatus::Valid, String::new())
    );
    let noisy = bench(1, &NOISY);
    for (limits, said) in [
        (
            AlignmentSettings {
                max_residual_us: 0.01,
                ..limits
            },
            "residual rms",
        ),
        (
            AlignmentSettings {
                max_camera_interval_us: 1.0,
                ..limits
            },
            "95 % interval at the presses",
        ),
        (
            AlignmentSettings {
                max_host_interval_us: 100.0,
                ..limits
            },
            "host from box, bound at the presses",
        ),
        (
            AlignmentSettings {
                max_drift_ppm: 0.001,
                ..limits
            },
            "drift",
        ),
        (
            AlignmentSettings {
                max_lost: 0.1,
                ..limits
            },
            "lost edges",
        ),
        (
            AlignmentSettings {
                max_spurious: 0.01,
                ..limits
            },
            "doubled and spurious edges",
        ),
        (
            AlignmentSettings {
                min_coverage: 1.0,
                ..limits
            },
            "share outside the stated interval",
        ),
    ] {
        let (found, words) = status(&noisy, &limits);
        assert_eq!(found, AlignmentStatus::Invalid, "{said}");
        assert!(words.contains(said), "{said}: {words}");
    }
    // No edge of one camera, as when its cable is off.
    let mut dead = bench(2, &CLEAN);
    dead.edges[1].clear();
    let (found, words) = status(&dead, &limits);
    assert_eq!(found, AlignmentStatus::Invalid);
    assert!(words.contains("camera 2 from box"), "{words}");
    // The wrong camera's cable: another bench's trains have the same names at other times.
    let mut swapped = bench(3, &CLEAN);
    swapped.edges[0] = bench(4, &CLEAN).edges[0].clone();
    assert_eq!(status(&swapped, &limits).0, AlignmentStatus::Invalid);
    // No exchange with the host.
    let mut silent = bench(5, &CLEAN);
    silent
        .reports
        .retain(|r| !matches!(r, BoxReport::Exchange { .. }));
    let (found, words) = status(&silent, &limits);
    assert_eq!(found, AlignmentStatus::Invalid);
    assert!(words.contains("host from box"), "{words}");
    // A host clock that jumped in the middle.
    let mut jumped = bench(6, &CLEAN);
    for report in &mut jumped.reports {
        if let BoxReport::Exchange { sent, received, .. } = report
            && sent.0 > 20_000_000_000
        {
            sent.0 += 50_000_000;
            received.0 += 50_000_000;
        }
    }
    assert_eq!(status(&jumped, &limits).0, AlignmentStatus::Invalid);
}

/// Clocks whose rate changes faster than a clock's may: of a camera, of the box, and a jump. Their trains came, and are not called lost.
#[test]
fn a_clock_that_drifts_too_fast_is_told_from_a_wire_that_loses() {
    let limits = AlignmentSettings::default();
    let clock = |origin_us: f64, swing: (f64, f64)| Clock {
        origin_us,
        drift: 20e-6,
        wander: 0.0,
        swing,
    };
    let steady = clock(5e8, (0.0, 1.0));
    for period_s in [3.0, 7.0, 20.0] {
        for ppm in [100.0, 300.0, 1_000.0] {
            let swinging = clock(3e9, (ppm * 1e-6, std::f64::consts::TAU / (period_s * 1e6)));
            for (of_box, name) in [(false, "camera 1"), (true, "trigger box")] {
                let (boxed, one) = match of_box {
                    true => (swinging, steady),
                    false => (steady, swinging),
                };
                let b = run(Random(9), boxed, [one, steady], &CLEAN);
                let (found, words) = status(&b, &limits);
                let case = format!("{name}, {ppm} ppm in {period_s} s: {words}");
                assert_eq!(found, AlignmentStatus::Invalid, "{case}");
                assert!(words.contains(&format!("{name}, clock drift: ")), "{case}");
                assert!(!words.contains("edges: expected"), "{case}");
            }
        }
    }
    // A wire that loses and invents edges is no clock's fault.
    let worn = Conditions {
        lost: 0.4,
        spurious: 0.05,
        ..CLEAN
    };
    let (found, words) = status(&bench(1, &worn), &limits);
    assert_eq!(found, AlignmentStatus::Invalid);
    assert!(
        words.contains("lost edges") && !words.contains("clock drift"),
        "{words}"
    );
}

#[test]
fn nothing_is_certified_without_a_press_and_nothing_is_said_without_a_box() {
    let mut b = bench(7, &CLEAN);
    b.presses.clear();
    b.edges[0].clear();
    assert_eq!(
        status(&b, &AlignmentSettings::default()).0,
        AlignmentStatus::NotCertified
    );
    let ties = Ties {
        reports: &[],
        edges: [&[], &[]],
        channel: 0,
        recorded: [&[], &[]],
        legs: &[],
        used_at_us: &[1.0],
    };
    assert_eq!(TimeBase::new(&ties, &AlignmentSettings::default()), None);
}

#[test]
fn a_reset_of_the_box_in_the_middle_is_bridged() {
    // Two benches after one another; the box goes on counting its trains, its clock starts anew.
    let mut b = bench(8, &NOISY);
    let half_us = 21e6;
    let jump_us = b.boxed.at(half_us) as u64 - 5_000;
    let late = |us: u64| us > jump_us;
    let at_of = |r: &BoxReport| match *r {
        BoxReport::Exchange { at, .. }
        | BoxReport::Mark { at, .. }
        | BoxReport::Sync { at, .. }
        | BoxReport::Input { at, .. } => at.us,
        BoxReport::Reset { .. } => 0,
    };
    let (mut after, before): (Vec<_>, Vec<_>) =
        b.reports.iter().copied().partition(|r| late(at_of(r)));
    for report in &mut after {
        match report {
            BoxReport::Exchange { at, .. }
            | BoxReport::Mark { at, .. }
            | BoxReport::Sync { at, .. }
            | BoxReport::Input { at, .. } => at.us -= jump_us,
            BoxReport::Reset { .. } => {}
        }
    }
    let noticed = HostTime((half_us * 1e3) as i64);
    b.reports = [before, vec![BoxReport::Reset { noticed }], after].concat();
    let base = b.align(&AlignmentSettings::default());
    assert_eq!(
        (base.alignment.status, base.alignment.resets),
        (AlignmentStatus::Valid, 1),
        "{:#?}",
        base.alignment
    );
    for at in &b.presses {
        for (k, camera) in b.cameras.iter().enumerate() {
            let found = base.camera_us(k, *at).unwrap();
            assert!(
                (found.us - camera.at(*at)).abs() <= found.within_us(),
                "{at}"
            );
        }
    }
}

impl Bench {
    /// As if the wire to camera `k` came off at a host time, µs.
    fn cut_wire(&mut self, k: usize, at_us: f64) {
        let camera = self.cameras[k];
        let end_us = camera.at(at_us);
        self.edges[k].retain(|e| (e.t_us as f64) < end_us);
    }

    /// Camera `k` recorded between two host times, µs.
    fn recorded(&mut self, k: usize, from_us: f64, to_us: f64) {
        let camera = self.cameras[k];
        let (from, to) = (camera.at(from_us) as u64, camera.at(to_us) as u64);
        self.recorded[k] = vec![(from, to)];
        self.edges[k].retain(|e| (from..to).contains(&e.t_us));
    }
}

#[test]
fn what_a_wire_loses_at_the_ends_is_lost_and_no_press_there_is_timed() {
    let limits = AlignmentSettings::default();
    for seed in 40..50 {
        let mut b = bench(seed, &CLEAN);
        for k in 0..2 {
            b.recorded(k, 0.0, 40e6);
        }
        b.cut_wire(1, 26e6);
        let a = b.align(&limits).alignment;
        let shares = [0, 1].map(|k| a.lines[k].share(a.lines[k].lost));
        assert!(shares[0] < 0.01, "seed {seed}: {shares:?}");
        assert!((0.34..0.36).contains(&shares[1]), "seed {seed}: {shares:?}");
        assert_eq!(a.status, AlignmentStatus::Invalid);
        assert!(a.violations[0].contains("lost edges"), "{a:?}");

        // A quarter lost is within the limit. What lies beyond the wire's end is not timed; what is near it, is, and says how well.
        let mut b = bench(seed, &CLEAN);
        b.cut_wire(1, 31e6);
        let base = b.align(&limits);
        let a = &base.alignment;
        assert_eq!(a.status, AlignmentStatus::Valid, "seed {seed}: {a:#?}");
        assert!(
            a.warnings[0].starts_with("camera 2: 3 of 20 contacts"),
            "{:?}",
            a.warnings
        );
        for at in &b.presses {
            let (_, distance) = base.tie_distance_us(1, *at).unwrap();
            assert_eq!(distance > 2.5e6, *at > 33.5e6, "{at}: {distance}");
            let found = base.camera_us(1, *at).unwrap();
            assert!((found.us - b.cameras[1].at(*at)).abs() <= found.within_us());
        }
        let half = |host_us: f64| {
            let box_us = b.boxed.at(host_us) as u64;
            base.camera_us_of_box(1, box_us).unwrap().bound_us
        };
        // 20 ppm of wander in 2 s, and further off in proportion.
        assert!((half(35e6) - half(33e6) - 40.0).abs() < 5.0);
        assert!(half(38e6) - half(30e6) > 139.0);
        // Of the interval at the presses only those count that are timed.
        let map = a
            .maps
            .iter()
            .find(|m| m.map == MapName::Camera2FromBox)
            .unwrap();
        assert!(map.interval_us.unwrap().1 < 1.0, "{map:?}");
        assert!(map.bound_us.unwrap().1 < 55.0, "{map:?}");
    }
}

#[test]
fn what_a_camera_did_not_record_is_not_lost_and_not_timed() {
    let limits = AlignmentSettings::default();
    let mut b = bench(51, &CLEAN);
    b.recorded(0, 0.0, 40e6);
    b.recorded(1, 8e6, 20e6);
    let base = b.align(&limits);
    let a = &base.alignment;
    assert_eq!(a.status, AlignmentStatus::Valid, "{a:#?}");
    let line = a.lines[1];
    assert!(line.share(line.lost) < 0.01, "{line:?}");
    // A train each second and three of a press each other second, in 28 s of 40.
    assert!((68..=72).contains(&line.trains_unrecorded), "{line:?}");
    assert_eq!(a.lines[0].trains_unrecorded, 0);
    let untimed = |at: &&f64| base.tie_distance_us(1, **at).unwrap().1 > 2.5e6;
    assert_eq!(b.presses.iter().filter(untimed).count(), 3 + 9);
    // It recorded all along and saw nothing there: most of it is lost.
    b.recorded[1].clear();
    assert_eq!(b.align(&limits).alignment.status, AlignmentStatus::Invalid);
}

#[test]
fn presses_after_the_last_exchange_are_not_timed() {
    let limits = AlignmentSettings::default();
    let mut b = bench(52, &CLEAN);
    let mut end = |after_us: f64| {
        b.reports.retain(
            |r| !matches!(r, BoxReport::Exchange { sent, .. } if sent.0 as f64 > after_us * 1e3),
        );
        let base = b.align(&limits);
        for at in &b.presses {
            let (tie, distance) = base.tie_distance_us(0, *at).unwrap();
            if *at > after_us + 1e6 {
                assert_eq!(tie, Tie::Exchange);
                assert!((distance - (at - after_us)).abs() < 0.2e6);
            }
            // The rate may have changed: the bound says so.
            let found = base.host_us_of_box(b.boxed.at(*at) as u64).unwrap();
            assert!((found.us - at).abs() <= found.bound_us);
            assert!(found.bound_us >= 20e-6 * (at - after_us));
        }
        base.alignment
    };
    let a = end(32e6);
    assert_eq!(a.status, AlignmentStatus::Valid, "{a:#?}");
    assert_eq!(a.warnings.len(), 2);
    let a = end(23e6);
    assert_eq!(a.status, AlignmentStatus::Invalid);
    let said = a.violations.join("; ");
    assert!(
        said.contains("without a tie within 2.5 s: expected at most 30 %"),
        "{said}"
    );
}

/// Nothing happens in front of the cameras.
struct Dark;

impl EventSource for Dark {
    fn for_each_slice(&self, _: CameraId, _: &mut dyn FnMut(&[CdEvent])) -> Result<(), String> {
        Ok(())
    }
}

/// A session of the presses of a bench. With `marks`, the box reports nothing, and the host knows when its marks were sent.
fn session_of(b: &Bench, marks: bool) -> SessionInput {
    let mut input = planted::session(
        RigGeometry {
            outline: SkinOutline::PAPER,
            nominal: StereoGeometry::PAPER,
            trigger_channel: Some(0),
            trigger_delay_us: [0; 2],
        },
        AnalysisSettings::default(),
    );
    for at in &b.presses {
        let middle = Point2::new(10.0, 5.0);
        let touch = planted::Touch {
            timing: planted::timing(at * 1e-6, [0.01, 0.15, 0.4, 0.5, 0.6]),
            ..planted::Touch::new(PressRole::Score, 0, 0, middle)
        };
        planted::press(&mut input, touch);
    }
    input.edges = b.edges.clone();
    input.recorded = b.recorded.clone();
    if marks {
        let sent = b.reports.iter().filter_map(|r| match *r {
            BoxReport::Mark { mark, at } => Some(SentMark {
                mark,
                t: HostTime((b.boxed.host_us(at.us as f64) * 1e3) as i64),
                uncertainty_ns: 10_000,
            }),
            _ => None,
        });
        input.marks = sent.collect();
    } else {
        input.box_reports = b.reports.clone();
    }
    input
}

#[test]
fn a_press_that_no_clock_reaches_is_refused_by_a_rule_that_names_itself() {
    let mut b = bench(53, &CLEAN);
    b.cut_wire(1, 31e6);
    for (marks, said) in [(false, "train"), (true, "mark")] {
        let input = session_of(&b, marks);
        let a = analyze(&input, &Dark).unwrap();
        assert!(a.alignment.is_usable(), "{:?}", a.alignment);
        for (press, at) in a.presses.iter().zip(&b.presses) {
            let reason = press.reason.as_deref().unwrap();
            if *at + 5e5 > 33.5e6 {
                assert_eq!(press.verdict, "invalid");
                assert_eq!(press.rule.as_deref(), Some("not timed (camera 2)"));
                assert!(
                    reason.starts_with(&format!("not timed: the nearest {said} that it saw is "))
                        && reason.ends_with(" s away, expected at most 2.5 s (camera 2)"),
                    "{reason}"
                );
            } else {
                // The cameras saw nothing of any press.
                assert_eq!(reason, "no cluster (camera 1)");
            }
        }
        assert!(a.counts.invalid >= 3 && a.counts.add_up());
        let warned = |w: &String| w.contains("not timed");
        let all = a.alignment.warnings.iter().chain(&a.warnings);
        assert_eq!(all.filter(|w| warned(w)).count(), 1, "{a:?}");
    }
    // A longer reach is a choice of the settings.
    let mut input = session_of(&b, false);
    input.settings.alignment.max_tie_distance_us = 60e6;
    input.settings.alignment.max_camera_interval_us = 1e3;
    let a = analyze(&input, &Dark).unwrap();
    assert_eq!(a.counts.invalid, 0);
}

/// Two benches joined as the recorder joins the legs of a session: the second with the same crystals, all its clocks begun anew, and
/// the same labels.
struct InLegs {
    first: Bench,
    second: Bench,
    leg: LegStart,
    joined: Bench,
}

fn in_legs(seed: u64) -> InLegs {
    let first = bench(seed, &NOISY);
    let anew = |clock: Clock, origin_us: f64| Clock { origin_us, ..clock };
    let second = run(
        Random(seed + 1000),
        anew(first.boxed, 3e5),
        [anew(first.cameras[0], 7e9), anew(first.cameras[1], 2e6)],
        &NOISY,
    );
    let after = |k: usize| (first.edges[k].last().unwrap().t_us / 1_000_000 + 2) * 1_000_000;
    let leg = LegStart::recorded(HostTime(43_000_000_000), [after(0), after(1)]);
    let later = |t: HostTime| HostTime(t.0 + leg.origin.0);
    let mut reports = first.reports.clone();
    reports.push(BoxReport::Reset {
        noticed: leg.origin,
    });
    reports.extend(second.reports.iter().map(|r| match *r {
        BoxReport::Exchange { sent, received, at } => BoxReport::Exchange {
            sent: later(sent),
            received: later(received),
            at,
        },
        other => other,
    }));
    let edges = [0, 1].map(|k| {
        let moved = second.edges[k].iter().map(|e| TriggerEdge {
            t_us: e.t_us + leg.camera_us[k],
            ..*e
        });
        first.edges[k].iter().copied().chain(moved).collect()
    });
    let moved = second.presses.iter().map(|at| at + 43e6);
    let presses = first.presses.iter().copied().chain(moved).collect();
    let joined = Bench {
        reports,
        edges,
        presses,
        ..first
    };
    let first = bench(seed, &NOISY);
    InLegs {
        first,
        second,
        leg,
        joined,
    }
}

/// Where the zero of a camera's clock in the leg lies, µs.
fn joint(leg: &LegStart, k: usize) -> f64 {
    leg.recorded_us[k] as f64 + leg.moved_us[k] as f64
}

/// The session as it was recorded.
fn input(s: &InLegs) -> SessionInput {
    SessionInput {
        planned: Vec::new(),
        outcomes: Vec::new(),
        earlier: Vec::new(),
        edges: s.joined.edges.clone(),
        marks: Vec::new(),
        box_reports: s.joined.reports.clone(),
        recorded: [Vec::new(), Vec::new()],
        gaps: [
            vec![
                (5, s.leg.camera_us[0] + 5),
                (s.leg.camera_us[0] + 9, u64::MAX),
            ],
            Vec::new(),
        ],
        pose_interval_us: None,
        crossing_se_us: None,
        legs: vec![s.leg],
        rig: RigGeometry {
            outline: SkinOutline::PAPER,
            nominal: StereoGeometry::PAPER,
            trigger_channel: Some(0),
            trigger_delay_us: [0; 2],
        },
        settings: AnalysisSettings::default(),
    }
}

#[test]
fn trains_of_one_leg_are_never_looked_for_in_another() {
    for seed in 20..30 {
        let s = in_legs(seed);
        let limits = AlignmentSettings::default();
        let mut aligned = input(&s);
        align(&mut aligned);
        let base = TimeBase::new(
            &Ties {
                reports: &aligned.box_reports,
                edges: [&aligned.edges[0], &aligned.edges[1]],
                channel: 0,
                recorded: [&[], &[]],
                legs: &aligned.legs,
                used_at_us: &s.joined.presses,
            },
            &limits,
        )
        .unwrap();
        let a = &base.alignment;
        assert_eq!(a.status, AlignmentStatus::Valid, "seed {seed}: {a:#?}");
        assert_eq!(a.resets, 0, "the box lost nothing");
        assert!(a.lines.iter().all(|line| line.trains_seen > 180), "{a:#?}");
        for k in 0..2 {
            for at in &s.first.presses {
                let found = base.camera_us(k, *at).unwrap();
                let half = found.within_us();
                let off = found.us - s.first.cameras[k].at(*at);
                assert!(off.abs() <= half, "seed {seed}, first leg: {off} µs");
            }
            for at in &s.second.presses {
                let found = base.camera_us(k, at + 43e6).unwrap();
                let half = found.within_us();
                let off = found.us - joint(&aligned.legs[0], k) - s.second.cameras[k].at(*at);
                assert!(off.abs() <= half, "seed {seed}, second leg: {off} µs");
            }
        }
        // Taken for one leg, every label is there twice.
        let base = s.joined.align(&limits);
        assert_eq!(base.alignment.status, AlignmentStatus::Invalid);
    }
}

#[test]
fn the_legs_are_laid_on_one_line() {
    let s = in_legs(31);
    let mut input = input(&s);
    align(&mut input);
    for k in 0..2 {
        let (one, two) = (s.first.cameras[k], s.second.cameras[k]);
        let moved = input.legs[0].moved_us[k] as f64;
        for host_us in [0.0, 20e6, 40e6] {
            let other = s.leg.camera_us[k] as f64 + two.at(host_us) + moved;
            let off = other - one.at(43e6 + host_us);
            assert!(off.abs() < 100.0, "camera {k}: {off} µs");
        }
    }
    let by = input.legs[0].moved_us[0];
    let after = |us: u64| (s.leg.recorded_us[0] + us).saturating_add_signed(by);
    assert_eq!(input.gaps[0], [(5, after(5)), (after(9), u64::MAX)]);
    let begins = input.legs[0].camera_us;
    for (k, edges) in input.edges.iter().enumerate() {
        assert!(edges.is_sorted_by_key(|e| e.t_us));
        let before = edges.partition_point(|e| e.t_us < begins[k]);
        assert_eq!(before, s.first.edges[k].len(), "camera {k}");
    }
    let last = s.joined.edges[1].last().unwrap().t_us;
    let moved = last.saturating_add_signed(input.legs[0].moved_us[1]);
    assert_eq!(input.edges[1].last().unwrap().t_us, moved);
    assert_eq!(input.edges[1][0], s.joined.edges[1][0]);
    // Again: they are on one line already.
    let aligned = input.legs[0].moved_us;
    align(&mut input);
    let further = (input.legs[0].moved_us[1] - aligned[1]).abs();
    assert!(further <= 20, "{further} µs");
}

/// A leg that was cut off before its first chunk: the next one begins at the same camera times.
#[test]
fn a_leg_that_holds_nothing_changes_nothing() {
    let s = in_legs(32);
    let mut without = input(&s);
    let mut with = without.clone();
    let empty = LegStart::recorded(HostTime(42_000_000_000), s.leg.recorded_us);
    with.legs.insert(0, empty);
    let reset = |r: &BoxReport| matches!(r, BoxReport::Reset { .. });
    let at = with.box_reports.iter().position(reset).unwrap();
    let noticed = empty.origin;
    with.box_reports.insert(at, BoxReport::Reset { noticed });
    align(&mut without);
    align(&mut with);
    assert_eq!(with.edges, without.edges);
    assert_eq!(with.gaps, without.gaps);
    assert_eq!(with.legs[1].moved_us, without.legs[0].moved_us);
    let base = |input: &SessionInput| {
        let ties = Ties {
            reports: &input.box_reports,
            edges: [&input.edges[0], &input.edges[1]],
            channel: 0,
            recorded: [&[], &[]],
            legs: &input.legs,
            used_at_us: &s.joined.presses,
        };
        TimeBase::new(&ties, &AlignmentSettings::default()).unwrap()
    };
    let (with, without) = (base(&with).alignment, base(&without).alignment);
    assert_eq!(with.status, AlignmentStatus::Valid, "{with:#?}");
    assert_eq!(with.camera_from_host, without.camera_from_host);
}

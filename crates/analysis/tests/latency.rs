//! The detection-latency study: its parts against slow references, planted onsets, inputs without an answer.

#![expect(clippy::unwrap_used, reason = "tests")]

#[path = "session/support.rs"]
mod support;

use proptest::prelude::*;
use skinrig_analysis::analyze;
use skinrig_analysis::kept::{Kept, KeptEvent, KeptPress, KeptView};
use skinrig_analysis::latency::bins::{Grid, Sight};
use skinrig_analysis::latency::cusum::{Cusum, background_rate_per_s};
use skinrig_analysis::latency::interval::{Outcome, Plan};
use skinrig_analysis::latency::smooth::{Edges, Kernel};
use skinrig_analysis::latency::study;
use skinrig_analysis::latency::sweep::{Hits, choose, sweep, thresholds};
use skinrig_analysis::latency::thin::chosen;
use skinrig_analysis::latency::trial::{Detector, Label, Trial};
use skinrig_analysis::result::{Analysis, ClockFit, ClockMethod, Latency, ThresholdRow};
use skinrig_model::{
    Background, CdEvent, HostDuration, LatencySettings, Polarity, PressId, PressRole,
};
use support::Random;

const BIN_S: f64 = 2e-4;

impl Random {
    /// Poisson counts by the times between events: slow, and right for any rate.
    fn counts(&mut self, per_s: impl Fn(usize) -> f64, bins: usize) -> Vec<u32> {
        (0..bins)
            .map(|bin| {
                let (mut n, mut t) = (0, -(1.0 - self.unit()).ln());
                while t < per_s(bin) * BIN_S {
                    n += 1;
                    t -= (1.0 - self.unit()).ln();
                }
                n
            })
            .collect()
    }
}

fn detector() -> Detector {
    let settings = LatencySettings::default();
    Detector::new(&settings, Edges::Renormalised, thresholds((1.0, 20.0), 20))
}

fn label(press: u32) -> Label {
    Label {
        press: PressId(press),
        location: press,
    }
}

/// Bins from `first` to `first + counts.len()`.
fn look(detector: &Detector, first: i64, counts: &[u32], background: &[u32]) -> Trial {
    let grid = Grid {
        first,
        len: counts.len(),
    };
    detector.look(label(0), grid, counts, background)
}

/// The whole detector for one threshold, as one would write it down from the paper: index of the onset.
fn slow_onset(detector: &Detector, counts: &[u32], rate_per_s: f64, h: f64) -> Option<usize> {
    let path = slow_path(detector, counts, rate_per_s);
    let run = detector.consecutive as usize;
    (0..path.len()).find(|i| (*i..i + run).all(|k| path.get(k).is_some_and(|s| *s >= h)))
}

fn slow_path(detector: &Detector, counts: &[u32], rate_per_s: f64) -> Vec<f64> {
    let half = (4.0 * 0.5f64 / detector.bin_ms).round() as i64;
    let tap = |k: i64| (-0.5 * (k as f64 * detector.bin_ms / 0.5).powi(2)).exp();
    let mut sum = 0.0f64;
    (0..counts.len() as i64)
        .map(|i| {
            let inside = |k: &i64| (0..counts.len() as i64).contains(&(i + k));
            let taps: f64 = match detector.edges {
                Edges::Renormalised => (-half..=half).filter(inside).map(tap).sum(),
                Edges::ZeroPadded => (-half..=half).map(tap).sum(),
            };
            let x: f64 = (-half..=half)
                .filter(inside)
                .map(|k| tap(k) / taps * f64::from(counts[(i + k) as usize]))
                .sum();
            let step = x * detector.alpha.ln() - (detector.alpha - 1.0) * rate_per_s * BIN_S;
            sum = (sum + step).max(0.0);
            sum
        })
        .collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// One sweep for all thresholds finds what a search for each finds.
    #[test]
    fn onsets_are_those_of_straight_loops(
        seed in 1u64.., rate in 0.0f64..50_000.0, step in 0.0f64..10.0, bins in 0usize..700, padded in any::<bool>(),
        consecutive in 1u32..6,
    ) {
        let mut random = Random(seed);
        let counts = random.counts(|bin| if bin < bins / 2 { rate } else { rate * step }, bins);
        let background = random.counts(|_| rate, 500);
        let detector = Detector {
            edges: if padded { Edges::ZeroPadded } else { Edges::Renormalised },
            consecutive,
            // Never exactly on a value of the path, where the last digit would decide.
            thresholds: (0..20).map(|i| 0.7 + 1.013 * f64::from(i)).collect(),
            ..detector()
        };
        let trial = look(&detector, -300, &counts, &background);
        let events: u32 = background.iter().sum();
        let rate = f64::from(events).max(0.5) / 0.1;
        for (h, onset) in detector.thresholds.iter().zip(&trial.onsets_ms) {
            let slow = slow_onset(&detector, &counts, rate, *h);
            let slow_ms = slow.map(|bin| (bin as f64 - 300.0 + 0.5) * 0.2);
            prop_assert_eq!(*onset, slow_ms, "h {}", h);
        }
    }

    /// Each alarm is the first onset since the detector was started anew.
    #[test]
    fn alarms_are_onsets_one_after_another(
        seed in 1u64.., rate in 100.0f64..30_000.0, h in 0.5f64..6.0, cool_down in 0usize..200,
    ) {
        let counts = Random(seed).counts(|bin| if bin % 500 < 20 { 3.0 * rate } else { rate }, 3000);
        let smoothed: Vec<f64> = counts.iter().map(|c| f64::from(*c)).collect();
        let cusum = Cusum::new(4.0, rate, BIN_S, 3);
        let (mut alarms, mut from) = (0, 0);
        while let Some(onset) = smoothed.get(from..).and_then(|rest| cusum.onsets(rest, &[h])[0]) {
            alarms += 1;
            from += onset + 3 + cool_down;
        }
        prop_assert_eq!(cusum.alarms(&smoothed, h, cool_down), alarms);
    }
}

#[test]
fn the_kernel_is_the_published_one_and_keeps_a_constant() {
    let kernel = Kernel::gaussian(0.5, 0.2);
    let taps = kernel.taps();
    assert_eq!(taps.len(), 11);
    assert!((taps[0] - 0.159_580_679_327_215_23).abs() < 1e-15);
    assert!((taps[10] - 5.353_335_404_957_566_5e-5).abs() < 1e-18);
    assert!((taps[0] + 2.0 * taps[1..].iter().sum::<f64>() - 1.0).abs() < 1e-15);
    // Also where there are fewer bins than taps.
    for n in [1, 6, 20, 21, 100] {
        let smoothed = kernel.smooth(&vec![7; n], Edges::Renormalised);
        assert_eq!(smoothed.len(), n);
        assert!(
            smoothed.iter().all(|x| (x - 7.0).abs() < 1e-12),
            "{n}: {smoothed:?}"
        );
    }
    let padded = kernel.smooth(&[7; 100], Edges::ZeroPadded);
    assert!((padded[50] - 7.0).abs() < 1e-12 && padded[0] < 4.1 && padded[99] < 4.1);
    assert_eq!(
        Kernel::gaussian(0.0, 0.2).smooth(&[3, 0, 5], Edges::ZeroPadded),
        [3.0, 0.0, 5.0]
    );
}

#[test]
fn windows_of_published_length_hold_the_published_bins() {
    for (seconds, bins) in [(0.3, 1500), (0.6, 3000), (1.0, 5000), (1.7, 8500)] {
        assert_eq!(
            Grid::within(0.0, seconds * 1e6, 200.0),
            Grid {
                first: 0,
                len: bins
            }
        );
        assert_eq!(
            Grid::within(-seconds * 1e6, 0.0, 200.0).first,
            -(bins as i64)
        );
    }
    // Only whole bins.
    assert_eq!(
        Grid::within(-399.0, 599.0, 200.0),
        Grid { first: -1, len: 3 }
    );
    assert_eq!(Grid::within(10.0, -10.0, 200.0).len, 0);
}

/// A camera's view that begins 1 s before the contact, with events at these host times after the contact, µs.
fn view(clock: &ClockFit, contact_us: f64, after_us: &[f64]) -> KeptView {
    let rate = 1.0 + clock.drift_ppm * 1e-6;
    let start_us = (contact_us - 1e6).floor().max(0.0) as u64;
    let contact_us = contact_us - start_us as f64;
    let mut events: Vec<KeptEvent> = after_us
        .iter()
        .map(|after| {
            let t_us = start_us + (contact_us + after * rate).round() as u64;
            let event = CdEvent {
                t_us,
                x: 3,
                y: 200,
                polarity: Polarity::On,
            };
            KeptEvent::pack(&event, start_us).unwrap()
        })
        .collect();
    events.sort_unstable();
    KeptView {
        start_us,
        length_us: 3_000_000,
        window_us: ((contact_us - 5e4).ceil() as u32, (contact_us + 5e5) as u32),
        idle_from_us: (contact_us - 5.5e5) as u32,
        contact_us,
        release_us: contact_us + 4.5e5,
        events,
    }
}

fn clock(drift_ppm: f64) -> ClockFit {
    ClockFit {
        method: ClockMethod::TriggerMarks,
        offset_us: 0.0,
        drift_ppm,
        drift_se_ppm: 0.0,
        residual_rms_us: 0.0,
        residual_max_us: 0.0,
        n: 3,
        rejected: 0,
    }
}

#[test]
fn every_event_is_in_the_bin_of_its_host_time_and_in_one_only() {
    // The edges of bins and a µs beside them, at the contact and far from it; the second clock runs 1000 ppm fast, so
    // that a host time that is not its own whole µs is rounded.
    for (drift, second) in [(0.0, 200.0), (1000.0, 201.0)] {
        let after = [
            -850_000.0, -200.0, -1.0, 0.0, 199.0, second, 800_000.0, 849_999.0,
        ];
        let bins = [-4250, -1, -1, 0, 0, 1, 4000, 4249];
        let clock = clock(drift);
        let view = view(&clock, 5e6, &after);
        let sight = Sight::new(&view, &clock, 0.0);
        let grid = Grid::within(-850_000.0, 850_000.0, 200.0);
        let count = |grid: Grid| {
            let mut counts = vec![0; grid.len];
            let events = sight.within(grid, 200.0).iter().copied();
            sight.count(events, grid, 200.0, &mut counts);
            counts
        };
        let counts = count(grid);
        assert_eq!(counts.len(), 8500);
        assert_eq!(counts.iter().sum::<u32>(), 8, "drift {drift}");
        for bin in bins {
            assert!(
                counts[(bin + 4250) as usize] > 0,
                "drift {drift}, bin {bin}"
            );
        }
        // Cut anywhere, the parts hold what the whole holds.
        for cut in [-4250, -1, 0, 1, 4249] {
            let before = count(Grid {
                first: -4250,
                len: (cut + 4250) as usize,
            });
            let after = count(Grid {
                first: cut,
                len: (4250 - cut) as usize,
            });
            assert_eq!([before, after].concat(), counts);
        }
    }
}

#[test]
fn a_background_has_a_rate_whatever_is_in_it() {
    // 0 and 1 events (public code: 0.001 per second), 2 events 1 µs apart (2e6), 2 at one instant (2e9): all over 0.9 s.
    for (events, rate) in [
        (0, 0.5 / 0.9),
        (1, 1.0 / 0.9),
        (2, 2.0 / 0.9),
        (45_000_000, 5e7),
    ] {
        assert!((background_rate_per_s(events, 0.9) / rate - 1.0).abs() < 1e-12);
    }
    // A touch is found behind each of the four, and a single event is none.
    let detector = detector();
    let quiet = vec![0; 4500];
    let mut touch = vec![0; 8500];
    touch[4250..4350].fill(10);
    for (bin, events) in [(0, 0), (2000, 1), (2000, 2), (4499, 2)] {
        let mut background = quiet.clone();
        background[bin] = events;
        let trial = look(&detector, -4250, &touch, &background);
        let onset = trial.onsets_ms[9].unwrap();
        assert!((-2.0..=0.2).contains(&onset), "{events} events: {onset} ms");
        let mut single = vec![0; 8500];
        single[100] = 1;
        let none = look(&detector, -4250, &single, &background);
        assert!(none.onsets_ms[4..].iter().all(Option::is_none));
    }
}

#[test]
fn trials_without_an_answer_are_answered_with_none() {
    let detector = detector();
    // No event; fewer bins than taps; a single bin; no bin.
    for counts in [vec![0; 8500], vec![0, 1, 0, 0, 1, 0], vec![1], vec![]] {
        let trial = look(&detector, 0, &counts, &[1, 0, 0, 1, 0]);
        assert!(
            trial.onsets_ms.iter().all(Option::is_none),
            "{} bins",
            counts.len()
        );
    }
    // All events at one instant: a burst like any other.
    let mut instant = vec![0; 8500];
    instant[4250] = 10_000_000;
    let trial = look(&detector, -4250, &instant, &[0; 2000]);
    assert!(
        trial
            .onsets_ms
            .iter()
            .all(|t| t.is_some_and(|t| (-2.0..=0.2).contains(&t)))
    );
    // 5e7 events per second throughout are background, four times as many are not.
    let flood = vec![10_000; 8500];
    let trial = look(&detector, -4250, &flood, &flood[..2000]);
    assert!(trial.onsets_ms.iter().all(Option::is_none));
    assert_eq!(trial.alarms(0, 1.0, 10), 0);
    let more: Vec<u32> = (0..8500)
        .map(|i| if i < 4250 { 10_000 } else { 40_000 })
        .collect();
    let trial = look(&detector, -4250, &more, &flood[..2000]);
    assert!(
        trial
            .onsets_ms
            .iter()
            .all(|t| t.is_some_and(|t| (-2.0..=0.2).contains(&t)))
    );
}

#[test]
fn a_planted_step_is_found_in_its_bin() {
    let mut random = Random(11);
    let sharp = Detector {
        kernel: Kernel::gaussian(0.0, 0.2),
        ..detector()
    };
    let smooth = detector();
    for planted in [-2000i64, -1, 0, 37, 3000] {
        let rate = |bin: usize| {
            if (bin as i64 - 4250) < planted {
                500.0
            } else {
                100_000.0
            }
        };
        let counts = random.counts(rate, 8500);
        let background = random.counts(|_| 500.0, 2250);
        // Twenty events per bin against a threshold of ten: the first bin decides.
        let onset = |d: &Detector| look(d, -4250, &counts, &background).onsets_ms[9].unwrap();
        let begins_ms = planted as f64 * 0.2;
        assert!((onset(&sharp) - begins_ms - 0.1).abs() < 1e-9, "{planted}");
        let early = onset(&smooth) - begins_ms;
        assert!((-2.0..=0.2).contains(&early), "{planted}: {early}");
    }
}

#[test]
fn false_alarms_on_pure_background_are_as_rare_as_theory_says() {
    // Lorden 1971: the mean time between false alarms of an unsmoothed CUSUM is at least exp(h) bins. For Poisson counts the
    // sum jumps in steps of ln 4, so the true rate lies below, within the overshoot of about one such step and the share
    // of excursions that a run of one bin asks for.
    let (rate, seconds) = (2000.0, 200.0);
    let counts = Random(5).counts(|_| rate, (seconds / BIN_S) as usize);
    let smoothed: Vec<f64> = counts.iter().map(|c| f64::from(*c)).collect();
    let cusum = Cusum::new(4.0, rate, BIN_S, 1);
    for h in [3.0f64, 5.0, 7.0] {
        let found = f64::from(cusum.alarms(&smoothed, h, 0)) / seconds;
        let bound = (-h).exp() / BIN_S;
        assert!(
            found < bound && found > 0.02 * bound,
            "h {h}: {found} alarms/s, bound {bound}"
        );
    }
    // A cool-down leaves time in which nothing can alarm.
    assert!(cusum.alarms(&smoothed, 3.0, 500) < cusum.alarms(&smoothed, 3.0, 0));
}

#[test]
fn onsets_count_about_their_median() {
    let hits = Hits::of(vec![10.0, 500.0, 12.0, 11.0, 111.0], 99.0);
    assert_eq!(
        (hits.onsets, hits.median_ms, hits.count),
        (5, Some(12.0), 4)
    );
    // Linear between order statistics: 10 + 0.15 and 12 + 0.85 * 99.
    assert!((hits.width_ms.unwrap() - (12.0 + 0.85 * 99.0 - 10.15)).abs() < 1e-9);
    // Nothing detected; one; two that lie further apart than two windows.
    let none = Hits {
        onsets: 0,
        median_ms: None,
        count: 0,
        width_ms: None,
    };
    assert_eq!(Hits::of(vec![], 100.0), none);
    assert_eq!(Hits::of(vec![3.0], 100.0).width_ms, Some(0.0));
    let apart = Hits {
        onsets: 2,
        median_ms: Some(150.0),
        count: 0,
        width_ms: None,
    };
    assert_eq!(Hits::of(vec![0.0, 300.0], 100.0), apart);
}

#[test]
fn the_threshold_has_the_fewest_false_alarms_among_those_that_detect_enough() {
    let rows = |list: &[(f64, f64)]| -> Vec<ThresholdRow> {
        let row = |(i, &(detected_rate, false_alarms_per_s)): (usize, &(f64, f64))| ThresholdRow {
            threshold: i as f64,
            onsets: 0,
            detected_rate,
            median_ms: Some(20.0),
            width_ms: None,
            false_alarms_per_s,
        };
        list.iter().enumerate().map(row).collect()
    };
    // The share of detections need not fall with the threshold.
    let all = rows(&[
        (0.96, 9.0),
        (0.2, 0.0),
        (0.97, 1.0),
        (0.95, 1.0),
        (0.9, 0.5),
    ]);
    assert_eq!(choose(&all, 0.95, -100.0), Some(2));
    assert_eq!(choose(&all, 0.99, -100.0), Some(2));
    assert_eq!(choose(&all, 0.9, -100.0), Some(4));
    assert_eq!(
        choose(&rows(&[(0.5, 3.0), (0.5, 2.0)]), 0.95, -100.0),
        Some(1)
    );
    assert_eq!(choose(&rows(&[(0.0, 3.0), (0.0, 2.0)]), 0.95, -100.0), None);
    assert_eq!(choose(&rows(&[(0.0, 3.0)]), 0.0, -100.0), None);
    assert_eq!(choose(&[], 0.95, -100.0), None);
    // Onsets that agree well, on the background 0.8 s before the contact.
    let mut early = all.clone();
    early.extend(rows(&[(0.0, 0.0); 5]));
    early.extend(rows(&[(0.0, 0.0); 5]).into_iter().map(|r| ThresholdRow {
        median_ms: None,
        ..r
    }));
    early.push(ThresholdRow {
        median_ms: Some(-800.0),
        detected_rate: 1.0,
        ..all[1]
    });
    assert_eq!(choose(&early, 0.95, -100.0), Some(2));
    assert_eq!(choose(&early, 0.95, -1000.0), Some(15));
    // Trials in which nothing is found: a share of 0, no width, no choice.
    let detector = detector();
    let silent = vec![look(&detector, 0, &[0; 100], &[1; 100]); 3];
    let found = sweep(&silent, &detector, 100.0);
    assert!(
        found
            .iter()
            .all(|r| r.detected_rate == 0.0 && r.width_ms.is_none())
    );
    assert_eq!((found.len(), choose(&found, 0.95, -100.0)), (20, None));
    assert_eq!(sweep(&[], &detector, 100.0), []);
    assert_eq!(thresholds((17.0, 19.0), 3), [17.0, 18.0, 19.0]);
    assert_eq!(thresholds((5.0, 9.0), 1), [5.0]);
}

#[test]
fn thinning_keeps_the_rounded_share_and_every_event_alike() {
    use rand_xoshiro::rand_core::SeedableRng;
    let mut rng = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(3);
    for (n, factor, kept) in [
        (0, 1024, 0),
        (511, 1024, 0),
        (512, 1024, 0),
        (513, 1024, 1),
        (1536, 1024, 2),
        (2560, 1024, 2),
        (7, 1, 7),
    ] {
        let picks = chosen(n, factor, &mut rng);
        assert_eq!(picks.len(), kept, "{n} / {factor}");
        assert!(picks.windows(2).all(|w| w[0] < w[1]) && picks.iter().all(|i| *i < n));
    }
    let mut times = [0u32; 40];
    for _ in 0..4000 {
        for i in chosen(40, 4, &mut rng) {
            times[i] += 1;
        }
    }
    // 1000 each; five standard deviations of a binomial are 137.
    assert!(times.iter().all(|t| t.abs_diff(1000) < 137), "{times:?}");
}

/// The planted session's results with events of another kind: background at 400 per second and camera, and a burst
/// of 20 000 per second and camera that begins `latency_us(press)` after the contact.
fn planted(latency_us: impl Fn(usize) -> Option<f64>) -> (Analysis, Kept) {
    let (input, memory) = support::session();
    let analysis = analyze(&input, &memory).unwrap();
    let mut random = Random(21);
    let scored = analysis
        .presses
        .iter()
        .enumerate()
        .filter(|(_, p)| p.role == PressRole::Score);
    let presses = scored
        .enumerate()
        .map(|(n, (row, press))| {
            let contact = press.timing.unwrap().contact;
            let views = [0, 1].map(|k| {
                let clock = analysis.clocks[k].unwrap();
                let mut after: Vec<f64> = (0..760).map(|_| 1.9e6 * random.unit() - 1e6).collect();
                if let Some(begin) = latency_us(n) {
                    after.extend((0..4000).map(|i| begin + 50.0 * f64::from(i)));
                }
                view(&clock, clock.camera_us_of_host(contact), &after)
            });
            KeptPress {
                row,
                press: press.press,
                views,
            }
        })
        .collect();
    (
        analysis,
        Kept {
            presses,
            left_out: 0,
        },
    )
}

fn studied(analysis: &Analysis, kept: &Kept) -> Latency {
    study(analysis, kept).unwrap()
}

#[test]
fn planted_latencies_come_back_with_their_uncertainty() {
    // 10, 11, ... 34 ms; camera clocks differ by hours and 63 ppm.
    let (mut analysis, kept) = planted(|n| Some(1e4 + 1e3 * n as f64));
    analysis.contact_timing.pose_interval_us = 1000.0;
    let found = studied(&analysis, &kept);
    assert_eq!((found.trials, found.unusable, found.shortened), (25, 0, 0));
    assert_eq!(found.detected_rate.value, Some(1.0));
    assert!((found.background_rate_per_s - 800.0).abs() < 60.0);
    // 0.55 s to 0.05 s before each contact.
    assert!(
        (found.background_s - 25.0 * 0.5).abs() < 0.02,
        "{}",
        found.background_s
    );
    for (n, (press, onset)) in found.onsets.iter().enumerate() {
        let late = onset.unwrap() - (10.0 + n as f64);
        assert!((-2.0..=0.3).contains(&late), "{press}: {late} ms late");
    }
    let contact = found.from_contact.unwrap();
    let close = |e: skinrig_analysis::result::Estimate, ms: f64| {
        let v = e.value.unwrap();
        (v - ms).abs() <= 2.0 && e.low.unwrap() <= v && v <= e.high.unwrap() && e.n == 25
    };
    assert!(
        close(contact.p5_ms, 11.2) && close(contact.median_ms, 22.0) && close(contact.p95_ms, 32.8)
    );
    assert!((found.width_ms.value.unwrap() - 21.6).abs() < 1.0);
    assert_eq!((contact.before_contact, contact.missed), (0, 0));
    // 1000 µs between poses and 200 µs bins over the root of 12; marks are good to 0.5 µs, the clocks to a µs or so.
    assert!((contact.from_contact_ms - 0.288_675).abs() < 1e-6);
    assert!((contact.from_bins_ms - 0.057_735).abs() < 1e-6);
    assert!(contact.from_clocks_ms > 0.000_288 && contact.from_clocks_ms < 0.005);
    let parts = [
        contact.from_contact_ms,
        contact.from_bins_ms,
        contact.from_clocks_ms,
    ];
    let sum: f64 = parts.iter().map(|p| p * p).sum();
    assert!((contact.uncertainty_ms - sum.sqrt()).abs() < 1e-12);
    assert!((found.decision_delay_ms - 2.5).abs() < 1e-12);
    let reduced = found.reduced.unwrap();
    assert_eq!((reduced.factor, reduced.detected_rate.n), (1024, 25));
    // The course rises where the touches begin, and has one bin per 2 ms.
    let course = &found.course;
    assert_eq!((course.start_ms, course.bin_ms), (-850.0, 2.0));
    assert!(course.press_per_s.iter().all(|c| c.len() == 850));
    let at = |ms: f64| course.press_per_s[1][((ms - course.start_ms) / course.bin_ms) as usize];
    assert!(at(5.0) < 2000.0 && at(40.0) > 38_000.0);
    assert!(
        course.background_per_s[0] <= course.background_per_s[1]
            && course.background_per_s[2] < 4000.0
    );
}

#[test]
fn what_is_before_the_contact_or_never_comes_is_counted_apart() {
    let (mut analysis, kept) = planted(|n| match n {
        0 => None,
        // Before the idle time that the background is taken from.
        1 | 2 => Some(-7.8e5),
        _ => Some(2e4),
    });
    // High enough that the background alone does not cross it near the contact by chance.
    analysis.settings.latency.threshold_range = (16.0, 20.0);
    let found = studied(&analysis, &kept);
    assert_eq!(found.trials, 25);
    let rate = found.detected_rate.value.unwrap();
    assert!(
        (rate - 22.0 / 25.0).abs() < 1e-12,
        "{rate}: {:?}",
        found.onsets
    );
    let contact = found.from_contact.unwrap();
    assert_eq!((contact.before_contact, contact.missed), (2, 1));
    assert_eq!(contact.median_ms.n, 22);
    assert_eq!(contact.from_contact_ms, 0.0);
    assert!((contact.p5_ms.value.unwrap() - 20.0).abs() < 2.1);
}

#[test]
fn what_was_left_out_by_hand_is_no_trial_and_what_the_skin_missed_is() {
    let (mut analysis, kept) = planted(|_| Some(2e4));
    for (n, rule) in [
        (3, "by hand"),
        (4, "the operator's hand in view"),
        (5, "no cluster (camera 1)"),
    ] {
        let press = &mut analysis.presses[kept.presses[n].row];
        press.verdict = "excluded".to_owned();
        press.rule = Some(rule.to_owned());
    }
    let found = studied(&analysis, &kept);
    assert_eq!((found.trials, found.unusable), (23, 2));
    let tried = |n: usize| {
        let press = kept.presses[n].press;
        found.onsets.iter().any(|o| o.0 == press)
    };
    assert_eq!([3, 4, 5].map(tried), [false, false, true]);
}

#[test]
fn no_false_alarm_and_no_miss_is_not_certainty() {
    let plan = Plan {
        window_ms: 100.0,
        earliest_ms: 0.0,
        resamples: 100,
        seed: 1,
    };
    // Two presses at each of six locations.
    let one = |i: u32| Outcome {
        location: i / 2,
        onset_ms: Some(20.0),
        alarms: 0,
        background_s: 0.5,
    };
    let all: Vec<Outcome> = (0..12).map(one).collect();
    let near = |found: Option<f64>, wanted: f64| (found.unwrap() - wanted).abs() < 1e-12;
    let found = plan.estimate(&all);
    let (detected, alarms) = (found.detected_rate, found.false_alarms_per_s);
    assert!(near(detected.low, 0.025f64.powf(1.0 / 6.0)) && detected.high == Some(1.0));
    assert!(alarms.low == Some(0.0) && near(alarms.high, -0.025f64.ln() / 6.0));
    assert_eq!(
        (found.width_ms.value, found.width_ms.high),
        (Some(0.0), Some(0.0))
    );
    let none: Vec<Outcome> = all
        .iter()
        .map(|o| Outcome {
            onset_ms: None,
            ..*o
        })
        .collect();
    let detected = plan.estimate(&none).detected_rate;
    assert!(detected.low == Some(0.0) && near(detected.high, 1.0 - 0.025f64.powf(1.0 / 6.0)));
}

#[test]
fn latency_from_the_contact_needs_a_contact_measured_apart_from_the_events() {
    let (mut analysis, kept) = planted(|_| Some(2e4));
    analysis.contact_timing.scheduled = true;
    assert_eq!(studied(&analysis, &kept).from_contact, None);
    analysis.contact_timing.scheduled = false;
    let fit = analysis.clocks[1].as_mut().unwrap();
    fit.method = ClockMethod::EventRates;
    let found = studied(&analysis, &kept);
    assert_eq!(found.from_contact, None);
    assert!(found.median_ms.value.is_some());
    analysis.clocks[0] = None;
    assert_eq!(study(&analysis, &kept), None);
}

#[test]
fn neighbours_cut_a_trial_and_the_study_says_so() {
    let (mut analysis, mut kept) = planted(|_| Some(2e4));
    // The press before the tenth is released 0.4 s before its contact.
    let row = kept.presses[10].row;
    let contact = analysis.presses[row].timing.unwrap().contact;
    let before = analysis.presses[row - 1].timing.as_mut().unwrap();
    before.release = contact - HostDuration::from_millis(400);
    let found = studied(&analysis, &kept);
    assert_eq!((found.trials, found.shortened), (25, 1));
    assert!((found.covered_ms.0 - 350.0).abs() < 0.1 && (found.covered_ms.1 - 850.0).abs() < 0.1);
    // 0.35 s to 0.05 s before that contact, 0.5 s before the others.
    assert!(
        (found.background_s - 24.0 * 0.5 - 0.3).abs() < 0.02,
        "{}",
        found.background_s
    );
    assert_eq!(found.detected_rate.value, Some(1.0));
    // Without idle time there is no background, and without background no trial.
    for press in &mut kept.presses {
        for view in &mut press.views {
            view.idle_from_us = view.window_us.0;
        }
    }
    let none = studied(&analysis, &kept);
    assert_eq!((none.trials, none.unusable, none.chosen), (0, 25, None));
    assert_eq!(
        (
            none.sweep.len(),
            none.detected_rate.value,
            none.false_alarms_per_s.value
        ),
        (0, None, None)
    );
    let text = serde_json::to_string(&none).unwrap();
    assert!(!text.contains("NaN"), "{text}");
    assert_eq!(serde_json::from_str::<Latency>(&text).unwrap(), none);
    // Views that end before the contact.
    kept.presses.truncate(3);
    for view in kept.presses.iter_mut().flat_map(|p| &mut p.views) {
        view.length_us = 900_000;
    }
    assert_eq!(studied(&analysis, &kept).unusable, 3);
    kept.presses.clear();
    assert_eq!(study(&analysis, &kept), None);
}

#[test]
fn the_published_choice_takes_its_background_after_the_press_and_pads_with_zeros() {
    let (mut analysis, mut kept) = planted(|_| Some(2e4));
    analysis.settings.latency.background = Background::After;
    // It lasts to 2.4 s after the middle; presses come every 1.75 s and only the last has nothing after it.
    let none = studied(&analysis, &kept);
    assert_eq!((none.trials, none.unusable), (1, 24));
    for press in &mut analysis.presses {
        let shift = HostDuration::from_secs_f64(2.0 * f64::from(press.press.0));
        let timing = press.timing.as_mut().unwrap();
        timing.contact += shift;
        timing.release += shift;
    }
    for view in kept.presses.iter_mut().flat_map(|p| &mut p.views) {
        view.length_us = 4_000_000;
    }
    let found = studied(&analysis, &kept);
    assert_eq!(
        (found.trials, found.shortened, found.zero_padded),
        (25, 0, true)
    );
    assert!((found.background_s - 25.0 * 0.9).abs() < 0.02);
    assert_eq!(found.background_rate_per_s, 0.0);
    // 1.5 s - 0.85 s from half a period before the middle, 225 ms after the contact.
    let half = 868_000.0 / 289.0 / 2.0;
    let (before, after) = (half - 1500.0 + 850.0 - 225.0, 1500.0 + 850.0 - half + 225.0);
    assert!(
        (found.covered_ms.0 - before).abs() < 0.01 && (found.covered_ms.1 - after).abs() < 0.01
    );
}

#[test]
fn the_study_is_the_same_whatever_the_number_of_threads() {
    let (analysis, kept) = planted(|n| (n % 5 > 0).then_some(1e4 + 2e3 * n as f64));
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        serde_json::to_string(&pool.install(|| studied(&analysis, &kept))).unwrap()
    };
    assert_eq!(with(1), with(3));
}

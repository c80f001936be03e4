//! The detector: its kernel, its path compared with a slow reference, its threshold, its false alarms.

use super::*;

/// Index of the onset from a direct implementation of the paper for one threshold.
fn slow_onset(detector: &Detector, counts: &[u32], rate_per_s: f64, h: f64) -> Option<usize> {
    let path = slow_path(detector, counts, rate_per_s);
    let run = detector.consecutive as usize;
    (0..path.len()).find(|i| (*i..i + run).all(|k| path.get(k).is_some_and(|s| *s >= h)))
}

fn slow_path(detector: &Detector, counts: &[u32], rate_per_s: f64) -> Vec<f64> {
    let half = (4.0 * 0.5f64 / detector.bin_ms).round() as i64;
    let tap = |k: i64| libm::exp(-0.5 * (k as f64 * detector.bin_ms / 0.5).powi(2));
    let mut sum = 0.0f64;
    (0..counts.len() as i64)
        .map(|i| {
            let inside = |k: &i64| (0..counts.len() as i64).contains(&(i + k));
            let taps: f64 = match detector.edges {
                Boundary::Renormalised => (-half..=half).filter(inside).map(tap).sum(),
                Boundary::ZeroPadded => (-half..=half).map(tap).sum(),
            };
            let x: f64 = (-half..=half)
                .filter(inside)
                .map(|k| tap(k) / taps * f64::from(counts[(i + k) as usize]))
                .sum();
            let step = x * libm::log(detector.alpha) - (detector.alpha - 1.0) * rate_per_s * BIN_S;
            sum = (sum + step).max(0.0);
            sum
        })
        .collect()
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
        let smoothed = kernel.smooth(&vec![7; n], Boundary::Renormalised);
        assert_eq!(smoothed.len(), n);
        assert!(
            smoothed.iter().all(|x| (x - 7.0).abs() < 1e-12),
            "{n}: {smoothed:?}"
        );
    }
    let padded = kernel.smooth(&[7; 100], Boundary::ZeroPadded);
    assert!((padded[50] - 7.0).abs() < 1e-12 && padded[0] < 4.1 && padded[99] < 4.1);
    assert_eq!(
        Kernel::gaussian(0.0, 0.2).smooth(&[3, 0, 5], Boundary::ZeroPadded),
        [3.0, 0.0, 5.0]
    );
}

#[test]
fn every_background_has_a_rate() {
    // 0 and 1 events (public code: 0.001 per second), 2 events 1 µs apart (2e6), 2 simultaneous ones (2e9): all over 0.9 s.
    for (events, rate) in [
        (0, 0.5 / 0.9),
        (1, 1.0 / 0.9),
        (2, 2.0 / 0.9),
        (45_000_000, 5e7),
    ] {
        assert!((background_rate_per_s(events, 0.9) / rate - 1.0).abs() < 1e-12);
    }
    // A press is found after each of the four, and a single event is not a press.
    let detector = detector();
    let quiet = vec![0; 4500];
    let mut touch = vec![0; 8500];
    touch[4250..4350].fill(10);
    for (bin, events) in [(0, 0), (2000, 1), (2000, 2), (4499, 2)] {
        let mut background = quiet.clone();
        background[bin] = events;
        let trial = run(&detector, -4250, &touch, &background);
        let onset = onsets_ms(&trial)[9].unwrap();
        assert!((-2.0..=0.2).contains(&onset), "{events} events: {onset} ms");
        let mut single = vec![0; 8500];
        single[100] = 1;
        let none = run(&detector, -4250, &single, &background);
        assert!(onsets_ms(&none)[4..].iter().all(Option::is_none));
    }
}

#[test]
fn trials_without_an_answer_are_answered_with_none() {
    let detector = detector();
    // No event; fewer bins than taps; a single bin; no bin.
    for counts in [vec![0; 8500], vec![0, 1, 0, 0, 1, 0], vec![1], vec![]] {
        let trial = run(&detector, 0, &counts, &[1, 0, 0, 1, 0]);
        assert!(
            onsets_ms(&trial).iter().all(Option::is_none),
            "{} bins",
            counts.len()
        );
    }
    // All events simultaneous: a burst like any other.
    let mut instant = vec![0; 8500];
    instant[4250] = 10_000_000;
    let trial = run(&detector, -4250, &instant, &[0; 2000]);
    assert!(
        onsets_ms(&trial)
            .iter()
            .all(|t| t.is_some_and(|t| (-2.0..=0.2).contains(&t)))
    );
    // 5e7 events per second throughout are background, four times as many are not.
    let flood = vec![10_000; 8500];
    let trial = run(&detector, -4250, &flood, &flood[..2000]);
    assert!(onsets_ms(&trial).iter().all(Option::is_none));
    let more: Vec<u32> = (0..8500)
        .map(|i| if i < 4250 { 10_000 } else { 40_000 })
        .collect();
    let trial = run(&detector, -4250, &more, &flood[..2000]);
    assert!(
        onsets_ms(&trial)
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
        let signal = counts(&mut random, rate, 8500);
        let background = counts(&mut random, |_| 500.0, 2250);
        // Twenty events per bin against a threshold of ten: the first bin decides.
        let onset = |d: &Detector| onsets_ms(&run(d, -4250, &signal, &background))[9].unwrap();
        let begins_ms = planted as f64 * 0.2;
        assert!((onset(&sharp) - begins_ms - 0.1).abs() < 1e-9, "{planted}");
        let early = onset(&smooth) - begins_ms;
        assert!((-2.0..=0.2).contains(&early), "{planted}: {early}");
    }
}

#[test]
fn false_alarms_on_pure_background_match_theory() {
    // Lorden 1971: the mean time between false alarms of an unsmoothed CUSUM is at least exp(h) bins. For Poisson counts the
    // sum jumps in steps of ln 4, so the true rate is lower, by the overshoot of about one such step and the share of
    // excursions that a run of one bin requires.
    let rate = 2000.0;
    let mut random = Random(5);
    let detector = Detector {
        kernel: Kernel::gaussian(0.0, 0.2),
        consecutive: 1,
        thresholds: vec![3.0, 5.0, 7.0],
        earliest_ms: 0.0,
        ..detector()
    };
    // A background of 20 s, so that its rate is known.
    let background = counts(&mut random, |_| rate, 100_000);
    let trials: Vec<Trial> = (0..400)
        .map(|_| {
            run(
                &detector,
                -2500,
                &counts(&mut random, |_| rate, 2500),
                &background,
            )
        })
        .collect();
    for (row, h) in sweep(&trials, &detector, 100.0)
        .iter()
        .zip([3.0f64, 5.0, 7.0])
    {
        let bound = libm::exp(-h) / BIN_S;
        let found = row.false_alarms_per_s;
        assert!(
            found < bound && found > 0.02 * bound,
            "h {h}: {found} alarms/s, bound {bound}"
        );
        assert_eq!(found, f64::from(row.false_alarms) / row.at_risk_s);
    }
}

#[test]
fn a_trip_before_the_contact_ends_the_search() {
    // 0.85 s before the contact to 0.85 s after it; a press of 20 ms from 10 ms on.
    let detector = Detector {
        earliest_ms: -3.0,
        ..detector()
    };
    let trial = |burst_ms: Option<f64>| {
        let mut counts = vec![0; 8500];
        counts[4300..4400].fill(10);
        if let Some(ms) = burst_ms {
            let at = (4250.0 + ms * 5.0) as usize;
            counts[at..at + 10].fill(10);
        }
        run(&detector, -4250, &counts, &[0; 2500]).searches[9]
    };
    let quiet = trial(None);
    assert!((quiet.onset_ms().unwrap() - 10.0).abs() < 2.1);
    assert!((quiet.at_risk_s - 0.847).abs() < 3e-4, "{quiet:?}");
    for early_ms in [-800.0, -600.0, -40.0, -6.0] {
        let found = trial(Some(early_ms));
        let at = found.false_alarm_ms().unwrap();
        assert!((at - early_ms).abs() < 2.1 && found.onset_ms().is_none());
        // From the start of the trial to the end of the bin of the alarm.
        assert!(
            (found.at_risk_s - (0.8501 + at * 1e-3)).abs() < 1e-9,
            "{found:?}"
        );
    }
    // Within the uncertainty of the contact.
    assert!((trial(Some(-0.5)).onset_ms().unwrap() + 0.5).abs() < 2.1);
}

#[test]
fn onsets_count_about_their_median() {
    let hits = OnsetStatistics::of(vec![10.0, 500.0, 12.0, 11.0, 111.0], 99.0);
    assert_eq!(
        (hits.onsets, hits.median_ms, hits.count),
        (5, Some(12.0), 4)
    );
    // Linear between order statistics: 10 + 0.15 and 12 + 0.85 * 99.
    assert!((hits.width_ms.unwrap() - (12.0 + 0.85 * 99.0 - 10.15)).abs() < 1e-9);
    // Nothing detected; one onset; two that are further apart than two windows.
    let none = OnsetStatistics {
        onsets: 0,
        median_ms: None,
        count: 0,
        width_ms: None,
    };
    assert_eq!(OnsetStatistics::of(vec![], 100.0), none);
    assert_eq!(OnsetStatistics::of(vec![3.0], 100.0).width_ms, Some(0.0));
    let apart = OnsetStatistics {
        onsets: 2,
        median_ms: Some(150.0),
        count: 0,
        width_ms: None,
    };
    assert_eq!(OnsetStatistics::of(vec![0.0, 300.0], 100.0), apart);
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
            false_alarms: 0,
            at_risk_s: 1.0,
            false_alarms_per_s,
        };
        list.iter().enumerate().map(row).collect()
    };
    // The detection rate need not fall with the threshold.
    let all = rows(&[
        (0.96, 9.0),
        (0.2, 0.0),
        (0.97, 1.0),
        (0.95, 1.0),
        (0.9, 0.5),
    ]);
    assert_eq!(choose(&all, 0.95), Some(2));
    assert_eq!(choose(&all, 0.99), Some(2));
    assert_eq!(choose(&all, 0.9), Some(4));
    assert_eq!(choose(&rows(&[(0.5, 3.0), (0.5, 2.0)]), 0.95), Some(1));
    assert_eq!(choose(&rows(&[(0.0, 3.0), (0.0, 2.0)]), 0.95), None);
    assert_eq!(choose(&rows(&[(0.0, 3.0)]), 0.0), None);
    assert_eq!(choose(&[], 0.95), None);
    // Trials without detections: a share of 0, no width, no choice.
    let detector = detector();
    let silent = vec![run(&detector, 0, &[0; 100], &[1; 100]); 3];
    let found = sweep(&silent, &detector, 100.0);
    assert!(
        found
            .iter()
            .all(|r| r.detected_rate == 0.0 && r.width_ms.is_none())
    );
    assert_eq!((found.len(), choose(&found, 0.95)), (20, None));
    assert_eq!(sweep(&[], &detector, 100.0), []);
    assert_eq!(
        thresholds(skinrig_model::ThresholdGrid {
            from: 17.0,
            to: 19.0,
            count: 3
        }),
        [17.0, 18.0, 19.0]
    );
    assert_eq!(
        thresholds(skinrig_model::ThresholdGrid {
            from: 5.0,
            to: 9.0,
            count: 1
        }),
        [5.0]
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// A single pass for all thresholds gives the same result as separate searches.
    #[test]
    fn onsets_are_those_of_straight_loops(
        seed in 1u64.., rate in 0.0f64..50_000.0, step in 0.0f64..10.0, bins in 0usize..700, padded in any::<bool>(),
        consecutive in 1u32..6,
    ) {
        let mut random = Random(seed);
        let signal = counts(&mut random, |bin| if bin < bins / 2 { rate } else { rate * step }, bins);
        let background = counts(&mut random, |_| rate, 500);
        let detector = Detector {
            edges: if padded { Boundary::ZeroPadded } else { Boundary::Renormalised },
            consecutive,
            // Never exactly on a value of the path, where the last digit would decide.
            thresholds: (0..20).map(|i| 0.7 + 1.013 * f64::from(i)).collect(),
            ..detector()
        };
        let trial = run(&detector, -300, &signal, &background);
        let events: u32 = background.iter().sum();
        let rate = f64::from(events).max(0.5) / 0.1;
        for (h, onset) in detector.thresholds.iter().zip(&onsets_ms(&trial)) {
            let slow = slow_onset(&detector, &signal, rate, *h);
            let slow_ms = slow.map(|bin| (bin as f64 - 300.0 + 0.5) * 0.2);
            prop_assert_eq!(*onset, slow_ms, "h {}", h);
        }
    }

    /// A false alarm is an onset before contact, and the time at risk ends with it.
    #[test]
    fn searches_are_onsets_cut_at_the_contact(
        seed in 1u64.., rate in 100.0f64..30_000.0, h in 0.5f64..6.0, first in -900i64..0, margin_ms in 0.0f64..20.0,
    ) {
        let signal = counts(&mut Random(seed), |bin| if bin % 500 < 20 { 3.0 * rate } else { rate }, 1200);
        let background = counts(&mut Random(seed ^ 1), |_| rate, 500);
        let anywhere = Detector { thresholds: vec![h], ..detector() };
        let cut = Detector { earliest_ms: -margin_ms, ..anywhere.clone() };
        let onset = onsets_ms(&run(&anywhere, first, &signal, &background))[0];
        let search = run(&cut, first, &signal, &background).searches[0];
        let early = onset.filter(|t| *t < -margin_ms);
        prop_assert_eq!(search.false_alarm_ms(), early);
        prop_assert_eq!(search.onset_ms(), onset.filter(|_| early.is_none()));
        // Bins whose middle is before the contact, up to the onset's.
        let bins = (0..1200).filter(|i| (first + i) as f64 * 0.2 + 0.1 < -margin_ms);
        let bins = bins.filter(|i| early.is_none_or(|t| (first + i) as f64 * 0.2 + 0.1 <= t + 1e-9));
        prop_assert!((search.at_risk_s - bins.count() as f64 * BIN_S).abs() < 1e-9);
    }
}

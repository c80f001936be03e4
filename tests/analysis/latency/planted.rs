//! The study on planted sessions: recovers latencies with their uncertainty, and counts non-trials separately.

use super::*;
use skinrig_analysis::exclusion::Exclusion;

/// The planted session's results with other events: background at 400 per second and camera, and a burst of 20 000 per
/// second and camera that begins `latency_us(press)` after contact.
fn planted(latency_us: impl Fn(usize) -> Option<f64>) -> (Analysis, RetainedPresses) {
    let (input, memory) = skinrig_planted::grid::session();
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
            RetainedPress {
                row,
                press: press.press,
                views,
            }
        })
        .collect();
    (
        analysis,
        RetainedPresses {
            presses,
            left_out: 0,
        },
    )
}

fn studied(analysis: &Analysis, retained: &RetainedPresses) -> Latency {
    study(analysis, retained).unwrap()
}

#[test]
fn planted_latencies_come_back_with_their_uncertainty() {
    // 10, 11, ... 34 ms; camera clocks differ by hours and 63 ppm.
    let (mut analysis, retained) = planted(|n| Some(1e4 + 1e3 * n as f64));
    analysis.contact_timing.pose_interval_us = 1000.0;
    let found = studied(&analysis, &retained);
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
    assert!(close(contact.median_ms, 22.0));
    // Of 25 onsets the outermost may all lie within the outer percentiles.
    for (outer, ms) in [(contact.p5_ms, 11.2), (contact.p95_ms, 32.8)] {
        assert!((outer.value.unwrap() - ms).abs() <= 2.0);
        assert_eq!((outer.low, outer.high, outer.n), (None, None, 25));
    }
    assert!((found.width_ms.value.unwrap() - 21.6).abs() < 1.0);
    assert_eq!((contact.before_contact, contact.missed), (0, 0));
    assert_counts_are_listed(&found);
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
    // The course rises at the onset of the presses, and has one bin per 2 ms.
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

/// Law of the false alarms: those listed are those counted, over exactly the time searched.
fn assert_counts_are_listed(found: &Latency) {
    let listed: Vec<PressId> = found.false_detections.iter().map(|f| f.0).collect();
    let alarmed = found.backgrounds.iter().filter(|b| b.alarms > 0);
    assert_eq!(listed, alarmed.map(|b| b.press).collect::<Vec<_>>());
    assert!(
        found
            .backgrounds
            .iter()
            .all(|b| b.alarms <= 1 && b.length_s > 0.0)
    );
    let at_risk_s: f64 = found.backgrounds.iter().map(|b| b.length_s).sum();
    assert!((at_risk_s - found.at_risk_s).abs() < 1e-9);
    let rate = found.false_alarms_per_s;
    assert!((rate.value.unwrap() * at_risk_s - listed.len() as f64).abs() < 1e-9);
    assert!(rate.low.unwrap() <= rate.value.unwrap() && rate.value < rate.high);
    let row = &found.sweep[found.chosen.unwrap() as usize];
    assert_eq!(
        (row.false_alarms as usize, row.false_alarms_per_s),
        (listed.len(), rate.value.unwrap())
    );
    for (press, at) in &found.false_detections {
        assert!(*at < found.earliest_ms);
        assert!(found.onsets.iter().any(|o| o.0 == *press && o.1.is_none()));
    }
    assert!(
        found
            .onsets
            .iter()
            .all(|o| o.1.is_none_or(|t| t >= found.earliest_ms))
    );
    let per_s = |rows: &[ThresholdRow]| {
        rows.iter()
            .map(|r| r.false_alarms_per_s)
            .collect::<Vec<_>>()
    };
    assert!(
        per_s(&found.sweep).is_sorted_by(|a, b| a >= b),
        "a higher threshold never trips earlier"
    );
}

#[test]
fn what_is_before_the_contact_or_never_comes_is_counted_apart() {
    let (mut analysis, retained) = planted(|n| match n {
        0 => None,
        // Before the idle time that the background is taken from.
        1 => Some(-7.8e5),
        2 => Some(-6.3e5),
        _ => Some(2e4),
    });
    // High enough that the background alone does not cross it near the contact by chance.
    analysis.settings.latency.thresholds = skinrig_model::ThresholdGrid {
        from: 16.0,
        to: 20.0,
        count: 20,
    };
    let found = studied(&analysis, &retained);
    assert_eq!(found.trials, 25);
    let rate = found.detected_rate.value.unwrap();
    assert!(
        (rate - 22.0 / 25.0).abs() < 1e-12,
        "{rate}: {:?}",
        found.onsets
    );
    assert_counts_are_listed(&found);
    let early: Vec<(PressId, f64)> = found.false_detections.clone();
    assert_eq!(early.len(), 2);
    for ((press, at), (n, planted)) in early.iter().zip([(1, -780.0), (2, -630.0)]) {
        assert_eq!(*press, retained.presses[n].press);
        assert!((at - planted).abs() < 2.5, "{at}");
    }
    // 23 trials search for 0.85 s, two only until their false alarm, minus half a kernel and the contact's uncertainty.
    let looked = 23.0 * (0.85 + found.earliest_ms * 1e-3) + 0.07 + 0.22;
    assert!(
        (found.at_risk_s - looked).abs() < 0.01,
        "{} s",
        found.at_risk_s
    );
    assert!(
        found.earliest_ms < -2.0 && found.earliest_ms > -2.5,
        "{}",
        found.earliest_ms
    );
    // Garwood's limits of two events.
    let rate = found.false_alarms_per_s;
    assert!((rate.low.unwrap() * found.at_risk_s - 0.2422).abs() < 1e-3);
    assert!((rate.high.unwrap() * found.at_risk_s - 7.2247).abs() < 1e-3);
    let contact = found.from_contact.unwrap();
    assert_eq!((contact.before_contact, contact.missed), (2, 1));
    assert_eq!(contact.median_ms.n, 22);
    assert_eq!(contact.from_contact_ms, 0.0);
    assert!((contact.p5_ms.value.unwrap() - 20.0).abs() < 2.1);
}

#[test]
fn contacts_that_were_not_measured_may_be_off_by_the_window() {
    // 40 ms before the scheduled contact throughout.
    let (mut analysis, retained) = planted(|_| Some(-4e4));
    assert_eq!(
        studied(&analysis, &retained)
            .detected_rate
            .value
            .unwrap_or(0.0),
        0.0
    );
    analysis.contact_timing.scheduled = true;
    let found = studied(&analysis, &retained);
    assert_eq!(
        (found.earliest_ms, found.detected_rate.value),
        (-102.0, Some(1.0))
    );
    assert_counts_are_listed(&found);
}

#[test]
fn manual_exclusions_are_no_trials_and_missed_presses_are() {
    let (mut analysis, retained) = planted(|_| Some(2e4));
    for (n, cause) in [
        (3, Exclusion::ByHand),
        (
            4,
            Exclusion::Excluded(skinrig_model::ExcludedReason::Recorded {
                text: "the operator's hand in view".to_owned(),
            }),
        ),
        (
            5,
            Exclusion::NoCluster {
                camera: skinrig_model::CameraId::One,
            },
        ),
    ] {
        let press = &mut analysis.presses[retained.presses[n].row];
        press.verdict = skinrig_model::Verdict::Excluded;
        press.cause = Some(cause);
    }
    let found = studied(&analysis, &retained);
    assert_eq!((found.trials, found.unusable), (23, 2));
    let tried = |n: usize| {
        let press = retained.presses[n].press;
        found.onsets.iter().any(|o| o.0 == press)
    };
    assert_eq!([3, 4, 5].map(tried), [false, false, true]);
}

#[test]
fn no_false_alarm_and_no_miss_is_not_certainty() {
    let plan = Plan {
        window_ms: 100.0,
        resamples: 100,
        seed: 1,
    };
    // Two presses at each of six locations.
    let one = |i: u32| Outcome {
        location: i / 2,
        onset_ms: Some(20.0),
        false_alarm: false,
        at_risk_s: 0.5,
    };
    let all: Vec<Outcome> = (0..12).map(one).collect();
    let near = |found: Option<f64>, expected: f64| (found.unwrap() - expected).abs() < 1e-12;
    let found = plan.estimate(&all);
    let (detected, alarms) = (found.detected_rate, found.false_alarms_per_s);
    assert!(near(detected.low, libm::pow(0.025f64, 1.0 / 6.0)) && detected.high == Some(1.0));
    assert!(alarms.low == Some(0.0) && near(alarms.high, -libm::log(0.025f64) / 6.0));
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
    assert!(detected.low == Some(0.0) && near(detected.high, 1.0 - libm::pow(0.025f64, 1.0 / 6.0)));
}

#[test]
fn latency_from_the_contact_needs_a_contact_measured_apart_from_the_events() {
    let (mut analysis, retained) = planted(|_| Some(2e4));
    analysis.contact_timing.scheduled = true;
    assert_eq!(studied(&analysis, &retained).from_contact, None);
    analysis.contact_timing.scheduled = false;
    let fit = analysis.clocks[1].as_mut().unwrap();
    fit.method = ClockMethod::EventRates;
    let found = studied(&analysis, &retained);
    assert_eq!(found.from_contact, None);
    assert!(found.median_ms.value.is_some());
    analysis.clocks[0] = None;
    assert_eq!(study(&analysis, &retained), None);
}

#[test]
fn neighbours_shorten_a_trial_and_the_study_reports_it() {
    let (mut analysis, mut retained) = planted(|_| Some(2e4));
    // The press before the tenth is released 0.4 s before its contact.
    let row = retained.presses[10].row;
    let contact = analysis.presses[row].timing.unwrap().contact;
    let before = analysis.presses[row - 1].timing.as_mut().unwrap();
    before.release = contact - HostDuration::from_millis(400);
    let found = studied(&analysis, &retained);
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
    for press in &mut retained.presses {
        for view in &mut press.views {
            view.idle_from_us = view.window_us.0;
        }
    }
    let none = studied(&analysis, &retained);
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
    retained.presses.truncate(3);
    for view in retained.presses.iter_mut().flat_map(|p| &mut p.views) {
        view.length_us = 900_000;
    }
    assert_eq!(studied(&analysis, &retained).unusable, 3);
    retained.presses.clear();
    assert_eq!(study(&analysis, &retained), None);
}

#[test]
fn the_published_choice_takes_its_background_after_the_press_and_pads_with_zeros() {
    let (mut analysis, mut retained) = planted(|_| Some(2e4));
    analysis.settings.latency.background = Background::After;
    // It lasts to 2.4 s after the middle; presses come every 1.75 s and only the last has nothing after it.
    let none = studied(&analysis, &retained);
    assert_eq!((none.trials, none.unusable), (1, 24));
    for press in &mut analysis.presses {
        let shift = HostDuration::from_secs_f64(2.0 * f64::from(press.press.index()));
        let timing = press.timing.as_mut().unwrap();
        timing.contact += shift;
        timing.release += shift;
    }
    for view in retained.presses.iter_mut().flat_map(|p| &mut p.views) {
        view.length_us = 4_000_000;
    }
    let found = studied(&analysis, &retained);
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
fn the_study_does_not_depend_on_the_number_of_threads() {
    let (analysis, retained) = planted(|n| (n % 5 > 0).then_some(1e4 + 2e3 * n as f64));
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        serde_json::to_string(&pool.install(|| studied(&analysis, &retained))).unwrap()
    };
    assert_eq!(with(1), with(3));
}

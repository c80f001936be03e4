//! Sessions without data, and corrupted or contradictory ones.

use proptest::prelude::*;
use skinrig_analysis::result::{LocationOutcome, ReadoutFault, Warning, WarningCause};
use skinrig_analysis::{
    Analysis, AnalysisError, EventSource, EventSourceError, SessionInput, analyze,
};
use skinrig_model::{
    CalibrationModel, CameraId, CdEvent, ExcludedReason, MissedReason, Point2, Polarity, PressId,
    PressRole, PressVerdict, Verdict,
};

use skinrig_planted::Memory;
use skinrig_planted::grid::{Shape, camera_us, plan, session, session_of};

#[test]
fn a_session_without_anything_is_still_an_analysis() {
    let (mut input, mut source) = session();
    source.events = [Vec::new(), Vec::new()];
    let a = analyze(&input, &source).unwrap();
    assert_eq!((a.counts.planned, a.counts.excluded), (50, 50));
    assert_eq!(
        a.presses[10].reason().as_deref(),
        Some("no cluster (camera 1)")
    );
    assert!(
        a.presses
            .iter()
            .all(|p| p.location_outcome == LocationOutcome::Missing)
    );
    assert_eq!(
        (a.scored.rmse_mm.value, a.scored.located_rate.value),
        (None, Some(0.0))
    );
    assert!(serde_json::to_string(&a).is_ok());

    // No marks and no events: no clock either.
    input.edges = [Vec::new(), Vec::new()];
    let a = analyze(&input, &source).unwrap();
    assert_eq!(a.clocks, [None, None]);
    assert_eq!(
        a.presses[10].reason().as_deref(),
        Some("no clock alignment (camera 1)")
    );
    assert_eq!((a.counts.invalid, a.counts.add_up()), (50, true));
    assert!(
        a.warnings.iter().any(|w| w.camera == Some(CameraId::Two)
            && matches!(w.cause, WarningCause::NoRatesClock { .. })),
        "{:?}",
        a.warnings
    );

    input.planned.clear();
    input.outcomes.clear();
    let a = analyze(&input, &source).unwrap();
    assert_eq!(a.counts.planned, 0);
}

#[test]
fn a_million_events_on_one_pixel_are_counted() {
    let (input, mut source) = session();
    let t = camera_us(0, plan()[30].4 + 0.2) as u64;
    let at = source.events[0].partition_point(|e| e.t_us < t);
    let hot = CdEvent {
        t_us: t,
        x: 3,
        y: 300,
        polarity: Polarity::On,
    };
    source.events[0].splice(at..at, std::iter::repeat_n(hot, 1_000_000));
    let a = analyze(&input, &source).unwrap();
    let view = a.presses[30].views[0].unwrap();
    assert!(view.events > 1_000_500 && view.cluster_events >= 1_000_000);
    assert!((view.centroid_u.unwrap() - 3.0).abs() < 0.01);
    // The position is that of the pixel: a warning names the press.
    let storms = |a: &Analysis| -> Vec<(Option<CameraId>, Vec<PressId>)> {
        let of = |w: &Warning| match &w.cause {
            WarningCause::EventStorms { presses, .. } => Some((w.camera, presses.clone())),
            _ => None,
        };
        a.warnings.iter().filter_map(of).collect()
    };
    assert_eq!(
        storms(&a),
        [(Some(CameraId::One), vec![PressId::from_index(30)])]
    );

    // Ten times the events of a press, and not of its repetitions or of two presses in five.
    let (_, mut source) = session();
    let in_press = |k: usize, e: &CdEvent| {
        let from = camera_us(1, plan()[k].4);
        (from..from + 5e5).contains(&(e.t_us as f64))
    };
    let copies = |events: &[CdEvent], presses: &[usize]| -> Vec<CdEvent> {
        let times = |e: &CdEvent| {
            if presses.iter().any(|k| in_press(*k, e)) {
                10
            } else {
                1
            }
        };
        let all = events
            .iter()
            .flat_map(|e| std::iter::repeat_n(*e, times(e)));
        all.collect()
    };
    let sound = source.events[1].clone();
    assert_eq!(storms(&analyze(&input, &source).unwrap()), []);
    source.events[1] = copies(&sound, &[12]);
    let found = storms(&analyze(&input, &source).unwrap());
    assert_eq!(
        found,
        [(Some(CameraId::Two), vec![PressId::from_index(12)])]
    );
    let many: Vec<usize> = (0..50).filter(|k| k % 5 < 2).collect();
    source.events[1] = copies(&sound, &many);
    assert_eq!(storms(&analyze(&input, &source).unwrap()), []);
}

#[test]
fn a_rate_that_stops_at_a_ceiling_is_named() {
    let ceilings = |a: &Analysis| -> Vec<(Option<CameraId>, f64, usize)> {
        let of = |w: &Warning| match w.cause {
            WarningCause::Readout(ReadoutFault::Ceiling {
                per_ms, presses, ..
            }) => Some((w.camera, per_ms, presses)),
            _ => None,
        };
        a.warnings.iter().filter_map(of).collect()
    };
    let strong = Shape {
        events: 3_000,
        ..Shape::USUAL
    };
    let (input, mut source) = session_of(7, &strong);
    assert_eq!(ceilings(&analyze(&input, &source).unwrap()), []);
    // 20 events per ms arrive while the tip moves down; the cable carries 8.
    let (mut ms, mut carried) = (0, 0);
    source.events[1].retain(|e| {
        if e.t_us / 1_000 != ms {
            (ms, carried) = (e.t_us / 1_000, 0);
        }
        carried += 1;
        carried <= 8
    });
    let found = ceilings(&analyze(&input, &source).unwrap());
    let [(Some(CameraId::Two), per_ms, presses)] = found[..] else {
        panic!("{found:?}");
    };
    assert!((7.5..=8.5).contains(&per_ms) && presses > 40, "{found:?}");
}

#[test]
fn a_recording_that_holds_each_event_twice_is_named() {
    let (input, mut source) = session();
    let repeated = |a: &Analysis| -> Vec<(Option<CameraId>, u64)> {
        let of = |w: &Warning| match w.cause {
            WarningCause::Readout(ReadoutFault::EventsTwice { repeated, .. }) => {
                Some((w.camera, repeated))
            }
            _ => None,
        };
        a.warnings.iter().filter_map(of).collect()
    };
    assert_eq!(repeated(&analyze(&input, &source).unwrap()), []);
    let twice = source.events[1].iter().flat_map(|e| [*e, *e]).collect();
    let once = std::mem::replace(&mut source.events[1], twice);
    let found = repeated(&analyze(&input, &source).unwrap());
    let [(Some(CameraId::Two), n)] = found[..] else {
        panic!("{found:?}");
    };
    // At the borders of slices nothing is compared.
    assert!(
        n <= once.len() as u64 && n > once.len() as u64 * 99 / 100,
        "{n}"
    );
}

/// A session whose settings see too little of its presses is not faulty, and says that they do not suit it.
#[test]
fn settings_that_do_not_suit_a_recording_are_told() {
    let (input, source) = session();
    let unsuitable = |change: fn(&mut SessionInput)| {
        let mut input = input.clone();
        change(&mut input);
        let analysis = analyze(&input, &source).unwrap();
        let is_of_settings =
            |w: &&Warning| matches!(w.cause, WarningCause::UnsuitableSettings { .. });
        let told = analysis.warnings.iter().find(is_of_settings).cloned();
        assert!(
            analysis.findings.iter().all(|f| !f.invalidates),
            "{:?}",
            analysis.findings
        );
        told.map(|w| w.to_string())
    };
    assert_eq!(unsuitable(|_| ()), None);
    // Windows of 3 s hold several presses. Own settings are judged by the defaults, those of a variant by the recorded ones.
    let told = unsuitable(|i| i.settings.window_before_ms = 3_000.0);
    assert!(told.is_some_and(|text| text.contains("looks faulty (clock wrong)")));
    let told = unsuitable(|i| {
        i.recorded_settings = Some(i.settings.clone());
        i.settings.window_before_ms = 3_000.0;
    });
    assert!(told.is_some());
    // A variant may correct what the recording's settings left out.
    let mut input = input.clone();
    let right = std::mem::replace(&mut input.settings.crop_v, [(0, 20); 2]);
    assert!(!analyze(&input, &source).unwrap().is_valid());
    input.recorded_settings = Some(input.settings.clone());
    input.settings.crop_v = right;
    let corrected = analyze(&input, &source).unwrap();
    assert!(corrected.is_valid(), "{:?}", corrected.findings);
}

#[test]
fn broken_times_are_errors_and_never_panic() {
    let (input, mut source) = session();
    let last = CdEvent {
        t_us: u64::MAX,
        x: 3,
        y: 300,
        polarity: Polarity::On,
    };
    source.events[0].push(last);
    source.events[0].push(CdEvent { t_us: 0, ..last });
    let a = analyze(&input, &source).unwrap();
    assert_eq!(a.counts.valid, 50);
    let of_camera_1 = a
        .warnings
        .iter()
        .filter(|w| w.camera == Some(CameraId::One));
    let causes: Vec<_> = of_camera_1.map(|w| &w.cause).collect();
    for expected in [
        WarningCause::EventsOutOfOrder {
            events: 1,
            limit_ms: 10,
        },
        WarningCause::EventsDaysAway { events: 1 },
    ] {
        assert!(causes.contains(&&expected), "{expected:?}: {causes:?}");
    }
}

#[test]
fn single_events_outside_the_sensor_are_left_out_and_counted() {
    let (input, source) = session();
    let clean = analyze(&input, &source).unwrap();
    let (_, mut corrupted) = session();
    let t_us = corrupted.events[1][500].t_us;
    for (x, y) in [(640, 300), (3, 480), (u16::MAX, 0)] {
        let polarity = Polarity::On;
        corrupted.events[1].insert(
            500,
            CdEvent {
                t_us,
                x,
                y,
                polarity,
            },
        );
    }
    let mut found = analyze(&input, &corrupted).unwrap();
    assert_eq!(found.off_sensor[0], clean.off_sensor[0]);
    assert_eq!(found.off_sensor[1].events, 3);
    assert_eq!(found.off_sensor[1].of, clean.off_sensor[1].of + 3);
    found.off_sensor = clean.off_sensor;
    assert_eq!(found, clean, "nothing else changes");
}

#[test]
fn contradictions_are_refused_with_their_place() {
    let refuse = |change: fn(&mut SessionInput, &mut Memory)| -> String {
        let (mut input, mut source) = session();
        change(&mut input, &mut source);
        analyze(&input, &source).unwrap_err().to_string()
    };
    let all = [
        refuse(|i, _| drop(i.outcomes.pop())),
        refuse(|i, _| i.outcomes.swap(4, 5)),
        refuse(|i, _| i.settings.eps_px = f64::NAN),
        refuse(|i, _| i.settings.min_samples = 0),
        refuse(|i, _| i.settings.crop_v[1] = (300, 480)),
        refuse(|i, _| i.rig.nominal.cameras[1].position = Point2::new(10.0, 2.0)),
        refuse(|_, s| s.events[1].iter_mut().step_by(50).for_each(|e| e.x = 640)),
    ];
    let expected = [
        "expected one outcome slot per planned press (53), found 52",
        "expected the outcome of press 5 in its journal row, found that of press 6",
        "`eps`, found NaN px",
        "`min_samples`, found 0",
        "`crop`, found 300 px to 480 px",
        "found (10, 2) mm, skew -1.47°",
        "expected events within 640 x 480 px but for at most 1 %, found ",
    ];
    for (found, expected) in all.iter().zip(expected) {
        assert!(found.contains(expected), "{found}");
    }

    struct FailingSource;
    impl EventSource for FailingSource {
        fn for_each_slice(
            &self,
            camera: CameraId,
            _: &mut dyn FnMut(&[CdEvent]),
        ) -> Result<(), EventSourceError> {
            match camera {
                CameraId::One => Ok(()),
                CameraId::Two => Err("chunk 7 is damaged".into()),
            }
        }
    }
    let (input, _) = session();
    let found = analyze(&input, &FailingSource).unwrap_err();
    let AnalysisError::Events { camera, source } = found else {
        panic!("{found}");
    };
    assert_eq!(camera, CameraId::Two);
    assert_eq!(source.to_string(), "chunk 7 is damaged");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn planned_is_always_valid_missed_invalid_and_excluded(
        fates in prop::collection::vec(0u8..9, 53),
        min_cluster_events in 0u32..700, exclude_outside in any::<bool>(), min_ray_sine in 0.0f64..0.99,
    ) {
        let (mut input, source) = session();
        input.settings.calibration = CalibrationModel::None;
        input.settings.bootstrap_resamples = 2;
        input.settings.min_cluster_events = min_cluster_events;
        input.settings.exclude_outside = exclude_outside;
        input.settings.min_ray_sine = min_ray_sine;
        for (outcome, defect) in input.outcomes.iter_mut().zip(&fates) {
            let Some(o) = outcome else { continue };
            match defect {
                0 => *outcome = None,
                1 => o.verdict = PressVerdict::Missed(MissedReason::NeverAttempted),
                2 => o.verdict = PressVerdict::cut_off(1),
                3 => o.verdict = PressVerdict::Excluded(ExcludedReason::Recorded { text: "e".to_owned() }),
                4 => o.timing = None,
                5 => o.measured_at = Some(Point2::new(f64::NAN, 0.0)),
                _ => {}
            }
        }
        let a = analyze(&input, &source).unwrap();
        prop_assert!(a.counts.add_up());
        prop_assert_eq!(a.counts.planned + a.counts.sync, 53);
        for p in &a.presses {
            prop_assert_eq!(p.verdict == Verdict::Valid, p.cause.is_none());
            prop_assert!(p.reason().is_none_or(|r| !r.is_empty()));
        }
        let valid_scored = a.presses.iter().filter(|p| p.role == PressRole::Score && p.verdict == Verdict::Valid);
        prop_assert_eq!(a.scored.rmse_mm.n as usize, valid_scored.count());
        prop_assert!(a.scored.rmse_mm.n <= a.scored.located_rate.n);
        prop_assert!(a.scored.rmse_mm.n <= a.scored_without_exclusions.rmse_mm.n);
    }
}

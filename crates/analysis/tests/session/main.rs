//! Whole analyses of planted sessions: what was planted comes out, and everything that goes wrong has its row.

#![expect(clippy::unwrap_used, reason = "tests")]

mod support;
mod tradeoff;

use std::sync::atomic::{AtomicU32, Ordering};

use proptest::prelude::*;
use skinrig_analysis::exclusion::Exclusion;
use skinrig_analysis::result::{LocationOutcome, WarningCause};
use skinrig_analysis::rule::Rule;
use skinrig_analysis::{
    AnalysisError, EventSource, EventSourceError, Retention, SessionInput, analyze,
    analyze_with_events, results_hash,
};
use skinrig_model::{
    CalibrationModel, CameraId, Causes, CdEvent, ExcludedReason, InvalidReason, MissedReason,
    Point2, Polarity, PressFault, PressRole, PressVerdict, RunEnd, StereoGeometry, StopReason,
    Verdict,
};

use support::{CLOCKS, Memory, PLANTED, camera_us, plan, session};

#[test]
fn a_planted_session_comes_out_with_its_clocks_geometry_and_places() {
    let (input, source) = session();
    let a = analyze(&input, &source).unwrap();
    assert!(a.warnings.is_empty(), "{:?}", a.warnings);
    assert!(a.counts.add_up());
    assert_eq!(
        (a.counts.planned, a.counts.valid, a.counts.sync),
        (50, 50, 3)
    );
    for (k, clock) in a.clocks.iter().enumerate() {
        let clock = clock.unwrap();
        assert!((clock.drift_ppm - CLOCKS[k].1).abs() < 0.05, "{clock:?}");
        assert!(
            (clock.camera_us(50e6) - camera_us(k, 50.0)).abs() < 0.5,
            "{clock:?}"
        );
    }
    // 600 events of 8 px spread: the centroid is known to 0.3 px, about 0.06 mm on the skin.
    assert!(
        a.scored.rmse_mm.value.unwrap() < 0.5,
        "{:?}",
        a.scored.rmse_mm
    );
    assert!(
        a.scored.rmse_mm.low < a.scored.rmse_mm.value
            && a.scored.rmse_mm.value < a.scored.rmse_mm.high
    );
    assert_eq!(a.scored.rmse_mm.n, 25);
    assert_eq!(a.scored.located_rate.value, Some(1.0));
    let calibration = a.calibration.as_ref().unwrap();
    assert_eq!(calibration.n, 25);
    assert!(calibration.rmse_before_mm > 2.0 && calibration.rmse_after_mm < 0.5);
    for press in &a.presses[3..] {
        let view = press.views[0].unwrap();
        assert!((560..700).contains(&view.events), "{view:?}");
        assert!(view.on_events > 150 && view.cluster_events <= view.events);
        assert!((view.centroid_v.unwrap() - 270.0).abs() < 2.0);
        assert!(view.rate_per_s > 1000.0 && view.idle_rate_per_s < 100.0 && view.idle_s == 0.5);
    }
    assert_eq!((a.pictures.len(), a.zooms.len()), (12, 6));
    for picture in &a.pictures {
        let view = a.presses[picture.press.index() as usize].views[picture.camera.index()].unwrap();
        let sum = |f: fn(&skinrig_analysis::result::PicturePixel) -> u32| {
            picture.pixels.iter().map(f).sum::<u32>()
        };
        assert_eq!(sum(|p| p.on + p.off), view.events);
        assert_eq!(sum(|p| p.on), view.on_events);
        assert_eq!(
            sum(|p| if p.clustered { p.on + p.off } else { 0 }),
            view.cluster_events
        );
    }
    for zoom in &a.zooms {
        let events: f64 = zoom
            .on_per_s
            .iter()
            .chain(&zoom.off_per_s)
            .map(|r| f64::from(*r) * zoom.bin_s)
            .sum();
        assert!((590.0..700.0).contains(&events), "{events}");
        let first = zoom.off_per_s.iter().position(|r| *r > 1000.0).unwrap();
        let at = zoom.start_s + first as f64 * zoom.bin_s;
        assert!(
            at.abs() < 0.03,
            "the burst begins at the contact, not {at} s after it"
        );
    }
    // 600 events per press, the background in the crop, on the host clock.
    let series = &a.rates[1];
    assert!((series.start_s - 0.0).abs() < 0.1, "{}", series.start_s);
    let events: f64 = series
        .mean_per_s
        .iter()
        .map(|r| f64::from(*r) * series.bin_s)
        .sum();
    assert!((events - 53.0 * 600.0 - 3250.0).abs() < 400.0, "{events}");
    let json = serde_json::to_string(&a).unwrap();
    let back: skinrig_analysis::Analysis = serde_json::from_str(&json).unwrap();
    assert_eq!(results_hash(&back), results_hash(&a));
    assert_eq!(back, a);
}

#[test]
fn the_same_input_gives_the_same_bits_however_it_is_sliced() {
    let (input, mut source) = session();
    let first = analyze(&input, &source).unwrap();
    source.slice = 37;
    let second = analyze(&input, &source).unwrap();
    assert_eq!(first, second);
    assert_eq!(results_hash(&first), results_hash(&second));
    let mut other = first.clone();
    other.presses[30].views[1].as_mut().unwrap().cluster_events += 1;
    assert_ne!(results_hash(&first), results_hash(&other));
    // It covers the kind of a cause, not its words and numbers.
    let camera = CameraId::One;
    let caused = |fault: PressFault| {
        let faults = InvalidReason::Faults(Causes::one(fault));
        let mut other = first.clone();
        other.presses[30].cause = Some(Exclusion::Invalid(faults));
        results_hash(&other)
    };
    let lost = |bytes| caused(PressFault::DataLost { camera, bytes });
    assert_eq!(lost(64), lost(65));
    assert_ne!(lost(64), caused(PressFault::NoData { camera }));
}

/// Counts the passes over each camera.
struct PassCounter<'a>(&'a Memory, [AtomicU32; 2]);

impl EventSource for PassCounter<'_> {
    fn for_each_slice(
        &self,
        camera: CameraId,
        each: &mut dyn FnMut(&[CdEvent]),
    ) -> Result<(), EventSourceError> {
        self.1[camera.index()].fetch_add(1, Ordering::Relaxed);
        self.0.for_each_slice(camera, each)
    }
}

#[test]
fn cached_events_equal_a_second_reading() {
    let (mut input, mut source) = session();
    input.rig.trigger_channel = None;
    input.marks.clear();
    let passes = |source: &Memory| {
        let counted = PassCounter(source, Default::default());
        let found = analyze_with_events(&input, &counted, Retention::All).unwrap();
        (found, counted.1.map(AtomicU32::into_inner))
    };
    let ((held, kept), once) = passes(&source);
    assert_eq!(once, [1, 1]);
    assert!(held.presses.iter().any(|p| p.views[1].is_some()) && !held.zooms.is_empty());
    // A late event outside the crop concerns no press, but might have: everything is read again.
    for events in &mut source.events {
        let t_us = events[0].t_us;
        let y = input.settings.crop_v[0].0 - 1;
        assert!(y < input.settings.crop_v[1].0);
        events.push(CdEvent {
            t_us,
            x: 0,
            y,
            polarity: Polarity::On,
        });
    }
    let ((mut read, kept_again), twice) = passes(&source);
    assert_eq!(twice, [2, 2]);
    assert_eq!(read.warnings.len(), held.warnings.len() + 2);
    read.warnings.clone_from(&held.warnings);
    read.activity.clone_from(&held.activity);
    read.off_sensor.clone_from(&held.off_sensor);
    assert_eq!(read, held);
    assert_eq!(kept_again, kept);
}

#[test]
fn without_marks_the_rates_align_the_clocks() {
    let (mut input, source) = session();
    let with_marks = analyze(&input, &source).unwrap();
    input.rig.trigger_channel = None;
    input.marks.clear();
    let a = analyze(&input, &source).unwrap();
    for k in 0..2 {
        let (clock, expected) = (a.clocks[k].unwrap(), camera_us(k, 50.0));
        assert!(
            (clock.camera_us(50e6) - expected).abs() < 15_000.0,
            "{clock:?}"
        );
    }
    assert_eq!(a.counts.valid, 50, "{:?}", a.warnings);
    let (x, y) = (
        a.scored.rmse_mm.value.unwrap(),
        with_marks.scored.rmse_mm.value.unwrap(),
    );
    assert!((x - y).abs() < 0.1, "{x} {y}");
}

#[test]
fn each_failure_has_its_own_row_and_reason() {
    let (mut input, mut source) = session();
    let verdict = |input: &mut SessionInput, row: usize, v: PressVerdict| {
        input.outcomes[row].as_mut().unwrap().verdict = v;
    };
    input.outcomes[52] = None;
    verdict(
        &mut input,
        51,
        PressVerdict::Missed(MissedReason::RunEnded(RunEnd::Stopped(StopReason::Stop))),
    );
    verdict(
        &mut input,
        50,
        PressVerdict::Invalid(InvalidReason::Faults(Causes::one(PressFault::Paused))),
    );
    verdict(
        &mut input,
        49,
        PressVerdict::Excluded(ExcludedReason::NotUsed {
            presses_used: "[1]".to_owned(),
        }),
    );
    input.outcomes[48].as_mut().unwrap().measured_at = None;
    input.outcomes[47].as_mut().unwrap().timing = None;
    let contact = |row: usize| plan()[row].4;
    let lost = camera_us(1, contact(46)) as u64;
    input.gaps[1].push((lost, lost + 10));
    // Camera 2 sees nothing of press 45 and little of 44; press 43 appears beside the skin.
    let inside = |row: usize, k: usize, e: &CdEvent| {
        let from = camera_us(k, contact(row) - 0.1) as u64;
        (from..from + 700_000).contains(&e.t_us)
    };
    source.events[1].retain(|e| !inside(45, 1, e));
    let mut kept = 0;
    source.events[1].retain(|e| {
        let keep = !inside(44, 1, e) || ((265..275).contains(&e.y) && kept < 15);
        kept += u32::from(inside(44, 1, e) && keep);
        keep
    });
    let planted = StereoGeometry::paper_like(PLANTED);
    let beside = Point2::new(-35.0, 47.0); // within the box, outside the rounded corner
    for (k, events) in source.events.iter_mut().enumerate() {
        let column = |p| planted.cameras[k].column_of_point(p).unwrap();
        let shift = (column(beside) - column(plan()[43].3)).round();
        for e in events.iter_mut().filter(|e| inside(43, k, e)) {
            e.x = (f64::from(e.x) + shift).clamp(0.0, 639.0) as u16;
        }
    }
    let a = analyze(&input, &source).unwrap();
    let reason = |row: usize| (a.presses[row].verdict, a.presses[row].reason().unwrap());
    let said = |v: Verdict, r: &str| (v, r.to_owned());
    assert_eq!(reason(52), said(Verdict::Missed, "never attempted"));
    assert_eq!(reason(51), said(Verdict::Missed, "operator: stop"));
    assert_eq!(reason(50), said(Verdict::Invalid, "paused by the operator"));
    assert_eq!(
        reason(49),
        said(Verdict::Excluded, "not used: presses_used is [1]")
    );
    assert_eq!(reason(48), said(Verdict::Invalid, "no measured position"));
    assert_eq!(reason(47), said(Verdict::Invalid, "no measured times"));
    assert_eq!(
        reason(46),
        said(Verdict::Invalid, "data lost in window (camera 2)")
    );
    assert_eq!(reason(45), said(Verdict::Excluded, "no cluster (camera 2)"));
    let (v, r) = reason(44);
    assert!(
        v == Verdict::Excluded
            && r.starts_with("too few cluster events: 1")
            && r.ends_with(" < 20 (camera 2)"),
        "{r}"
    );
    let (v, r) = reason(43);
    assert!(
        v == Verdict::Excluded && r == "outside the skin outline",
        "{v}: {r}"
    );
    // Kinds and fields, with both texts for people.
    let json = serde_json::to_value(&a).unwrap();
    let found = &json["presses"][45];
    assert_eq!(found["cause"]["no_cluster"]["camera"], "camera2", "{found}");
    assert_eq!(found["rule"], "no cluster (camera 2)");
    assert_eq!(
        json["presses"][50]["cause"]["invalid"]["faults"][0],
        "paused"
    );
    assert_eq!(json["presses"][50]["reason"], "paused by the operator");
    let back: skinrig_analysis::Analysis = serde_json::from_str(&json.to_string()).unwrap();
    assert_eq!(back, a);
    assert!(a.counts.add_up());
    assert_eq!(
        (
            a.counts.valid,
            a.counts.missed,
            a.counts.invalid,
            a.counts.excluded
        ),
        (40, 2, 4, 4)
    );
    // Attempted: 25 scored presses but the two missed and the one that the operator left out. Seven fail here.
    assert_eq!(a.scored.located_rate.n, 22);
    assert_eq!(a.scored.located_rate.value, Some(15.0 / 22.0));
    assert!(a.scored.rmse_mm.n < a.scored_without_exclusions.rmse_mm.n);
    assert!(a.scored.rmse_mm.value < a.scored_without_exclusions.rmse_mm.value);
}

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
        for (outcome, fate) in input.outcomes.iter_mut().zip(&fates) {
            let Some(o) = outcome else { continue };
            match fate {
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

#[test]
fn presses_with_different_reasons_are_grouped_by_rule() {
    let (input, mut source) = session();
    // Camera 2 sees almost nothing of two presses, not equally little.
    for (row, most) in [(40usize, 15), (41, 17)] {
        let from = camera_us(1, plan()[row].4 - 0.1) as u64;
        let mut kept = 0;
        source.events[1].retain(|e| {
            let inside = (from..from + 700_000).contains(&e.t_us);
            let keep = !inside || ((265..275).contains(&e.y) && kept < most);
            kept += u32::from(inside && keep);
            keep
        });
    }
    let a = analyze(&input, &source).unwrap();
    let (p, q) = (&a.presses[40], &a.presses[41]);
    assert_eq!(p.verdict, Verdict::Excluded, "{:?}", p.cause);
    assert_ne!(p.reason(), q.reason());
    assert_eq!(p.rule(), Some(Rule::FewClusterEvents(CameraId::Two)));
    assert_eq!(p.rule(), q.rule());
    assert!(
        a.presses
            .iter()
            .all(|p| p.cause.is_some() == (p.verdict != Verdict::Valid))
    );
}

#[test]
fn several_depths_are_also_scored_one_by_one() {
    let (mut input, source) = session();
    assert_eq!(analyze(&input, &source).unwrap().depths, []);
    for planned in input
        .planned
        .iter_mut()
        .filter(|p| p.location.index() % 2 == 0)
    {
        planned.depth_mm = 1.0;
    }
    let a = analyze(&input, &source).unwrap();
    let depths: Vec<f64> = a.depths.iter().map(|d| d.depth_mm).collect();
    assert_eq!(depths, [1.0, 2.0]);
    assert_eq!(
        a.depths.iter().map(|d| d.rmse_mm.n).sum::<u32>(),
        a.scored.rmse_mm.n
    );
    let squares: f64 = a
        .depths
        .iter()
        .map(|d| f64::from(d.rmse_mm.n) * d.rmse_mm.value.unwrap().powi(2))
        .sum();
    let pooled = (squares / f64::from(a.scored.rmse_mm.n)).sqrt();
    assert!((pooled - a.scored.rmse_mm.value.unwrap()).abs() < 1e-9);
}

/// Parts of the session as long as a repetition or a multiple of it would show the same place again and again.
#[test]
fn pictures_are_spread_over_the_places() {
    let (mut input, source) = session();
    // Both repetitions score: 50 presses at 25 places.
    for planned in input.planned.iter_mut().skip(3) {
        planned.role = PressRole::Score;
    }
    let a = analyze(&input, &source).unwrap();
    let mut places: Vec<skinrig_model::LocationId> = a
        .pictures
        .iter()
        .filter(|p| p.camera == CameraId::One)
        .map(|picture| {
            a.presses
                .iter()
                .find(|p| p.press == picture.press)
                .unwrap()
                .location
        })
        .collect();
    assert_eq!(places.len(), 6);
    places.sort_unstable();
    places.dedup();
    assert_eq!(places.len(), 6, "{places:?}");
}

#[test]
fn retained_events_are_those_of_the_chosen_presses() {
    let (mut input, source) = session();
    input.settings.study_presses = 10;
    let (a, scored) = analyze_with_events(&input, &source, Retention::Scored).unwrap();
    let (_, all) = analyze_with_events(&input, &source, Retention::All).unwrap();
    assert_eq!((scored.presses.len(), all.presses.len()), (10, 20));
    assert_eq!((scored.left_out, all.left_out), (0, 0));
    assert!(all.presses.is_sorted_by_key(|k| k.row));
    let of_scored = |k: &&skinrig_analysis::press_events::RetainedPress| {
        a.presses[k.row].role == PressRole::Score
    };
    assert!(all.presses.iter().filter(of_scored).eq(&scored.presses));
    for kept in &all.presses {
        let press = &a.presses[kept.row];
        assert_eq!(press.press, kept.press);
        for (view, observed) in kept.views.iter().zip(press.views.map(Option::unwrap)) {
            assert_eq!(view.press_events().len(), observed.events as usize);
            let on = view.press_events().iter().filter(|e| e.is_on()).count();
            assert_eq!(on, observed.on_events as usize);
            let idle = view.between(view.idle_from_us, view.window_us.0).len() as f64;
            assert!((idle / observed.idle_s - observed.idle_rate_per_s).abs() < 1e-9);
            assert!(view.events.is_sorted());
            // Contact 50 ms after the window begins, and the view reaches a second before it.
            assert!((view.contact_us - f64::from(view.window_us.0) - 50e3).abs() < 1.0);
            assert!((view.contact_us - 1e6).abs() < 2.0);
        }
    }
    let events: u64 = a.activity[1].counts.iter().sum();
    assert_eq!(events, source.events[1].len() as u64);
}

#[test]
fn presses_named_by_hand_are_rows_with_that_rule() {
    let (mut input, source) = session();
    let scored = input
        .planned
        .iter()
        .find(|p| p.role == PressRole::Score)
        .unwrap();
    input.settings.exclude_press_numbers = vec![scored.id];
    let a = analyze(&input, &source).unwrap();
    assert_eq!((a.counts.valid, a.counts.excluded), (49, 1));
    assert_eq!(
        a.presses[scored.id.index() as usize].rule(),
        Some(Rule::ByHand)
    );
    assert_eq!(a.scored.rmse_mm.n, 24);
    // It was attempted, so it is a failure.
    assert_eq!((a.penalised.failures, a.penalised.rmse_mm.n), (1, 25));
    assert_eq!((a.penalised.beyond_penalty, a.penalised.raised), (0, false));
    let count = |e: &skinrig_analysis::result::Estimate| e.value.unwrap() * f64::from(e.n);
    assert!((count(&a.scored.located_rate) - 24.0).abs() < 1e-9);
    let rms = |e: &skinrig_analysis::result::Estimate| e.value.unwrap().powi(2) * f64::from(e.n);
    let expected = rms(&a.scored.rmse_mm) + a.penalised.penalty_mm.powi(2);
    assert!((rms(&a.penalised.rmse_mm) - expected).abs() < 1e-6);
}

#[test]
fn a_background_that_makes_clusters_of_its_own_is_called_out() {
    let (mut input, source) = session();
    // About 40 background events in a press window: 0.1 of them in a neighbourhood of 10 px.
    let suggested = |input: &SessionInput| -> Vec<f64> {
        let warnings = analyze(input, &source).unwrap().warnings;
        let suggested = warnings.iter().filter_map(|w| match w.cause {
            WarningCause::DenseBackground {
                advised_min_samples,
                ..
            } => Some(advised_min_samples),
            _ => None,
        });
        suggested.collect()
    };
    assert_eq!(suggested(&input), [0.0; 0]);
    input.settings.eps_px = 50.0;
    input.settings.min_samples = 3;
    let found = suggested(&input);
    assert_eq!(found.len(), 2, "{found:?}");
    input.settings.min_samples = found[0] as u32;
    assert_eq!(suggested(&input), [0.0; 0]);
}

//! Whole analyses of planted sessions: what was planted comes out, and everything that goes wrong has its row.

mod bad_input;
mod exclusions;
mod predictions;
mod tradeoff;

use std::sync::atomic::{AtomicU32, Ordering};

use skinrig_analysis::exclusion::Exclusion;
use skinrig_analysis::result::WarningCause;
use skinrig_analysis::{
    EventSource, EventSourceError, Retention, SessionInput, analyze, analyze_with_events,
    results_hash,
};
use skinrig_model::{CameraId, Causes, CdEvent, InvalidReason, Polarity, PressFault, PressRole};

use skinrig_planted::Memory;
use skinrig_planted::grid::{CLOCKS, camera_us, session};

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
    let ((mut read, kept_again), again) = passes(&source);
    // For the clock, the hot pixels and the windows.
    assert_eq!(again, [3, 3]);
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

    // One press that stopped when it was felt: the others are no sample of its depth.
    let shallow =
        |p: &&skinrig_model::PlannedPress| p.role == PressRole::Score && p.depth_mm == 1.0;
    let stopped = input.planned.iter().find(shallow).unwrap().id;
    input.stopped = vec![stopped];
    let b = analyze(&input, &source).unwrap();
    assert_eq!(b.depths, a.depths[1..]);
    assert_eq!(b.scored, a.scored);
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
fn hot_pixels_change_nothing_but_a_warning() {
    const HOT: [(u16, u16); 3] = [(100, 200), (320, 270), (600, 350)];
    let (mut input, mut source) = session();
    let clean = analyze(&input, &source).unwrap();
    for events in &mut source.events {
        let (start_us, end_us) = (events[0].t_us, events.last().unwrap().t_us);
        for ((x, y), shift) in HOT.into_iter().zip(1..) {
            events.extend((0..(end_us - start_us) / 2_000).map(|n| CdEvent {
                t_us: start_us + 2_000 * n + 300 * shift,
                x,
                y,
                polarity: Polarity::from_bit(n % 2 == 0),
            }));
        }
        skinrig_planted::sort(events);
    }
    let found = analyze(&input, &source).unwrap();
    for (camera, hot) in found.hot_pixels.iter().enumerate() {
        assert_eq!(hot.pixels, HOT, "camera {camera}");
        assert!((450.0..550.0).contains(&hot.highest_per_s), "{hot:?}");
    }
    let is_hot = |w: &&skinrig_analysis::result::Warning| {
        matches!(w.cause, WarningCause::HotPixels { pixels: 3, .. })
    };
    assert_eq!(found.warnings.iter().filter(is_hot).count(), 2);
    let rmse = |a: &skinrig_analysis::Analysis| a.scored.rmse_mm.value.unwrap();
    assert!((rmse(&found) / rmse(&clean) - 1.0).abs() < 0.05);
    assert_eq!(found.scored.rmse_mm.n, 25);
    input.settings.hot_pixel_ratio = 0.0;
    let spoilt = analyze(&input, &source).unwrap();
    assert!(spoilt.hot_pixels.iter().all(|hot| hot.pixels.is_empty()));
    assert!(rmse(&spoilt) > 3.0 * rmse(&clean), "{}", rmse(&spoilt));
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
    // The core threshold follows the background, unless the settings forbid it.
    assert_eq!(suggested(&input), [0.0; 0]);
    input.settings.background_margin = 0.0;
    let found = suggested(&input);
    assert_eq!(found.len(), 2, "{found:?}");
    input.settings.min_samples = found[0] as u32;
    assert_eq!(suggested(&input), [0.0; 0]);
}

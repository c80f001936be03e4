//! The detector on planted streams: what it feels, and that slicing changes nothing.

use proptest::prelude::*;
use rand_xoshiro::Xoshiro256PlusPlus;
use skinrig_analysis::result::{ClockFit, ClockMethod};
use skinrig_model::{CameraId, CdEvent, Polarity};
use skinrig_statistics::seeded;

use crate::model::{Pattern, TouchModel};
use crate::regions::{REGIONS, region};
use crate::stream::TouchStream;
use crate::{Detection, Detector, Estimate, Felt, SkinModel, StreamSettings};

const IDLE_PER_S: f64 = 5_000.0;
const TOUCH_PER_S: f64 = 20_000.0;

fn clocks() -> [ClockFit; 2] {
    let fit = |offset_us, drift_ppm| ClockFit {
        method: ClockMethod::TimeBase,
        offset_us,
        drift_ppm,
        drift_se_ppm: 0.0,
        residual_rms_us: 0.0,
        residual_max_us: 0.0,
        n: 3,
        rejected: 0,
    };
    [fit(12.6e6, 31.0), fit(5.2e6, -24.0)]
}

fn event(t_us: u64, x: u16, y: u16) -> CdEvent {
    CdEvent {
        t_us,
        x,
        y,
        polarity: Polarity::from_bit(y & 1 == 1),
    }
}

/// A touch at `place` is seen in 64 columns of both cameras, here from this one on.
fn first_column(place: usize) -> u16 {
    64 + 96 * place as u16
}

pub(crate) fn model() -> TouchModel {
    let pattern = |place: usize| {
        let mut counts = vec![0.0; REGIONS];
        for x in first_column(place)..first_column(place) + 64 {
            for y in 200..264 {
                if let Some(region) = region(&event(0, x, y)) {
                    counts[region] += 1.0 / (2.0 * 64.0 * 64.0);
                }
            }
        }
        let shares = |k: usize| {
            let all = counts
                .clone()
                .into_iter()
                .enumerate()
                .map(move |(r, s)| (k, r, s));
            all.filter(|s| s.2 > 0.0)
        };
        Pattern {
            at: [place as f64, 0.0],
            shares: shares(0).chain(shares(1)).collect(),
        }
    };
    let idle = vec![IDLE_PER_S * 500e-6 / REGIONS as f64; REGIONS];
    TouchModel {
        idle: [idle.clone(), idle],
        patterns: (0..5).map(pattern).collect(),
        tail: Vec::new(),
        longest_press: 800,
        lowest_octave: -2,
    }
}

/// Two seconds of one camera, in order: idle, and a touch of 0.4 s from 1 s on whose tip moves in its first and last 0.1 s.
fn stream(seed: u64, camera: CameraId, place: Option<usize>) -> Vec<CdEvent> {
    let mut rng = seeded::generator(seed, camera.index() as u64);
    let clock = clocks()[camera.index()];
    let mut events = Vec::new();
    let mut add = |rng: &mut Xoshiro256PlusPlus,
                   from_us: f64,
                   to_us: f64,
                   per_s: f64,
                   first: u16,
                   width: usize,
                   rows: (u16, usize)| {
        for _ in 0..((to_us - from_us) * per_s * 1e-6) as u32 {
            let unit = 0.5 * (seeded::signed_unit(rng) + 1.0);
            let t_us = clock.camera_us(from_us + unit * (to_us - from_us)) as u64;
            let x = first + seeded::index(rng, width) as u16;
            events.push(event(t_us, x, rows.0 + seeded::index(rng, rows.1) as u16));
        }
    };
    add(&mut rng, 0.0, 2e6, IDLE_PER_S, 0, 640, (0, 480));
    if let Some(place) = place {
        for from_us in [1.0e6, 1.3e6] {
            add(
                &mut rng,
                from_us,
                from_us + 0.1e6,
                TOUCH_PER_S,
                first_column(place),
                64,
                (200, 64),
            );
        }
    }
    events.sort_by_key(|e| (e.t_us, e.x, e.y));
    events
}

/// Decisions on two streams of which the next slice has the camera and length that `next` says.
fn run(
    streams: &[Vec<CdEvent>; 2],
    threshold: f64,
    mut next: impl FnMut() -> (usize, usize),
) -> Vec<Detection> {
    let mut detector = Detector::new(&model(), &clocks(), threshold, 0).unwrap();
    let mut at = [0, 0];
    let mut found = Vec::new();
    while (0..2).any(|k| at[k] < streams[k].len()) {
        let (k, length) = next();
        let end = (at[k] + length).min(streams[k].len());
        let slice = &streams[k][at[k]..end];
        at[k] += detector.push(CameraId::ALL[k], slice, |d| found.push(d));
        // A stream that has ended delays nothing.
        for k in (0..2).filter(|k| at[*k] == streams[*k].len()) {
            detector.promise(CameraId::ALL[k], u64::MAX >> 20, |d| found.push(d));
        }
    }
    detector.finish(|d| found.push(d));
    assert!(
        detector
            .uncounted()
            .iter()
            .all(|u| *u == crate::Uncounted::default())
    );
    found
}

fn at_once(streams: &[Vec<CdEvent>; 2], threshold: f64) -> Vec<Detection> {
    let mut k = 0;
    run(streams, threshold, || {
        k = 1 - k;
        (k, usize::MAX / 2)
    })
}

fn streams(seed: u64, place: Option<usize>) -> [Vec<CdEvent>; 2] {
    CameraId::ALL.map(|camera| stream(seed, camera, place))
}

#[test]
fn a_touch_is_felt_once_where_it_is() {
    for place in 0..5 {
        let found = at_once(&streams(7, Some(place)), 14.0);
        let felt: Vec<Felt> = found.iter().map(|d| d.felt).collect();
        assert_eq!(felt, [Felt::Onset, Felt::Release], "{found:?}");
        let [onset, release] = found[..] else {
            panic!()
        };
        assert_eq!(onset.near_mm, [place as f64, 0.0]);
        assert!((1_000_000..1_003_000).contains(&onset.host_us), "{onset:?}");
        assert!(
            (999_000..=onset.host_us).contains(&onset.since_us),
            "{onset:?}"
        );
        assert!(
            (1_400_000..1_425_000).contains(&release.host_us),
            "{release:?}"
        );
        assert!(onset.llr >= 14.0);
    }
}

#[test]
fn an_uncertain_touch_ends_after_the_longest_press() {
    let thin: [Vec<CdEvent>; 2] =
        streams(9, Some(2)).map(|all| all.into_iter().step_by(1500).collect());
    let model = model().thinned(1.0 / 1500.0);
    let mut detector = Detector::new(&model, &clocks(), 9.0, 0).unwrap();
    let mut found = Vec::new();
    let mut at = [0, 0];
    while (0..2).any(|k| at[k] < thin[k].len()) {
        for (k, camera) in CameraId::ALL.into_iter().enumerate() {
            at[k] += detector.push(camera, &thin[k][at[k]..], |d| found.push(d));
            let next = thin[k].get(at[k]).map_or(u64::MAX >> 20, |e| e.t_us);
            detector.promise(camera, next, |d| found.push(d));
        }
    }
    for _ in 0..20 {
        for camera in CameraId::ALL {
            detector.promise(camera, u64::MAX >> 20, |d| found.push(d));
        }
    }
    let felt: Vec<Felt> = found.iter().map(|d| d.felt).collect();
    assert_eq!(felt[..2], [Felt::Onset, Felt::Withdrawn], "{found:?}");
    let lasted_us = found[1].host_us - found[0].host_us;
    assert!(lasted_us <= 401_000, "{lasted_us}");
}

#[test]
fn an_idle_skin_is_not_felt() {
    assert_eq!(at_once(&streams(8, None), 14.0), []);
    let weak = at_once(&streams(8, None), 4.0);
    assert!(weak.iter().any(|d| d.felt == Felt::Withdrawn), "{weak:?}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn slicing_changes_nothing(
        seed in 0u64..1000, slices in 0u64..1000, longest in prop_oneof![Just(1usize), 2usize..2000],
    ) {
        let streams = streams(seed, Some((seed % 5) as usize));
        // Low, so that there are false alarms too.
        let expected = at_once(&streams, 7.0);
        let mut rng = seeded::generator(slices, 9);
        let found = run(&streams, 7.0, || {
            (seeded::index(&mut rng, 2), 1 + seeded::index(&mut rng, longest))
        });
        let bits = |all: &[Detection]| -> Vec<_> {
            all.iter().map(|d| (d.felt, d.host_us, d.since_us, d.llr.to_bits())).collect()
        };
        prop_assert_eq!(bits(&found), bits(&expected));
    }
}

/// Every estimate from two streams that come whole, one camera after the other, or in slices in turn.
fn estimates(skin: &SkinModel, streams: &[Vec<CdEvent>; 2], slice: usize) -> Vec<Estimate> {
    let settings = StreamSettings {
        every_us: 5_000,
        from_us: 0,
    };
    let mut stream = TouchStream::new(skin, settings).unwrap();
    let mut found = Vec::new();
    let mut each = |e: Estimate| found.push(e);
    let mut slices = [0, 1].map(|k| streams[k].chunks(slice));
    loop {
        let next = [slices[0].next(), slices[1].next()];
        if next == [None, None] {
            break;
        }
        for (camera, events) in CameraId::ALL.into_iter().zip(next) {
            let events = events.unwrap_or_default();
            let newest_us = events.last().map(|e| e.t_us);
            assert_eq!(stream.push(camera, events, newest_us, &mut each), Ok(()));
        }
    }
    stream.finish(&mut each);
    found
}

/// Everything felt.
fn felt(streams: &[Vec<CdEvent>; 2], slice: usize) -> Vec<(Felt, i64)> {
    all_felt(&SkinModel::nominal(model(), clocks(), 14.0), streams, slice)
}

fn all_felt(skin: &SkinModel, streams: &[Vec<CdEvent>; 2], slice: usize) -> Vec<(Felt, i64)> {
    let felt = |e| match e {
        Estimate::Felt(d) => Some((d.felt, d.host_us)),
        Estimate::Position { .. } => None,
    };
    let all = estimates(skin, streams, slice).into_iter();
    all.filter_map(felt).collect()
}

#[test]
fn events_after_the_longest_window_do_not_count_for_the_position() {
    let streams = streams(7, Some(2));
    let events_at = |longest_window_us: Option<i64>| -> Vec<(i64, [u32; 2])> {
        let skin = SkinModel {
            longest_window_us,
            ..SkinModel::nominal(model(), clocks(), 14.0)
        };
        let events = |e| match e {
            Estimate::Position { host_us, position } => Some((host_us, position.events)),
            Estimate::Felt(_) => None,
        };
        let all = estimates(&skin, &streams, 100).into_iter();
        all.filter_map(events).collect()
    };
    let (whole, cut) = (events_at(None), events_at(Some(50_000)));
    assert_eq!(whole.len(), cut.len());
    let onset_us = whole[0].0;
    let (early, late): (Vec<_>, Vec<_>) = whole
        .iter()
        .zip(&cut)
        .partition(|((t, _), _)| *t <= onset_us + 40_000);
    assert!(early.len() > 5 && early.iter().all(|(whole, cut)| whole == cut));
    let [last_whole, last_cut] = [whole[whole.len() - 1].1, cut[cut.len() - 1].1];
    assert!(
        (0..2).all(|k| last_whole[k] > last_cut[k]),
        "{last_whole:?} {last_cut:?}"
    );
    // All instants after the window hold the same events.
    let after = late.iter().filter(|((t, _), _)| *t > onset_us + 60_000);
    assert!(after.clone().count() > 20);
    assert!(after.map(|(_, cut)| cut.1).all(|events| events == last_cut));
}

#[test]
fn a_gap_in_both_streams_and_a_camera_far_ahead_change_nothing() {
    // Half a second is missing in both, 0.3 s in one, before the touch from 1 s on.
    let lost = [300e3..800e3, 300e3..850e3];
    let mut streams = streams(7, Some(2));
    for camera in CameraId::ALL {
        let k = camera.index();
        let clock = clocks()[k];
        streams[k].retain(|e| !lost[k].contains(&clock.host_us_of_camera(e.t_us as f64)));
    }
    let expected = felt(&streams, 100);
    let kinds: Vec<Felt> = expected.iter().map(|f| f.0).collect();
    assert_eq!(kinds, [Felt::Onset, Felt::Release], "{expected:?}");
    assert!(
        (1_000_000..1_003_000).contains(&expected[0].1),
        "{expected:?}"
    );
    for slice in [1, 700, usize::MAX] {
        assert!(felt(&streams, slice) == expected, "{slice}");
    }
}

/// Three touches, of which the first one is seen only from its release on.
fn begun_in_the_middle_of_a_press() -> [Vec<CdEvent>; 2] {
    CameraId::ALL.map(|camera| {
        let k = camera.index();
        let clock = clocks()[k];
        let touches = [
            stream(7, camera, Some(2)),
            stream(8, camera, Some(2)),
            stream(9, camera, Some(2)),
        ];
        let mut all = Vec::new();
        for (n, touch) in touches.into_iter().enumerate() {
            let shift = (clock.camera_us(2e6) - clock.camera_us(0.0)) as u64 * n as u64;
            all.extend(touch.into_iter().map(|e| CdEvent {
                t_us: e.t_us + shift,
                ..e
            }));
        }
        // Nothing of the first press but its release.
        all.retain(|e| !(0.9e6..1.29e6).contains(&clock.host_us_of_camera(e.t_us as f64)));
        all.sort_by_key(|e| e.t_us);
        all
    })
}

fn assert_later_touches_are_felt(found: &[(Felt, i64)]) {
    for contact_us in [3_000_000, 5_000_000] {
        let onset = (Felt::Onset, contact_us..contact_us + 5_000);
        let is_felt = found
            .iter()
            .any(|(felt, at)| *felt == onset.0 && onset.1.contains(at));
        assert!(is_felt, "{contact_us}: {found:?}");
    }
}

/// A touch taken up at a release, as when one begins to feel in the middle of a press, does not hide those that follow.
#[test]
fn a_touch_that_began_at_a_release_ends_before_the_next_press() {
    assert_later_touches_are_felt(&felt(&begun_in_the_middle_of_a_press(), 500));
}

/// Nor does one on a skin whose presses may last longer than the time between two: at a release, pixels change the other way.
#[test]
fn a_release_is_told_from_a_long_touch_by_its_polarity() {
    let mut skin = SkinModel::nominal(model(), clocks(), 14.0);
    skin.touches.longest_press = 8_000;
    for pattern in &mut skin.touches.patterns {
        for (_, region, share) in &mut pattern.shares {
            *share *= if *region & 1 == 1 { 1.6 } else { 0.4 };
        }
    }
    let mut streams = begun_in_the_middle_of_a_press();
    for camera in CameraId::ALL {
        let clock = clocks()[camera.index()];
        for (n, e) in streams[camera.index()].iter_mut().enumerate() {
            let at_us = clock.host_us_of_camera(e.t_us as f64) % 2e6;
            let usual = !n.is_multiple_of(5);
            if (1.0e6..1.1e6).contains(&at_us) {
                e.polarity = Polarity::from_bit(usual);
            } else if (1.3e6..1.4e6).contains(&at_us) {
                e.polarity = Polarity::from_bit(!usual);
            }
        }
    }
    let found = all_felt(&skin, &streams, 500);
    assert_eq!(found[1].0, Felt::Withdrawn, "{found:?}");
    assert_later_touches_are_felt(&found);
}

//! One pass over events, compared with a plain count.

use super::*;

fn window(row: usize, idle_start_us: u64, start_us: u64, end_us: u64) -> Window {
    Window {
        row,
        start_us,
        end_us,
        idle_start_us,
    }
}

fn event(t_us: u64, y: u16, polarity: Polarity) -> CdEvent {
    CdEvent {
        t_us,
        x: 100,
        y,
        polarity,
    }
}

fn run(windows: &[Window], events: &[CdEvent]) -> PassOutput {
    let settings = AnalysisSettings::default();
    let request = PassRequest {
        windows,
        ..PassRequest::default()
    };
    let mut all = Accumulator::new(CameraId::One, &settings, request);
    events.chunks(2).for_each(|slice| all.take(slice));
    all.finish().unwrap()
}

#[test]
fn windows_include_their_start_and_exclude_their_end_in_any_order_within_the_slack() {
    let windows = [window(4, 500_000, 1_000_000, 1_600_000)];
    let on = |t| event(t, 200, Polarity::On);
    let off = |t| event(t, 200, Polarity::Off);
    let mut events = vec![
        on(499_999),
        on(500_000),
        off(999_999),
        on(1_000_000),
        off(1_300_000),
        off(1_599_999),
        on(1_600_000),
    ];
    // Rows outside the crop (185..=360) count nowhere.
    events.push(event(1_600_001, 184, Polarity::On));
    events.push(event(1_600_002, 361, Polarity::On));
    // Older than the newest event, but within the slack.
    events.push(off(1_599_000));
    let done = run(&windows, &events);
    let (row, view) = done.views[0];
    assert_eq!((row, view.events, view.on_events), (4, 4, 1));
    assert!((view.idle_rate_per_s - 2.0 / 0.5).abs() < 1e-9);
    assert!((view.rate_per_s - 4.0 / 0.6).abs() < 1e-9);
    assert_eq!(done.late, 0);
}

#[test]
fn overlapping_windows_each_keep_all_of_their_events() {
    let windows = [
        window(0, 1_000, 1_000, 5_000),
        window(1, 3_000, 3_000, 9_000),
    ];
    let events: Vec<CdEvent> = (0..100)
        .map(|i| event(100 * i, 250, Polarity::On))
        .collect();
    let views = run(&windows, &events).views;
    let counts: Vec<(usize, u32)> = views.iter().map(|(row, v)| (*row, v.events)).collect();
    assert_eq!(counts, [(0, 40), (1, 60)]);
    assert_eq!(views[0].1.idle_s, 0.0);
}

#[test]
fn an_estimator_keeps_so_many_events_of_all_open_windows_and_no_more() {
    let windows = [
        window(0, 1_000, 1_000, 5_000),
        window(1, 3_000, 3_000, 9_000),
        window(2, 20_000, 20_000, 24_000),
    ];
    let events: Vec<CdEvent> = (0..400)
        .map(|i| event(100 * i, 250, Polarity::On))
        .collect();
    let done = |estimator, most_kept| {
        let settings = AnalysisSettings {
            estimator,
            ..AnalysisSettings::default()
        };
        let request = PassRequest {
            windows: &windows,
            ..PassRequest::default()
        };
        let mut all = Accumulator::new(CameraId::Two, &settings, request);
        all.most_kept = most_kept;
        events.chunks(2).for_each(|slice| all.take(slice));
        all.finish().map(|done| done.views.len())
    };
    // 40 and 60 while both are open; the 40 of the last one arrive after those are closed.
    assert_eq!(done(Estimator::ColumnMedian, 100).unwrap(), 3);
    let found = done(Estimator::ColumnMedian, 99).unwrap_err();
    let AnalysisError::TooManyEvents {
        camera,
        press,
        most,
    } = found
    else {
        panic!("{found}");
    };
    assert_eq!(
        (camera, press, most),
        (CameraId::Two, PressId::from_index(1), 99)
    );
    // Clusters of pixels need only counts.
    assert_eq!(done(Estimator::Dbscan, 0).unwrap(), 3);
}

#[test]
fn an_event_that_is_too_late_is_reported() {
    let windows = [window(0, 1_000, 1_000, 5_000)];
    let late = [2_000, 16_000, 15_000, 5_999].map(|t| event(t, 250, Polarity::On));
    assert_eq!(run(&windows, &late).late, 1);
}

#[test]
fn slices_of_any_size_equal_single_events() {
    let windows = [
        window(0, 3_000, 20_000, 60_000),
        window(1, 50_000, 50_000, 90_000),
        window(2, 90_000, 120_000, 150_000),
    ];
    // Every seventh event is 4 ms late, and some are outside the crop.
    let events: Vec<CdEvent> = (0..5_000u64)
        .map(|i| {
            let t_us = 40 * i + 4_000 - if i % 7 == 0 { 4_000 } else { 0 };
            event(t_us, 180 + (i % 11) as u16, Polarity::from_bit(i % 3 == 0))
        })
        .collect();
    let settings = AnalysisSettings::default();
    let counted = |size: usize| {
        let request = PassRequest {
            windows: &windows,
            rates: Some(CameraRates::new(&settings)),
            ..PassRequest::default()
        };
        let mut all = Accumulator::new(CameraId::One, &settings, request);
        events.chunks(size).for_each(|slice| all.take(slice));
        let done = all.finish().unwrap();
        assert_eq!(done.late, 0);
        (done.views, done.rates, done.activity)
    };
    let whole = counted(events.len());
    let inside = |from: u64, to: u64| {
        let near = events.iter().filter(|e| (185..=360).contains(&e.y));
        near.filter(|e| (from..to).contains(&e.t_us)).count() as u32
    };
    for ((row, view), w) in whole.0.iter().zip(&windows) {
        assert_eq!(*row, w.row);
        assert_eq!(view.events, inside(w.start_us, w.end_us));
        let idle = view.idle_rate_per_s * view.idle_s;
        assert!((idle - f64::from(inside(w.idle_start_us, w.start_us))).abs() < 1e-6);
    }
    for size in [1, 7, 1_000, 1_024] {
        assert_eq!(counted(size), whole, "slices of {size}");
    }
}

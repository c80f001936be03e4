//! Compares estimators with slow references, on planted presses and edge cases.

use proptest::prelude::*;
use skinrig_model::{AnalysisSettings, CdEvent, CentroidRule, Estimator, Polarity, Precision};

use super::*;
use skinrig_statistics::seeded;

const ROWS: (u16, u16) = (185, 360);
const ALL: [(Estimator, Precision); 6] = [
    (Estimator::Dbscan, Precision::F64),
    (Estimator::ColumnMedian, Precision::F64),
    (Estimator::HistogramPeak, Precision::F64),
    (Estimator::HistogramPeak, Precision::F32),
    (Estimator::Streaming, Precision::F64),
    (Estimator::Streaming, Precision::F32),
];

fn event(t_us: u32, x: u16, y: u16) -> PackedEvent {
    let event = CdEvent {
        t_us: u64::from(t_us),
        x,
        y,
        polarity: Polarity::On,
    };
    PackedEvent::pack(&event, 0).unwrap()
}

fn settings(estimator: Estimator, precision: Precision, bin_px: u16) -> AnalysisSettings {
    AnalysisSettings {
        estimator,
        precision,
        bin_px,
        ..AnalysisSettings::default()
    }
}

fn estimate(s: &AnalysisSettings, events: &[PackedEvent]) -> ColumnEstimate {
    PressEstimator::new(s, ROWS).estimate(events, 0, s.min_samples)
}

/// A press: events around column `u` (standard deviation `sd`), and background over the whole crop, in time order.
fn planted(u: f64, sd: f64, touch: usize, background: usize, seed: u64) -> Vec<PackedEvent> {
    let mut rng = seeded::generator(seed, 0);
    let mut unit = || seeded::signed_unit(&mut rng);
    let mut events = Vec::new();
    for i in 0..touch + background {
        let t = (250_000.0 * (1.0 + unit())) as u32;
        // The sum of twelve uniform numbers on -1..1 has variance 4.
        let normal = (0..12).map(|_| unit()).sum::<f64>() / 2.0;
        let (x, y) = if i < touch {
            (u + sd * normal, 270.0 + 10.0 * unit())
        } else {
            (319.5 + 320.0 * unit(), 272.0 + 87.0 * unit())
        };
        if (-0.5..639.5).contains(&x) {
            events.push(event(t, x.round().max(0.0) as u16, y as u16));
        }
    }
    events.sort_unstable();
    events
}

#[test]
fn a_planted_touch_is_found_by_each_estimator_without_bias() {
    for (estimator, precision) in ALL {
        for bin in [1, 4, 16] {
            let s = settings(estimator, precision, bin);
            let errors: Vec<f64> = (0..60)
                .map(|i| {
                    let u = 150.0 + 5.77 * f64::from(i);
                    let events = planted(u, 12.0, 3000, 150, u64::from(i as u32));
                    estimate(&s, &events).column.unwrap() - u
                })
                .collect();
            let n = errors.len() as f64;
            let mean = errors.iter().sum::<f64>() / n;
            let std = (errors.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
            // Bins of 16 px are wider than the press; the remaining error is periodic, not a bias.
            let most = if bin == 16 { 5.0 } else { 1.6 };
            assert!(
                std < most,
                "{estimator:?} {precision:?} bin {bin}: std {std}"
            );
            let bound = 3.0 * std / n.sqrt() + 0.05;
            assert!(
                mean.abs() < bound,
                "{estimator:?} {precision:?} bin {bin}: bias {mean}, std {std}"
            );
        }
    }
}

#[test]
fn background_moves_the_running_histogram_less_than_the_median() {
    let events = planted(150.0, 12.0, 2000, 2000, 5);
    let error = |estimator| {
        let s = settings(estimator, Precision::F64, 1);
        (estimate(&s, &events).column.unwrap() - 150.0).abs()
    };
    assert!(error(Estimator::ColumnMedian) > 6.0);
    assert!(error(Estimator::Streaming) < 2.0);
    assert!(error(Estimator::HistogramPeak) < 4.0);
}

#[test]
fn none_one_two_and_many_events_in_one_place_have_their_answers() {
    for (estimator, precision) in ALL {
        for bin in AnalysisSettings::BIN_SIDES_PX {
            let s = AnalysisSettings {
                min_samples: 1,
                ..settings(estimator, precision, bin)
            };
            let label = format!("{estimator:?} {precision:?} bin {bin}");
            assert_eq!(estimate(&s, &[]), ColumnEstimate::default(), "{label}");
            // Positions within a bin are indistinguishable.
            let tolerance = f64::from(bin) / 2.0 + 1e-4;
            for x in [0u16, 15, 320, 639] {
                for count in [1u32, 2, 1000] {
                    for step in [0, 7] {
                        let events: Vec<_> = (0..count).map(|i| event(step * i, x, 300)).collect();
                        let found = estimate(&s, &events).column.unwrap();
                        assert!(
                            (found - f64::from(x)).abs() <= tolerance,
                            "{label}: {x} is {found}"
                        );
                    }
                }
            }
            let two = [event(0, 300, 250), event(1, 303, 250)];
            let found = estimate(&s, &two).column.unwrap();
            assert!(
                (found - 301.5).abs() <= f64::from(bin),
                "{label}: two events at {found}"
            );
        }
    }
}

#[test]
fn an_estimator_has_no_state_between_presses() {
    let (a, b) = (
        planted(200.0, 9.0, 500, 50, 1),
        planted(420.0, 15.0, 900, 50, 2),
    );
    for (estimator, precision) in ALL {
        let s = settings(estimator, precision, 2);
        let mut used = PressEstimator::new(&s, ROWS);
        let fresh = used.estimate(&a, 0, s.min_samples);
        used.estimate(&b, 0, s.min_samples);
        assert_eq!(used.estimate(&a, 0, s.min_samples), fresh, "{estimator:?}");
    }
}

#[test]
fn the_running_histogram_is_small_and_forgets() {
    assert!(
        size_of::<StreamingEstimator<f32>>() <= 360 && size_of::<StreamingEstimator<f64>>() <= 680
    );
    let mut stream = StreamingEstimator::<f64>::new(1, 50.0);
    stream.restart(0);
    (0..2000).for_each(|i| stream.add(10 * i, 100));
    assert_eq!(stream.now().column, Some(100.0));
    (0..500).for_each(|i| stream.add(1_000_000 + 10 * i, 500));
    assert_eq!(
        stream.now().column,
        Some(500.0),
        "20 time constants later the first press is forgotten"
    );
    // After one time constant 1/e remains, within the width of a step.
    let mut one = StreamingEstimator::<f64>::new(1, 50.0);
    one.restart(0);
    (0..1_000_000).for_each(|_| one.add(0, 100));
    one.add(50_000, 600);
    let left = f64::from(one.now().events) / 1e6;
    assert!(
        (left - libm::exp(-1.0)).abs() < libm::exp(-1.0) / 64.0,
        "{left}"
    );
}

/// Reference: sort all columns of all events and take the median of their positions within the columns.
fn slow_median(columns: &mut [u16]) -> f64 {
    columns.sort_unstable();
    let n = columns.len();
    let spread: Vec<(f64, f64)> = (0..n)
        .map(|i| {
            let same = columns.iter().filter(|c| **c == columns[i]).count() as f64;
            let rank = (0..i).filter(|j| columns[*j] == columns[i]).count() as f64;
            let left = f64::from(columns[i]) - 0.5;
            (left + rank / same, left + (rank + 1.0) / same)
        })
        .collect();
    if n % 2 == 1 {
        (spread[n / 2].0 + spread[n / 2].1) / 2.0
    } else {
        (spread[n / 2 - 1].1 + spread[n / 2].0) / 2.0
    }
}

fn slow_peak(columns: &[u16], sigma: f64) -> f64 {
    let height = |u: f64| -> f64 {
        let near = columns.iter().map(|c| (f64::from(*c) - u).abs() / sigma);
        near.filter(|d| *d <= 3.0)
            .map(|d| libm::exp(-0.5 * d * d))
            .sum()
    };
    let heights: Vec<f64> = (-1..=640).map(|u| height(f64::from(u))).collect();
    let mut at = 1;
    for i in 1..=640 {
        if heights[i] > heights[at] * (1.0 + 1e-12) {
            at = i;
        }
    }
    let (l, t, r) = (heights[at - 1], heights[at], heights[at + 1]);
    at as f64 - 1.0 + 0.5 * (r - l) / (2.0 * t - l - r)
}

fn columns() -> impl Strategy<Value = Vec<u16>> {
    (
        20u16..620,
        1u16..20,
        proptest::collection::vec((0u16..640, any::<bool>()), 1..200),
    )
        .prop_map(|(middle, width, raw)| {
            let near = |x: u16| (middle + x % width).min(639);
            raw.into_iter()
                .map(|(x, far)| if far && x % 5 == 0 { x } else { near(x) })
                .collect()
        })
}

proptest! {
    #[test]
    fn the_median_is_that_of_the_sorted_columns(mut columns in columns()) {
        let events: Vec<_> = columns.iter().enumerate().map(|(i, x)| event(i as u32, *x, 200)).collect();
        let found = estimate(&settings(Estimator::ColumnMedian, Precision::F64, 1), &events);
        prop_assert!((found.column.unwrap() - slow_median(&mut columns)).abs() < 1e-9);
        prop_assert_eq!(found.events as usize, columns.len());
    }

    #[test]
    fn the_peak_is_that_of_the_summed_kernels(columns in columns()) {
        let events: Vec<_> = columns.iter().enumerate().map(|(i, x)| event(i as u32, *x, 200)).collect();
        let found = estimate(&settings(Estimator::HistogramPeak, Precision::F64, 1), &events);
        let slow = slow_peak(&columns, 10.0);
        prop_assert!((found.column.unwrap() - slow).abs() < 1e-6, "{:?} is not {slow}", found.column);
    }

    #[test]
    fn a_mirrored_press_gives_a_mirrored_response(columns in columns(), bin in proptest::sample::select(&AnalysisSettings::BIN_SIDES_PX[..])) {
        for (estimator, precision) in ALL {
            let s = AnalysisSettings { centroid: CentroidRule::AllClusters, ..settings(estimator, precision, bin) };
            let of = |flip: bool| {
                let events: Vec<_> = columns.iter().enumerate()
                    .map(|(i, x)| event(i as u32, if flip { 639 - x } else { *x }, 200)).collect();
                estimate(&s, &events)
            };
            let (seen, mirrored) = (of(false), of(true));
            prop_assert_eq!(seen.column.is_some(), mirrored.column.is_some());
            // Of two equal maxima the first counts, and the mirror image has the other one first.
            let tie = matches!(estimator, Estimator::HistogramPeak | Estimator::Streaming);
            if let (Some(a), Some(b)) = (seen.column, mirrored.column) && (!tie || (a + b - 639.0).abs() < 0.5) {
                prop_assert!((a + b - 639.0).abs() < 1e-2, "{estimator:?} {precision:?}: {a} and {b}");
            }
        }
    }

    #[test]
    fn half_the_bits_move_a_column_by_less_than_a_hundredth_of_a_pixel(u in 40.0..600.0f64, seed in 0u64..50) {
        let events = planted(u, 10.0, 800, 40, seed);
        for estimator in [Estimator::HistogramPeak, Estimator::Streaming] {
            let of = |precision| estimate(&settings(estimator, precision, 1), &events).column.unwrap();
            let (wide, narrow) = (of(Precision::F64), of(Precision::F32));
            prop_assert!((wide - narrow).abs() < 0.01, "{estimator:?}: {wide} and {narrow}");
        }
    }
}

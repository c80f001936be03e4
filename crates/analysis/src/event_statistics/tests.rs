//! Laws whose statistics are known.

use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use skinrig_model::Polarity;

use super::*;

fn of(events: Vec<CdEvent>) -> EventStatistics {
    with_presses(&events, &[])
}

fn with_presses(events: &[CdEvent], presses: &[(f64, f64)]) -> EventStatistics {
    let mut collector = EventStatisticsCollector::new(presses);
    events.chunks(7).for_each(|slice| collector.push(slice));
    collector.finish(CameraId::One)
}

fn event(t_us: u64, x: u16, y: u16, on: bool) -> CdEvent {
    CdEvent {
        t_us,
        x,
        y,
        polarity: Polarity::from_bit(on),
    }
}

/// Events of one pixel at intervals of at least `floor` µs, the rest of which `draw` makes from a uniform number.
fn one_pixel(n: usize, draw: impl Fn([f64; 3]) -> f64) -> EventStatistics {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(5);
    let mut unit = || (random.next_u64() >> 11) as f64 * (0.5f64).powi(53);
    let mut t_us = 0;
    let events = (0..n).map(|_| {
        t_us += draw([unit(), unit(), unit()]).round().max(1.0) as u64;
        event(t_us, 3, 4, true)
    });
    of(events.collect())
}

#[test]
fn an_exponential_and_an_inverse_gaussian_law_are_told_apart() {
    let exponential = one_pixel(20_000, |[u, ..]| -5_000.0 * libm::log(1.0 - u));
    let law = exponential.intervals.unwrap();
    assert!(law.exponential < law.inverse_gaussian, "{law:?}");
    assert!((law.mean_us / 5_000.0 - 1.0).abs() < 0.03, "{law:?}");
    // Michael, Schucany and Haas (1976): mean 5 ms, shape 2 ms.
    let (mean, shape) = (5_000.0, 2_000.0);
    let gaussian = one_pixel(20_000, |[u, v, pick]| {
        let z = libm::sqrt(-2.0 * libm::log(1.0 - u)) * libm::cos(core::f64::consts::TAU * v);
        let y = mean * z * z;
        let low = mean + mean / (2.0 * shape) * (y - libm::sqrt(4.0 * shape * y + y * y));
        if pick <= mean / (mean + low) {
            low
        } else {
            mean * mean / low
        }
    });
    let law = gaussian.intervals.unwrap();
    assert!(law.inverse_gaussian < law.exponential, "{law:?}");
    assert!((law.shape_us / shape - 1.0).abs() < 0.1, "{law:?}");
}

#[test]
fn the_refractory_floor_is_found() {
    let found = one_pixel(20_000, |[u, ..]| 250.0 - 900.0 * libm::log(1.0 - u));
    let floor = found.intervals.unwrap().floor_us.unwrap();
    assert!((250..=252).contains(&floor), "{floor}");
}

#[test]
fn equal_times_polarity_and_neighbours_are_counted() {
    let found = of(vec![
        event(10, 100, 100, true),
        event(10, 300, 100, false),
        event(500, 103, 101, true),
        event(5_000, 103, 101, true),
    ]);
    assert_eq!(found.events, 4);
    assert_eq!(found.equal_times, Some(0.25));
    assert_eq!(found.on_share, Some(0.75));
    assert_eq!(found.supported, Some(0.25));
    assert_eq!(found.intervals, None, "one interval is no law");
}

#[test]
fn no_events_give_no_numbers() {
    let found = of(Vec::new());
    assert_eq!(
        (found.events, found.on_share, found.intervals),
        (0, None, None)
    );
    assert_eq!(found.supported_by_chance, None);
}

#[test]
fn the_bins_hold_every_interval_and_every_pixel_once() {
    let found = one_pixel(20_000, |[u, ..]| -5_000.0 * libm::log(1.0 - u));
    let law = found.intervals.unwrap();
    assert_eq!(found.interval_bins.iter().map(|b| b.n).sum::<u64>(), law.n);
    let median = 5_000.0 * core::f64::consts::LN_2;
    let below = |to: f64| {
        let bins = found.interval_bins.iter().filter(|b| b.to <= to);
        bins.map(|b| b.n).sum::<u64>() as f64 / law.n as f64
    };
    assert!(below(median) < 0.5 && below(1.3 * median) > 0.5);
    // One pixel with 3 events, two with one.
    let times = [(1, 5), (2, 5), (3, 5), (4, 6), (5, 7)];
    let found = of(times.map(|(t, x)| event(t, x, 0, true)).to_vec());
    let pixels: Vec<_> = found.pixels.iter().filter(|b| b.n > 0).collect();
    assert_eq!((pixels[0].from, pixels[0].n), (1.0, 2));
    assert!(pixels[1].from <= 3.0 && 3.0 < pixels[1].to && pixels[1].n == 1);
}

/// Independent events have no correlation and the dispersion of a Poisson process; echoes of each, 8 px beside, have both.
#[test]
fn independent_events_have_no_correlation_and_echoes_have() {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(6);
    let mut below = |n: u64| random.next_u64() % n;
    let mut times: Vec<u64> = (0..100_000).map(|_| below(10_000_000)).collect();
    times.sort_unstable();
    let alone: Vec<CdEvent> = times
        .iter()
        .map(|t| event(*t, below(600) as u16, below(480) as u16, true))
        .collect();
    let found = of(alone.clone());
    let chance = found.correlation_by_chance.unwrap();
    // Nearer rings have few cells. The events take 600 of the 640 columns.
    for ring in &found.correlation[2..] {
        assert!((0.6..1.5).contains(&(ring.active / chance)), "{ring:?}");
    }
    assert!((0.9..1.1).contains(&found.dispersion.unwrap()), "{found:?}");
    let mut echoes: Vec<CdEvent> = alone
        .iter()
        .flat_map(|e| [*e, event(e.t_us + 20, e.x + 8, e.y, false)])
        .collect();
    echoes.sort_by_key(|e| e.t_us);
    let found = of(echoes);
    let ring = |k: usize| found.correlation[k].active / found.correlation_by_chance.unwrap();
    // Half of the events have their source in one of the 16 cells of the second ring.
    assert!(
        ring(2) > 3.0 * ring(1) && ring(2) > 3.0 * ring(3),
        "{found:?}"
    );
    assert!((1.8..2.2).contains(&found.dispersion.unwrap()), "{found:?}");
}

#[test]
fn polarity_is_counted_from_contacts_and_from_lifts() {
    // ON at the press, OFF at the lift, and one before the press and one too late for the lift.
    let events = [
        event(900_000, 1, 1, true),
        event(1_000_000, 1, 1, true),
        event(1_199_999, 1, 1, true),
        event(1_200_000, 1, 1, false),
        event(2_000_000, 1, 1, false),
        event(2_100_000, 1, 1, true),
        event(2_200_000, 1, 1, true),
    ];
    let found = with_presses(&events, &[(1e6, 2e6)]).polarity.unwrap();
    assert_eq!((found.presses, found.at_press, found.at_lift), (1, 2, 2));
    assert_eq!(
        (found.on_at_press, found.on_at_lift),
        (Some(1.0), Some(0.5))
    );
    assert_eq!(of(events.to_vec()).polarity, None);
}

#[test]
fn rates_follow_contacts_and_lifts_as_long_as_half_of_the_presses_do() {
    // Two presses: 30 and 50 ms long, the second one 600 ms after the lift of the first.
    let presses = [(1e6, 1.03e6), (1.63e6, 1.68e6)];
    let events = [
        event(950_000, 1, 1, true),
        event(1_005_000, 1, 1, true),
        event(1_041_000, 1, 1, true),
        // In the 100 ms before the second contact, not in the course of the lift.
        event(1_560_000, 1, 1, true),
        event(1_630_000, 1, 1, true),
        event(1_639_999, 1, 1, true),
        event(1_671_000, 1, 1, true),
        event(1_691_000, 1, 1, true),
    ];
    let course = with_presses(&events, &presses).course.unwrap();
    assert_eq!(course.bin_ms, 10.0);
    assert_eq!(course.before_per_s, Some(10.0));
    // The last two bins are those of the second press alone.
    assert_eq!(course.contact_per_s, [150.0, 0.0, 0.0, 0.0, 100.0]);
    assert_eq!(course.lift_per_s[..3], [0.0, 100.0, 0.0]);
    assert_eq!(course.lift_per_s.len(), 60);
    // Without time between presses there is no rate before them.
    let close = [(1e6, 1.1e6), (1.2e6, 1.3e6), (1.4e6, 1.5e6)];
    let course = with_presses(&events, &close).course.unwrap();
    assert_eq!(course.lift_per_s.len(), 10);
    assert_eq!(course.before_per_s, Some(10.0));
    assert_eq!(of(events.to_vec()).course, None);
}

//! Presses with no, one, two and ten million events, all on one pixel, all simultaneous, and counts at the end of 32 bits.

use skinrig_analysis::dbscan::{Cluster, Dbscan};
use skinrig_analysis::grid::PixelGrid;
use skinrig_analysis::press_events::PackedEvent;
use skinrig_model::{CdEvent, Polarity};

use crate::numerics::bounds::{self, UNIT, Watch};
use crate::numerics::precise::{self, real};

/// Exact centroid column of all pixels, in 256 bits, from the counts alone.
fn exact_column(pixels: &[(u16, u16, u32)]) -> precise::Real {
    let (mut events, mut sum) = (real(0.0), real(0.0));
    for &(u, _, n) in pixels {
        events += real(f64::from(n));
        sum += real(f64::from(u)) * real(f64::from(n));
    }
    sum / events
}

fn grid_of(pixels: &[(u16, u16, u32)]) -> PixelGrid {
    let mut grid = PixelGrid::new((0, 479));
    for &(u, v, n) in pixels {
        assert!(grid.add_many(u, v, n), "{n} at ({u}, {v})");
    }
    grid
}

#[test]
fn none_one_two_and_ten_million_events() {
    let centroid = Watch::new(&bounds::CENTROID);
    let one = Some(1u32);
    for (pixels, min_samples, clusters) in [
        (vec![], one, 0),
        (vec![(3, 3, 1)], Some(2), 0),
        (vec![(3, 3, 1)], one, 1),
        (vec![(0, 0, 1), (639, 479, 1)], one, 2),
        (vec![(0, 0, 1), (6, 8, 1)], Some(2), 1),
        (vec![(0, 0, 1), (7, 8, 1)], Some(2), 0),
        (vec![(639, 479, 10_000_000)], None, 1),
        (vec![(0, 0, 9_999_999), (1, 0, 1)], None, 1),
        // Ten million, one more in every third column of a row.
        (
            (0..640)
                .map(|u| (u, 250, 15_625 + u32::from(u % 3 == 0)))
                .collect(),
            None,
            1,
        ),
    ] {
        let mut dbscan = Dbscan::new(10.0, min_samples.unwrap_or(10));
        let found = dbscan.run(&grid_of(&pixels)).to_vec();
        assert_eq!(found.len(), clusters, "{pixels:?}");
        let Some(all) = found.iter().copied().reduce(Cluster::merged) else {
            continue;
        };
        let (u, _) = all.centroid().unwrap();
        let exact = exact_column(&pixels);
        let size = precise::near(&exact).abs().max(f64::MIN_POSITIVE);
        centroid.record(
            precise::error(u, &exact) / size / UNIT,
            format!("{clusters} clusters"),
        );
    }
    assert_eq!(Cluster::default().centroid(), None);
}

#[test]
fn counts_reach_the_end_of_32_bits_and_not_beyond() {
    let centroid = Watch::new(&bounds::CENTROID);
    for pixels in [
        vec![(639, 479, u32::MAX)],
        vec![(0, 0, u32::MAX - 1), (9, 0, 1)],
        vec![(639, 10, u32::MAX / 2), (630, 12, u32::MAX / 2 + 1)],
        vec![(1, 5, 3), (7, 5, u32::MAX - 7), (8, 6, 4)],
    ] {
        let mut grid = grid_of(&pixels);
        assert_eq!(grid.events(), u32::MAX);
        // Full: nothing more is counted, on old or new pixels, and the count is unchanged.
        let (u, v, _) = pixels[0];
        assert!(!grid.add(u, v) && !grid.add(320, 240) && !grid.add_many(320, 240, 7));
        assert_eq!(grid.events(), u32::MAX);
        let mut touched = Vec::new();
        grid.sorted_pixels(&mut touched);
        assert_eq!(touched.len(), pixels.len());
        for min_samples in [1, 10, u32::MAX] {
            let mut dbscan = Dbscan::new(20.0, min_samples);
            let found = dbscan.run(&grid);
            assert_eq!((found.len(), found[0].events), (1, u64::from(u32::MAX)));
            let exact = exact_column(&pixels);
            let (u, _) = found[0].centroid().unwrap();
            let error = precise::error(u, &exact) / precise::near(&exact) / UNIT;
            centroid.record(error, format!("{pixels:?}"));
        }
    }
    // One too many at once: rejected as a whole.
    let mut grid = PixelGrid::new((0, 479));
    assert!(grid.add_many(5, 5, 2) && !grid.add_many(5, 6, u32::MAX - 1));
    assert_eq!(grid.events(), 2);
    assert!(!grid.add_many(640, 0, 1) && !grid.add_many(0, 480, 1));
}

#[test]
fn a_retained_event_has_32_bit_times_at_any_camera_time() {
    for start_us in [
        0,
        (1 << 34) - 1,
        (1 << 53) + 1,
        u64::MAX - u64::from(u32::MAX),
    ] {
        for after in [0, 1, u32::MAX] {
            let event = CdEvent {
                t_us: start_us + u64::from(after),
                x: 639,
                y: 479,
                polarity: Polarity::Off,
            };
            assert_eq!(PackedEvent::pack(&event, start_us).unwrap().t_us(), after);
        }
    }
}

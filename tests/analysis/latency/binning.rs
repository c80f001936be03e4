//! Events to bins: windows, clocks, thinning.

use super::*;

#[test]
fn windows_of_published_length_hold_the_published_bins() {
    for (seconds, bins) in [(0.3, 1500), (0.6, 3000), (1.0, 5000), (1.7, 8500)] {
        assert_eq!(
            Grid::within(0.0, seconds * 1e6, 200.0),
            Grid {
                first: 0,
                len: bins
            }
        );
        assert_eq!(
            Grid::within(-seconds * 1e6, 0.0, 200.0).first,
            -(bins as i64)
        );
    }
    // Only whole bins.
    assert_eq!(
        Grid::within(-399.0, 599.0, 200.0),
        Grid { first: -1, len: 3 }
    );
    assert_eq!(Grid::within(10.0, -10.0, 200.0).len, 0);
}

fn clock(drift_ppm: f64) -> ClockFit {
    ClockFit {
        method: ClockMethod::TriggerMarks,
        offset_us: 0.0,
        drift_ppm,
        drift_se_ppm: 0.0,
        residual_rms_us: 0.0,
        residual_max_us: 0.0,
        n: 3,
        rejected: 0,
    }
}

#[test]
fn every_event_is_in_the_bin_of_its_host_time_and_in_one_only() {
    // The edges of bins and a µs beside them, at the contact and far from it; the second clock runs 1000 ppm fast, so host
    // times are rounded to whole µs.
    for (drift, second) in [(0.0, 200.0), (1000.0, 201.0)] {
        let after = [
            -850_000.0, -200.0, -1.0, 0.0, 199.0, second, 800_000.0, 849_999.0,
        ];
        let bins = [-4250, -1, -1, 0, 0, 1, 4000, 4249];
        let clock = clock(drift);
        let view = view(&clock, 5e6, &after);
        let sight = HostTimeView::new(&view, &clock, 0.0);
        let grid = Grid::within(-850_000.0, 850_000.0, 200.0);
        let count = |grid: Grid| {
            let mut counts = vec![0; grid.len];
            let events = sight.within(grid, 200.0).iter().copied();
            sight.count(events, grid, 200.0, &mut counts);
            counts
        };
        let counts = count(grid);
        assert_eq!(counts.len(), 8500);
        assert_eq!(counts.iter().sum::<u32>(), 8, "drift {drift}");
        for bin in bins {
            assert!(
                counts[(bin + 4250) as usize] > 0,
                "drift {drift}, bin {bin}"
            );
        }
        // Split anywhere, the parts contain what the whole contains.
        for cut in [-4250, -1, 0, 1, 4249] {
            let before = count(Grid {
                first: -4250,
                len: (cut + 4250) as usize,
            });
            let after = count(Grid {
                first: cut,
                len: (4250 - cut) as usize,
            });
            assert_eq!([before, after].concat(), counts);
        }
    }
}

#[test]
fn thinning_keeps_the_rounded_share_and_every_event_alike() {
    use rand_xoshiro::rand_core::SeedableRng;
    let mut rng = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(3);
    for (n, factor, kept) in [
        (0, 1024, 0),
        (511, 1024, 0),
        (512, 1024, 0),
        (513, 1024, 1),
        (1536, 1024, 2),
        (2560, 1024, 2),
        (7, 1, 7),
    ] {
        let picks = choose_events(n, factor, &mut rng);
        assert_eq!(picks.len(), kept, "{n} / {factor}");
        assert!(picks.windows(2).all(|w| w[0] < w[1]) && picks.iter().all(|i| *i < n));
    }
    let mut times = [0u32; 40];
    for _ in 0..4000 {
        for i in choose_events(40, 4, &mut rng) {
            times[i] += 1;
        }
    }
    // 1000 each; five standard deviations of a binomial are 137.
    assert!(times.iter().all(|t| t.abs_diff(1000) < 137), "{times:?}");
}

//! Random thinning of one camera's view of a press, and the centroid of the remaining events.
//!
//! Clustering uses only event counts per pixel, not times, and thinning treats all events of a view alike; so a random
//! choice among events is a random choice among the entries of the pixel list, whatever their order. One random order of
//! that list serves all factors: its first m entries are a uniform choice of m events. For the exact count m = max(1, n /
//! k). For independent events m is binomial: Bernoulli thinning with probability 1 / k is a Binomial(n, 1 / k) count of
//! uniformly chosen events. Binomial counts of successive powers of two are drawn by halving, Binomial(m, 1 / 2) of the m
//! remaining, which is the number of ones in m random bits.
//!
//! The events kept at a factor are thus a subset of those at all smaller factors, and both kinds share their order:
//! differences between rows and between the two curves come from the removed events and not also from chance. Each row alone
//! has exactly the same distribution as if drawn alone.

use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::Rng;
use skinrig_model::CentroidRule;

use crate::background::CoreThreshold;
use crate::dbscan::GrowingDbscan;
use crate::estimators::ColumnEstimate;
use crate::locator::CameraFeatures;
use crate::press_events::PackedEvent;
use crate::result::Thinning;
use skinrig_statistics::seeded;

/// A view at one factor.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct ThinnedView {
    /// Number of remaining events.
    pub events: u32,
    /// What a locator sees of them.
    pub features: CameraFeatures,
}

/// Thins the views of one camera, one after another.
pub(super) struct Thinner {
    remaining: GrowingDbscan,
    core: CoreThreshold,
    /// Events that the background puts within eps of a pixel of the whole view.
    neighbours: f64,
    centroid: CentroidRule,
    /// (column, row) of each event of the view, in an order that each seed reshuffles.
    pixels: Vec<(u16, u16)>,
    /// (events, index in the result) for the current seed.
    steps: Vec<(u32, usize)>,
}

impl Thinner {
    pub(super) fn new(
        crop: (u16, u16),
        eps_px: f64,
        core: CoreThreshold,
        centroid: CentroidRule,
    ) -> Self {
        Self {
            remaining: GrowingDbscan::new(crop, eps_px, core.min_samples),
            core,
            neighbours: 0.0,
            centroid,
            pixels: Vec::new(),
            steps: Vec::new(),
        }
    }

    /// Loads the events of a view, fewer than 2^32, to which the background adds `neighbours` events within eps of a pixel, and
    /// returns the unthinned result.
    pub(super) fn load(&mut self, events: &[PackedEvent], neighbours: f64) -> ThinnedView {
        self.neighbours = neighbours;
        self.pixels.clear();
        self.pixels.extend(events.iter().map(|e| (e.x(), e.y())));
        let n = self.count();
        self.grow(n);
        let full = self.left();
        self.remaining.clear();
        full
    }

    /// Thins the view by 2, 4 .. 2^`max_power` with each of `kinds`; all factors of the first kind come first. All random
    /// numbers come from `rng`; the result depends on earlier calls only since the last [`Self::load`].
    pub(super) fn thin(
        &mut self,
        rng: &mut Xoshiro256PlusPlus,
        kinds: &[Thinning],
        max_power: u32,
        out: &mut Vec<ThinnedView>,
    ) {
        let n = self.count();
        self.steps.clear();
        for kind in kinds {
            let mut left = n;
            for power in 1..=max_power {
                left = match kind {
                    Thinning::Exact => (n >> power).max(n.min(1)),
                    Thinning::Bernoulli => heads(rng, left),
                };
                self.steps.push((left, self.steps.len()));
            }
        }
        self.steps.sort_unstable();
        self.shuffle(rng, self.steps.last().map_or(0, |s| s.0));
        out.clear();
        out.resize(self.steps.len(), ThinnedView::default());
        let mut last = ThinnedView::default();
        for i in 0..self.steps.len() {
            let (events, at) = self.steps[i];
            if events != last.events {
                self.grow(events);
                last = self.left();
            }
            out[at] = last;
        }
        self.remaining.clear();
    }

    /// Number of events in the view.
    fn count(&self) -> u32 {
        u32::try_from(self.pixels.len()).unwrap_or(u32::MAX)
    }

    /// Moves a uniform choice of `count` events in uniform order to the front (partial Fisher-Yates shuffle).
    fn shuffle(&mut self, rng: &mut Xoshiro256PlusPlus, count: u32) {
        for i in 0..count as usize {
            let other = i + seeded::index(rng, self.pixels.len() - i);
            self.pixels.swap(i, other);
        }
    }

    /// Makes the first `count` events the remaining ones; fewer remained before. The background thins with the press, and the core
    /// threshold follows it.
    fn grow(&mut self, count: u32) {
        let share = f64::from(count) / f64::from(self.count().max(1));
        self.remaining
            .set_min_samples(self.core.at(self.neighbours * share));
        for &(u, v) in &self.pixels[self.remaining.events() as usize..count as usize] {
            self.remaining.add(u, v);
        }
    }

    /// Centroid of the remaining events.
    fn left(&mut self) -> ThinnedView {
        let events = self.remaining.events();
        let features = if events < self.remaining.min_samples() {
            CameraFeatures::default() // no event has that many neighbours
        } else {
            let clusters = self.remaining.run();
            let estimate = ColumnEstimate::of_clusters(clusters, self.centroid, 1);
            CameraFeatures::from(&estimate)
        };
        ThinnedView { events, features }
    }
}

/// Number of heads in `tosses` of a fair coin.
fn heads(rng: &mut Xoshiro256PlusPlus, tosses: u32) -> u32 {
    let whole: u32 = (0..tosses / 64).map(|_| rng.next_u64().count_ones()).sum();
    match tosses % 64 {
        0 => whole,
        rest => whole + (rng.next_u64() >> (64 - rest)).count_ones(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dbscan::Dbscan;
    use crate::grid::PixelGrid;
    use proptest::prelude::*;
    use skinrig_model::{CdEvent, Polarity};

    const CROP: (u16, u16) = (185, 360);

    const fn core(min_samples: u32) -> CoreThreshold {
        CoreThreshold {
            min_samples,
            margin: 4.0,
        }
    }

    fn events(pixels: &[(u16, u16)]) -> Vec<PackedEvent> {
        let event = |(t_us, &(x, y)): (u64, &(u16, u16))| CdEvent {
            t_us,
            x,
            y,
            polarity: Polarity::On,
        };
        let packed = (0..).zip(pixels).map(event);
        packed.map(|e| PackedEvent::pack(&e, 0).unwrap()).collect()
    }

    proptest! {
        /// Reference: cluster each choice of events from scratch.
        #[test]
        fn every_step_clusters_the_remaining_events(
            pixels in prop::collection::vec((300u16..340, 250u16..270), 0..300), min_samples in 1u32..12, seed in 0u64..1000,
            neighbours in prop_oneof![Just(0.0), 0.0..20.0],
        ) {
            const POWERS: u32 = 9;
            let rule = CentroidRule::LargestCluster;
            let mut thinner = Thinner::new(CROP, 3.0, core(min_samples), rule);
            let fresh = |chosen: &[(u16, u16)]| {
                let mut grid = PixelGrid::new(CROP);
                chosen.iter().for_each(|(u, v)| assert!(grid.add(*u, *v)));
                let share = chosen.len() as f64 / pixels.len().max(1) as f64;
                let threshold = core(min_samples).at(neighbours * share);
                let mut dbscan = Dbscan::new(3.0, threshold);
                dbscan.run(&grid);
                let features = match chosen.len() < threshold as usize {
                    true => CameraFeatures::default(),
                    false => CameraFeatures::from(&ColumnEstimate::of_clusters(&dbscan, rule, 1)),
                };
                ThinnedView { events: chosen.len() as u32, features }
            };
            prop_assert_eq!(thinner.load(&events(&pixels), neighbours), fresh(&pixels));
            let mut rng = seeded::generator(seed, 0);
            let mut out = Vec::new();
            for _ in 0..2 {
                thinner.thin(&mut rng, &[Thinning::Exact, Thinning::Bernoulli], POWERS, &mut out);
                let mut shuffled = thinner.pixels.clone();
                for (left, power) in out.iter().zip((1..=POWERS).cycle()) {
                    prop_assert_eq!(*left, fresh(&shuffled[..left.events as usize]), "power {}", power);
                }
                for (left, power) in out[..POWERS as usize].iter().zip(1..) {
                    let n = pixels.len() as u32;
                    prop_assert_eq!(left.events, if n == 0 { 0 } else { (n / 2u32.pow(power)).max(1) });
                }
                prop_assert!(out[POWERS as usize..].is_sorted_by(|a, b| a.events >= b.events));
                // No event is lost or duplicated.
                let mut before = pixels.clone();
                before.sort_unstable();
                shuffled.sort_unstable();
                prop_assert_eq!(before, shuffled);
            }
        }
    }

    #[test]
    fn every_event_is_as_likely_and_counts_are_binomial() {
        // 40 events on as many distant pixels: the grid shows which remain.
        let pixels: Vec<(u16, u16)> = (0..40).map(|i| (15 * i, 200)).collect();
        let mut thinner = Thinner::new(CROP, 1.0, core(1), CentroidRule::AllClusters);
        thinner.load(&events(&pixels), 0.0);
        let (mut rng, mut out) = (seeded::generator(5, 0), Vec::new());
        const RUNS: u32 = 20_000;
        const KINDS: [Thinning; 2] = [Thinning::Exact, Thinning::Bernoulli];
        let mut chosen = [[0u32; 40]; 2];
        let (mut sum, mut squares) = (0.0, 0.0);
        for _ in 0..RUNS {
            thinner.thin(&mut rng, &KINDS, 2, &mut out);
            for (counts, left) in chosen.iter_mut().zip([out[1], out[3]]) {
                for (u, _) in &thinner.pixels[..left.events as usize] {
                    counts[usize::from(u / 15)] += 1;
                }
            }
            let left = f64::from(out[3].events);
            sum += left;
            squares += left * left;
        }
        // A quarter of the events: each 5000 times, standard deviation 61.
        for counts in chosen {
            assert!(
                counts.iter().all(|c| c.abs_diff(RUNS / 4) < 5 * 62),
                "{counts:?}"
            );
        }
        let mean = sum / f64::from(RUNS);
        let variance = squares / f64::from(RUNS) - mean * mean;
        assert!((mean - 10.0).abs() < 0.1, "{mean}");
        assert!((variance - 40.0 * 0.25 * 0.75).abs() < 0.4, "{variance}");
    }
}

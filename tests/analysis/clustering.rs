//! DBSCAN on pixel counts, compared with scikit-learn's labels and with a brute-force reference on events.

use std::collections::BTreeMap;

use proptest::prelude::*;
use serde_json::Value;
use skinrig_analysis::dbscan::{Cluster, Dbscan, NOISE};
use skinrig_analysis::grid::PixelGrid;
use skinrig_simd::InstructionSet;

type Event = (u16, u16);

fn grid_of(events: &[Event]) -> PixelGrid {
    let mut grid = PixelGrid::new((0, 479));
    for &(u, v) in events {
        assert!(grid.add(u, v));
    }
    grid
}

/// Labels per event by definition, comparing every pair; border events go to the nearest core event, ties to the first by
/// row, then column; clusters are numbered by their first core event in that order.
fn reference(events: &[Event], eps: f64, min_samples: u32) -> Vec<u32> {
    let sq = |a: Event, b: Event| {
        let d = |p: u16, q: u16| f64::from(p) - f64::from(q);
        d(a.0, b.0).powi(2) + d(a.1, b.1).powi(2)
    };
    let near = |a: Event, b: Event| sq(a, b) <= eps * eps;
    let core: Vec<bool> = events
        .iter()
        .map(|a| events.iter().filter(|b| near(*a, **b)).count() as u32 >= min_samples)
        .collect();
    let mut order: Vec<usize> = (0..events.len()).filter(|i| core[*i]).collect();
    order.sort_by_key(|i| (events[*i].1, events[*i].0));
    let mut labels = vec![NOISE; events.len()];
    let mut next = 0;
    for &seed in &order {
        if labels[seed] != NOISE {
            continue;
        }
        let mut todo = vec![seed];
        labels[seed] = next;
        while let Some(i) = todo.pop() {
            for &j in &order {
                if labels[j] == NOISE && near(events[i], events[j]) {
                    labels[j] = next;
                    todo.push(j);
                }
            }
        }
        next += 1;
    }
    for i in 0..events.len() {
        if !core[i] {
            let reach = order
                .iter()
                .copied()
                .filter(|j| near(events[i], events[*j]));
            let best = reach
                .min_by(|a, b| sq(events[i], events[*a]).total_cmp(&sq(events[i], events[*b])));
            labels[i] = best.map_or(NOISE, |j| labels[j]);
        }
    }
    labels
}

/// Labels of the events from the implementation under test.
fn labels(dbscan: &mut Dbscan, events: &[Event]) -> Vec<u32> {
    dbscan.run(&grid_of(events));
    let by_pixel: BTreeMap<u32, u32> = dbscan.labels().collect();
    let index = |e: &Event| u32::from(e.1) * PixelGrid::WIDTH as u32 + u32::from(e.0);
    events.iter().map(|e| by_pixel[&index(e)]).collect()
}

fn clusters_of(events: &[Event], labels: &[u32]) -> Vec<Cluster> {
    let count = labels
        .iter()
        .filter(|l| **l != NOISE)
        .max()
        .map_or(0, |m| m + 1);
    (0..count)
        .map(|k| {
            let mut c = Cluster::default();
            for (e, _) in events.iter().zip(labels).filter(|(_, l)| **l == k) {
                c.events += 1;
                c.sum_u += u64::from(e.0);
                c.sum_v += u64::from(e.1);
                c.sum_uu += u64::from(e.0).pow(2);
                c.sum_vv += u64::from(e.1).pow(2);
            }
            c
        })
        .collect()
}

#[test]
fn the_labels_are_those_of_scikit_learn() {
    let file: Value = serde_json::from_str(include_str!("fixtures/clusters.json")).unwrap();
    let cases = file["cases"].as_array().unwrap();
    assert_eq!(cases.len(), 11);
    for case in cases {
        let name = &case["case"];
        let list = |key: &str| -> Vec<i64> {
            let values = case[key].as_array().unwrap();
            values.iter().map(|v| v.as_i64().unwrap()).collect()
        };
        let events: Vec<Event> = list("x")
            .into_iter()
            .zip(list("y"))
            .map(|(x, y)| (x as u16, y as u16))
            .collect();
        let min = case["min_samples"].as_u64().unwrap() as u32;
        let mut dbscan = Dbscan::new(case["eps_px"].as_f64().unwrap(), min);
        let found = labels(&mut dbscan, &events);
        // Cluster numbers, and the cluster of a border event between two, depend on scikit-learn's input order: compare
        // noise for all events, and cluster membership for all except such border events.
        let expected = list("labels");
        let ambiguous = |e: &Event| name.as_str().unwrap().starts_with("border") && e.0 == 110;
        for (i, a) in events.iter().enumerate() {
            assert_eq!(found[i] == NOISE, expected[i] == -1, "{name}: event {i}");
            for (j, b) in events.iter().enumerate() {
                if !ambiguous(a) && !ambiguous(b) {
                    let together = expected[i] == expected[j];
                    assert_eq!(found[i] == found[j], together, "{name}: events {i}, {j}");
                }
            }
        }
        let centroid = |c: Option<Cluster>| c.and_then(|c| c.centroid()).map(|(u, _)| u);
        let near = |a: Option<f64>, b: Option<f64>| match (a, b) {
            (Some(a), Some(b)) => (a - b).abs() < 1e-9,
            (a, b) => a == b,
        };
        let all = dbscan.clusters().iter().copied().reduce(Cluster::merged);
        assert!(near(centroid(all), case["all_u"].as_f64()), "{name}");
        let largest = dbscan.largest().map(|(_, c)| c);
        assert!(
            near(centroid(largest), case["largest_u"].as_f64()),
            "{name}"
        );
    }
}

#[test]
fn a_million_events_on_one_pixel_are_one_cluster() {
    let mut grid = PixelGrid::new((185, 360));
    for _ in 0..1_000_000 {
        assert!(grid.add(639, 360));
    }
    let mut dbscan = Dbscan::new(10.0, 10);
    let clusters = dbscan.run(&grid);
    assert_eq!(clusters.len(), 1);
    assert_eq!(clusters[0].events, 1_000_000);
    assert_eq!(clusters[0].centroid(), Some((639.0, 360.0)));
    grid.clear();
    assert!(dbscan.run(&grid).is_empty());
    assert!(grid.add(0, 185));
    assert!(dbscan.run(&grid).is_empty());
    assert_eq!(dbscan.labels().collect::<Vec<_>>(), [(0, NOISE)]);
}

#[test]
fn the_grid_takes_only_its_crop() {
    let mut grid = PixelGrid::new((185, 360));
    for (u, v) in [(0, 184), (0, 361), (640, 200), (u16::MAX, u16::MAX)] {
        assert!(!grid.add(u, v), "({u}, {v})");
    }
    assert_eq!(grid.events(), 0);
}

/// Blobs, streaks and scatter; small coordinates so that neighbourhoods overlap, and the sensor's edges.
fn scenes() -> impl Strategy<Value = Vec<Event>> {
    let blob = (0u16..640, 0u16..480, 1u16..25, 1usize..80, any::<u64>()).prop_map(
        |(u, v, size, n, mut seed)| {
            let mut draw = |span: u16| {
                seed = seed
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1_442_695_040_888_963_407);
                ((seed >> 33) % u64::from(span)) as u16
            };
            let event = |_| ((u + draw(size)).min(639), (v + draw(size)).min(479));
            (0..n).map(event).collect::<Vec<Event>>()
        },
    );
    let near = (0u16..70, 0u16..40, 1u16..12, 1usize..30).prop_map(|(u, v, step, n)| {
        (0..n as u16)
            .map(|k| (u + k * step, v + k % 3))
            .collect::<Vec<Event>>()
    });
    let scatter = prop::collection::vec((0u16..80, 0u16..50), 0..120);
    prop::collection::vec(prop_oneof![blob, near, scatter], 0..5).prop_map(|v| v.concat())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn pixel_counts_give_what_the_definition_gives(
        events in scenes(),
        eps in prop_oneof![Just(10.0), Just(1.0), Just(0.5), Just(50.0), 0.1f64..50.0, 50.0f64..300.0],
        min_samples in prop_oneof![Just(10u32), Just(1), 1u32..40],
    ) {
        let expected = reference(&events, eps, min_samples);
        for set in InstructionSet::available() {
            let mut dbscan = Dbscan::new(eps, min_samples).with_instructions(set);
            // Buffers of an earlier run must have no effect.
            dbscan.run(&grid_of(&[(3, 3), (3, 4), (600, 470)]));
            prop_assert_eq!(labels(&mut dbscan, &events), expected.clone(), "{:?}", set);
            prop_assert_eq!(dbscan.clusters(), &clusters_of(&events, &expected)[..]);
        }
    }

    #[test]
    fn the_order_of_events_plays_no_part(events in scenes(), seed in any::<u64>()) {
        let mut shuffled = events.clone();
        let mut state = seed;
        for i in (1..shuffled.len()).rev() {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            shuffled.swap(i, (state >> 33) as usize % (i + 1));
        }
        let mut dbscan = Dbscan::new(10.0, 10);
        let a = dbscan.run(&grid_of(&events)).to_vec();
        let b = dbscan.run(&grid_of(&shuffled)).to_vec();
        prop_assert_eq!(a, b);
    }
}

//! Clusters of events on pixels.

use skinrig_analysis::dbscan::Dbscan;
use skinrig_analysis::grid::PixelGrid;

use crate::problem::{Problem, Solution};

pub(crate) fn solve(problem: &Problem) -> Solution {
    let mut grid = PixelGrid::new((0, 479));
    for pixel in problem.inputs["pixels"].as_array().unwrap() {
        let whole = |i: usize| u32::try_from(pixel[i].as_u64().unwrap()).unwrap();
        let [u, v] = [0, 1].map(|i| u16::try_from(whole(i)).unwrap());
        if !grid.add_many(u, v, whole(2)) {
            return Solution::Refused(
                "overflow".to_owned(),
                "PixelGrid::add_many -> false",
                Vec::new(),
            );
        }
    }
    let least = problem.inputs["min_samples"].as_u64().unwrap();
    let mut dbscan = Dbscan::new(problem.number("eps_px"), u32::try_from(least).unwrap());
    let clusters = dbscan.run(&grid).len() as f64;
    let Some((_, largest)) = dbscan.largest() else {
        let values = vec![("clusters", clusters)];
        return Solution::Refused("none".to_owned(), "Dbscan::largest -> None", values);
    };
    let (u, v) = largest.centroid().unwrap();
    Solution::Values(vec![
        ("clusters", clusters),
        ("events", largest.events as f64),
        ("mean_u", u),
        ("mean_v", v),
        ("spread_u", largest.spread_u().unwrap()),
        ("spread_v", largest.spread_v().unwrap()),
    ])
}

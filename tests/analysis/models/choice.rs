//! The automatic choice on simulated calibrations: it selects the model that the data require, rarely a larger one, and the
//! held-out error is that of the best candidate, with and without a tenth of outliers.

use super::*;
use skinrig_analysis::calibrate::parameter_count;
use skinrig_analysis::sets::CalibrationPress;

const MODELS: [CalibrationModel; 4] = [
    CalibrationModel::Positions,
    CalibrationModel::PositionsSkews,
    CalibrationModel::Full,
    CalibrationModel::FullScale,
];

/// A rig, its pressed locations, and the noise of its centroids.
#[derive(Clone, Copy)]
struct Scene {
    name: &'static str,
    /// Skews, distortions and half field of view; the drawn rig has 0, 0, 0, 0 and 60 degrees.
    rest: [f64; 4],
    half_fov_deg: f64,
    /// Smallest model that contains the planted rig.
    needed: CalibrationModel,
    /// Locations along each side.
    side: u32,
    noise_px: f64,
    /// One press in this many has a random column; 0: none.
    outlier_in: usize,
}

impl Scene {
    fn geometry(&self) -> StereoGeometry {
        let [s1, s2, w1, w2] = self.rest;
        let mut planted = StereoGeometry::paper_like([43.0, -33.5, 47.0, 38.0, s1, s2, w1, w2]);
        for camera in &mut planted.cameras {
            let w = camera.lens.coefficients().1;
            camera.lens = camera.lens.with(self.half_fov_deg, w);
        }
        planted
    }
}

fn scenes() -> Vec<Scene> {
    let drawn_fov = DRAWN.cameras[0].lens.coefficients().0;
    let skews = [-1.9, -1.5];
    let kinds = [
        (
            "positions",
            [0.0; 4],
            drawn_fov,
            CalibrationModel::Positions,
        ),
        (
            "skews",
            [skews[0], skews[1], 0.0, 0.0],
            drawn_fov,
            CalibrationModel::PositionsSkews,
        ),
        (
            "small skews",
            [-0.4, 0.3, 0.0, 0.0],
            drawn_fov,
            CalibrationModel::PositionsSkews,
        ),
        (
            "distortions",
            [skews[0], skews[1], -0.17, 0.074],
            drawn_fov,
            CalibrationModel::Full,
        ),
        (
            "small distortions",
            [skews[0], skews[1], -0.04, 0.03],
            drawn_fov,
            CalibrationModel::Full,
        ),
        (
            "scales",
            [skews[0], skews[1], -0.17, 0.074],
            55.0,
            CalibrationModel::FullScale,
        ),
    ];
    let sizes = [(5, 1.5), (9, 1.5), (9, 8.0), (12, 8.0)];
    let mut out = Vec::new();
    for (name, rest, half_fov_deg, needed) in kinds {
        for (side, noise_px) in sizes {
            for outlier_in in [0, 10] {
                out.push(Scene {
                    name,
                    rest,
                    half_fov_deg,
                    needed,
                    side,
                    noise_px,
                    outlier_in,
                });
            }
        }
    }
    out
}

/// One simulated calibration.
struct Run {
    chosen: CalibrationModel,
    /// Error at new presses of the chosen model over that of the best one.
    over_best: f64,
}

fn run(scene: &Scene, seed: u64) -> Run {
    let planted = scene.geometry();
    let mut rows = presses(&planted, &grid(scene.side), 1, scene.noise_px, seed);
    if scene.outlier_in > 0 {
        let mut noise = Noise(Xoshiro256PlusPlus::seed_from_u64(seed ^ 0xa5a5));
        for i in (0..rows.len()).filter(|i| (i + seed as usize).is_multiple_of(scene.outlier_in)) {
            rows[i].views[(noise.unit() * 2.0) as usize] = view(640.0 * noise.unit());
        }
    }
    let set = CalibrationSet::from_presses(&rows);
    let chosen = auto(&set, seed).calibration.unwrap().model;
    // Presses that no fit has seen.
    let fresh = presses(&planted, &grid(13), 1, scene.noise_px, seed + (1 << 40));
    let fresh = CalibrationSet::from_presses(&fresh);
    // Bounded as the choice bounds them: near the line through both cameras a press can err by any amount.
    let errors = MODELS.map(|model| {
        let geometry = calibrate(&set, &DRAWN, model, seed).map_or(DRAWN, |(geometry, _)| geometry);
        let one = |s: &CalibrationPress| {
            skinrig_analysis::calibrate::rmse_mm(std::slice::from_ref(s), &geometry)
        };
        fresh.sights().iter().map(one).collect::<Vec<f64>>()
    });
    let median = |errors: &Vec<f64>| {
        let mut sorted = errors.clone();
        sorted.sort_by(f64::total_cmp);
        sorted[sorted.len() / 2]
    };
    let bound_mm = 5.0 / libm::log(2f64).sqrt() / 2f64.sqrt()
        * errors.iter().map(median).fold(f64::INFINITY, f64::min);
    let errors = errors.map(|e| {
        let squares: f64 = e.iter().map(|e| e.min(bound_mm).powi(2)).sum();
        (squares / e.len() as f64).sqrt()
    });
    let best = errors.iter().copied().fold(f64::INFINITY, f64::min);
    let at = MODELS.iter().position(|m| *m == chosen).unwrap();
    Run {
        chosen,
        over_best: errors[at] / best - 1.0,
    }
}

/// Shares too small and too large, mean and 95th percentile of the error over the best contender's.
struct Summary {
    too_small: f64,
    too_large: f64,
    mean_over: f64,
    p95_over: f64,
}

fn simulate(scene: &Scene, seeds: u64) -> Summary {
    let runs: Vec<Run> = (0..seeds)
        .into_par_iter()
        .map(|seed| run(scene, seed))
        .collect();
    let n = seeds as f64;
    let share = |of: &dyn Fn(&Run) -> bool| runs.iter().filter(|r| of(r)).count() as f64 / n;
    let needed = parameter_count(scene.needed);
    let mut over: Vec<f64> = runs.iter().map(|r| r.over_best).collect();
    over.sort_by(f64::total_cmp);
    Summary {
        too_small: share(&|r| parameter_count(r.chosen) < needed),
        too_large: share(&|r| parameter_count(r.chosen) > needed),
        mean_over: over.iter().sum::<f64>() / n,
        p95_over: over[(0.95 * (n - 1.0)) as usize],
    }
}

/// What `docs/adr/0022-*` states of every scene: share of models too large, and error over the best contender's.
const TOO_LARGE: f64 = 0.3;
const OVER_BEST: f64 = 0.05;

#[test]
#[ignore = "minutes: SKINRIG_CI_LONG=1 .ci/run, or cargo test -p skinrig-analysis-tests -- --ignored --nocapture two_hundred_seeds"]
fn the_choice_is_right_over_two_hundred_seeds_of_every_scene() {
    let seeds = std::env::var("SKINRIG_SEEDS").map_or(200, |s| s.parse().unwrap());
    println!(
        "| Scene | Places | Noise (px) | Outliers | Too small | Too large | Over best, mean | 95 % |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for scene in scenes() {
        let s = simulate(&scene, seeds);
        println!(
            "| {} | {} | {} | {} | {:.3} | {:.3} | {:.1} % | {:.1} % |",
            scene.name,
            scene.side * scene.side,
            scene.noise_px,
            if scene.outlier_in > 0 { "10 %" } else { "-" },
            s.too_small,
            s.too_large,
            100.0 * s.mean_over,
            100.0 * s.p95_over
        );
        assert!(s.too_large <= TOO_LARGE);
        // Of 25 places a few decide: see the table.
        assert!(scene.side == 5 || s.mean_over <= OVER_BEST);
    }
}

/// A sample of the same: what each scene needs is plain to see, with and without outliers.
#[test]
fn auto_selects_the_lowest_sufficient_level() {
    let plain = |s: &Scene| s.side == 9 && s.noise_px < 2.0 && !s.name.starts_with("small");
    for scene in scenes().into_iter().filter(plain) {
        let s = simulate(&scene, 16);
        let (name, outlier_in) = (scene.name, scene.outlier_in);
        assert_eq!(s.too_small, 0.0, "{name}, {outlier_in}");
        assert!(
            s.too_large <= TOO_LARGE,
            "{name}, {outlier_in}: {}",
            s.too_large
        );
        assert!(s.mean_over <= 0.02, "{name}, {outlier_in}: {}", s.mean_over);
    }
}

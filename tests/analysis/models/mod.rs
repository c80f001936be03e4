//! The choice of a calibration on planted geometries with noise: the model, its errors, its seeds, hopeless data.

#![expect(clippy::unwrap_used, reason = "tests")]

mod choice;

use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use rayon::prelude::*;
use skinrig_analysis::calibrate::{ModelChoice, calibrate, choose};
use skinrig_analysis::result::{LocationOutcome, PressResult, PressView, Warning, WarningCause};
use skinrig_analysis::sets::CalibrationSet;
use skinrig_model::{
    AnalysisSettings, CalibrationModel, LensKind, LensModel, LocationId, Point2, PressId,
    PressRole, RepetitionId, StereoGeometry, Verdict,
};

/// The drawn rig: where calibrations start.
const DRAWN: StereoGeometry =
    StereoGeometry::paper_like([45.0, -36.0, 45.0, 40.0, 0.0, 0.0, 0.0, 0.0]);

struct Noise(Xoshiro256PlusPlus);

impl Noise {
    fn unit(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }
    /// Standard normal but for the farthest tails.
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.unit()).sum::<f64>() - 6.0
    }
}

fn view(u: f64) -> Option<PressView> {
    skinrig_planted::view(u, 100)
}

/// Presses at these places, `repeats` times, as `geometry` sees them with this noise of the centroids.
fn presses(
    geometry: &StereoGeometry,
    places: &[Point2],
    repeats: usize,
    noise_px: f64,
    seed: u64,
) -> Vec<PressResult> {
    let mut noise = Noise(Xoshiro256PlusPlus::seed_from_u64(seed));
    let mut rows = Vec::new();
    for _ in 0..repeats {
        for (location, at) in places.iter().enumerate() {
            let columns = geometry.cameras.map(|c| c.column_of_point(*at));
            let [Some(a), Some(b)] = columns else {
                continue;
            };
            let columns = [a, b].map(|u| u + noise_px * noise.normal());
            rows.push(PressResult {
                press: PressId::from_index(rows.len() as u32),
                role: PressRole::Calibrate,
                repetition: RepetitionId::default(),
                location: LocationId::from_index(location as u32),
                planned: *at,
                depth_mm: 2.0,
                truth: Some(*at),
                verdict: Verdict::Valid,
                cause: None,
                timing: None,
                views: columns.map(view),
                location_outcome: LocationOutcome::Missing,
                region: None,
                extrapolated: false,
            });
        }
    }
    rows
}

/// `side` by `side` places over the 64 mm that the published path covers.
fn grid(side: u32) -> Vec<Point2> {
    let step = 64.0 / f64::from(side - 1);
    let at = |i: u32| step * f64::from(i);
    (0..side * side)
        .map(|i| Point2::new(-22.0 + at(i / side), -30.0 + at(i % side)))
        .collect()
}

fn set(geometry: &StereoGeometry, places: &[Point2], noise_px: f64, seed: u64) -> CalibrationSet {
    CalibrationSet::from_presses(&presses(geometry, places, 1, noise_px, seed))
}

fn settings(calibration: CalibrationModel, seed: u64) -> AnalysisSettings {
    AnalysisSettings {
        calibration,
        seed,
        bootstrap_resamples: 39,
        ..AnalysisSettings::default()
    }
}

fn auto(set: &CalibrationSet, seed: u64) -> ModelChoice {
    choose(set, &DRAWN, &settings(CalibrationModel::Auto, seed))
}

#[test]
fn intervals_of_two_standard_errors_hold_the_planted_value() {
    let planted = [43.0, -33.5, 47.0, 38.0, -1.2, 0.4, -0.11, 0.03];
    let geometry = StereoGeometry::paper_like(planted);
    let places = grid(9);
    let inside: Vec<Vec<bool>> = (0..200u64)
        .into_par_iter()
        .map(|seed| {
            let set = set(&geometry, &places, 1.0, 1000 + seed);
            let (_, result) = calibrate(&set, &DRAWN, CalibrationModel::Full, seed).unwrap();
            let pairs = result.values.iter().zip(&result.standard_errors);
            pairs
                .zip(planted)
                .map(|((value, error), planted)| (value - planted).abs() <= 1.96 * error.unwrap())
                .collect()
        })
        .collect();
    // Binomial: 190 of 200 expected, standard deviation 3.1.
    for p in 0..8 {
        let held = inside.iter().filter(|row| row[p]).count();
        assert!((178..=199).contains(&held), "parameter {p}: {held} of 200");
    }
}

#[test]
fn every_seed_and_every_number_of_threads_finds_the_same_optimum() {
    let geometry = StereoGeometry::paper_like([
        42.51, -33.337, 41.947, 36.103, -2.388, 0.302, -0.1138, 0.0168,
    ]);
    let mut rows = presses(&geometry, &grid(16), 1, 8.0, 4);
    for i in (0..rows.len()).step_by(20) {
        rows[i].views[0] = view((i as f64 * 37.0) % 640.0);
    }
    let set = CalibrationSet::from_presses(&rows);
    assert!(set.sights().len() > 240);
    for model in [
        CalibrationModel::Positions,
        CalibrationModel::Full,
        CalibrationModel::FullScale,
    ] {
        let fits: Vec<_> = (0..6)
            .map(|seed| calibrate(&set, &DRAWN, model, seed).unwrap().1)
            .collect();
        for fit in &fits {
            assert!((fit.rmse_after_mm - fits[0].rmse_after_mm).abs() < 1e-6);
            assert!(2 * fit.starts_agreeing > fit.starts, "{fit:?}");
            assert!(fit.termination.is_converged(), "{:?}", fit.termination);
            for (a, b) in fit.values.iter().zip(&fits[0].values) {
                assert!((a - b).abs() < 1e-5 * (1.0 + b.abs()), "{:?}", fit.values);
            }
        }
    }
    let in_pool = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| auto(&set, 1))
    };
    let one = in_pool(1);
    assert_eq!(one, in_pool(2));
    assert_eq!(one.calibration.unwrap().compared.len(), 4);
}

#[test]
fn every_lens_is_found_through_its_own_projection() {
    use LensKind::{Equidistant, Equisolid, Exponential, Rectilinear, Stereographic};
    for kind in [
        Exponential,
        Equidistant,
        Rectilinear,
        Stereographic,
        Equisolid,
    ] {
        let mut planted =
            StereoGeometry::paper_like([43.0, -33.5, 47.0, 38.0, -1.2, 0.4, 0.0, 0.0]);
        for (camera, w) in planted.cameras.iter_mut().zip([-0.08, 0.06]) {
            camera.lens = LensModel::new(kind, 57.0, w);
        }
        let set = set(&planted, &grid(9), 0.0, 1);
        let settings = AnalysisSettings {
            lens: kind,
            ..settings(CalibrationModel::FullScale, 1)
        };
        let chosen = choose(&set, &DRAWN, &settings);
        let result = chosen.calibration.unwrap();
        assert_eq!(result.lens, kind);
        assert!(result.rmse_after_mm < 1e-7, "{kind:?}: {result:?}");
        for (found, planted) in chosen.geometry.cameras.iter().zip(&planted.cameras) {
            assert!(found.position.distance_mm(planted.position) < 1e-4);
            let (found, planted) = (found.lens.coefficients(), planted.lens.coefficients());
            assert!((found.0 - planted.0).abs() < 1e-4 && (found.1 - planted.1).abs() < 1e-5);
        }
    }
}

#[test]
fn a_named_model_is_used_compared_and_called_out() {
    let geometry = StereoGeometry::PAPER;
    let set = set(&geometry, &grid(9), 1.0, 1);
    let named = choose(&set, &DRAWN, &settings(CalibrationModel::Positions, 1));
    let result = named.calibration.unwrap();
    assert_eq!(result.model, CalibrationModel::Positions);
    let chosen: Vec<bool> = result.compared.iter().map(|c| c.chosen).collect();
    assert_eq!(chosen, [true, false, false, false]);
    assert!(
        matches!(
            named.warnings[..],
            [Warning {
                cause: WarningCause::WorseModel {
                    used: CalibrationModel::Positions,
                    better: CalibrationModel::Full,
                    ..
                },
                ..
            }]
        ),
        "{:?}",
        named.warnings
    );
    let full = choose(&set, &DRAWN, &settings(CalibrationModel::Full, 1));
    assert_eq!(full.warnings, []);
    // Comparing changes nothing in the fit.
    let alone = calibrate(&set, &DRAWN, CalibrationModel::Full, 1)
        .unwrap()
        .1;
    let result = full.calibration.unwrap();
    assert_eq!(result.values, alone.values);
    for row in &result.compared {
        let (rmse, fitted) = (row.rmse_mm.value.unwrap(), row.fitted_rmse_mm.unwrap());
        assert!(row.rmse_mm.low < row.rmse_mm.value && row.rmse_mm.value < row.rmse_mm.high);
        assert!(
            fitted < rmse,
            "held-out presses err more than fitted ones: {row:?}"
        );
        assert!(row.bounded_rmse_mm.unwrap() <= rmse);
    }
    let none = choose(&set, &DRAWN, &settings(CalibrationModel::None, 1));
    assert_eq!((none.geometry, none.calibration), (DRAWN, None));
}

#[test]
fn too_few_locations_use_the_largest_supported_model_with_a_note() {
    let geometry = StereoGeometry::paper_like([43.0, -33.5, 47.0, 38.0, 0.0, 0.0, 0.0, 0.0]);
    let places: Vec<Point2> = grid(3);
    let of = |n: usize| {
        let rows = presses(&geometry, &places[..n], 3, 0.3, 1);
        auto(&CalibrationSet::from_presses(&rows), 1)
    };
    let four = of(4);
    let result = four.calibration.unwrap();
    assert_eq!(
        (result.model, result.compared.len()),
        (CalibrationModel::Positions, 0)
    );
    let few = WarningCause::FewLocationsToCompare {
        locations: 4,
        used: CalibrationModel::Positions,
    };
    assert_eq!(four.warnings[0].cause, few);
    assert_eq!(four.errors_mm, None);
    let nine = of(9);
    let result = nine.calibration.unwrap();
    let values: Vec<bool> = result
        .compared
        .iter()
        .map(|c| c.rmse_mm.value.is_some())
        .collect();
    assert_eq!(values, [true, true, true, false]);
    assert_eq!(nine.warnings, []);
    let two = of(2);
    assert_eq!((two.geometry, two.calibration), (DRAWN, None));
    assert_eq!(
        two.warnings,
        [WarningCause::FewLocationsForAny { locations: 2 }.into()]
    );
}

/// Noise in which the larger models run out of what a rig can be.
#[test]
fn a_failed_fit_falls_back_to_the_next_smaller_model_with_a_note() {
    let geometry = StereoGeometry::PAPER;
    let largest_first = [
        CalibrationModel::FullScale,
        CalibrationModel::Full,
        CalibrationModel::PositionsSkews,
        CalibrationModel::Positions,
    ];
    let mut fallen = 0;
    for seed in 0..40 {
        let set = set(&geometry, &grid(4), 60.0, seed);
        for (at, model) in largest_first.into_iter().enumerate() {
            let fits = |m: &&CalibrationModel| calibrate(&set, &DRAWN, **m, seed).is_some();
            let expected = largest_first[at..].iter().find(fits).copied();
            let chosen = choose(&set, &DRAWN, &settings(model, seed));
            let used = chosen.calibration.as_ref().map(|c| c.model);
            assert_eq!(used, expected);
            let warned = |cause: &WarningCause| chosen.warnings.iter().any(|w| w.cause == *cause);
            let fell = used.filter(|used| *used != model);
            let fallback = fell.map(|used| WarningCause::ImplausibleModel {
                wanted: model,
                used,
            });
            assert_eq!(fallback.is_some_and(|cause| warned(&cause)), fell.is_some());
            assert_eq!(warned(&WarningCause::NoPlausibleGeometry), used.is_none());
            fallen += u32::from(used.is_some() && used != Some(model));
        }
    }
    assert!(fallen > 0, "no fit failed: the test tells nothing");
}

/// Places on one ray of camera 1: it sees all of them in the same column.
#[test]
fn what_the_data_leave_open_is_reported() {
    let geometry = StereoGeometry::paper_like([45.0, -36.0, 45.0, 40.0, 0.5, 0.0, 0.0, 0.0]);
    let camera = geometry.cameras[0];
    let [dx, dy] = camera.direction(camera.angle_of_column_deg(330.0));
    let places: Vec<Point2> = (0..12)
        .map(|i| 25.0 + 4.0 * f64::from(i))
        .map(|r| Point2::new(camera.position.x_mm + r * dx, camera.position.y_mm + r * dy))
        .collect();
    let on_one_ray = set(&geometry, &places, 0.0, 3);
    let chosen = choose(&on_one_ray, &DRAWN, &settings(CalibrationModel::Full, 1));
    let result = chosen.calibration.unwrap();
    // Of camera 1 the places tell the ray and nothing else: two of its four parameters.
    assert_eq!((result.rank, result.condition), (6, None));
    let known: Vec<bool> = result.standard_errors.iter().map(Option::is_some).collect();
    assert_eq!(known, [false, false, true, true, false, true, false, true]);
    assert!(result.correlation[0].iter().all(Option::is_none));
    assert!(
        matches!(
            chosen.warnings[0].cause,
            WarningCause::OpenParameters {
                determined: 6,
                parameters: 8,
                model: CalibrationModel::Full,
                ..
            }
        ),
        "{:?}",
        chosen.warnings
    );
    // Left to itself, the choice takes a model that they do determine.
    let result = auto(&on_one_ray, 1).calibration.unwrap();
    assert_eq!(
        (result.model, result.rank),
        (CalibrationModel::Positions, 4)
    );
}

#[test]
fn hopeless_data_end_in_a_warning() {
    let planted = StereoGeometry::paper_like([43.0, -33.5, 47.0, 38.0, -1.2, 0.4, -0.11, 0.03]);
    let rows = presses(&planted, &grid(9), 1, 1.0, 1);
    let broken = |change: fn(&mut PressResult)| {
        let mut rows = rows.clone();
        rows.iter_mut().for_each(change);
        let chosen = auto(&CalibrationSet::from_presses(&rows), 1);
        assert!(!chosen.warnings.is_empty());
        chosen
    };
    broken(|p| p.views.swap(0, 1));
    broken(|p| p.truth = p.truth.map(|t| Point2::new(t.x_mm * 1e-3, t.y_mm * 1e-3)));
    broken(|p| p.truth = p.truth.map(|t| Point2::new(t.x_mm + 1e6, t.y_mm)));
    broken(|p| p.truth = p.truth.map(|t| Point2::new(t.x_mm * 1e200, t.y_mm)));
    broken(|p| p.truth = Some(Point2::new(10.0, 2.0)));
    broken(|p| p.views = [view(320.0), view(320.0)]);
    let nothing = broken(|p| p.truth = Some(Point2::new(f64::NAN, 0.0)));
    assert_eq!((nothing.geometry, nothing.calibration), (DRAWN, None));
    // The columns of other presses.
    let mut shuffled = rows.clone();
    for (i, row) in shuffled.iter_mut().enumerate() {
        row.views = rows[(i * 37 + 11) % rows.len()].views;
    }
    let chosen = auto(&CalibrationSet::from_presses(&shuffled), 1);
    assert!(!chosen.warnings.is_empty());
}

//! Areas, taxels and contact maps, compared with independently computed numbers.

use proptest::prelude::*;
use skinrig_analysis::cmre::ContactMap;
use skinrig_analysis::coverage::{
    ARC_SEGMENTS, coverage, field_of_view, neighbour_distance_mm, overlap, probed_area_mm2, taxels,
};
use skinrig_analysis::result::{Estimate, PressResult};
use skinrig_model::skin::polygon_area_mm2;
use skinrig_model::{
    CameraModel, CmreSettings, LensModel, Point2, PressRole, SkinOutline, Verdict,
};

const SKIN: SkinOutline = SkinOutline::PAPER;

fn areas(pieces: &[Vec<Point2>]) -> f64 {
    pieces.iter().map(|p| polygon_area_mm2(p)).sum()
}

/// A camera that looks at the skin centre.
fn camera(at: (f64, f64), skew_deg: f64, half_fov_deg: f64, w: f64) -> CameraModel {
    CameraModel {
        position: Point2::new(at.0, at.1),
        aim: SKIN.centre,
        skew_deg,
        lens: LensModel::Exponential { half_fov_deg, w },
    }
}

/// The published grid: 17 x 17 locations 4 mm apart about the skin centre.
fn grid() -> Vec<Point2> {
    let at = |i: i32| f64::from(4 * (i - 8));
    (0..289)
        .map(|n| Point2::new(10.0 + at(n / 17), 2.0 + at(n % 17)))
        .collect()
}

fn estimate(value: f64, low: f64, high: f64) -> Estimate {
    Estimate {
        value: Some(value),
        low: Some(low),
        high: Some(high),
        n: 250,
    }
}

/// The polygon of the public code: arcs in steps of 5°, and the upper left arc without its last point.
fn published_polygon() -> Vec<Point2> {
    let mut polygon = SKIN.polygon(18);
    polygon.retain(|p| (p.x_mm + 40.0).abs() > 1e-9 || (p.y_mm - 27.0).abs() > 1e-9);
    polygon
}

#[test]
fn areas_are_those_of_the_published_skin() {
    assert!((polygon_area_mm2(&published_polygon()) - 9328.12).abs() < 0.005);
    assert!((polygon_area_mm2(&SKIN.polygon(ARC_SEGMENTS)) - SKIN.area_mm2()).abs() < 0.007);
    let views_of = |at: [(f64, f64); 2], skews: [f64; 2], skin: &[Point2]| {
        let views = [0, 1].map(|k| field_of_view(&camera(at[k], skews[k], 60.0, 0.0), skin));
        areas(&overlap(&views.map(Option::unwrap)))
    };
    let skin = published_polygon();
    let chamfers = [(50.0, -38.0), (50.0, 42.0)];
    let optimised = [(44.25, -31.98), (49.71, 39.81)];
    for (at, skews, expected) in [
        (chamfers, [0.0, 0.0], 8781.7),
        (chamfers, [-1.92, -1.47], 8771.7),
        (optimised, [0.0, 0.0], 7996.0),
    ] {
        let found = views_of(at, skews, &skin);
        assert!((found - expected).abs() < 0.1, "{found}");
    }
}

#[test]
fn the_published_grid_represents_its_cells() {
    let places = grid();
    assert_eq!(neighbour_distance_mm(&places), Some(4.0));
    assert_eq!(probed_area_mm2(&SKIN, &places, 4.0), 4624.0);
    assert_eq!(probed_area_mm2(&SKIN, &places[..250], 4.0), 4000.0);
    // Cells twice as wide overlap: 68 + 4 on each axis.
    assert_eq!(probed_area_mm2(&SKIN, &places, 8.0), 72.0 * 72.0);
    // The whole skin, with its chamfers and arcs.
    let all = probed_area_mm2(&SKIN, &places, 60.0);
    assert!((all - SKIN.area_mm2()).abs() < 0.007, "{all}");
    assert_eq!(neighbour_distance_mm(&places[..1]), None);
}

#[test]
fn taxels_are_the_published_ones_at_the_radius_they_need() {
    let rmse = estimate(5.305, 5.0, 6.0);
    let whole = taxels(Some(9328.12), &rmse);
    assert!((whole.value.unwrap() - 105.5).abs() < 0.05);
    assert!((taxels(Some(4096.0), &rmse).value.unwrap() - 46.3).abs() < 0.05);
    assert!(
        (taxels(Some(9328.12), &estimate(4.66, 4.0, 5.0))
            .value
            .unwrap()
            - 136.7)
            .abs()
            < 0.05
    );
    assert!(
        (taxels(Some(9328.12), &estimate(9.33, 9.0, 9.5))
            .value
            .unwrap()
            - 34.1)
            .abs()
            < 0.05
    );
    // The interval is inverted, and stays around the value.
    assert!((whole.low.unwrap() - 9328.12 / (36.0 * std::f64::consts::PI)).abs() < 1e-9);
    assert!(whole.low < whole.value && whole.value < whole.high);
    // Zero error gives no taxels.
    assert_eq!(taxels(Some(9328.12), &estimate(0.0, 0.0, 1.0)).value, None);
    assert_eq!(taxels(None, &rmse).value, None);
}

/// Every recorded case of the public code: SR 5, edges -40, -35 .. 60 and -48, -43 .. 52, sigma 1 mm.
#[test]
fn contact_maps_score_as_in_the_public_code_but_for_its_two_faults() {
    let settings = CmreSettings {
        cell_mm: 5.0,
        sigma_mm: 1.0,
        sr_mm: 5.0,
    };
    let map = ContactMap::new(&SKIN, &settings).unwrap();
    let score = |estimate: (f64, f64), truth: (f64, f64)| {
        map.score(
            Point2::new(estimate.0, estimate.1),
            Point2::new(truth.0, truth.1),
        )
    };
    let truth = (12.5, 4.5);
    for (name, estimate, truth, expected) in [
        (
            "exact centre",
            (12.5, 4.5),
            truth,
            -1.905_425_898_286_428_5e-10,
        ),
        (
            "same cell",
            (14.0, 6.0),
            truth,
            -0.000_311_447_086_133_754_6,
        ),
        ("on edge", (15.0, 4.5), truth, -0.978_214_339_802_362_8),
        ("one cell", (17.5, 4.5), truth, 0.019_963_462_911_518_626),
        ("two cells", (22.5, 4.5), truth, 0.749_900_146_356_329_5),
        // The public code: 0.99818, because its map underflows to nothing.
        ("far outside", (200.0, 200.0), truth, 0.992_017_081_767_522),
        (
            "truth on edge",
            truth,
            (15.0, 2.0),
            0.019_963_462_911_518_577,
        ),
    ] {
        let found = score(estimate, truth).unwrap();
        assert!((found - expected).abs() < 1e-14, "{name}: {found}");
    }
    // The public code: 0.99202, because it moves the truth into the corner cell.
    assert_eq!(score(truth, (300.0, 300.0)), None);
    assert_eq!(score((f64::NAN, 0.0), truth), None);
    assert!(score(truth, (60.0, 52.0)).is_some());
    // A Gaussian as wide as a cell is bright all around the true cell.
    let wide = CmreSettings {
        sigma_mm: 5.0,
        ..settings
    };
    let wide = ContactMap::new(&SKIN, &wide).unwrap();
    let wide = wide.score(Point2::new(12.5, 4.5), Point2::new(12.5, 4.5));
    assert!(wide.unwrap() < -1.0);
}

#[test]
fn contact_maps_without_sense_are_refused() {
    let bad = |cell_mm: f64, sigma_mm: f64, sr_mm: f64| {
        let settings = CmreSettings {
            cell_mm,
            sigma_mm,
            sr_mm,
        };
        ContactMap::new(&SKIN, &settings).unwrap_err().to_string()
    };
    for (message, name) in [
        (bad(0.0, 1.0, 5.0), "cmre.cell"),
        (bad(0.1, 1.0, 5.0), "cmre.cell"),
        (bad(5.0, f64::NAN, 5.0), "cmre.sigma"),
        (bad(5.0, 1.0, f64::INFINITY), "cmre.sr"),
    ] {
        assert!(message.contains(name), "{message}");
    }
}

/// Spacing of the lattice over the skin's rectangle.
const STEP_MM: f64 = 0.5;

fn lattice() -> impl Iterator<Item = Point2> {
    (0..200 * 200).map(|n| {
        let at = |i: i32| STEP_MM * (f64::from(i) + 0.5);
        Point2::new(-40.0 + at(n / 200), -48.0 + at(n % 200))
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    /// Compares areas with counts of points that each camera has in a column, for narrow and very wide lenses.
    #[test]
    fn views_hold_the_points_that_have_a_column(
        x in 20.0f64..58.0, y in -46.0f64..50.0, skew in -20.0f64..20.0, half in 20.0f64..170.0, w in -0.05f64..0.3,
    ) {
        let second = camera((50.0, 42.0), 0.0, 60.0, 0.0);
        let first = camera((x, y), skew, half, w);
        let skin = SKIN.polygon(ARC_SEGMENTS);
        let views = [first, second].map(|c| field_of_view(&c, &skin).unwrap());
        let span = first.angle_of_column_deg(640.0) - first.angle_of_column_deg(0.0);
        prop_assert!(views[0].len() <= 1 + usize::from(span >= 180.0));
        // By angle from the middle of the field of view, so that the wrap-around does not matter.
        let sees = |c: &CameraModel, p: Point2| {
            let (a, b) = (c.angle_of_column_deg(0.0), c.angle_of_column_deg(640.0));
            let off = (c.angle_of_point_deg(p) - (a + b) / 2.0 + 540.0).rem_euclid(360.0) - 180.0;
            off.abs() <= (b - a) / 2.0
        };
        let inside: Vec<Point2> = lattice().filter(|p| SKIN.contains(*p)).collect();
        let count = |f: &dyn Fn(Point2) -> bool| {
            inside.iter().filter(|p| f(**p)).count() as f64 * STEP_MM * STEP_MM
        };
        // The border, at most 400 mm long, is accurate to about a quarter of a step.
        let near = |exact: f64, counted: f64| (exact - counted).abs() < 0.1 * 400.0 * STEP_MM;
        let one = areas(&views[0]);
        prop_assert!(near(one, count(&|p| sees(&first, p))), "{one}");
        let both = areas(&overlap(&views));
        prop_assert!(near(both, count(&|p| sees(&first, p) && sees(&second, p))), "{both}");
    }

    #[test]
    fn probed_area_is_that_of_the_points_near_a_place(
        places in prop::collection::vec((-45.0f64..65.0, -53.0f64..57.0), 1..12), side in 1.0f64..40.0,
    ) {
        let places: Vec<Point2> = places.into_iter().map(|(x, y)| Point2::new(x, y)).collect();
        let covered = |p: &Point2| {
            let near = |a: f64, b: f64| (a - b).abs() <= side / 2.0;
            places.iter().any(|q| near(p.x_mm, q.x_mm) && near(p.y_mm, q.y_mm))
        };
        let counted = lattice().filter(|p| SKIN.contains(*p) && covered(p)).count() as f64;
        let exact = probed_area_mm2(&SKIN, &places, side);
        let border = 4.0 * side * places.len() as f64 + 400.0;
        prop_assert!((exact - counted * STEP_MM * STEP_MM).abs() < 0.15 * border * STEP_MM, "{exact}");
    }
}

/// A place that only calibrates, or whose scored presses are left out, is not where the RMSE was measured.
#[test]
fn places_without_a_press_in_the_rmse_are_not_probed() {
    let (input, events) = skinrig_planted::grid::session();
    let mut analysis = skinrig_analysis::analyze(&input, &events).unwrap();
    let whole = coverage(&analysis).unwrap();
    let is_scored = |p: &PressResult| p.role == PressRole::Score;
    let lost = analysis.presses.iter().find(|p| is_scored(p)).unwrap();
    let lost = lost.location;
    for press in &mut analysis.presses {
        if is_scored(press) && press.location == lost {
            press.verdict = Verdict::Excluded;
        }
    }
    let found = coverage(&analysis).unwrap();
    assert_eq!(found.locations + 1, whole.locations);
    assert_eq!(found.cell_mm, whole.cell_mm);
    let [part, all] = [found, whole].map(|c| c.probed_mm2.unwrap());
    assert!(part < all, "{part} {all}");
}

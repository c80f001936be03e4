//! Calibration: recovers planted geometries, tolerates outliers and unusable presses, keeps roles separate.

use skinrig_analysis::calibrate::{calibrate, largest_supported_model};
use skinrig_analysis::result::{LocationOutcome, PressResult, PressView};
use skinrig_analysis::sets::{CalibrationSet, ScoreSet};
use skinrig_analysis::triangulate::intersect;
use skinrig_model::{
    CalibrationModel, LocationId, Point2, PressId, PressRole, RepetitionId, StereoGeometry, Verdict,
};

const PLANTED: [f64; 8] = [
    42.51, -33.337, 41.947, 36.103, -2.388, 0.302, -0.1138, 0.0168,
];

fn view(u: f64) -> Option<PressView> {
    skinrig_planted::view(u, 100)
}

fn row(id: u32, role: PressRole, truth: Point2, columns: [f64; 2]) -> PressResult {
    PressResult {
        press: PressId::from_index(id),
        role,
        repetition: RepetitionId::default(),
        location: LocationId::from_index(id),
        planned: truth,
        depth_mm: 2.0,
        truth: Some(truth),
        verdict: Verdict::Valid,
        cause: None,
        timing: None,
        views: columns.map(view),
        location_outcome: LocationOutcome::Missing,
        region: None,
        extrapolated: false,
    }
}

/// Every grid point that both cameras see, with exact columns; `pitch` mm apart.
fn exact(geometry: &StereoGeometry, pitch: f64) -> Vec<PressResult> {
    let mut rows = Vec::new();
    for i in -8i32..=8 {
        for j in -8i32..=8 {
            let p = Point2::new(10.0 + pitch * f64::from(i), 2.0 + pitch * f64::from(j));
            if let [Some(a), Some(b)] = geometry.cameras.map(|c| c.column_of_point(p)) {
                rows.push(row(rows.len() as u32, PressRole::Calibrate, p, [a, b]));
            }
        }
    }
    rows
}

#[test]
fn exact_rays_give_the_planted_geometry_back() {
    let planted = StereoGeometry::paper_like(PLANTED);
    let set = CalibrationSet::from_presses(&exact(&planted, 4.0));
    assert!(set.sights().len() > 200);
    let start = StereoGeometry::PAPER;
    let (found, result) = calibrate(&set, &start, CalibrationModel::Full, 1).unwrap();
    for (value, expected) in result.values.iter().zip(PLANTED) {
        assert!((value - expected).abs() < 1e-6, "{:?}", result.values);
    }
    assert!(
        result.rmse_after_mm < 1e-7 && result.rmse_before_mm > 1.0,
        "{result:?}"
    );
    assert_eq!(result.start, start);
    assert_eq!(
        found,
        StereoGeometry::paper_like(result.values.clone().try_into().unwrap())
    );
    assert_eq!(result.names[4], "camera 1 skew (deg)");
    assert!(
        result
            .standard_errors
            .iter()
            .all(|e| e.is_some_and(|e| e < 1e-6))
    );
    let repeated = calibrate(&set, &start, CalibrationModel::Full, 1).unwrap();
    assert_eq!(repeated, (found, result));
}

#[test]
fn nested_models_move_only_their_own_parameters() {
    let mut p = PLANTED;
    p[6..].copy_from_slice(&[-0.17, 0.074]);
    let planted = StereoGeometry::paper_like(p);
    let set = CalibrationSet::from_presses(&exact(&planted, 4.0));
    let start = StereoGeometry::PAPER;
    let (six, result) = calibrate(&set, &start, CalibrationModel::PositionsSkews, 3).unwrap();
    assert_eq!(result.values.len(), 6);
    assert!(result.rmse_after_mm < 1e-7);
    assert_eq!(six.cameras[0].lens, start.cameras[0].lens);
    let (four, result) = calibrate(&set, &start, CalibrationModel::Positions, 3).unwrap();
    assert_eq!(
        (
            result.values.len(),
            result.names.len(),
            result.standard_errors.len()
        ),
        (4, 4, 4)
    );
    assert_eq!(four.cameras[1].skew_deg, start.cameras[1].skew_deg);
    assert!(result.rmse_after_mm < result.rmse_before_mm && result.rmse_after_mm > 1e-3);
    assert_eq!(calibrate(&set, &start, CalibrationModel::None, 3), None);
}

#[test]
fn outliers_and_presses_without_a_fix_pull_little() {
    let planted = StereoGeometry::paper_like(PLANTED);
    let mut rows = exact(&planted, 4.0);
    for i in (0..rows.len()).step_by(12) {
        // Unrelated centroids anywhere in the image, some of them behind a camera.
        rows[i].views = [
            view(20.0 + (i as f64 * 37.0) % 600.0),
            view(630.0 - (i as f64 * 53.0) % 600.0),
        ];
    }
    let set = CalibrationSet::from_presses(&rows);
    let (found, result) =
        calibrate(&set, &StereoGeometry::PAPER, CalibrationModel::Full, 1).unwrap();
    assert_eq!(result.n as usize, rows.len(), "every press takes part");
    // Compare predicted points instead of parameters, which are strongly correlated.
    for p in [(10.0, 2.0), (-20.0, 20.0), (30.0, -15.0), (-15.0, -20.0)] {
        let p = Point2::new(p.0, p.1);
        let columns = planted.cameras.map(|c| c.column_of_point(p).unwrap());
        let angles = [0, 1].map(|k| found.cameras[k].angle_of_column_deg(columns[k]));
        let off = intersect(&found, angles).at.distance_mm(p);
        assert!(off < 0.05, "{off} mm off at {p:?}");
    }
}

#[test]
fn too_few_places_get_a_smaller_model() {
    let planted = StereoGeometry::paper_like(PLANTED);
    let rows = exact(&planted, 4.0);
    for (places, expected) in [
        (3, CalibrationModel::None),
        (4, CalibrationModel::Positions),
        (7, CalibrationModel::PositionsSkews),
        (8, CalibrationModel::Full),
    ] {
        // Five repetitions at the same locations do not add locations.
        let few: Vec<PressResult> = (0..5).flat_map(|_| rows[..places].to_vec()).collect();
        let set = CalibrationSet::from_presses(&few);
        assert_eq!(
            largest_supported_model(&set, CalibrationModel::Full),
            expected
        );
    }
    let set = CalibrationSet::from_presses(&rows);
    let positions = CalibrationModel::Positions;
    assert_eq!(largest_supported_model(&set, positions), positions);
}

#[test]
fn no_press_calibrates_and_scores() {
    let planted = StereoGeometry::paper_like(PLANTED);
    let mut rows = exact(&planted, 8.0);
    let roles = [PressRole::Sync, PressRole::Calibrate, PressRole::Score];
    for (i, r) in rows.iter_mut().enumerate() {
        r.role = roles[i % 3];
        let at = r.planned;
        r.location_outcome = LocationOutcome::Located { at, sine: 0.9 };
    }
    rows[4].verdict = Verdict::Excluded;
    rows[7].verdict = Verdict::Invalid;
    rows[5].verdict = Verdict::Missed;
    rows[8].verdict = Verdict::Excluded;
    let calibration = CalibrationSet::from_presses(&rows);
    let score = ScoreSet::from_presses(&rows, &[]);
    let of = |role: PressRole| rows.iter().filter(|r| r.role == role).count();
    assert_eq!(calibration.sights().len(), of(PressRole::Calibrate) - 2);
    assert_eq!(
        score.presses().len(),
        of(PressRole::Score) - 1,
        "failures stay, only the missed one goes"
    );
    assert_eq!(score.presses().iter().filter(|p| !p.valid).count(), 1);
    for sight in calibration.sights() {
        assert!(score.presses().iter().all(|p| p.press != sight.press));
    }
}

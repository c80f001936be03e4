//! Mirrored, turned, reordered and repeated presses: the answers that the symmetry demands.

use skinrig_analysis::calibrate::choose;
use skinrig_analysis::locator::{LocatorChoice, choose_locator};
use skinrig_analysis::result::PressResult;
use skinrig_analysis::sets::CalibrationSet;
use skinrig_model::{Locator, Point2, StereoGeometry};

use super::skins::{DRAWN, Skin, Spreads, features, settings};

fn skin() -> Skin {
    Skin {
        bend_px: 12.0,
        side: 9,
        spreads: Spreads::Near(0.08),
        ..Skin::new(4)
    }
}

fn learn(presses: &[PressResult], drawn: &StereoGeometry, locator: Locator) -> LocatorChoice {
    let set = CalibrationSet::from_presses(presses);
    let settings = settings(locator);
    let model = choose(&set, drawn, &settings);
    choose_locator(&set, &model.geometry, model.calibration.as_ref(), &settings).unwrap()
}

/// Every press located before and after `change`, which also moves a position.
fn holds(
    change: impl Fn(&PressResult) -> PressResult,
    drawn: &StereoGeometry,
    moved: impl Fn(Point2) -> Point2,
    tolerance_mm: f64,
) {
    let presses = skin().presses();
    let changed: Vec<PressResult> = presses.iter().map(&change).collect();
    for locator in [Locator::Field, Locator::Direct] {
        let (own, other) = (
            learn(&presses, &DRAWN, locator),
            learn(&changed, drawn, locator),
        );
        assert_eq!(
            (own.fitted.locator(), other.fitted.locator()),
            (locator, locator)
        );
        for (a, b) in presses.iter().zip(&changed) {
            let a = own.fitted.locate(&features(a)).unwrap();
            let b = other.fitted.locate(&features(b)).unwrap();
            let expected = moved(Point2::new(a.at[0], a.at[1]));
            let off = libm::hypot(b.at[0] - expected.x_mm, b.at[1] - expected.y_mm);
            assert!(off < tolerance_mm, "{locator:?}: {off} mm");
            let (a, b) = (a.region.unwrap(), b.region.unwrap());
            let ratio = b.area_mm2() / a.area_mm2();
            assert!((ratio - 1.0).abs() < 0.05, "{locator:?}: {ratio}");
        }
    }
}

fn moved_press(press: &PressResult, to: impl Fn(Point2) -> Point2) -> PressResult {
    PressResult {
        planned: to(press.planned),
        truth: press.truth.map(&to),
        ..press.clone()
    }
}

fn moved_geometry(to: impl Fn(Point2) -> Point2) -> StereoGeometry {
    let mut geometry = DRAWN;
    for camera in &mut geometry.cameras {
        camera.position = to(camera.position);
        camera.aim = to(camera.aim);
    }
    geometry
}

#[test]
fn a_turned_skin_is_located_where_it_turned_to() {
    let (sin, cos) = libm::sincos(0.7_f64);
    let turn = |p: Point2| Point2::new(cos * p.x_mm - sin * p.y_mm, sin * p.x_mm + cos * p.y_mm);
    holds(|p| moved_press(p, turn), &moved_geometry(turn), turn, 0.02);
}

#[test]
fn a_shifted_skin_is_located_where_it_shifted_to() {
    let shift = |p: Point2| Point2::new(p.x_mm + 130.0, p.y_mm - 55.0);
    holds(
        |p| moved_press(p, shift),
        &moved_geometry(shift),
        shift,
        0.02,
    );
}

/// A mirrored skin: columns run backwards in both cameras.
#[test]
fn a_mirrored_skin_is_located_at_the_mirror_images() {
    let mirror = |p: Point2| Point2::new(p.x_mm, -p.y_mm);
    let change = |press: &PressResult| {
        let mut press = moved_press(press, mirror);
        for view in press.views.iter_mut().flatten() {
            view.centroid_u = view.centroid_u.map(|u| 640.0 - u);
        }
        press
    };
    holds(change, &moved_geometry(mirror), mirror, 0.02);
}

#[test]
fn cameras_that_change_names_change_nothing() {
    let swapped = StereoGeometry {
        cameras: [DRAWN.cameras[1], DRAWN.cameras[0]],
    };
    let change = |press: &PressResult| PressResult {
        views: [press.views[1], press.views[0]],
        ..press.clone()
    };
    holds(change, &swapped, |p| p, 0.02);
}

#[test]
fn the_order_of_the_presses_does_not_matter() {
    let presses = skin().presses();
    let mut reversed = presses.clone();
    reversed.reverse();
    for locator in [Locator::Field, Locator::Direct] {
        let (own, other) = (
            learn(&presses, &DRAWN, locator),
            learn(&reversed, &DRAWN, locator),
        );
        for press in &presses {
            let at = |choice: &LocatorChoice| choice.fitted.locate(&features(press)).unwrap().at;
            let (a, b) = (at(&own), at(&other));
            let off = libm::hypot(a[0] - b[0], a[1] - b[1]);
            assert!(off < 0.02, "{off} mm");
        }
    }
}

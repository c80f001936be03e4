//! Properties of several tips on the optical level.

use skinrig_model::{CameraId, Point2};

use super::tests::{P, mean_column, press, quiet, run, scene};
use super::{OpticalConfig, SeveralTips};
use crate::scene::{FurtherTip, PixelEvent, PixelModel, TipSample};

const Q: Point2 = Point2::new(10.0, -12.0);

/// A model for two tips without noise.
fn two_tips(id: CameraId, further: FurtherTip) -> SeveralTips {
    let config = OpticalConfig::default().without_noise();
    SeveralTips::new(&scene(id), config, &[further])
}

fn apart(from: Point2, to: Point2, shorter_mm: f64) -> FurtherTip {
    FurtherTip {
        offset_mm: [to.x_mm - from.x_mm, to.y_mm - from.y_mm],
        shorter_mm,
    }
}

fn several(mut model: SeveralTips, tips: &[TipSample]) -> Vec<PixelEvent> {
    let mut out = Vec::new();
    model.advance(tips, &mut out);
    out
}

#[test]
fn a_second_tip_that_never_touches_changes_nothing() {
    for id in CameraId::ALL {
        let alone = run(&mut quiet(id), &press(P, 2.0));
        let model = two_tips(id, apart(P, Q, 9.0));
        let beside = several(model, &press(P, 2.0));
        // The two ways to evaluate pixels differ in rounding only.
        assert!(beside.len().abs_diff(alone.len()) <= alone.len() / 200);
        let off = mean_column(&beside) - mean_column(&alone);
        assert!(off.abs() < 0.2, "{off}");
    }
}

#[test]
fn dents_in_different_columns_do_not_interact() {
    let id = CameraId::Two;
    let pair = several(two_tips(id, apart(P, Q, 0.0)), &press(P, 2.0));
    let [one, two] = [P, Q].map(|at| run(&mut quiet(id), &press(at, 2.0)));
    let between = 0.5 * (mean_column(&one) + mean_column(&two));
    let near = |events: &[PixelEvent], low: bool| {
        let on_side = |e: &&PixelEvent| (f64::from(e.x) < between) == low;
        events.iter().filter(on_side).count()
    };
    for low in [false, true] {
        let (both, alone) = (near(&pair, low), near(&one, low) + near(&two, low));
        assert!(both.abs_diff(alone) <= alone / 50, "{both} {alone}");
    }
}

#[test]
fn dents_on_one_ray_act_in_the_order_of_their_distance() {
    // Both on one ray of camera 1; which tip is the first makes no difference, which dent is in front does.
    let camera = scene(CameraId::One).camera;
    let [dx, dy] = camera.direction(camera.angle_of_column_deg(300.0));
    let at = |r: f64| Point2::new(camera.position.x_mm + r * dx, camera.position.y_mm + r * dy);
    let (near, far) = (at(30.0), at(60.0));
    let pair = |from: Point2, to: Point2| {
        several(
            two_tips(CameraId::One, apart(from, to, 0.0)),
            &press(from, 2.0),
        )
        .len()
    };
    let (forth, back) = (pair(near, far), pair(far, near));
    assert!(forth.abs_diff(back) <= forth / 200, "{forth} {back}");
    assert!(forth > run(&mut quiet(CameraId::One), &press(near, 2.0)).len());
}

#[test]
fn a_shorter_tip_touches_later() {
    let id = CameraId::Two;
    let column = scene(id).camera.column_of_point(Q).unwrap();
    let first_ms = |shorter_mm: f64| {
        let events = several(two_tips(id, apart(P, Q, shorter_mm)), &press(P, 2.0));
        let near = |e: &&PixelEvent| (f64::from(e.x) - column).abs() < 30.0;
        events.iter().find(near).unwrap().t_ns as f64 * 1e-6
    };
    // The tip moves at 30 mm/s.
    let later_ms = first_ms(0.6) - first_ms(0.0);
    assert!((later_ms - 20.0).abs() < 1.0, "{later_ms}");
}

#[test]
fn two_tips_do_not_depend_on_the_division_into_calls() {
    let tips = press(P, 1.5);
    let model = || {
        SeveralTips::new(
            &scene(CameraId::One),
            OpticalConfig::default(),
            &[apart(P, Q, 0.1)],
        )
    };
    let whole = several(model(), &tips);
    let (mut parts, mut cut) = (Vec::new(), model());
    for some in tips.chunks(7) {
        cut.advance(some, &mut parts);
    }
    assert_eq!(whole, parts);
    assert!(whole.is_sorted_by_key(|e| e.t_ns));
}

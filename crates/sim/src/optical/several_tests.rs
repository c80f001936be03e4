//! Properties of several tips on the optical level.

use skinrig_model::{CameraId, Point2, Point3};
use skinrig_simd::InstructionSet;

use super::dent::Dent;
use super::tests::{P, mean_column, press, quiet, run, scene, tip};
use super::{OpticalConfig, OpticalModel};
use crate::scene::{GRID_NS, PixelEvent, TipSample};

const Q: Point2 = Point2::new(10.0, -12.0);

/// Another tip on the same holder as the first.
#[derive(Debug, Clone, Copy)]
struct Beside {
    offset_mm: [f64; 2],
    /// Height of its end above that of the first one, mm: it touches later and less deep.
    shorter_mm: f64,
}

/// A model for two tips without noise.
fn two_tips(id: CameraId) -> OpticalModel {
    let config = OpticalConfig::default().without_noise();
    OpticalModel::with_config(&scene(id), config, 2).unwrap()
}

fn apart(from: Point2, to: Point2, shorter_mm: f64) -> Beside {
    Beside {
        offset_mm: [to.x_mm - from.x_mm, to.y_mm - from.y_mm],
        shorter_mm,
    }
}

/// The events while the first tip follows `tips` and the other moves with it.
fn several(mut model: OpticalModel, beside: Beside, tips: &[TipSample]) -> Vec<PixelEvent> {
    let mut out = Vec::new();
    advance(&mut model, beside, tips, &mut out);
    out
}

fn advance(
    model: &mut OpticalModel,
    beside: Beside,
    tips: &[TipSample],
    out: &mut Vec<PixelEvent>,
) {
    let [dx, dy] = beside.offset_mm;
    for tip in tips {
        let at = tip.position;
        let other = Point3::new(at.x_mm + dx, at.y_mm + dy, at.z_mm + beside.shorter_mm);
        model.advance_to(tip.t_ns, &[at, other], out);
    }
}

#[test]
fn a_second_tip_that_never_touches_changes_nothing() {
    for id in CameraId::ALL {
        let alone = run(&mut quiet(id), &press(P, 2.0));
        let beside = several(two_tips(id), apart(P, Q, 9.0), &press(P, 2.0));
        assert!(beside == alone);
    }
}

#[test]
fn dents_in_different_columns_do_not_interact() {
    let id = CameraId::Two;
    let pair = several(two_tips(id), apart(P, Q, 0.0), &press(P, 2.0));
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
            two_tips(CameraId::One),
            apart(from, to, 0.0),
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
        let events = several(two_tips(id), apart(P, Q, shorter_mm), &press(P, 2.0));
        let near = |e: &&PixelEvent| (f64::from(e.x) - column).abs() < 30.0;
        events.iter().find(near).unwrap().t_ns as f64 * 1e-6
    };
    // The tip moves at 30 mm/s.
    let later_ms = first_ms(0.6) - first_ms(0.0);
    assert!((later_ms - 20.0).abs() < 1.0, "{later_ms}");
}

#[test]
fn two_tips_do_not_depend_on_the_division_into_calls() {
    let (tips, beside) = (press(P, 1.5), apart(P, Q, 0.1));
    let model = || {
        let config = OpticalConfig::default();
        OpticalModel::with_config(&scene(CameraId::One), config, 2).unwrap()
    };
    let whole = several(model(), beside, &tips);
    let (mut parts, mut cut) = (Vec::new(), model());
    for some in tips.chunks(7) {
        advance(&mut cut, beside, some, &mut parts);
    }
    assert!(whole == parts);
    assert!(whole.is_sorted_by_key(|e| e.t_ns));
}

/// A press at `p`, `start_ms` later than the first one.
fn later(p: Point2, start_ms: i64) -> Vec<TipSample> {
    let shift = |t: TipSample| TipSample {
        t_ns: t.t_ns + start_ms * GRID_NS,
        ..t
    };
    press(p, 2.0).into_iter().map(shift).collect()
}

#[test]
fn a_dent_that_was_left_keeps_relaxing_while_the_tip_presses_elsewhere() {
    let (low, high) = (Point2::new(34.0, -30.0), Point2::new(34.0, 34.0));
    for (id, here, elsewhere) in [(CameraId::One, low, high), (CameraId::Two, high, low)] {
        // The tip moves on 200 ms after it left, and the events go on as if it had not.
        let moved_on = [press(here, 2.0), later(elsewhere, 501)].concat();
        let rest = (501..=1001).map(|ms| tip(ms, here.x_mm, here.y_mm, 1.0));
        let stays: Vec<_> = press(here, 2.0).into_iter().chain(rest).collect();
        let reached = Dent::new(&quiet(id).optics, [elsewhere.x_mm, elsewhere.y_mm]).columns;
        let of_here =
            |e: &PixelEvent| e.t_ns > 501 * GRID_NS && !reached.contains(&usize::from(e.x));
        let tail = |tips: &[TipSample]| {
            let events = run(&mut quiet(id), tips);
            events.into_iter().filter(&of_here).collect::<Vec<_>>()
        };
        let (alone, beside) = (tail(&stays), tail(&moved_on));
        assert!(alone.len() > 20, "{}", alone.len());
        assert!(alone == beside, "{} {}", alone.len(), beside.len());
    }
}

#[test]
fn columns_that_are_not_evaluated_have_no_event() {
    let near = Point2::new(P.x_mm + 6.0, P.y_mm - 4.0);
    let tips = [press(P, 2.0), later(Q, 501), later(near, 1002)].concat();
    let positions = |t: &TipSample| [t.position, Point3::new(12.0, -10.0, t.position.z_mm + 0.3)];
    let mut events = [Vec::new(), Vec::new()];
    for (all, out) in events.iter_mut().enumerate() {
        let config = OpticalConfig::default();
        let mut model = OpticalModel::with_config(&scene(CameraId::One), config, 2).unwrap();
        for t in &tips {
            if all == 1 {
                model.pixels.forget_slack();
            }
            model.advance_to(t.t_ns, &positions(t), out);
        }
    }
    assert!(events[0].len() > 10_000);
    assert!(events[0] == events[1]);
}

#[test]
fn a_new_touch_wakes_no_pixel_of_the_dent_before() {
    for id in CameraId::ALL {
        let tips = [press(P, 2.0), later(Q, 501)].concat();
        let events = run(&mut quiet(id), &tips);
        // Contact at Q is 33 ms after its press begins; the events of the millisecond before and after it.
        let within = |from_ms: i64| {
            let span = (501 + from_ms) * GRID_NS..(502 + from_ms) * GRID_NS;
            events.iter().filter(|e| span.contains(&e.t_ns)).count()
        };
        let (before, after) = (within(31), within(34));
        assert!(after <= before + 3, "{before} {after}");
    }
}

#[test]
fn all_instruction_sets_give_the_same_events() {
    let events = InstructionSet::available().into_iter().map(|set| {
        let mut model = OpticalModel::new(&scene(CameraId::One));
        model.pixels.use_instructions(set);
        run(&mut model, &[press(P, 2.0), later(Q, 501)].concat())
    });
    let all: Vec<_> = events.collect();
    assert!(all.iter().all(|one| *one == all[0]));
}

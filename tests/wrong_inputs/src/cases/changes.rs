//! Changes of a bench, for the cases.

use skinrig_model::Point2;

use crate::bench::{Bench, ExecutedPress, Picture, Timetable, meander};

pub(super) fn import(seed: u64, change: impl FnOnce(&mut Bench)) -> Bench {
    let mut bench = Bench::new(seed);
    change(&mut bench);
    bench
}

pub(super) fn robot(seed: u64, change: impl FnOnce(&mut Bench)) -> Bench {
    let mut bench = Bench::robot(seed);
    change(&mut bench);
    bench
}

/// Transforms every position of the table.
pub(super) fn table(bench: &mut Bench, change: impl Fn(Point2) -> Point2) {
    bench.table.iter_mut().for_each(|p| *p = change(*p));
}

/// Transforms the robot's measured positions.
pub(super) fn measured(bench: &mut Bench, change: impl Fn(Point2) -> Point2) {
    let plan = bench.table.clone();
    table(bench, change);
    if let Some(robot) = &mut bench.robot {
        robot.planned = Some(plan);
    }
}

pub(super) const CENTRE: Point2 = Point2::new(10.0, 2.0);

pub(super) fn moved(p: Point2, dx: f64, dy: f64) -> Point2 {
    Point2::new(p.x_mm + dx, p.y_mm + dy)
}

pub(super) fn times(p: Point2, factor: f64) -> Point2 {
    Point2::new(p.x_mm * factor, p.y_mm * factor)
}

/// An extra press at `at_s`, in the middle of the path.
pub(super) fn extra(bench: &mut Bench, at_s: f64) {
    let at = bench.pressed.iter().position(|p| p.contact_s > at_s);
    let press = ExecutedPress {
        at: CENTRE,
        contact_s: at_s,
    };
    bench
        .pressed
        .insert(at.unwrap_or(bench.pressed.len()), press);
}

/// Delays everything from press `from` on (sync presses count) by `by_s`.
pub(super) fn later(bench: &mut Bench, from: usize, by_s: f64) {
    bench.pressed[from..]
        .iter_mut()
        .for_each(|p| p.contact_s += by_s);
}

/// Contact of the first press of the path, s.
pub(super) fn path_begins_s(bench: &Bench) -> f64 {
    bench.pressed[3].contact_s
}

/// Three of the five lines, once: 15 locations.
pub(super) fn single(seed: u64) -> Bench {
    let base = Bench::new(seed).timetable;
    let timetable = Timetable {
        presses: 30,
        used: 30,
        repetitions: 1,
        ..base
    };
    Bench::of(seed, timetable, meander(6, 5, 8.0))
}

/// Four locations, four times.
pub(super) fn short(seed: u64) -> Bench {
    let base = Bench::new(seed).timetable;
    let timetable = Timetable {
        presses: 4,
        used: 4,
        repetitions: 4,
        ..base
    };
    let places = vec![
        Point2::new(-15.0, -15.0),
        Point2::new(-15.0, 19.0),
        Point2::new(12.0, 19.0),
        Point2::new(12.0, -15.0),
    ];
    Bench::of(seed, timetable, places)
}

pub(super) fn right_table(bench: &mut Bench) {
    bench.table = crate::bench::path();
    if let Some(robot) = &mut bench.robot {
        robot.planned = None;
    }
}

pub(super) fn right_schedule(bench: &mut Bench) {
    bench.timetable = Bench::new(0).timetable;
    right_table(bench);
}

pub(super) fn right_streams(bench: &mut Bench) {
    bench.feeds = [0, 1];
}

pub(super) fn right_pictures(bench: &mut Bench) {
    bench.pictures = [Picture::Upright; 2];
    right_streams(bench);
}

//! Schedules and robot positions that contradict the recording.

use skinrig_analysis::result::Fault::{self, *};
use skinrig_model::Point2;

use super::changes::*;
use super::{NEARLY, Table};
use crate::bench::{Bench, Random};
use crate::judge::Allowed::{Named, Refused, Right, Unknowable};

pub(super) fn schedules(t: &mut Table) {
    t.1 = "schedules";
    t.case(
        "four sync presses for three",
        |s| import(s, |b| extra(b, b.pressed[0].contact_s - 1.0)),
        &[Named(SyncPattern)],
    );
    t.case(
        "two sync presses for three",
        |s| {
            import(s, |b| {
                b.pressed.remove(1);
            })
        },
        &[Named(SyncPattern)],
    );
    t.case(
        "2 s between sync presses for 1 s",
        |s| {
            import(s, |b| {
                b.pressed[0].contact_s -= 2.0;
                b.pressed[1].contact_s -= 1.0;
            })
        },
        &[Named(SyncPattern)],
    );
    t.case(
        "a pause of 6 s after the sync presses for 3 s",
        |s| import(s, |b| later(b, 3, 3.0)),
        &[Named(SyncPattern), Refused],
    );
    t.case(
        "no sync presses in the recording",
        |s| import(s, |b| drop(b.pressed.drain(0..3))),
        &[Named(SyncPattern), Right],
    );
    t.papers(
        "the schedule of a single repetition for two",
        |s| import(s, |b| b.timetable.repetitions = 1),
        |b| b.timetable.repetitions = 2,
        &[Right, Named(PressesUnlisted), Refused],
    );
    t.papers(
        "three repetitions for two",
        |s| import(s, |b| b.timetable.repetitions = 3),
        right_schedule,
        &[Named(PressesMissing), Refused],
    );
    t.papers(
        "20 presses for 25, and as many rows",
        |s| {
            import(s, |b| {
                b.timetable.presses = 20;
                b.timetable.used = 20;
                b.table.truncate(20);
            })
        },
        right_schedule,
        &[
            Named(PressesUnlisted),
            Named(IndexShifted),
            Named(PressesMissing),
            Refused,
        ],
    );
    t.papers(
        "the last 20 rows of 25",
        |s| {
            import(s, |b| {
                b.timetable.presses = 20;
                b.timetable.used = 20;
                b.table.drain(..5);
            })
        },
        right_schedule,
        &[Named(IndexShifted), Refused],
    );
    t.case(
        "20 presses for 25, with all rows",
        |s| import(s, |b| b.timetable.presses = 20),
        &[Refused],
    );
    t.papers(
        "a period of 2.1 s for 2 s",
        |s| import(s, |b| b.timetable.period_s = 2.1),
        right_schedule,
        &[Refused, Named(ClockWrong), Named(PressesMissing)],
    );
    t.papers(
        "a period of 4 s for 2 s",
        |s| import(s, |b| b.timetable.period_s = 4.0),
        right_schedule,
        &[
            Refused,
            Named(ClockWrong),
            Named(PressesMissing),
            Named(PressesUnlisted),
        ],
    );
    t.papers(
        "a pause of 6 s between repetitions for 3 s",
        |s| import(s, |b| b.timetable.pause_s = 6.0),
        right_schedule,
        &[
            Refused,
            Named(ClockWrong),
            Named(PressesMissing),
            Named(IndexShifted),
            Right,
        ],
    );
    t.papers(
        "a pause of 5 s between repetitions for 3 s: a period more",
        |s| import(s, |b| b.timetable.pause_s = 5.0),
        right_schedule,
        &[Refused, Named(IndexShifted)],
    );
    t.case(
        "milliseconds taken for seconds",
        |s| {
            import(s, |b| {
                b.timetable.period_s = 2000.0;
                b.timetable.sync.interval_s = 1000.0;
            })
        },
        &[Refused],
    );
    t.case(
        "the times of a camera in ms",
        |s| import(s, |b| b.clocks[1].1 = -999_000.0),
        &[
            Refused,
            Named(ClockWrong),
            Named(CameraBlind),
            Named(PressesMissing),
        ],
    );
    t.case(
        "a camera clock 400 ppm fast",
        |s| robot(s, |b| b.clocks[0].1 = 400.0),
        &[Right, Named(ClockWrong)],
    );
}

pub(super) fn robots(t: &mut Table) {
    t.1 = "the robot's positions";
    let mut off = |name, bench: fn(u64) -> Bench, fault: Fault| {
        t.papers(name, bench, right_table, &[Named(fault)]);
    };
    off(
        "measured with x and y exchanged",
        |s| robot(s, |b| measured(b, |p| Point2::new(p.y_mm, p.x_mm))),
        AxesExchanged,
    );
    off(
        "measured with y mirrored",
        |s| robot(s, |b| measured(b, |p| Point2::new(p.x_mm, 4.0 - p.y_mm))),
        AxisMirrored,
    );
    off(
        "measured from the skin's centre",
        |s| robot(s, |b| measured(b, |p| moved(p, -10.0, -2.0))),
        PositionsDisplaced,
    );
    off(
        "measured in metres",
        |s| robot(s, |b| measured(b, |p| times(p, 1e-3))),
        UnitOfPositions,
    );
    off(
        "measured 6 mm beside, at random",
        |s| {
            robot(s, |b| {
                let plan = b.table.clone();
                let mut random = Random::new(s);
                b.table.iter_mut().for_each(|p| {
                    *p = moved(*p, 6.0 * random.normal(), 6.0 * random.normal());
                });
                if let Some(robot) = &mut b.robot {
                    robot.planned = Some(plan);
                }
            })
        },
        RobotOff,
    );
    t.case(
        "planned and measured from the skin's centre",
        |s| robot(s, |b| table(b, |p| moved(p, -10.0, -2.0))),
        &[Named(PositionsDisplaced), Unknowable(NEARLY)],
    );
    t.case(
        "the trigger wires crossed, of one box",
        |s| {
            robot(s, |b| {
                if let Some(robot) = &mut b.robot {
                    robot.wires_crossed = true;
                }
            })
        },
        &[Right, Refused, Named(ClockWrong), Named(CameraBlind)],
    );
    t.case(
        "the trigger wires crossed, one sync press",
        |s| {
            robot(s, |b| {
                b.timetable.sync.count = 1;
                if let Some(robot) = &mut b.robot {
                    robot.wires_crossed = true;
                }
            })
        },
        &[Right, Refused, Named(ClockWrong), Named(CameraBlind)],
    );
}

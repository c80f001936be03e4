//! Extra and missing presses, and cameras that stop, lose data or move.

use skinrig_analysis::result::Fault::*;

use super::Table;
use super::changes::*;
use crate::bench::{ExecutedPress, Picture};
use crate::judge::Allowed::{Named, Refused, Right};

pub(super) fn presses(t: &mut Table) {
    t.1 = "presses";
    t.case(
        "an extra press after the path",
        |s| import(s, |b| extra(b, b.end_s() + 1.0)),
        &[Right, Named(PressesUnlisted)],
    );
    t.case(
        "five extra presses after the path, in its rhythm",
        |s| import(s, |b| (0..5).for_each(|_| extra(b, b.end_s() - 1.0))),
        &[Right, Named(PressesUnlisted), Refused],
    );
    t.case(
        "five extra presses before the sync presses",
        |s| {
            import(s, |b| {
                later(b, 0, 14.0);
                (0..5).for_each(|k| extra(b, 1.0 + 2.0 * f64::from(k)));
            })
        },
        &[Right, Named(PressesUnlisted), Named(SyncPattern), Refused],
    );
    t.case(
        "an extra press in the pause between repetitions",
        |s| import(s, |b| extra(b, path_begins_s(b) + 51.5)),
        &[Right, Named(PressesUnlisted)],
    );
    t.case(
        "the robot misses ten presses",
        |s| import(s, |b| drop(b.pressed.drain(35..45))),
        &[Named(PressesMissing), Right],
    );
    t.case(
        "the robot misses one press",
        |s| {
            import(s, |b| {
                b.pressed.remove(40);
            })
        },
        &[Right],
    );
    t.case(
        "the robot leaves out a press and goes on a period earlier",
        |s| {
            import(s, |b| {
                b.pressed.remove(40);
                later(b, 40, -2.0);
            })
        },
        &[Named(IndexShifted), Refused],
    );
    t.case(
        "the robot makes a press twice and goes on a period later",
        |s| {
            import(s, |b| {
                let press = b.pressed[35];
                later(b, 36, 2.0);
                b.pressed.insert(
                    36,
                    ExecutedPress {
                        contact_s: press.contact_s + 2.0,
                        ..press
                    },
                );
            })
        },
        &[Named(IndexShifted), Refused],
    );
    t.case(
        "every press made twice, half a period apart",
        |s| {
            import(s, |b| {
                let twice: Vec<ExecutedPress> = b.pressed[3..]
                    .iter()
                    .map(|p| ExecutedPress {
                        contact_s: p.contact_s + 1.0,
                        ..*p
                    })
                    .collect();
                b.pressed.extend(twice);
                b.pressed
                    .sort_by(|a, b| a.contact_s.total_cmp(&b.contact_s));
            })
        },
        &[Right, Named(PressesUnlisted), Refused],
    );
}

pub(super) fn ends(t: &mut Table) {
    t.1 = "ends and holes";
    t.case(
        "camera 2 ends at 80 s",
        |s| import(s, |b| b.silent_s[1].push((80.0, 1e9))),
        &[Named(RecordingShort)],
    );
    t.case(
        "camera 1 ends at 40 s",
        |s| import(s, |b| b.silent_s[0].push((40.0, 1e9))),
        &[Named(RecordingShort), Refused],
    );
    t.case(
        "both cameras end at 80 s",
        |s| {
            import(s, |b| {
                b.silent_s.iter_mut().for_each(|k| k.push((80.0, 1e9)))
            })
        },
        &[Named(PressesMissing)],
    );
    t.case(
        "camera 1 starts 20 s late",
        |s| import(s, |b| b.silent_s[0].push((-9.0, 20.0))),
        &[Named(RecordingShort)],
    );
    t.case(
        "both cameras start 20 s late",
        |s| {
            import(s, |b| {
                b.silent_s.iter_mut().for_each(|k| k.push((-9.0, 20.0)))
            })
        },
        &[Named(PressesMissing)],
    );
    t.case(
        "both cameras start after the sync presses",
        |s| {
            import(s, |b| {
                b.silent_s.iter_mut().for_each(|k| k.push((-9.0, 3.5)))
            })
        },
        &[Named(PressesMissing), Right],
    );
    t.case(
        "a hole of 15 s in camera 1",
        |s| import(s, |b| b.silent_s[0].push((70.0, 85.0))),
        &[Named(RecordingGap)],
    );
    t.case(
        "a hole of 15 s in camera 2, of the robot",
        |s| robot(s, |b| b.silent_s[1].push((70.0, 85.0))),
        &[Named(RecordingGap)],
    );
    t.case(
        "a hole of 15 s in both cameras",
        |s| {
            import(s, |b| {
                b.silent_s.iter_mut().for_each(|k| k.push((70.0, 85.0)))
            })
        },
        &[Named(RecordingGap)],
    );
    t.case(
        "holes of 15 s in both cameras at different times",
        |s| {
            import(s, |b| {
                b.silent_s[0].push((30.0, 45.0));
                b.silent_s[1].push((80.0, 95.0));
            })
        },
        &[Named(RecordingGap)],
    );
    t.case(
        "camera 2 sends nothing",
        |s| import(s, |b| b.silent_s[1].push((-9.0, 1e9))),
        &[Named(NoEvents), Refused],
    );
    t.case(
        "neither camera sends anything",
        |s| {
            import(s, |b| {
                b.silent_s.iter_mut().for_each(|k| k.push((-9.0, 1e9)))
            })
        },
        &[Named(NoEvents), Refused],
    );
    t.case(
        "the trigger line is cut half-way",
        |s| {
            robot(s, |b| {
                if let Some(robot) = &mut b.robot {
                    robot.line_cut = Some(0.5);
                }
            })
        },
        &[Right, Named(NoTriggers), Refused],
    );
}

pub(super) fn cameras(t: &mut Table) {
    t.1 = "cameras";
    t.papers(
        "swapped",
        |s| import(s, |b| b.feeds = [1, 0]),
        right_streams,
        &[Named(CamerasSwapped)],
    );
    t.papers(
        "swapped, of the robot",
        |s| robot(s, |b| b.feeds = [1, 0]),
        right_streams,
        &[Named(CamerasSwapped)],
    );
    t.papers(
        "swapped in a short run",
        |s| {
            let mut b = short(s);
            b.feeds = [1, 0];
            b
        },
        right_streams,
        &[Named(CamerasSwapped)],
    );
    t.case(
        "camera 1 twice",
        |s| import(s, |b| b.feeds = [0, 0]),
        &[Named(OneCameraTwice)],
    );
    t.case(
        "camera 2 twice",
        |s| import(s, |b| b.feeds = [1, 1]),
        &[Named(OneCameraTwice)],
    );
    t.papers(
        "camera 1 mirrored",
        |s| import(s, |b| b.pictures[0] = Picture::Mirrored),
        right_pictures,
        &[Named(PictureTurned)],
    );
    t.papers(
        "both mirrored",
        |s| import(s, |b| b.pictures = [Picture::Mirrored; 2]),
        right_pictures,
        &[Named(PictureTurned)],
    );
    t.papers(
        "camera 2 upside down",
        |s| import(s, |b| b.pictures[1] = Picture::UpsideDown),
        right_pictures,
        &[Named(PictureTurned)],
    );
    t.case(
        "camera 2 on its side",
        |s| import(s, |b| b.pictures[1] = Picture::OnItsSide),
        &[Named(CameraBlind), Refused],
    );
    t.case(
        "camera 1 displaced by 12 mm",
        |s| import(s, |b| b.rig.nominal.cameras[0].position.x_mm += 12.0),
        &[Right],
    );
    t.case(
        "camera 1 displaced by 30 mm",
        |s| import(s, |b| b.rig.nominal.cameras[0].position.y_mm -= 30.0),
        &[Right, Named(GeometryOff)],
    );
    t.case(
        "both displaced by 25 mm, apart",
        |s| {
            import(s, |b| {
                b.rig.nominal.cameras[0].position.y_mm -= 25.0;
                b.rig.nominal.cameras[1].position.y_mm += 25.0;
            })
        },
        &[Right, Named(GeometryOff)],
    );
    t.case(
        "both drawn at each other's place",
        |s| import(s, |b| b.rig.nominal.cameras.swap(0, 1)),
        &[Named(CamerasSwapped)],
    );
    t.case(
        "the crop shows rows without the skin",
        |s| import(s, |b| b.crop = Some([(0, 100), (0, 100)])),
        &[Refused, Named(CameraBlind), Named(NoEvents)],
    );
    t.case(
        "camera 2 moves half-way",
        |s| import(s, |b| b.nudged = Some((path_begins_s(b) + 50.0, 40.0))),
        &[Named(RigMoved)],
    );
}

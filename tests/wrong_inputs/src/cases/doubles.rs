//! Two defects at once.

use skinrig_analysis::result::Fault::*;
use skinrig_model::Point2;

use super::changes::*;
use super::{NEARLY, Table};
use crate::bench::Picture;
use crate::judge::Allowed::{Named, Refused, Unknowable};

pub(super) fn doubles(t: &mut Table) {
    t.1 = "two at once";
    t.case(
        "cameras swapped and y mirrored",
        |s| {
            import(s, |b| {
                b.feeds = [1, 0];
                table(b, |p| Point2::new(p.x_mm, 4.0 - p.y_mm));
            })
        },
        &[
            Named(CamerasSwapped),
            Named(AxisMirrored),
            Named(PictureTurned),
            Refused,
        ],
    );
    t.case(
        "cameras swapped and one row on",
        |s| {
            import(s, |b| {
                b.feeds = [1, 0];
                b.table.rotate_left(1);
            })
        },
        &[
            Named(CamerasSwapped),
            Named(IndexShifted),
            Named(OrderOfPresses),
            Refused,
        ],
    );
    t.case(
        "axes exchanged and metres",
        |s| {
            import(s, |b| {
                table(b, |p| Point2::new(1e-3 * p.y_mm, 1e-3 * p.x_mm))
            })
        },
        &[Named(UnitOfPositions), Named(AxesExchanged), Refused],
    );
    t.case(
        "a hole and an early end of the other camera",
        |s| {
            import(s, |b| {
                b.silent_s[0].push((30.0, 45.0));
                b.silent_s[1].push((90.0, 1e9));
            })
        },
        &[Named(RecordingShort), Named(RecordingGap)],
    );
    t.case(
        "four sync presses and a hole",
        |s| {
            import(s, |b| {
                extra(b, b.pressed[0].contact_s - 1.0);
                b.silent_s[0].push((70.0, 85.0));
            })
        },
        &[Named(SyncPattern), Named(RecordingGap)],
    );
    t.case(
        "extra presses and camera 2 ends at 80 s",
        |s| {
            import(s, |b| {
                extra(b, path_begins_s(b) + 51.5);
                b.silent_s[1].push((80.0, 1e9));
            })
        },
        &[Named(RecordingShort), Named(PressesUnlisted)],
    );
    t.case(
        "positions from the centre and a camera displaced",
        |s| {
            import(s, |b| {
                table(b, |p| moved(p, -10.0, -2.0));
                b.rig.nominal.cameras[0].position.y_mm -= 12.0;
            })
        },
        &[Named(PositionsDisplaced), Unknowable(NEARLY)],
    );
    t.case(
        "camera 1 mirrored and one row on",
        |s| {
            import(s, |b| {
                b.pictures[0] = Picture::Mirrored;
                b.table.rotate_left(1);
            })
        },
        &[Named(PictureTurned), Named(IndexShifted), Refused],
    );
    t.case(
        "20 rows for 25 and camera 1 ends at 60 s",
        |s| {
            import(s, |b| {
                b.timetable.presses = 20;
                b.timetable.used = 20;
                b.table.truncate(20);
                b.silent_s[0].push((60.0, 1e9));
            })
        },
        &[
            Refused,
            Named(RecordingShort),
            Named(PressesUnlisted),
            Named(IndexShifted),
            Named(PressesMissing),
        ],
    );
    t.case(
        "a single-repetition schedule and the cameras swapped",
        |s| {
            let mut b = single(s);
            b.feeds = [1, 0];
            b
        },
        &[Named(CamerasSwapped)],
    );
}

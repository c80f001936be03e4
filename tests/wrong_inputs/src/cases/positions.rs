//! Wrong positions in the table, and wrong rows of it.

use skinrig_analysis::result::Fault::{self, *};
use skinrig_model::Point2;

use super::changes::*;
use super::{NEARLY, TWO_BAD, Table};
use crate::bench::{Bench, Random};
use crate::judge::Allowed::{Named, Refused, Right, Unknowable};

pub(super) fn positions(t: &mut Table) {
    t.1 = "positions";
    let mut of_table = |name, bench: fn(u64) -> Bench, fault: Fault| {
        t.papers(name, bench, right_table, &[Named(fault)]);
    };
    of_table(
        "x and y exchanged",
        |s| import(s, |b| table(b, |p| Point2::new(p.y_mm, p.x_mm))),
        AxesExchanged,
    );
    of_table(
        "x and y exchanged about the centre",
        |s| {
            import(s, |b| {
                table(b, |p| Point2::new(p.y_mm - 2.0 + 10.0, p.x_mm - 10.0 + 2.0));
            })
        },
        AxesExchanged,
    );
    of_table(
        "turned by 90 degrees",
        |s| {
            import(s, |b| {
                table(b, |p| {
                    Point2::new(10.0 - (p.y_mm - 2.0), 2.0 + p.x_mm - 10.0)
                });
            })
        },
        AxesExchanged,
    );
    of_table(
        "x mirrored",
        |s| import(s, |b| table(b, |p| Point2::new(20.0 - p.x_mm, p.y_mm))),
        AxisMirrored,
    );
    of_table(
        "y mirrored",
        |s| import(s, |b| table(b, |p| Point2::new(p.x_mm, 4.0 - p.y_mm))),
        AxisMirrored,
    );
    of_table(
        "x with the wrong sign",
        |s| import(s, |b| table(b, |p| Point2::new(-p.x_mm, p.y_mm))),
        AxisMirrored,
    );
    of_table(
        "y with the wrong sign",
        |s| import(s, |b| table(b, |p| Point2::new(p.x_mm, -p.y_mm))),
        AxisMirrored,
    );
    of_table(
        "turned by 180 degrees",
        |s| {
            import(s, |b| {
                table(b, |p| Point2::new(20.0 - p.x_mm, 4.0 - p.y_mm));
            })
        },
        AxisMirrored,
    );
    of_table(
        "metres taken for mm",
        |s| import(s, |b| table(b, |p| times(p, 1e-3))),
        UnitOfPositions,
    );
    of_table(
        "mm taken for metres",
        |s| import(s, |b| table(b, |p| times(p, 1e3))),
        UnitOfPositions,
    );
    of_table(
        "cm taken for mm",
        |s| import(s, |b| table(b, |p| times(p, 0.1))),
        UnitOfPositions,
    );
    of_table(
        "inches taken for mm",
        |s| import(s, |b| table(b, |p| times(p, 1.0 / 25.4))),
        UnitOfPositions,
    );
    of_table(
        "relative to the skin's centre",
        |s| import(s, |b| table(b, |p| moved(p, -10.0, -2.0))),
        PositionsDisplaced,
    );
    of_table(
        "relative to the skin's corner",
        |s| import(s, |b| table(b, |p| moved(p, 40.0, 48.0))),
        PositionsDisplaced,
    );
    of_table(
        "shifted by 25 mm along x",
        |s| import(s, |b| table(b, |p| moved(p, 25.0, 0.0))),
        PositionsDisplaced,
    );
    let scale = [Named(UnitOfPositions), Named(PositionsDisplaced)];
    t.papers(
        "0.6 times as large",
        |s| import(s, |b| table(b, |p| times(p, 0.6))),
        right_table,
        &scale,
    );
    t.papers(
        "x half as large",
        |s| import(s, |b| table(b, |p| Point2::new(0.5 * p.x_mm, p.y_mm))),
        right_table,
        &scale,
    );
    t.papers(
        "the same y in all rows",
        |s| import(s, |b| table(b, |p| Point2::new(p.x_mm, 0.0))),
        right_table,
        &[Named(Unknown), Refused],
    );
    t.case(
        "shifted by 2 mm",
        |s| import(s, |b| table(b, |p| moved(p, 2.0, 0.0))),
        &[Right, Named(PositionsDisplaced), Unknowable(NEARLY)],
    );
    t.papers(
        "5 % too large",
        |s| import(s, |b| table(b, |p| times(p, 1.05))),
        right_table,
        &[Right, Unknowable(NEARLY)],
    );
    t.case(
        "one position is not a number",
        |s| import(s, |b| b.table[7].x_mm = f64::NAN),
        &[Right, Refused, Named(NoTruth)],
    );
}

pub(super) fn rows(t: &mut Table) {
    t.1 = "rows";
    let order = [Named(OrderOfPresses), Refused];
    t.papers(
        "shuffled",
        |s| {
            import(s, |b| {
                let mut random = Random::new(s);
                for i in (1..b.table.len()).rev() {
                    let j = (random.unit() * (i + 1) as f64) as usize;
                    b.table.swap(i, j);
                }
            })
        },
        right_table,
        &order,
    );
    t.papers(
        "from the last to the first",
        |s| import(s, |b| b.table.reverse()),
        right_table,
        &order,
    );
    t.papers(
        "a raster for a meander",
        |s| {
            import(s, |b| {
                b.table
                    .chunks_mut(5)
                    .skip(1)
                    .step_by(2)
                    .for_each(<[Point2]>::reverse);
            })
        },
        right_table,
        &order,
    );
    // The robust fit of the cameras leaves the exchanged rows out.
    t.papers(
        "two lines of five exchanged",
        |s| {
            import(s, |b| {
                let (one, two) = b.table[5..15].split_at_mut(5);
                one.swap_with_slice(two);
            })
        },
        right_table,
        &order,
    );
    t.papers(
        "ten rows in reverse",
        |s| import(s, |b| b.table[4..14].reverse()),
        right_table,
        &order,
    );
    t.papers(
        "sorted by y",
        |s| {
            import(s, |b| {
                b.table.sort_by(|a, b| {
                    (a.y_mm, a.x_mm)
                        .partial_cmp(&(b.y_mm, b.x_mm))
                        .unwrap_or(std::cmp::Ordering::Equal)
                });
            })
        },
        right_table,
        &[Named(OrderOfPresses), Named(AxesExchanged), Refused],
    );
    t.papers(
        "rows in a random order within blocks of six",
        |s| {
            import(s, |b| {
                let mut random = Random::new(s);
                for rows in b.table.chunks_mut(6) {
                    for i in (1..rows.len()).rev() {
                        let j = (random.unit() * (i + 1) as f64) as usize;
                        rows.swap(i, j);
                    }
                }
            })
        },
        right_table,
        &order,
    );
    t.papers(
        "ten rows exchanged here and there",
        |s| {
            import(s, |b| {
                let rows = [1, 4, 6, 9, 11, 14, 16, 19, 21, 23];
                let before = b.table.clone();
                for (i, row) in rows.iter().enumerate() {
                    b.table[*row] = before[rows[(i + 1) % rows.len()]];
                }
            })
        },
        right_table,
        &order,
    );
    let shifted = [Named(IndexShifted), Refused];
    t.papers(
        "one row on",
        |s| import(s, |b| b.table.rotate_left(1)),
        right_table,
        &shifted,
    );
    t.papers(
        "one row back",
        |s| import(s, |b| b.table.rotate_right(1)),
        right_table,
        &shifted,
    );
    t.papers(
        "three rows on",
        |s| import(s, |b| b.table.rotate_left(3)),
        right_table,
        &shifted,
    );
    t.papers(
        "a row twice, and a later one missing",
        |s| {
            import(s, |b| {
                b.table.remove(17);
                b.table.insert(4, b.table[4]);
            })
        },
        right_table,
        &[
            Named(IndexShifted),
            Named(OrderOfPresses),
            Named(ClockWrong),
            Refused,
        ],
    );
    t.papers(
        "two rows exchanged",
        |s| import(s, |b| b.table.swap(3, 12)),
        right_table,
        &[Right, Unknowable(TWO_BAD), Refused],
    );
    t.case(
        "a row missing",
        |s| {
            import(s, |b| {
                b.table.remove(9);
            })
        },
        &[Refused],
    );
    t.case(
        "a row twice",
        |s| import(s, |b| b.table.insert(9, b.table[9])),
        &[Refused],
    );
}

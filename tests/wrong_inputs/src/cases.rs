//! The cases: what is wrong with each, and the allowed outcomes. To add one, add a few lines to [`all`].

use skinrig_analysis::result::Fault::{self, *};
use skinrig_model::Point2;

use crate::bench::{Bench, ExecutedPress, Picture, Random, Timetable, meander};
use crate::judge::Allowed::{self, Named, Refused, Right, Unknowable};

/// A wrong or unusual recording or setup.
#[derive(Clone)]
pub struct Case {
    /// Group in the table.
    pub group: &'static str,
    /// Description of the defect.
    pub name: &'static str,
    /// The recording and its documents.
    pub bench: fn(u64) -> Bench,
    /// Corrects the documents, if possible; the result is then what the faulty ones should have given.
    pub papers: Option<fn(&mut Bench)>,
    /// Allowed outcomes.
    pub allowed: Vec<Allowed>,
}

fn import(seed: u64, change: impl FnOnce(&mut Bench)) -> Bench {
    let mut bench = Bench::new(seed);
    change(&mut bench);
    bench
}

fn robot(seed: u64, change: impl FnOnce(&mut Bench)) -> Bench {
    let mut bench = Bench::robot(seed);
    change(&mut bench);
    bench
}

/// Transforms every position of the table.
fn table(bench: &mut Bench, change: impl Fn(Point2) -> Point2) {
    bench.table.iter_mut().for_each(|p| *p = change(*p));
}

/// Transforms the robot's measured positions.
fn measured(bench: &mut Bench, change: impl Fn(Point2) -> Point2) {
    let plan = bench.table.clone();
    table(bench, change);
    if let Some(robot) = &mut bench.robot {
        robot.planned = Some(plan);
    }
}

const CENTRE: Point2 = Point2::new(10.0, 2.0);

fn moved(p: Point2, dx: f64, dy: f64) -> Point2 {
    Point2::new(p.x_mm + dx, p.y_mm + dy)
}

fn times(p: Point2, factor: f64) -> Point2 {
    Point2::new(p.x_mm * factor, p.y_mm * factor)
}

/// An extra press at `at_s`, in the middle of the path.
fn extra(bench: &mut Bench, at_s: f64) {
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
fn later(bench: &mut Bench, from: usize, by_s: f64) {
    bench.pressed[from..]
        .iter_mut()
        .for_each(|p| p.contact_s += by_s);
}

/// Contact of the first press of the path, s.
fn path_begins_s(bench: &Bench) -> f64 {
    bench.pressed[3].contact_s
}

/// Three of the five lines, once: 15 locations.
fn single(seed: u64) -> Bench {
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
fn short(seed: u64) -> Bench {
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

struct Table(Vec<Case>, &'static str);

impl Table {
    fn case(&mut self, name: &'static str, bench: fn(u64) -> Bench, allowed: &[Allowed]) {
        self.0.push(Case {
            group: self.1,
            name,
            bench,
            papers: None,
            allowed: allowed.to_vec(),
        });
    }

    /// Adds a case whose documents can be corrected.
    fn papers(
        &mut self,
        name: &'static str,
        bench: fn(u64) -> Bench,
        right: fn(&mut Bench),
        allowed: &[Allowed],
    ) {
        self.case(name, bench, allowed);
        if let Some(case) = self.0.last_mut() {
            case.papers = Some(right);
        }
    }
}

/// The table of the faultless path.
fn right_table(bench: &mut Bench) {
    bench.table = crate::bench::path();
    if let Some(robot) = &mut bench.robot {
        robot.planned = None;
    }
}

fn right_schedule(bench: &mut Bench) {
    bench.timetable = Bench::new(0).timetable;
    right_table(bench);
}

fn right_streams(bench: &mut Bench) {
    bench.feeds = [0, 1];
}

fn right_pictures(bench: &mut Bench) {
    bench.pictures = [Picture::Upright; 2];
    right_streams(bench);
}

const NEARLY: &str = "a rig description a few mm off looks the same";
const TWO_BAD: &str = "two bad locations look the same";

/// All cases.
#[must_use]
pub fn all() -> Vec<Case> {
    let mut t = Table(Vec::new(), "sound");
    t.case("an import", Bench::new, &[Right]);
    t.case(
        "an import whose camera model is chosen",
        |s| import(s, |b| b.chosen_model = true),
        &[Right],
    );
    t.case("a session of the robot", Bench::robot, &[Right]);
    t.case("a single repetition", single, &[Right]);
    t.case("a short run", short, &[Right]);
    presses(&mut t);
    ends(&mut t);
    positions(&mut t);
    rows(&mut t);
    cameras(&mut t);
    schedules(&mut t);
    robots(&mut t);
    doubles(&mut t);
    t.0
}

fn presses(t: &mut Table) {
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
                let again = b.pressed[35];
                later(b, 36, 2.0);
                b.pressed.insert(
                    36,
                    ExecutedPress {
                        contact_s: again.contact_s + 2.0,
                        ..again
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

fn ends(t: &mut Table) {
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

fn positions(t: &mut Table) {
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

fn rows(t: &mut Table) {
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

fn cameras(t: &mut Table) {
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

fn schedules(t: &mut Table) {
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

fn robots(t: &mut Table) {
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

fn doubles(t: &mut Table) {
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

//! The session that the relations change: 16 locations, two depths, repeated and failed presses, and its events.

use skinrig_analysis::{Analysis, SessionInput, analyze};
use skinrig_model::{
    AnalysisSettings, Causes, CdEvent, HostTime, InvalidReason, MarkKind, Point2, Polarity,
    PressFault, PressRole, PressVerdict, RigGeometry, SkinOutline, StereoGeometry,
};
use skinrig_planted::grid::{PLANTED, Random, camera_us};
use skinrig_planted::{Memory, PlantedPress, mark, press, timing};

/// Number of locations.
pub(crate) const PLACES: u32 = 16;
/// Role and depth of each repetition, mm.
const REPETITIONS: [(PressRole, f64); 5] = [
    (PressRole::Calibrate, 1.0),
    (PressRole::Calibrate, 2.0),
    (PressRole::Score, 2.0),
    (PressRole::Score, 2.0),
    (PressRole::Score, 1.0),
];
/// Number of sync presses, the first rows.
pub(crate) const SYNC: usize = 3;
/// Contact of the first press at a location, and time between contacts, s.
const BEGIN_S: f64 = 7.0;
pub(crate) const PERIOD_S: f64 = 1.75;

/// Everything that an analysis reads.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Session {
    pub input: SessionInput,
    pub events: [Vec<CdEvent>; 2],
}

impl Session {
    pub(crate) fn analysis(&self) -> Analysis {
        let source = Memory {
            events: self.events.clone(),
            slice: 4096,
        };
        analyze(&self.input, &source).unwrap()
    }
}

/// Row of a press in the plan.
pub(crate) const fn row(repetition: u32, place: u32) -> usize {
    SYNC + (repetition * PLACES + place) as usize
}

/// Contact of the press in a row, s on the host clock.
pub(crate) fn contact_s(row: usize) -> f64 {
    match row.checked_sub(SYNC) {
        Some(i) => BEGIN_S + PERIOD_S * i as f64,
        None => 2.0 + row as f64,
    }
}

/// Four by four locations about the skin's centre, none of them in the order of its coordinates.
fn place(index: u32) -> Point2 {
    let i = (7 * index + 3) % PLACES;
    Point2::new(
        -14.0 + 14.0 * f64::from(i / 4),
        -19.0 + 13.5 * f64::from(i % 4),
    )
}

/// The base session. No event is in column 0, which has no mirror image on the sensor.
pub(crate) fn session() -> Session {
    let mut random = Random(11);
    let input = skinrig_planted::session(
        RigGeometry {
            outline: SkinOutline::PAPER,
            nominal: StereoGeometry::PAPER,
            trigger_channel: Some(0),
            trigger_delay_us: [0; 2],
        },
        AnalysisSettings {
            bootstrap_resamples: 200,
            ..AnalysisSettings::default()
        },
    );
    let mut session = Session {
        input,
        events: [Vec::new(), Vec::new()],
    };
    for i in 0..SYNC {
        let touch = PlantedPress::new(PressRole::Sync, 0, 0, SkinOutline::PAPER.centre);
        add(&mut session, touch, contact_s(i), &mut random);
    }
    for (repetition, (role, depth_mm)) in (0..).zip(REPETITIONS) {
        for location in 0..PLACES {
            let at = place(location);
            let touch = PlantedPress {
                depth_mm,
                measured_at: Point2::new(
                    at.x_mm + 0.02 * random.normal(),
                    at.y_mm + 0.02 * random.normal(),
                ),
                measured_depth_mm: Some(depth_mm + 0.02 * random.normal()),
                ..PlantedPress::new(role, repetition, location, at)
            };
            let contact = contact_s(row(repetition, location));
            add(&mut session, touch, contact, &mut random);
        }
    }
    background(&mut session, &mut random);
    fail_some(&mut session);
    session
}

fn add(session: &mut Session, touch: PlantedPress, contact: f64, random: &mut Random) {
    let timing = timing(contact, [0.1, 0.1, 0.3, 0.45, 0.6]);
    let id = press(&mut session.input, PlantedPress { timing, ..touch });
    let force = 0.4 * touch.depth_mm + 0.01 * random.normal();
    session.input.hold_forces_n.push(Some(force));
    for (kind, t) in [
        (MarkKind::Contact, contact),
        (MarkKind::Release, contact + 0.45),
    ] {
        let sent = HostTime::from_secs_f64(t);
        mark(&mut session.input, (kind, id), sent, 500, |k| {
            (camera_us(k, t) + 2.0 * random.unit()).round() as u64
        });
    }
    let truth = StereoGeometry::paper_like(PLANTED);
    for (k, events) in session.events.iter_mut().enumerate() {
        let column = truth.cameras[k].column_of_point(touch.measured_at).unwrap();
        let centre = column + 2.0 * random.normal();
        for n in 0..(150.0 * touch.depth_mm) as u32 {
            let after = if n % 3 < 2 {
                0.1 * random.unit()
            } else {
                0.3 + 0.15 * random.unit()
            };
            events.push(CdEvent {
                t_us: camera_us(k, contact + after) as u64,
                x: (centre + 6.0 * touch.depth_mm * random.normal())
                    .round()
                    .clamp(1.0, 639.0) as u16,
                y: (270.0 + 6.0 * random.normal()).round() as u16,
                polarity: Polarity::from_bit(n % 5 < 2),
            });
        }
    }
}

fn background(session: &mut Session, random: &mut Random) {
    let end_s = contact_s(session.input.planned.len());
    for (k, events) in session.events.iter_mut().enumerate() {
        for _ in 0..9000 {
            events.push(CdEvent {
                t_us: camera_us(k, end_s * random.unit()) as u64,
                x: (1.0 + 639.0 * random.unit()) as u16,
                y: (480.0 * random.unit()) as u16,
                polarity: Polarity::from_bit(random.unit() < 0.5),
            });
        }
        skinrig_planted::sort(events);
    }
}

/// Scored presses that fail in different ways.
fn fail_some(session: &mut Session) {
    let input = &mut session.input;
    input.outcomes[row(3, 2)] = None;
    let paused = PressVerdict::Invalid(InvalidReason::Faults(Causes::one(PressFault::Paused)));
    input.outcomes[row(2, 5)].as_mut().unwrap().verdict = paused;
    let lost = camera_us(1, contact_s(row(3, 7))) as u64;
    input.gaps[1].push((lost, lost + 10));
    // Measured elsewhere: a large error.
    let stray = input.outcomes[row(4, 9)].as_mut().unwrap();
    stray.measured_at = stray
        .measured_at
        .map(|p| Point2::new(p.x_mm + 6.0, p.y_mm - 4.0));
    // Not seen by camera 2, and beside the skin.
    let during = |row: usize, k: usize, e: &CdEvent| {
        let from = camera_us(k, contact_s(row) - 0.1) as u64;
        (from..from + 700_000).contains(&e.t_us)
    };
    session.events[1].retain(|e| !during(row(2, 11), 1, e));
    let truth = StereoGeometry::paper_like(PLANTED);
    let beside = Point2::new(-33.0, 50.0);
    for (k, events) in session.events.iter_mut().enumerate() {
        let column = |p| truth.cameras[k].column_of_point(p).unwrap();
        let shift = (column(beside) - column(place(0))).round();
        let moved = events.iter_mut().filter(|e| during(row(4, 0), k, e));
        for e in moved {
            e.x = (f64::from(e.x) + shift).clamp(1.0, 639.0) as u16;
        }
    }
}

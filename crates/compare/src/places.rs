//! Owns which presses of the skins stand at the same place: locations by planned position, presses that count.

use std::collections::{BTreeMap, BTreeSet};

use skinrig_analysis::result::PressResult;
use skinrig_analysis::verdict::is_rule_on_data;
use skinrig_model::{Point2, PressRole, PressVerdict};

use crate::subject::{Session, Subject};

/// Positions that differ by less are one place, mm.
const SAME_PLACE_MM: f64 = 0.05;

/// A planned position on a grid of [`SAME_PLACE_MM`].
type Cell = (i64, i64);

fn cell(at: Point2) -> Cell {
    let of = |mm: f64| (mm / SAME_PLACE_MM).round() as i64;
    (of(at.x_mm), of(at.y_mm))
}

/// A depth in µm.
fn micrometres(depth_mm: f64) -> i64 {
    (depth_mm * 1e3).round() as i64
}

/// The places of several skins, numbered alike for all of them.
#[derive(Debug, Clone, Default)]
pub(crate) struct Places {
    numbers: BTreeMap<Cell, u32>,
    at: Vec<Point2>,
    /// Depths that are compared, µm.
    depths: BTreeSet<i64>,
}

/// A scored press that was attempted.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Attempt<'a> {
    /// Number of the place.
    pub place: u32,
    /// Which presses are repetitions of each other: of one session at one depth.
    pub series: u32,
    /// The press.
    pub press: &'a PressResult,
    /// The session that it is of.
    pub session: &'a Session,
}

impl Attempt<'_> {
    /// Error vector of a press that counts, mm.
    pub fn error(&self) -> Option<(f64, f64)> {
        let valid = self.press.verdict == PressVerdict::Valid.name();
        self.press.error_mm().filter(|_| valid)
    }

    /// Its length, mm.
    pub fn error_mm(&self) -> Option<f64> {
        self.error().map(|(x, y)| libm::hypot(x, y))
    }
}

impl Places {
    /// The places and shared depths of `subjects`.
    pub fn of(subjects: &[Subject]) -> Self {
        let mut places = Self::default();
        for press in subjects.iter().flat_map(scored) {
            let next = places.at.len() as u32;
            if *places.numbers.entry(cell(press.planned)).or_insert(next) == next {
                places.at.push(press.planned);
            }
        }
        let depths =
            |s: &Subject| -> BTreeSet<i64> { scored(s).map(|p| micrometres(p.depth_mm)).collect() };
        let mut all = subjects.iter().map(depths);
        if let Some(first) = all.next() {
            places.depths = all.fold(first, |shared, of| {
                shared.intersection(&of).copied().collect()
            });
        }
        places
    }

    /// Where a place is.
    pub fn at(&self, place: u32) -> Point2 {
        self.at[place as usize]
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.at.len()
    }

    /// Depths that all skins were pressed to.
    pub(crate) fn shared_depths(&self) -> usize {
        self.depths.len()
    }

    /// The attempted scored presses of `subject` at the shared depths.
    pub fn attempts<'a>(&'a self, subject: &'a Subject) -> impl Iterator<Item = Attempt<'a>> {
        let depth = |p: &PressResult| {
            self.depths
                .iter()
                .position(|d| *d == micrometres(p.depth_mm))
        };
        let depths = self.depths.len().max(1);
        subject
            .sessions
            .iter()
            .enumerate()
            .flat_map(move |(i, session)| {
                let presses = session.analysis.presses.iter().filter(|p| is_attempt(p));
                presses.filter_map(move |press| {
                    Some(Attempt {
                        place: *self.numbers.get(&cell(press.planned))?,
                        series: (i * depths + depth(press)?) as u32,
                        press,
                        session,
                    })
                })
            })
    }

    /// The places that each of `subjects` attempted.
    pub fn shared(&self, subjects: [&Subject; 2]) -> BTreeSet<u32> {
        let [a, b] = subjects.map(|s| self.attempts(s).map(|p| p.place).collect::<BTreeSet<u32>>());
        a.intersection(&b).copied().collect()
    }
}

fn scored(subject: &Subject) -> impl Iterator<Item = &PressResult> {
    let presses = subject.sessions.iter().flat_map(|s| &s.analysis.presses);
    presses.filter(|p| is_attempt(p))
}

/// As the metrics of a session count: scored, done, and not left out by the journal before anybody looked at the data.
fn is_attempt(press: &PressResult) -> bool {
    let by_journal = press.verdict == "excluded"
        && !press
            .rule
            .as_deref()
            .is_some_and(|rule| rule == "by hand" || is_rule_on_data(rule));
    press.role == PressRole::Score && press.verdict != "missed" && !by_journal
}

//! Owns matching of locations between skins by planned position, and which presses count.

use std::collections::BTreeSet;

use skinrig_analysis::result::PressResult;
use skinrig_model::{Places, Point2, PressRole, Verdict};

use crate::subject::{Session, Subject};

/// Depth in µm.
fn micrometres(depth_mm: f64) -> i64 {
    (depth_mm * 1e3).round() as i64
}

/// Locations of several skins, with common numbers.
#[derive(Debug, Clone, Default)]
pub(crate) struct Locations {
    places: Places,
    /// Depths shared by all skins, µm.
    depths: BTreeSet<i64>,
}

/// An attempted scored press.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Attempt<'a> {
    /// Number of the location.
    pub location: u32,
    /// Presses with equal numbers are repetitions: same session, same depth.
    pub series: u32,
    pub press: &'a PressResult,
    /// Session of the press.
    pub session: &'a Session,
}

impl Attempt<'_> {
    /// Error vector in mm; `None` for a press that does not count.
    pub(crate) fn error(&self) -> Option<(f64, f64)> {
        let valid = self.press.verdict == Verdict::Valid;
        self.press.error_mm().filter(|_| valid)
    }

    /// Error length in mm; `None` for a press that does not count.
    pub(crate) fn error_mm(&self) -> Option<f64> {
        self.error().map(|(x, y)| libm::hypot(x, y))
    }
}

impl Locations {
    /// Collects the locations and the shared depths of `subjects`.
    pub(crate) fn of(subjects: &[Subject]) -> Self {
        let mut locations = Self::default();
        for press in subjects.iter().flat_map(scored) {
            locations.places.add(press.planned);
        }
        let depths =
            |s: &Subject| -> BTreeSet<i64> { scored(s).map(|p| micrometres(p.depth_mm)).collect() };
        let mut all = subjects.iter().map(depths);
        if let Some(first) = all.next() {
            locations.depths = all.fold(first, |shared, of| {
                shared.intersection(&of).copied().collect()
            });
        }
        locations
    }

    /// Planned position of a location.
    pub(crate) fn at(&self, location: u32) -> Point2 {
        self.places.all()[location as usize]
    }

    /// Number of locations.
    pub(crate) fn len(&self) -> usize {
        self.places.all().len()
    }

    /// Number of depths that all skins share.
    pub(crate) fn shared_depths(&self) -> usize {
        self.depths.len()
    }

    /// Attempted scored presses of `subject` at the shared depths.
    pub(crate) fn attempts<'a>(
        &'a self,
        subject: &'a Subject,
    ) -> impl Iterator<Item = Attempt<'a>> {
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
                        location: self.places.find(press.planned)?,
                        series: (i * depths + depth(press)?) as u32,
                        press,
                        session,
                    })
                })
            })
    }

    /// Locations that both `subjects` attempted.
    pub(crate) fn shared(&self, subjects: [&Subject; 2]) -> BTreeSet<u32> {
        let [a, b] = subjects.map(|s| {
            self.attempts(s)
                .map(|p| p.location)
                .collect::<BTreeSet<u32>>()
        });
        a.intersection(&b).copied().collect()
    }
}

fn scored(subject: &Subject) -> impl Iterator<Item = &PressResult> {
    let presses = subject.sessions.iter().flat_map(|s| &s.analysis.presses);
    presses.filter(|p| is_attempt(p))
}

/// Same rule as the metrics of a session: a scored press that was not missed, nor excluded by a rule decided before the data
/// were seen.
fn is_attempt(press: &PressResult) -> bool {
    let by_journal = press.verdict == Verdict::Excluded
        && !press
            .rule()
            .is_some_and(|rule| rule.is_by_hand() || rule.is_on_data());
    press.role == PressRole::Score && press.verdict != Verdict::Missed && !by_journal
}

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
    /// Of several depths: where the errors of all skins can be compared.
    cells: Option<Cells>,
}

/// Locations that all skins attempted, and at which depths each of them located a press there.
#[derive(Debug, Clone, Default)]
struct Cells {
    locations: BTreeSet<u32>,
    located: BTreeSet<(u32, i64)>,
}

impl Cells {
    /// False for a press whose error would make its skin look worse because the other one did not locate its like.
    fn hold(&self, location: u32, depth_um: i64) -> bool {
        !self.locations.contains(&location) || self.located.contains(&(location, depth_um))
    }
}

/// An attempted scored press.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Attempt<'a> {
    /// Number of the location.
    pub location: u32,
    /// Presses with equal numbers are repetitions: same session, same depth.
    pub series: u32,
    pub press: &'a PressResult,
    /// True if all skins located presses at this location and depth.
    is_shared: bool,
    /// Session of the press.
    pub session: &'a Session,
}

impl Attempt<'_> {
    /// Error vector in mm; `None` for a press that does not count, or at a location and depth where another skin has none.
    pub(crate) fn error(&self) -> Option<(f64, f64)> {
        own_error(self.press).filter(|_| self.is_shared)
    }

    /// Its length.
    pub(crate) fn error_mm(&self) -> Option<f64> {
        self.error().map(|(x, y)| libm::hypot(x, y))
    }

    /// Error length in mm, whatever the other skins located; `None` for a press that does not count.
    pub(crate) fn own_error_mm(&self) -> Option<f64> {
        own_error(self.press).map(|(x, y)| libm::hypot(x, y))
    }
}

fn own_error(press: &PressResult) -> Option<(f64, f64)> {
    let valid = press.verdict == Verdict::Valid;
    press.error_mm().filter(|_| valid)
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
        if locations.depths.len() > 1 {
            locations.cells = locations.shared_cells(subjects);
        }
        locations
    }

    fn shared_cells(&self, subjects: &[Subject]) -> Option<Cells> {
        let of = |subject: &Subject| {
            let mut own = Cells::default();
            for attempt in self.attempts(subject) {
                own.locations.insert(attempt.location);
                if own_error(attempt.press).is_some() {
                    let depth_um = micrometres(attempt.press.depth_mm);
                    own.located.insert((attempt.location, depth_um));
                }
            }
            own
        };
        subjects.iter().map(of).reduce(|a, b| Cells {
            locations: a.locations.intersection(&b.locations).copied().collect(),
            located: a.located.intersection(&b.located).copied().collect(),
        })
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
                    let location = self.places.find(press.planned)?;
                    let depth_um = micrometres(press.depth_mm);
                    let cells = self.cells.as_ref();
                    Some(Attempt {
                        location,
                        series: (i * depths + depth(press)?) as u32,
                        press,
                        is_shared: cells.is_none_or(|cells| cells.hold(location, depth_um)),
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

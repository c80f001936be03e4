//! Owns the check that the calibrations of the sides come from alike presses: as many of them, and at as many of the scored locations.

use std::collections::BTreeSet;

use skinrig_analysis::result::PressResult;
use skinrig_model::{Places, PressRole, Verdict};

use super::difference::{Difference, Severity, difference};
use crate::subject::{Session, Subject, join_values};

/// Sides differ if one has more than this many times the calibrating presses of the other. Of n presses, a fit of 8 parameters adds 8/n
/// to the mean square error: with 80 presses instead of 64, 2.5 %. Our choice.
const MAX_RATIO: f64 = 1.25;
/// Sides differ if the shares of their scored presses at locations that also calibrated are further apart: as for shares of presses.
const MAX_DIFFERENCE: f64 = 0.12;

/// Which presses calibrate a session, by plan: what failed is the skin's.
#[derive(Debug, Clone, Copy)]
struct Calibrating {
    presses: usize,
    locations: usize,
    /// Share of the scored presses at locations that also calibrated.
    known: f64,
}

impl Calibrating {
    /// `None` for a session that its own presses do not calibrate; `calibration-origin` compares that.
    fn of(session: &Session) -> Option<Self> {
        session.analysis.calibration.as_ref()?;
        let made = |role| {
            let presses = session.analysis.presses.iter();
            presses.filter(move |p| p.role == role && p.verdict != Verdict::Missed)
        };
        let mut places = Places::default();
        for press in made(PressRole::Calibrate) {
            places.add(press.planned);
        }
        let is_known = |p: &&PressResult| places.find(p.planned).is_some();
        let scored = made(PressRole::Score).count();
        (scored > 0).then(|| Self {
            presses: made(PressRole::Calibrate).count(),
            locations: places.all().len(),
            known: made(PressRole::Score).filter(is_known).count() as f64 / scored as f64,
        })
    }

    fn differs(&self, other: &Self) -> bool {
        let [few, many] = [
            self.presses.min(other.presses),
            self.presses.max(other.presses),
        ];
        many as f64 > MAX_RATIO * few as f64 || (self.known - other.known).abs() > MAX_DIFFERENCE
    }

    fn text(&self) -> String {
        format!(
            "{} at {} locations, those of {:.0} % of the scored presses",
            self.presses,
            self.locations,
            100.0 * self.known
        )
    }
}

pub(super) fn calibrating(subjects: &[Subject]) -> Option<Difference> {
    let all = || subjects.iter().flat_map(|s| &s.sessions);
    let each: Vec<Calibrating> = all().filter_map(Calibrating::of).collect();
    let differ = each
        .iter()
        .enumerate()
        .any(|(k, a)| each[k + 1..].iter().any(|b| a.differs(b)));
    differ.then(|| {
        let text = |s: &Session| Calibrating::of(s).map_or_else(|| "none".to_owned(), |c| c.text());
        let of = |s: &Subject| -> BTreeSet<String> { s.sessions.iter().map(text).collect() };
        difference(
            "evaluation",
            "presses that calibrate",
            Severity::Confounding,
            subjects.iter().map(|s| join_values(&of(s))).collect(),
            "the side that calibrates with more presses, or at more of the scored locations, looks better",
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn alike_calibrations_do_not_differ() {
        let of = |presses, known| Calibrating {
            presses,
            locations: presses,
            known,
        };
        let all = of(80, 1.0);
        assert!(!all.differs(&all));
        assert!(!all.differs(&of(64, 1.0)) && !of(64, 1.0).differs(&all));
        assert!(all.differs(&of(63, 1.0)) && of(63, 1.0).differs(&all));
        assert!(!all.differs(&of(80, 0.9)));
        assert!(all.differs(&of(80, 0.85)));
        assert!(of(0, 0.0).differs(&of(1, 0.0)));
    }
}

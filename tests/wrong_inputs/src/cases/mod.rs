//! The cases: the defect of each, and the allowed outcomes. To add one, add a few lines to a group.

mod changes;
mod doubles;
mod positions;
mod recordings;
mod schedules;

use crate::bench::Bench;
use crate::judge::Allowed::{self, Right};
use changes::{import, short, single};

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

pub(super) struct Table(Vec<Case>, &'static str);

impl Table {
    pub(super) fn case(
        &mut self,
        name: &'static str,
        bench: fn(u64) -> Bench,
        allowed: &[Allowed],
    ) {
        self.0.push(Case {
            group: self.1,
            name,
            bench,
            papers: None,
            allowed: allowed.to_vec(),
        });
    }

    /// Adds a case whose documents can be corrected.
    pub(super) fn papers(
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
/// Reasons of [`Allowed::Unknowable`].
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
    recordings::presses(&mut t);
    recordings::ends(&mut t);
    positions::positions(&mut t);
    positions::rows(&mut t);
    recordings::cameras(&mut t);
    schedules::schedules(&mut t);
    schedules::robots(&mut t);
    doubles::doubles(&mut t);
    t.0
}

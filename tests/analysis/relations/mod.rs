//! Metamorphic relations: a whole session changed in a way whose effect on every figure of its analysis is known.
//!
//! Every test changes a copy of one session ([`base`]): events, trigger edges, marks, plan, journal, geometry and clocks. It
//! also changes the figures of the session's analysis, as the relation demands, and compares them with the analysis of the
//! changed session, figure by figure. A failure lists the figures that differ. `-- relations --nocapture` prints how many
//! figures each relation compares, and the one with the fewest digits in common.

#![expect(clippy::print_stdout, reason = "digits in common of every relation")]
#![expect(clippy::unwrap_used, reason = "tests")]

mod base;
mod events;
mod figures;
mod presses;
mod space;
mod time;
mod variants;

use std::sync::LazyLock;

use base::Session;
use figures::{Digits, Figure, Figures, compare, figures, kind};
use skinrig_analysis::result::WarningCause;

/// The session and its figures.
static BASE: LazyLock<(Session, Figures)> = LazyLock::new(|| {
    let session = base::session();
    let figures = figures(&session.analysis());
    (session, figures)
});

/// A change of a session, and what follows for its figures.
struct Relation<'a> {
    name: &'a str,
    /// Changes the session.
    change: &'a dyn Fn(&mut Session),
    /// Changes a figure and its path.
    expect: &'a dyn Fn(&mut String, &mut Figure),
    /// Kinds of paths that the relation says nothing about. Each needs a reason.
    silent: &'a dyn Fn(&str) -> bool,
    /// Fewer digits than the common number, for beginnings of kinds of paths. Each needs a reason.
    digits: Digits<'a>,
}

impl Relation<'_> {
    /// The figures of the base session stay as they are.
    const fn nothing_changes<'a>(name: &'a str, change: &'a dyn Fn(&mut Session)) -> Relation<'a> {
        Relation {
            name,
            change,
            expect: &|_, _| (),
            silent: &|_| false,
            digits: &[],
        }
    }

    fn holds(&self) {
        self.holds_for(&BASE.0, &BASE.1);
    }

    /// Compares the figures of a changed `session` with the changed figures of the session.
    fn holds_for(&self, session: &Session, own: &Figures) {
        let mut changed = session.clone();
        (self.change)(&mut changed);
        let found = figures(&changed.analysis());
        let spoken = |path: &String| !(self.silent)(&kind(path));
        let expected = own.iter().filter(|(path, _)| spoken(path));
        let expected = expected.map(|(path, figure)| {
            let (mut path, mut figure) = (path.clone(), figure.clone());
            (self.expect)(&mut path, &mut figure);
            (path, figure)
        });
        let expected: Figures = expected.collect();
        let found: Figures = found.into_iter().filter(|(path, _)| spoken(path)).collect();
        let result = compare(&expected, &found, self.digits);
        println!(
            "{}: {} figures, {} equal in all bits, least {:?}",
            self.name, result.figures, result.equal, result.least
        );
        assert!(
            result.broken.is_empty(),
            "{}: {}",
            self.name,
            result.report()
        );
    }
}

/// True for a path that starts with one of these.
fn begins(path: &str, with: &[&str]) -> bool {
    with.iter().any(|start| path.starts_with(start))
}

/// Changes the number of a figure; words stay.
fn number(figure: &mut Figure, change: impl FnOnce(f64) -> f64) {
    if let Figure::Number(n) = figure {
        *n = change(*n);
    }
}

/// The base session has everything that a relation could break.
#[test]
fn the_session_has_failures_depths_and_studies() {
    let a = BASE.0.analysis();
    let counts = a.counts;
    assert_eq!(
        (
            counts.planned,
            counts.valid,
            counts.missed,
            counts.invalid,
            counts.excluded,
            counts.sync
        ),
        (80, 75, 1, 2, 2, 3)
    );
    assert_eq!(a.scored.rmse_mm.n, 43);
    assert!((1.0..3.0).contains(&a.scored.rmse_mm.value.unwrap()));
    assert!(a.findings.is_empty());
    let causes = a.warnings.iter().map(|w| &w.cause);
    assert!(causes.clone().all(|c| matches!(
        c,
        WarningCause::ExclusionsMatter { .. } | WarningCause::FewDecide { .. }
    )));
    assert_eq!(a.depths.len(), 2);
    assert!(
        a.indentation
            .is_some_and(|i| i.depth.is_some() && i.force.is_some())
    );
    assert!(a.reduction.is_some() && a.latency.is_some_and(|l| l.from_contact.is_some()));
    assert!(a.coverage.is_some() && a.cmre.is_some() && a.bit_rates.is_some());
}

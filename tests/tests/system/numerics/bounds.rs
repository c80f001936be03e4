//! Error bounds of this suite, by their names in `README.md`, and the worst error observed.

use std::cell::RefCell;
use std::fmt::Display;

/// Half the distance of 1.0 from the next double.
pub(crate) const UNIT: f64 = f64::EPSILON / 2.0;

/// A guaranteed bound on an error.
pub(crate) struct Bound {
    /// Name in the table of the document.
    pub name: &'static str,
    /// Limit in the unit stated in the document.
    pub limit: f64,
}

macro_rules! bounds {
    ($($constant:ident: $name:literal <= $limit:literal;)*) => {
        $(pub(crate) const $constant: Bound = Bound { name: $name, limit: $limit };)*
        const ALL: &[(Bound, &str)] = &[$(($constant, stringify!($limit))),*];
    };
}

bounds! {
    SINE: "sine between the rays" <= 8.0;
    MEET: "point where the rays meet" <= 10.0;
    RANGE: "range along a ray" <= 10.0;
    ROUND_TRIP: "point to angles and back" <= 4.0;
    LENS_ANGLE: "angle of a column" <= 4.0;
    LENS_BACKWARD: "column of an angle, backward" <= 8.0;
    LENS_FOLD: "column of an angle at the fold" <= 1e-5;
    POINT_ANGLE: "angle of a point" <= 3.0;
    SCALE: "scale law" <= 2.0;
    TRANSLATION: "translation law" <= 2.0;
    CENTROID: "centroid of a cluster" <= 1.0;
    CLOCK_MAP: "camera time of a host time" <= 3.0;
    CLOCK_BACK: "host time of a camera time" <= 6.0;
    WINDOW: "edge of a window" <= 8.0;
    DRIFT: "drift from marks" <= 2e-3;
    OFFSET: "camera time from marks" <= 0.5;
    RATES_DRIFT: "drift from event rates" <= 5.0;
    RATES_OFFSET: "camera time from event rates" <= 20.0;
    SUM: "sum" <= 4.0;
    RMS: "root mean square" <= 4.0;
    VARIANCE: "variance" <= 8.0;
    RATE: "event rate" <= 2.0;
}

/// Tracks one bound: fails at the first larger error, and finally reports the worst one.
pub(crate) struct Watch {
    bound: &'static Bound,
    worst: RefCell<(f64, String)>,
}

impl Watch {
    pub(crate) fn new(bound: &'static Bound) -> Self {
        Self {
            bound,
            worst: RefCell::new((0.0, String::new())),
        }
    }

    /// Checks one error; `at` is shown if it is too large. NaN is too large.
    pub(crate) fn record(&self, error: f64, at: impl Display) {
        let Bound { name, limit } = self.bound;
        assert!(error <= *limit, "{name}: {error:e} > {limit:e} at {at}");
        if error > self.worst.borrow().0 {
            *self.worst.borrow_mut() = (error, at.to_string());
        }
    }
}

impl Drop for Watch {
    #[expect(
        clippy::print_stderr,
        reason = "the worst error is what a reader of the run wants to know"
    )]
    fn drop(&mut self) {
        let (worst, at) = &*self.worst.borrow();
        let Bound { name, limit } = self.bound;
        eprintln!("{name}: worst {worst:.3e} of {limit:e}, at {at}");
    }
}

#[test]
fn the_document_states_the_bounds_that_are_held() {
    let document = include_str!("README.md");
    let row = |name: &str| {
        let mut rows = document
            .lines()
            .filter(|l| l.starts_with(&format!("| {name} |")));
        let row = rows.next().unwrap_or_else(|| panic!("no row for `{name}`"));
        assert_eq!(rows.next(), None, "two rows for `{name}`");
        row.to_owned()
    };
    for (bound, limit) in ALL {
        let row = row(bound.name);
        assert!(
            row.contains(&format!("`{limit}`")),
            "the limit {limit} is not in the row: {row}"
        );
    }
}

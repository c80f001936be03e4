//! The mapping of a limit, one table per unit, and how it is read.

use skinrig_model::Limit;

use super::Metric;
use crate::keys::optional;
use crate::shape::{Field, Key, Range, Shape, Table, Value};
use skinrig_settings::Collector;
use skinrig_settings::Dimension::{
    self, Data, DataRate, Drift, EventRate, Force, Length, Share, Time,
};

/// A metric: the key of its limit in the check's table, and what people are shown.
pub(super) const fn metric(name: &'static str, title: &'static str, unit: &'static str) -> Metric {
    Metric { name, title, unit }
}

/// The key of a metric's limit.
pub(super) const fn limit(of: Metric, table: &'static Table) -> Key {
    optional(of.name, Shape::Map(table), of.title)
}

const DOC: &str = "A limit, stated before anything is measured.";

macro_rules! limit_table {
    ($table:ident, $name:literal, $shape:expr, $margin:expr) => {
        pub(super) static $table: Table = Table {
            name: $name,
            doc: DOC,
            keys: &[
                optional("at_least", $shape, "The smallest value that is good."),
                optional("at_most", $shape, "The largest value that is good."),
                optional(
                    "margin",
                    $margin,
                    "A good value nearer to a limit than this is MARGINAL.",
                ),
            ],
            exactly_one: &[],
        };
    };
}

const WIDE: Range = Range::between(-1e15, 1e15);
const POSITIVE: Range = Range::above_zero(1e15);

const fn value(dimension: &'static [Dimension]) -> Shape {
    Shape::Quantity(dimension, WIDE)
}
const fn margin(dimension: &'static [Dimension]) -> Shape {
    Shape::Quantity(dimension, POSITIVE)
}

limit_table!(
    COUNT,
    "limit_count",
    Shape::Number(WIDE),
    Shape::Number(POSITIVE)
);
limit_table!(LENGTH, "limit_length", value(&[Length]), margin(&[Length]));
limit_table!(TIME, "limit_time", value(&[Time]), margin(&[Time]));
limit_table!(FORCE, "limit_force", value(&[Force]), margin(&[Force]));
limit_table!(
    EVENTS,
    "limit_events",
    value(&[EventRate]),
    margin(&[EventRate])
);
limit_table!(DATA, "limit_data", value(&[Data]), margin(&[Data]));
limit_table!(
    RATE,
    "limit_data_rate",
    value(&[DataRate]),
    margin(&[DataRate])
);
limit_table!(SHARE, "limit_share", value(&[Share]), margin(&[Share]));
limit_table!(DRIFT, "limit_drift", value(&[Drift]), margin(&[Drift]));

/// The limit that `field` states.
pub(super) fn read(field: &Field, out: &mut Collector) -> Option<Limit> {
    let number = |key: &str| match field.get(key)?.value {
        Value::Quantity(value, _) | Value::Number(value) => Some(value),
        _ => None,
    };
    let (at_least, at_most) = (number("at_least"), number("at_most"));
    let wrong = |out: &mut Collector, what: &str, expected: String, found: String| {
        out.error(field.span, field.path.as_str(), what)
            .expected(expected)
            .found(found);
    };
    match (at_least, at_most) {
        (None, None) => {
            let expected = "`at_least`, `at_most` or both".to_owned();
            wrong(
                out,
                "a limit that nothing can break",
                expected,
                "neither".to_owned(),
            );
            return None;
        }
        (Some(least), Some(most)) if least > most => {
            let expected = format!("at_least not above at_most ({most})");
            wrong(out, "no value is good", expected, format!("{least}"));
            return None;
        }
        _ => {}
    }
    Some(Limit {
        at_least,
        at_most,
        margin: number("margin").unwrap_or(0.0),
    })
}

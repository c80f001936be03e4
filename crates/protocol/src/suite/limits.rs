//! The mapping of a limit, one per unit.

use skinrig_model::Limit;
use skinrig_settings::{Collector, Field, Settings, ValueRange};

const WIDE: ValueRange = ValueRange::between(-1e15, 1e15);
const POSITIVE: ValueRange = ValueRange::above_zero(1e15);

macro_rules! limit {
    ($name:ident, $table:literal, $unit:literal, $example:literal) => {
        /// A limit, set before the measurement.
        #[derive(Settings)]
        #[settings(name = $table)]
        pub(super) struct $name {
            /// The largest good value.
            #[setting(unit = $unit, range = WIDE, at_least_one, example = $example)]
            at_most: Option<f64>,
            /// The smallest good value.
            #[setting(unit = $unit, range = WIDE, at_least_one)]
            at_least: Option<f64>,
            /// A good value closer to a limit than this is MARGINAL.
            #[setting(unit = $unit, range = POSITIVE)]
            margin: Option<f64>,
        }

        impl $name {
            /// Unit for display; empty for counts.
            pub(super) const UNIT: &str = $unit;
            /// A limit as it could be typed.
            pub(super) const EXAMPLE: &str = concat!("{at_most: ", $example, "}");

            pub(super) fn read(field: &Field, out: &mut Collector) -> Option<Limit> {
                let limit = Self::from_mapping(field, out)?;
                in_order(limit.at_least, limit.at_most, field, out).then_some(Limit {
                    at_least: limit.at_least,
                    at_most: limit.at_most,
                    margin: limit.margin.unwrap_or(0.0),
                })
            }
        }
    };
}

limit!(Count, "limit_count", "", "0");
limit!(Length, "limit_length", "mm", "0.5 mm");
limit!(Time, "limit_time", "s", "10 ms");
limit!(Force, "limit_force", "N", "2 N");
limit!(EventRate, "limit_events", "ev/s", "500 kev/s");
limit!(Data, "limit_data", "B", "2 GB");
limit!(DataRate, "limit_data_rate", "B/s", "20 MB/s");
limit!(Share, "limit_share", "%", "5 %");
limit!(Drift, "limit_drift", "ppm", "100 ppm");

/// Checks that at least one value is within the limits.
fn in_order(
    at_least: Option<f64>,
    at_most: Option<f64>,
    field: &Field,
    out: &mut Collector,
) -> bool {
    let (Some(least), Some(most)) = (at_least, at_most) else {
        return true;
    };
    if least > most {
        out.error(
            field.span,
            field.path.as_str(),
            "no value is within the limits",
        )
        .expected(format!("at_least not above at_most ({most})"))
        .found(format!("{least}"));
    }
    least <= most
}

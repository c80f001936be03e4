//! The mapping of a limit, one per kind of value.

use skinrig_model::Limit;
use skinrig_settings::{Collector, Field, Settings, ValueRange};

const WIDE: ValueRange = ValueRange::between(-1e15, 1e15);
const POSITIVE: ValueRange = ValueRange::above_zero(1e15);

/// Which values of a metric are good.
#[derive(Clone, Copy)]
enum Good {
    /// Small ones. None is negative.
    Small,
    /// Large ones, up to this. None is negative.
    Large(f64),
    /// Those of a range. None is negative.
    Between,
    /// Those around zero, of either sign.
    Around,
}

macro_rules! limit {
    ($name:ident, $table:literal, $unit:literal, $good:expr, $typed:literal, $limits:literal) => {
        /// A limit, set before the measurement.
        #[derive(Settings)]
        #[settings(name = $table)]
        pub(super) struct $name {
            /// The largest good value.
            #[setting(unit = $unit, range = WIDE, at_least_one, example = $typed)]
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
            pub(super) const EXAMPLE: &str = $limits;

            pub(super) fn read(field: &Field, out: &mut Collector) -> Option<Limit> {
                let limit = Self::from_mapping(field, out)?;
                let (least, most) = (limit.at_least, limit.at_most);
                if let Some(fault) = fault($good, least, most) {
                    let (message, expected, found) = fault;
                    out.error(field.span, field.path.as_str(), message)
                        .expected(expected)
                        .found(found)
                        .help(concat!("write for example `", $limits, "`"));
                    return None;
                }
                Some(Limit {
                    at_least: least,
                    at_most: most,
                    margin: limit.margin.unwrap_or(0.0),
                })
            }
        }
    };
}

limit!(Count, "limit_count", "", Good::Small, "0", "{at_most: 0}");
limit!(
    Length,
    "limit_length",
    "mm",
    Good::Small,
    "0.5 mm",
    "{at_most: 0.5 mm}"
);
limit!(
    Height,
    "limit_height",
    "mm",
    Good::Around,
    "0.5 mm",
    "{at_least: -0.5 mm, at_most: 0.1 mm}"
);
limit!(
    Time,
    "limit_time",
    "s",
    Good::Small,
    "10 ms",
    "{at_most: 10 ms}"
);
limit!(
    Offset,
    "limit_offset",
    "s",
    Good::Around,
    "10 ms",
    "{at_least: -10 ms, at_most: 10 ms}"
);
limit!(
    Force,
    "limit_force",
    "N",
    Good::Small,
    "2 N",
    "{at_most: 2 N}"
);
limit!(
    EventRate,
    "limit_events",
    "ev/s",
    Good::Between,
    "500 kev/s",
    "{at_most: 500 kev/s}"
);
limit!(
    Loss,
    "limit_loss",
    "B",
    Good::Small,
    "0 B",
    "{at_most: 0 B}"
);
limit!(
    Space,
    "limit_space",
    "B",
    Good::Large(f64::INFINITY),
    "2 GB",
    "{at_least: 2 GB}"
);
limit!(
    DataRate,
    "limit_data_rate",
    "B/s",
    Good::Between,
    "20 MB/s",
    "{at_most: 20 MB/s}"
);
limit!(
    WriteRate,
    "limit_write_rate",
    "B/s",
    Good::Large(f64::INFINITY),
    "60 MB/s",
    "{at_least: 60 MB/s}"
);
limit!(
    Share,
    "limit_share",
    "%",
    Good::Large(100.0),
    "90 %",
    "{at_least: 90 %}"
);
limit!(
    Ratio,
    "limit_ratio",
    "%",
    Good::Between,
    "125 %",
    "{at_least: 80 %, at_most: 125 %}"
);
limit!(
    Drift,
    "limit_drift",
    "ppm",
    Good::Around,
    "100 ppm",
    "{at_least: -100 ppm, at_most: 100 ppm}"
);

/// Why limits cannot fail, or cannot be met: message, what was expected, and what was found. `None` if they are sound.
fn fault(
    good: Good,
    least: Option<f64>,
    most: Option<f64>,
) -> Option<(&'static str, String, String)> {
    const NONE_IS_GOOD: &str = "no value is within the limits";
    const ALL_ARE_GOOD: &str = "every value is within the limits";
    let alone = |key: &str| format!("`{key}` alone");
    if let (Some(least), Some(most)) = (least, most)
        && least > most
    {
        let expected = format!("at_least not above at_most ({most})");
        return Some((NONE_IS_GOOD, expected, format!("{least}")));
    }
    match (good, least, most) {
        (Good::Small, Some(_), None) => Some((
            "the limit does not find the fault",
            "`at_most`: small values are good".to_owned(),
            alone("at_least"),
        )),
        (Good::Large(_), None, Some(_)) => Some((
            "the limit does not find the fault",
            "`at_least`: large values are good".to_owned(),
            alone("at_most"),
        )),
        (Good::Around, None, Some(_)) | (Good::Around, Some(_), None) => Some((
            "the limit finds half of the faults",
            "`at_least` and `at_most`: values have either sign".to_owned(),
            alone(if least.is_some() {
                "at_least"
            } else {
                "at_most"
            }),
        )),
        (Good::Around, ..) => None,
        (_, _, Some(most)) if most < 0.0 => Some((
            NONE_IS_GOOD,
            "at_most of 0 or more: no value is negative".to_owned(),
            format!("{most}"),
        )),
        (Good::Large(_), Some(least), _) | (Good::Between, Some(least), None) if least <= 0.0 => {
            Some((
                ALL_ARE_GOOD,
                "at_least above 0: no value is negative".to_owned(),
                format!("{least}"),
            ))
        }
        (Good::Large(largest), Some(least), _) if least > largest => Some((
            NONE_IS_GOOD,
            format!("at_least of at most {largest}"),
            format!("{least}"),
        )),
        _ => None,
    }
}

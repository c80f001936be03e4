//! Quantities: a number with its unit.
//!
//! `4 mm`, `0.4 cm`, `1.5e-1 s`, `20 mm/s`, `2 N`, `30 deg`, `1 kHz`, `10 px`. The space is optional. A quotient by a
//! whole number keeps a value exact that has no short decimal form: `868 s / 289`. A bare number is an error, because
//! its unit is unknown.

use crate::diagnostic::closest;

/// Dimension of a quantity. Values are stored in the unit that the variant states.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dimension {
    /// Millimetres.
    Length,
    /// Seconds.
    Time,
    /// Millimetres per second.
    Speed,
    /// Newton.
    Force,
    /// Degrees.
    Angle,
    /// Hertz.
    Frequency,
    /// Pixels.
    Pixels,
    /// Kilograms.
    Mass,
    /// Millimetres per second squared.
    Acceleration,
    /// Millimetres per second cubed.
    Jerk,
    /// Events per second.
    EventRate,
    /// Bytes.
    Data,
    /// Bytes per second.
    DataRate,
    /// Percent of a whole.
    Share,
    /// Degrees Celsius.
    Temperature,
    /// Parts per million.
    Drift,
}

impl Dimension {
    /// The accepted units, each with its size in the stored unit; the usual one first.
    #[must_use]
    pub const fn units(self) -> &'static [(&'static str, f64)] {
        match self {
            Self::Length => &[
                ("mm", 1.0),
                ("cm", 10.0),
                ("m", 1e3),
                ("um", 1e-3),
                ("µm", 1e-3),
            ],
            Self::Time => &[
                ("s", 1.0),
                ("ms", 1e-3),
                ("us", 1e-6),
                ("µs", 1e-6),
                ("min", 60.0),
                ("h", 3600.0),
            ],
            Self::Speed => &[("mm/s", 1.0), ("cm/s", 10.0), ("m/s", 1e3), ("um/s", 1e-3)],
            Self::Force => &[("N", 1.0), ("mN", 1e-3)],
            Self::Angle => &[
                ("deg", 1.0),
                ("°", 1.0),
                ("rad", 180.0 / std::f64::consts::PI),
            ],
            Self::Frequency => &[("Hz", 1.0), ("kHz", 1e3), ("MHz", 1e6)],
            Self::Pixels => &[("px", 1.0)],
            Self::Mass => &[("kg", 1.0), ("g", 1e-3)],
            Self::Acceleration => &[("mm/s2", 1.0), ("m/s2", 1e3)],
            Self::Jerk => &[("mm/s3", 1.0), ("m/s3", 1e3)],
            Self::EventRate => &[("ev/s", 1.0), ("kev/s", 1e3), ("Mev/s", 1e6)],
            Self::Data => &[
                ("B", 1.0),
                ("kB", 1e3),
                ("MB", 1e6),
                ("GB", 1e9),
                ("TB", 1e12),
            ],
            Self::DataRate => &[("B/s", 1.0), ("kB/s", 1e3), ("MB/s", 1e6), ("GB/s", 1e9)],
            Self::Share => &[("%", 1.0)],
            Self::Temperature => &[("degC", 1.0), ("°C", 1.0)],
            Self::Drift => &[("ppm", 1.0)],
        }
    }

    /// All dimensions.
    const ALL: [Self; 16] = [
        Self::Length,
        Self::Time,
        Self::Speed,
        Self::Force,
        Self::Angle,
        Self::Frequency,
        Self::Pixels,
        Self::Mass,
        Self::Acceleration,
        Self::Jerk,
        Self::EventRate,
        Self::Data,
        Self::DataRate,
        Self::Share,
        Self::Temperature,
        Self::Drift,
    ];

    /// `a length`, `a time`, ...
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Length => "a length",
            Self::Time => "a time",
            Self::Speed => "a speed",
            Self::Force => "a force",
            Self::Angle => "an angle",
            Self::Frequency => "a frequency",
            Self::Pixels => "a number of pixels",
            Self::Mass => "a mass",
            Self::Acceleration => "an acceleration",
            Self::Jerk => "a jerk",
            Self::EventRate => "an event rate",
            Self::Data => "an amount of data",
            Self::DataRate => "a data rate",
            Self::Share => "a share",
            Self::Temperature => "a temperature",
            Self::Drift => "a drift",
        }
    }

    /// The unit in common use.
    #[must_use]
    pub fn usual_unit(self) -> &'static str {
        self.units().first().map_or("", |(unit, _)| unit)
    }

    /// A value for examples.
    #[must_use]
    pub const fn example(self) -> &'static str {
        match self {
            Self::Length => "4 mm",
            Self::Time => "1.5 s",
            Self::Speed => "20 mm/s",
            Self::Force => "2 N",
            Self::Angle => "30 deg",
            Self::Frequency => "1 kHz",
            Self::Pixels => "10 px",
            Self::Mass => "140 g",
            Self::Acceleration => "100 mm/s2",
            Self::Jerk => "1000 mm/s3",
            Self::EventRate => "50 kev/s",
            Self::Data => "2 GB",
            Self::DataRate => "20 MB/s",
            Self::Share => "2 %",
            Self::Temperature => "60 degC",
            Self::Drift => "50 ppm",
        }
    }
}

/// A value with its dimension.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quantity {
    /// In the unit of the dimension, which its variant names. Finite.
    pub value: f64,
    /// Its dimension.
    pub dimension: Dimension,
}

/// Reason why a text is not a quantity of an expected dimension: fragments for "expected", "found" and "help".
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct QuantityError {
    /// The problem, in a few words.
    pub message: String,
    /// Accepted values.
    pub expected: String,
    /// Actual value.
    pub found: String,
    /// Suggested text, if there is one.
    pub help: Option<String>,
}

/// Reads `text` as a quantity of one of `dimensions` (at least one).
///
/// # Errors
/// [`QuantityError`] for anything else: a bare number, an unknown or unexpected unit, not a number, not finite.
pub fn parse(text: &str, dimensions: &[Dimension]) -> Result<Quantity, QuantityError> {
    let text = text.trim();
    let expected = expectation(dimensions);
    let usual = dimensions.first().map_or("mm", |d| d.usual_unit());
    let fail = |message: &str, found: String, help: Option<String>| QuantityError {
        message: message.to_owned(),
        expected: expected.clone(),
        found,
        help,
    };
    let (number, rest) = split_number(text);
    let shown: String = text.chars().take(60).collect();
    let Some(number) = number else {
        return Err(fail("not a quantity", format!("`{shown}`"), None));
    };
    if !number.is_finite() {
        return Err(fail("the number is too large", format!("`{shown}`"), None));
    }
    let (unit, divisor) = match split_divisor(rest) {
        Ok(parts) => parts,
        Err(BadDivisor(divisor)) => {
            let found = format!("`{}`", divisor.chars().take(30).collect::<String>());
            let help =
                Some("write a quotient as `868 s / 289`, by a whole number above 0".to_owned());
            return Err(fail(
                "the divisor is not a whole number above 0",
                found,
                help,
            ));
        }
    };
    if unit.is_empty() {
        let help = Some(format!("write `{shown} {usual}`, or the intended unit"));
        return Err(fail(
            "the unit is missing",
            format!("the bare number `{shown}`"),
            help,
        ));
    }
    if unit.starts_with(',') {
        let help = Some(format!(
            "write the decimal point as `.`: `{}`",
            shown.replacen(',', ".", 1)
        ));
        return Err(fail("not a quantity", format!("`{shown}`"), help));
    }
    for &dimension in dimensions {
        if let Some((_, size)) = dimension.units().iter().find(|(name, _)| *name == unit) {
            let value = number * size / divisor;
            if !value.is_finite() {
                return Err(fail("the number is too large", format!("`{shown}`"), None));
            }
            return Ok(Quantity { value, dimension });
        }
    }
    for other in Dimension::ALL {
        if other.units().iter().any(|(name, _)| *name == unit) {
            let help = None;
            return Err(fail(
                "the unit does not fit",
                format!("{}, `{shown}`", other.name()),
                help,
            ));
        }
    }
    let known = dimensions
        .iter()
        .flat_map(|d| d.units())
        .map(|(name, _)| *name);
    let close = known
        .clone()
        .find(|name| name.eq_ignore_ascii_case(unit))
        .or_else(|| closest(unit, known));
    let help = close.map(|name| {
        let before = text.get(..text.len() - rest.len()).unwrap_or("").trim_end();
        format!("did you mean `{before} {name}`?")
    });
    let unit: String = unit.chars().take(30).collect();
    Err(fail("unknown unit", format!("`{unit}`"), help))
}

/// `a length with its unit, for example `4 mm` (mm, cm, m, um)`.
fn expectation(dimensions: &[Dimension]) -> String {
    let each: Vec<String> = dimensions
        .iter()
        .map(|d| {
            let units: Vec<&str> = d
                .units()
                .iter()
                .map(|(name, _)| *name)
                .filter(|name| name.is_ascii())
                .collect();
            format!(
                "{} such as `{}` (units: {})",
                d.name(),
                d.example(),
                units.join(", ")
            )
        })
        .collect();
    each.join(" or ")
}

/// The number at the start of `text` and the rest, without spaces between.
pub(crate) fn split_number(text: &str) -> (Option<f64>, &str) {
    let bytes = text.as_bytes();
    let digits = |from: usize| {
        let mut at = from;
        while bytes.get(at).is_some_and(u8::is_ascii_digit) {
            at += 1;
        }
        at
    };
    let sign = usize::from(matches!(bytes.first(), Some(b'+' | b'-')));
    let mut end = digits(sign);
    let mut has_digits = end > sign;
    if bytes.get(end) == Some(&b'.') {
        let fraction = digits(end + 1);
        has_digits |= fraction > end + 1;
        end = fraction;
    }
    if !has_digits {
        return (None, text);
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        let exponent = digits(end + 1 + sign);
        if exponent > end + 1 + sign {
            end = exponent;
        }
    }
    let (number, rest) = text.split_at(end);
    (number.parse().ok(), rest.trim_start())
}

/// Text after a `/` that is not a whole number above 0.
struct BadDivisor<'a>(&'a str);

/// A unit and the divisor after it, 1 without a divisor. `mm/s` is a unit, `s / 289` a quotient.
fn split_divisor(rest: &str) -> Result<(&str, f64), BadDivisor<'_>> {
    let Some((unit, divisor)) = rest.rsplit_once('/') else {
        return Ok((rest.trim(), 1.0));
    };
    let divisor = divisor.trim();
    if !divisor.starts_with(|c: char| c.is_ascii_digit() || c == '-' || c == '+') {
        return Ok((rest.trim(), 1.0));
    }
    match divisor.parse::<u32>() {
        Ok(d) if d > 0 => Ok((unit.trim(), f64::from(d))),
        _ => Err(BadDivisor(divisor)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn units_convert() {
        let value = |text: &str, d| parse(text, &[d]).unwrap().value;
        assert_eq!(value("4 mm", Dimension::Length), 4.0);
        assert_eq!(value("0.4cm", Dimension::Length), 4.0);
        assert_eq!(value("-1.5e1 um", Dimension::Length), -0.015);
        assert_eq!(value("50 ms", Dimension::Time), 0.05);
        assert_eq!(value("1 min", Dimension::Time), 60.0);
        assert_eq!(value("0.02 m/s", Dimension::Speed), 20.0);
        assert_eq!(value("1 kHz", Dimension::Frequency), 1000.0);
        assert_eq!(value("868 s / 289", Dimension::Time), 868.0 / 289.0);
        assert_eq!(value("60 mm/s / 3", Dimension::Speed), 20.0);
    }

    #[test]
    fn either_dimension() {
        let dimensions = [Dimension::Speed, Dimension::Time];
        assert_eq!(
            parse("2 s", &dimensions).unwrap().dimension,
            Dimension::Time
        );
        assert_eq!(
            parse("2 mm/s", &dimensions).unwrap().dimension,
            Dimension::Speed
        );
    }

    #[test]
    fn errors_show_the_fix() {
        let error = |text: &str| parse(text, &[Dimension::Length]).unwrap_err();
        assert_eq!(error("4").message, "the unit is missing");
        assert_eq!(
            error("4").help.unwrap(),
            "write `4 mm`, or the intended unit"
        );
        assert_eq!(error("4 s").found, "a time, `4 s`");
        assert_eq!(error("4 mmm").help.unwrap(), "did you mean `4 mm`?");
        assert_eq!(error("4 MM").help.unwrap(), "did you mean `4 mm`?");
        assert_eq!(
            error("4,5 mm").help.unwrap(),
            "write the decimal point as `.`: `4.5 mm`"
        );
        for text in [
            "",
            "mm",
            "nan mm",
            ".inf mm",
            "-",
            ".",
            "1e999 mm",
            "4 mm / 0",
            "4 mm / -1",
            "4 mm / x",
        ] {
            assert!(parse(text, &[Dimension::Length]).is_err(), "{text}");
        }
    }

    proptest! {
        #[test]
        fn never_panics(text in ".{0,40}") {
            let _ = parse(&text, &[Dimension::Length, Dimension::Time]);
        }

        #[test]
        fn written_values_read_back(value in -1e6f64..1e6) {
            prop_assert_eq!(parse(&format!("{value} mm"), &[Dimension::Length]).unwrap().value, value);
        }
    }
}

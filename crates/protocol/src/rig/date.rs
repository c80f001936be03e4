//! Calendar dates in rig files.

use std::fmt;

use serde::{Serialize, Serializer};
use skinrig_settings::{Collector, Field, Setting, Shape};

/// A day of the Gregorian calendar, written `2026-11-20`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Date {
    year: u16,
    month: u8,
    day: u8,
}

impl Date {
    /// Reads `year-month-day` with four, two and two digits; `None` for anything that is not a date.
    #[must_use]
    pub fn parse(text: &str) -> Option<Self> {
        let mut parts = text.split('-');
        let mut number = |digits: usize| {
            let part = parts.next()?;
            let plain = part.len() == digits && part.bytes().all(|b| b.is_ascii_digit());
            plain.then(|| part.parse::<u16>().ok())?
        };
        let (year, month, day) = (number(4)?, number(2)?, number(2)?);
        if parts.next().is_some() || !(1..=12).contains(&month) {
            return None;
        }
        let leap = year % 4 == 0 && (year % 100 != 0 || year % 400 == 0);
        let last = match month {
            2 if leap => 29,
            2 => 28,
            4 | 6 | 9 | 11 => 30,
            _ => 31,
        };
        (1..=last).contains(&day).then_some(Self {
            year,
            month: month as u8,
            day: day as u8,
        })
    }

    /// Days since 1970-01-01; negative before.
    #[must_use]
    pub fn days_since_1970(self) -> i64 {
        // Years that begin in March: the leap day comes last. 146 097 days in 400 years.
        let (month, year) = (i64::from(self.month), i64::from(self.year));
        let year = if month <= 2 { year - 1 } else { year };
        let month_from_march = (month + 9) % 12;
        let day_of_year = (153 * month_from_march + 2) / 5 + i64::from(self.day) - 1;
        365 * year + year.div_euclid(4) - year.div_euclid(100) + year.div_euclid(400) + day_of_year
            - 719_468
    }
}

impl fmt::Display for Date {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:04}-{:02}-{:02}", self.year, self.month, self.day)
    }
}

impl Setting for Date {
    const SHAPE: Shape = Shape::Text;

    fn from_field(field: &Field, out: &mut Collector) -> Option<Self> {
        let text = field.as_text()?;
        let date = Self::parse(text);
        if date.is_none() {
            out.error(field.span, field.path.as_str(), "not a date")
                .expected("year-month-day such as `2026-11-20`")
                .found(format!("`{text}`"));
        }
        date
    }

    fn text(&self) -> String {
        self.to_string()
    }
}

impl Serialize for Date {
    fn serialize<S: Serializer>(&self, s: S) -> Result<S::Ok, S::Error> {
        s.collect_str(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn days_are_consecutive_and_invalid_dates_are_rejected() {
        let days = |text: &str| Date::parse(text).map(Date::days_since_1970);
        assert_eq!(days("1970-01-01"), Some(0));
        assert_eq!(days("2000-03-01"), Some(11_017));
        assert_eq!(days("2026-11-20"), Some(20_777));
        assert_eq!(days("2024-02-29"), Some(19_782));
        for text in [
            "2026-02-29",
            "2026-13-01",
            "2026-00-10",
            "2026-1-01",
            "20.11.2026",
            "2026-11-20-1",
            "1900-02-29",
            "+026-01-01",
            "",
        ] {
            assert_eq!(Date::parse(text), None, "{text}");
        }
        assert_eq!(Date::parse("2026-01-09").unwrap().to_string(), "2026-01-09");
    }
}

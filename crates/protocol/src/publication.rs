//! Publications: files that state what skinrig cannot know of published data, such as people and licence.

use serde::Serialize;
use skinrig_settings::{Collector, Diagnostics, Field, Settings, open, quote};

/// What a published crate states about its data beyond what is recorded.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Settings)]
#[settings(name = "publication", version = "skinrig_publication", finish = Self::each_person_once)]
pub struct Publication {
    /// Title.
    #[setting(example = "Presses on mold 3")]
    pub title: String,
    /// What the data are and how they were recorded.
    #[setting(example = "Presses of a 10 mm cube on mold 3, recorded for our comparison of molds")]
    pub description: String,
    /// Licence of the data, by its SPDX identifier.
    #[setting(read = license, example = "CC-BY-4.0")]
    pub license: String,
    /// Day of publication: year-month-day.
    #[setting(read = day, example = "2026-01-31")]
    pub published_on: String,
    /// Authors, in order.
    #[setting(items = 1..=1000, example = "[{name: A. Person, orcid: 0000-0002-1825-0097}]")]
    pub people: Vec<Person>,
    /// Who publishes the data.
    pub publisher: Option<Organisation>,
    /// What the data do not show, and what is known to be wrong with them.
    #[setting(items = 1..=1000, example = "[one skin of its kind was pressed]")]
    pub known_limits: Vec<String>,
}

/// A person.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Settings)]
#[settings(name = "person")]
pub struct Person {
    /// Name, as it is cited.
    #[setting(example = "A. Person")]
    pub name: String,
    /// ORCID, for example 0000-0002-1825-0097.
    #[setting(read = orcid, example = "0000-0002-1825-0097")]
    pub orcid: String,
    /// Where they work.
    pub affiliation: Option<Organisation>,
}

/// An organisation.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Settings)]
#[settings(name = "organisation")]
pub struct Organisation {
    /// Name.
    #[setting(example = "A Laboratory")]
    pub name: String,
    /// Address on the web.
    #[setting(read = address, example = "https://example.org/")]
    pub url: String,
}

impl Publication {
    /// Reads a publication from the bytes of a file named `name`.
    ///
    /// # Errors
    /// [`Diagnostics`] with every finding at once.
    pub fn parse(name: &str, bytes: &[u8]) -> Result<Self, Diagnostics> {
        let (mut out, root) = open(name, bytes, &[], Self::TABLE)?;
        match root.and_then(|root| Self::from_mapping(&root, &mut out)) {
            Some(found) if out.is_clean() => Ok(found),
            _ => Err(out.finish()),
        }
    }

    fn each_person_once(self, field: &Field, out: &mut Collector) -> Option<Self> {
        let items = field.at("people").items();
        for (i, (person, item)) in self.people.iter().zip(items).enumerate() {
            if self.people[..i].iter().any(|p| p.orcid == person.orcid) {
                out.error(item.span, item.path.as_str(), "the ORCID is given twice")
                    .expected("each person once")
                    .found(quote(&person.orcid));
            }
        }
        Some(self)
    }
}

impl Person {
    /// The ORCID as an address.
    #[must_use]
    pub fn id(&self) -> String {
        format!("https://orcid.org/{}", self.orcid)
    }
}

/// Four groups of four digits; the last one is the check digit of ISO 7064, mod 11-2.
fn orcid(field: &Field, out: &mut Collector) -> Option<String> {
    let text = field.as_text()?;
    let number = text.strip_prefix("https://orcid.org/").unwrap_or(text);
    let places: Vec<char> = number.chars().collect();
    let has_form = places.len() == 19
        && places.iter().enumerate().all(|(i, c)| match i {
            4 | 9 | 14 => *c == '-',
            18 => c.is_ascii_digit() || *c == 'X',
            _ => c.is_ascii_digit(),
        });
    if has_form && check_digit(&places) == places.last().copied() {
        return Some(number.to_owned());
    }
    let (message, expected) = match has_form {
        true => (
            "a digit of the ORCID is wrong",
            "an ORCID whose last digit fits the others",
        ),
        false => (
            "not an ORCID",
            "four groups of four digits, for example 0000-0002-1825-0097",
        ),
    };
    out.error(field.span, field.path.as_str(), message)
        .expected(expected)
        .found(quote(text));
    None
}

/// Check digit of the first 15 digits.
fn check_digit(places: &[char]) -> Option<char> {
    let digits = places.iter().filter_map(|c| c.to_digit(10)).take(15);
    let total = digits.fold(0, |total, digit| (total + digit) * 2 % 11);
    match (12 - total) % 11 {
        10 => Some('X'),
        digit => char::from_digit(digit, 10),
    }
}

/// An SPDX identifier: letters, digits, `.` and `-`.
fn license(field: &Field, out: &mut Collector) -> Option<String> {
    let text = field.as_text()?;
    if text
        .chars()
        .all(|c| c.is_ascii_alphanumeric() || ".-+".contains(c))
    {
        return Some(text.to_owned());
    }
    out.error(field.span, field.path.as_str(), "not an SPDX identifier")
        .expected("an identifier of https://spdx.org/licenses, for example `CC-BY-4.0`")
        .found(quote(text));
    None
}

fn address(field: &Field, out: &mut Collector) -> Option<String> {
    let text = field.as_text()?;
    if text.starts_with("https://") && !text.contains(char::is_whitespace) {
        return Some(text.to_owned());
    }
    out.error(field.span, field.path.as_str(), "not an address")
        .expected("an address that begins with https://")
        .found(quote(text));
    None
}

/// A day of the Gregorian calendar.
fn day(field: &Field, out: &mut Collector) -> Option<String> {
    let text = field.as_text()?;
    let part = |from: usize, to: usize| text.get(from..to)?.parse::<u32>().ok();
    let is_separated =
        text.len() == 10 && text.get(4..5) == Some("-") && text.get(7..8) == Some("-");
    let parts = (part(0, 4), part(5, 7), part(8, 10));
    if let (true, (Some(year), Some(month), Some(day))) = (is_separated, parts)
        && (1..=days_of(year, month)).contains(&day)
    {
        return Some(text.to_owned());
    }
    out.error(field.span, field.path.as_str(), "not a day")
        .expected("year-month-day, for example 2026-01-31")
        .found(quote(text));
    None
}

/// Days of a month; 0 for a month that does not exist.
const fn days_of(year: u32, month: u32) -> u32 {
    let is_leap = year.is_multiple_of(4) && (!year.is_multiple_of(100) || year.is_multiple_of(400));
    match month {
        1 | 3 | 5 | 7 | 8 | 10 | 12 => 31,
        4 | 6 | 9 | 11 => 30,
        2 if is_leap => 29,
        2 => 28,
        _ => 0,
    }
}

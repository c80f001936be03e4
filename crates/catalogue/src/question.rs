//! Questions to a catalogue: names, parameters and answers. The statements are in `questions/`.

use chrono::NaiveDate;
use serde::Serialize;

use crate::catalogue::Catalogue;
use crate::error::CatalogueError;
use crate::value::{Bound, Value};

/// A question with a fixed statement.
#[derive(Debug, PartialEq, Eq)]
pub struct Question {
    /// Name for the command line.
    pub name: &'static str,
    /// The question in words.
    pub about: &'static str,
    /// Parameters, in the order of the statement's `$1`, `$2`, ...
    pub parameters: &'static [Parameter],
    pub(crate) sql: &'static str,
}

/// A parameter of a question.
#[derive(Debug, PartialEq, Eq)]
pub struct Parameter {
    /// Its name.
    pub name: &'static str,
    /// Kind of value.
    pub kind: ParameterKind,
    /// Value if none is given; `None`: one must be given.
    pub default: Option<&'static str>,
}

/// Kind of value of a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ParameterKind {
    /// Any text.
    Text,
    /// A count from 1.
    Count,
    /// A day, `2026-11-20`, from its beginning in UTC.
    Day,
    /// A day, `2026-11-20`, to its end in UTC.
    LastDay,
    /// One of these words.
    Choice(&'static [&'static str]),
}

/// Answer to a question.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Answer {
    /// Name of the question.
    pub question: &'static str,
    /// Values of the parameters.
    pub parameters: Vec<(&'static str, String)>,
    /// Names of the columns; empty without rows.
    pub columns: Vec<String>,
    /// The rows.
    pub rows: Vec<Vec<Value>>,
}

/// Length of a day, s.
const DAY_S: i64 = 86_400;

/// Beginning of a day in UTC, s; `None` if the text is none.
fn day_s(text: &str) -> Option<i64> {
    let day = NaiveDate::parse_from_str(text, "%Y-%m-%d").ok()?;
    Some(day.and_hms_opt(0, 0, 0)?.and_utc().timestamp())
}

impl ParameterKind {
    /// Description of a valid value.
    #[must_use]
    pub fn words(self) -> String {
        match self {
            Self::Text => "text".to_owned(),
            Self::Count => "a count from 1".to_owned(),
            Self::Day | Self::LastDay => "a day, for example 2026-11-20".to_owned(),
            Self::Choice(words) => format!("one of {}", words.join(", ")),
        }
    }

    fn read(self, text: &str) -> Option<Bound> {
        match self {
            Self::Text => Some(text.into()),
            Self::Choice(words) => words.contains(&text).then(|| text.into()),
            Self::Count => text
                .parse::<i64>()
                .ok()
                .filter(|n| *n >= 1)
                .map(Bound::from),
            Self::Day => day_s(text).map(Bound::from),
            Self::LastDay => Some((day_s(text)? + DAY_S).into()),
        }
    }
}

impl Question {
    /// The values of all parameters, from `given` or by default, as text and as bound.
    fn bind(
        &self,
        given: &[(String, String)],
    ) -> Result<Vec<(&'static str, String, Bound)>, CatalogueError> {
        let wrong = |expected: String, found: String| CatalogueError::Parameter {
            question: self.name,
            expected,
            found,
        };
        let names: Vec<&str> = self.parameters.iter().map(|p| p.name).collect();
        if let Some((name, _)) = given
            .iter()
            .find(|(name, _)| !names.contains(&name.as_str()))
        {
            let expected = match names[..] {
                [] => "no parameters".to_owned(),
                _ => format!("parameters among {}", names.join(", ")),
            };
            return Err(wrong(expected, format!("`{name}`")));
        }
        let value = |parameter: &Parameter| {
            let own = given.iter().rfind(|(name, _)| name == parameter.name);
            let text = own.map(|(_, value)| value.as_str()).or(parameter.default);
            let (name, kind) = (parameter.name, parameter.kind.words());
            let text = text.ok_or_else(|| wrong(format!("{name}=VALUE, {kind}"), "none".into()))?;
            let bound = parameter.kind.read(text);
            let bound =
                bound.ok_or_else(|| wrong(format!("{name} as {kind}"), format!("`{text}`")))?;
            Ok((name, text.to_owned(), bound))
        };
        let bound: Vec<_> = self
            .parameters
            .iter()
            .map(value)
            .collect::<Result<_, _>>()?;
        let day = |wanted: &str| bound.iter().find(|(name, ..)| *name == wanted);
        if let (Some((_, since, from)), Some((_, until, to))) = (day("since"), day("until"))
            && from.integer() >= to.integer()
        {
            return Err(wrong(
                "since no later than until".to_owned(),
                format!("{since} and {until}"),
            ));
        }
        Ok(bound)
    }
}

impl Catalogue {
    /// Answers a question; `given` are parameters by name.
    ///
    /// # Errors
    /// [`CatalogueError::Parameter`], or if the catalogue cannot be read.
    pub fn ask(
        &mut self,
        question: &'static Question,
        given: &[(String, String)],
    ) -> Result<Answer, CatalogueError> {
        let parameters = question.bind(given)?;
        let bound: Vec<Bound> = parameters.iter().map(|(.., bound)| bound.clone()).collect();
        let rows = self.runtime.block_on(self.db.fetch(question.sql, &bound));
        let rows =
            rows.map_err(|e| CatalogueError::sql(self.place(), "answering a question", e))?;
        let shown = parameters.into_iter().map(|(name, text, _)| (name, text));
        Ok(Answer {
            question: question.name,
            parameters: shown.collect(),
            columns: rows.columns,
            rows: rows.rows,
        })
    }
}

//! Diagnostics of an input: every finding with its location, expected and found values, and help.

use std::collections::BTreeMap;
use std::fmt;

use serde::Serialize;
use skinrig_text::{Paint, Style, width};

use crate::source::{Location, Sources, Span};

/// One finding. Findings are always errors: no input is repaired silently.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Diagnostic {
    /// The problem, in a few words, lower case.
    pub message: String,
    /// The key path, for example `path.meander.pitch`; empty for the file as a whole.
    pub path: String,
    /// Location.
    pub location: Location,
    /// Accepted values.
    pub expected: Option<String>,
    /// Actual value.
    pub found: Option<String>,
    /// Next step: a fix to type, or a "did you mean".
    pub help: Option<String>,
}

/// Every finding of one input, in the order of the text. Never empty when returned as an error.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct Diagnostics {
    list: Vec<Diagnostic>,
}

impl Diagnostics {
    /// These findings, in this order.
    pub fn new(list: Vec<Diagnostic>) -> Self {
        Self { list }
    }

    /// The findings, in the order of the text.
    #[must_use]
    pub fn list(&self) -> &[Diagnostic] {
        &self.list
    }

    /// The findings as text: for each one the location, the underlined line, expected, found, help.
    /// With `color`, ANSI escapes mark severity, locations and fixes.
    #[must_use]
    pub fn render(&self, color: bool) -> String {
        let paint = Paint::new(color);
        let mut out = String::new();
        for diagnostic in &self.list {
            diagnostic.write(&mut out, paint);
            out.push('\n');
        }
        let count = match self.list.len() {
            1 => "1 error".to_owned(),
            n if n >= MOST_FINDINGS => format!("{n} errors; more were not listed"),
            n => format!("{n} errors"),
        };
        out.push_str(&paint.apply(Style::Error, &count));
        out.push('\n');
        out
    }
}

impl fmt::Display for Diagnostics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.render(false))
    }
}

impl std::error::Error for Diagnostics {}

impl Diagnostic {
    fn write(&self, out: &mut String, paint: Paint) {
        let Location {
            file,
            line,
            column,
            length,
            text,
            text_column,
        } = &self.location;
        let number = line.to_string();
        let margin = " ".repeat(number.len());
        let bar = paint.apply(Style::Frame, "|");
        out.push_str(&format!(
            "{}: {}\n",
            paint.apply(Style::Error, "error"),
            self.message
        ));
        let path = if self.path.is_empty() {
            String::new()
        } else {
            format!("  {}", paint.bold(&self.path))
        };
        out.push_str(&format!(
            "{margin}{} {file}:{line}:{}{path}\n",
            paint.apply(Style::Frame, "-->"),
            self.location.column
        ));
        out.push_str(&format!("{margin} {bar}\n"));
        let column = (column + 1).saturating_sub(*text_column).max(1);
        out.push_str(&format!(
            "{} {bar} {text}\n",
            paint.apply(Style::Frame, &number)
        ));
        let before: String = text.chars().take(column - 1).collect();
        let marked: String = text.chars().skip(column - 1).take(*length).collect();
        // A location after the last character has no width of its own.
        let carets = "^".repeat(width(&marked).max(1));
        out.push_str(&format!(
            "{margin} {bar} {}{}\n",
            " ".repeat(width(&before)),
            paint.apply(Style::Error, &carets)
        ));
        for (label, value) in [("expected", &self.expected), ("found", &self.found)] {
            if let Some(value) = value {
                out.push_str(&format!("{margin} = {label}: {value}\n"));
            }
        }
        if let Some(help) = &self.help {
            out.push_str(&format!(
                "{margin} = {}: {help}\n",
                paint.apply(Style::Help, "help")
            ));
        }
    }
}

/// Most findings kept for one input.
const MOST_FINDINGS: usize = 100;

/// Collects findings about some sources.
#[derive(Default)]
pub struct Collector {
    /// The texts.
    pub sources: Sources,
    /// True for the text of a recording, which may be older than today's keys.
    pub recorded: bool,
    /// Values of environment variables, for readers of texts with `${NAME}`.
    pub variables: BTreeMap<String, String>,
    found: Vec<(Span, Diagnostic)>,
}

/// A finding under construction; it is already in the collector.
pub struct Finding<'a>(Option<&'a mut Diagnostic>);

impl Finding<'_> {
    /// Sets the accepted values.
    pub fn expected(mut self, text: impl Into<String>) -> Self {
        if let Some(d) = self.0.as_mut() {
            d.expected = Some(text.into());
        }
        self
    }

    /// Sets the actual value.
    pub fn found(mut self, text: impl Into<String>) -> Self {
        if let Some(d) = self.0.as_mut() {
            d.found = Some(text.into());
        }
        self
    }

    /// Sets the next step.
    pub fn help(mut self, text: impl Into<String>) -> Self {
        if let Some(d) = self.0.as_mut() {
            d.help = Some(text.into());
        }
        self
    }

    /// Sets the next step, if any.
    pub(crate) fn maybe_help(self, text: Option<String>) -> Self {
        match text {
            Some(text) => self.help(text),
            None => self,
        }
    }
}

impl Collector {
    /// A collector without findings.
    pub fn new(sources: Sources) -> Self {
        Self {
            sources,
            recorded: false,
            variables: BTreeMap::new(),
            found: Vec::new(),
        }
    }

    /// Adds a finding at `span` of the key `path`.
    pub fn error(
        &mut self,
        span: Span,
        path: impl Into<String>,
        message: impl Into<String>,
    ) -> Finding<'_> {
        if self.found.len() >= MOST_FINDINGS {
            return Finding(None);
        }
        let diagnostic = Diagnostic {
            message: message.into(),
            path: path.into(),
            location: self.sources.locate(span),
            expected: None,
            found: None,
            help: None,
        };
        self.found.push((span, diagnostic));
        Finding(self.found.last_mut().map(|(_, d)| d))
    }

    /// Moves the findings in source `from` to the same bytes of source `to`.
    pub(crate) fn move_findings(&mut self, from: usize, to: usize) {
        for (span, diagnostic) in &mut self.found {
            if span.source == from {
                span.source = to;
                diagnostic.location = self.sources.locate(*span);
            }
        }
    }

    /// Number of findings.
    #[must_use]
    pub fn count(&self) -> usize {
        self.found.len()
    }

    /// True if there are no findings so far.
    #[must_use]
    pub fn is_clean(&self) -> bool {
        self.found.is_empty()
    }

    /// The findings in the order of the text.
    pub fn finish(mut self) -> Diagnostics {
        self.found
            .sort_by_key(|(span, _)| (span.source, span.start, span.end));
        Diagnostics {
            list: self.found.into_iter().map(|(_, d)| d).collect(),
        }
    }
}

/// The candidate most similar to `word`, if it is close enough to be a typing error.
pub fn closest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    const LONGEST: usize = 64;
    if word.len() > LONGEST {
        return None;
    }
    let flat = |s: &str| s.to_lowercase().replace(['-', ' '], "_");
    let target = flat(word);
    candidates
        .into_iter()
        .map(|c| (strsim::damerau_levenshtein(&target, &flat(c)), c))
        .filter(|(distance, c)| {
            let shorter = c.chars().count().min(target.chars().count());
            *distance < shorter && *distance <= 1.max(shorter / 3)
        })
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, c)| c)
}

/// `did you mean X?` for the most similar candidate.
pub fn did_you_mean<'a>(
    word: &str,
    candidates: impl IntoIterator<Item = &'a str>,
) -> Option<String> {
    closest(word, candidates).map(|c| format!("did you mean `{c}`?"))
}

/// `a`, `b` or `c`.
pub fn one_of<'a>(words: impl IntoIterator<Item = &'a str>) -> String {
    let words: Vec<String> = words.into_iter().map(|w| format!("`{w}`")).collect();
    match words.as_slice() {
        [] => "nothing".to_owned(),
        [only] => only.clone(),
        [first @ .., last] => format!("{} or {last}", first.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn carets_align_with_wide_and_combining_characters() {
        for (text, marked, carets) in [
            ("name: skin", "skin", "      ^^^^"),
            ("皮膚: 一号", "一号", "      ^^^^"),
            ("e\u{301}te\u{301}: 2", "2", "     ^"),
            ("name:", "", "     ^"),
        ] {
            let mut sources = Sources::default();
            let source = sources.add("file", text);
            let start = text.len() - marked.len();
            let mut collector = Collector::new(sources);
            collector.error(Span::new(source, start, text.len()), "", "wrong");
            let shown = collector.finish().render(false);
            let expected = format!("1 | {text}\n  | {carets}\n");
            assert!(shown.contains(&expected), "{shown}");
        }
    }
}

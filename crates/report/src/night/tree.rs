//! Owns the terminal tree of a night: every check with its measurements, and why a check failed and what to do next.

use skinrig_nightly::{Attempt, CheckResult, Measurement, Night, Part, Verdict};
use skinrig_text::{Column, LongWords, Paint, Style, Table, WIDTH, hang, width};

use super::text;
use crate::format::plain;

/// Columns of a verdict.
const VERDICT: usize = 12;
/// Column of titles.
const INDENT: usize = 15;
/// Columns of the name of a device.
const LABEL: usize = 12;

/// Formats a night as a tree.
#[must_use]
pub fn tree(night: &Night, paint: Paint) -> String {
    let mut out = Lines {
        text: String::new(),
        paint,
    };
    out.wrapped(
        0,
        &format!("{} on {}, {}", night.suite, night.rig, night.started),
    );
    for check in &night.checks {
        out.check(check);
    }
    out.text.push('\n');
    let verdict = out.painted(night.verdict, night.verdict.name());
    out.text.push_str(&format!(
        "{verdict}  {} (exit {})\n",
        text::headline(night),
        night.exit as u8
    ));
    out.wrapped(0, &text::tally(night));
    out.wrapped(
        0,
        &format!(
            "took {} of {}, planned {} without repeats",
            text::span(night.took_s),
            text::span(night.budget_s),
            text::span(night.planned_s)
        ),
    );
    if let Some(why) = &night.ended_early {
        out.wrapped(0, &format!("ended early: {why}"));
    }
    if !night.finished && night.ended_early.is_none() {
        out.wrapped(0, "unfinished: still running, or its process died");
    }
    if let Some(note) = &night.lease_note {
        out.wrapped(0, &format!("lease: {note}"));
    }
    out.text
}

/// Formats the line of one check.
#[must_use]
pub fn line(check: &CheckResult, paint: Paint) -> String {
    let lines = Lines {
        text: String::new(),
        paint,
    };
    lines.head(check)
}

struct Lines {
    text: String,
    paint: Paint,
}

impl Lines {
    fn head(&self, check: &CheckResult) -> String {
        let took = match check.attempts.len() {
            0 => String::new(),
            1 => text::span(text::took_s(check)),
            n => format!("{n} attempts, {}", text::span(text::took_s(check))),
        };
        let name = Column::left(VERDICT).cell(check.verdict.name());
        let title = plain(&check.title);
        let gap = 1;
        let room = (WIDTH - INDENT).saturating_sub(width(&took) + gap);
        let row = Table::new([Column::left(room)])
            .gap(gap)
            .row([&title, &took]);
        format!("{}   {row}", self.painted(check.verdict, &name))
    }

    fn check(&mut self, check: &CheckResult) {
        let head = self.head(check);
        self.text.push_str(&head);
        self.text.push('\n');
        if let Some(reason) = &check.skipped {
            self.wrapped(INDENT, reason);
        }
        if let Some(why) = text::why(check) {
            self.wrapped(INDENT, &why);
        }
        if let Some(repeats) = &check.repeats {
            self.wrapped(INDENT, repeats);
        }
        let several = check.attempts.len() > 1;
        for (i, attempt) in check.attempts.iter().enumerate() {
            if several {
                let name = attempt.verdict.name();
                self.wrapped(INDENT, &format!("attempt {}: {name}", i + 1));
            }
            self.attempt(attempt);
        }
    }

    fn attempt(&mut self, attempt: &Attempt) {
        for part in &attempt.parts {
            self.part(part);
        }
        if attempt.verdict.is_good() {
            return;
        }
        let mut last = None;
        for e in &attempt.evidence {
            let what = format!("{}: {}", e.kind.name(), e.what);
            self.labelled(None, &e.subject, &what);
            // Do not repeat a next step for several items of a kind.
            if let Some(next) = e.next.as_ref().filter(|n| last != Some(*n)) {
                self.labelled(None, "next", next);
                last = Some(next);
            }
        }
    }

    fn part(&mut self, part: &Part) {
        let (good, bad): (Vec<&Measurement>, Vec<&Measurement>) = part
            .measurements
            .iter()
            .partition(|m| m.verdict == Verdict::Pass);
        let mut subject = part.subject.as_str();
        for m in bad {
            self.labelled(Some(m.verdict), subject, &text::against(m));
            subject = "";
        }
        if !good.is_empty() {
            let all: Vec<String> = good
                .iter()
                .map(|m| format!("{} {}", m.metric, text::amount(m.value, &m.unit)))
                .collect();
            self.labelled(None, subject, &all.join(", "));
        }
    }

    /// Text with a label, and the verdict before it.
    fn labelled(&mut self, verdict: Option<Verdict>, label: &str, text: &str) {
        let column = Column::right(VERDICT);
        let name = match verdict {
            Some(verdict) => self.painted(verdict, &column.cell(verdict.name())),
            None => column.cell(""),
        };
        let label = Column::left(LABEL).cell(&plain(label));
        let first = format!("{name}   {label} ");
        self.text += &hang(&first, &plain(text), LongWords::Keep);
    }

    fn wrapped(&mut self, indent: usize, text: &str) {
        self.text += &hang(&" ".repeat(indent), &plain(text), LongWords::Keep);
    }

    fn painted(&self, verdict: Verdict, text: &str) -> String {
        let style = match verdict {
            Verdict::Skipped => Style::Dim,
            Verdict::Pass => Style::Good,
            Verdict::Marginal => Style::Warning,
            Verdict::Inconclusive => Style::Undecided,
            Verdict::Fail => Style::Error,
            Verdict::Invalid => Style::Invalid,
        };
        self.paint.apply(style, text)
    }
}

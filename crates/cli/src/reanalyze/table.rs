//! The table at the end of a re-analysis: one row per session.

use std::path::PathBuf;

use serde_json::{Value, json};
use skinrig_analysis::result::Estimate;
use skinrig_report::Summary;
use skinrig_text::{Column, Table, widest};

use super::args::ReanalyzeArgs;
use super::request::{Answered, Refusal, Request};
use crate::terminal::Output;

/// Rows that are shown without `-v`: with the lines around them, 12 lines.
const ROWS: usize = 8;

/// State of a session.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum State {
    /// Not analysed yet.
    Open,
    /// Analysed now.
    Done,
    /// Analysed now, in place of results with other settings, of another version or of another content.
    Replaced,
    /// Its results were there.
    There,
    /// Not analysed.
    Failed,
}

impl State {
    const fn word(self) -> &'static str {
        match self {
            Self::Open => "open",
            Self::Done => "done",
            Self::Replaced => "replaced",
            Self::There => "there",
            Self::Failed => "failed",
        }
    }
}

/// A session in the table.
#[derive(Debug, Clone)]
pub(super) struct Row {
    session: PathBuf,
    variant: String,
    pub state: State,
    replaces: bool,
    summary: Option<Summary>,
    /// Scored RMSE of the official results.
    official_mm: Option<Estimate>,
    pub error: Option<Refusal>,
}

impl Row {
    /// Before its analysis; `summary`: of results that are there.
    pub(super) fn before(request: &Request, summary: Option<Summary>) -> Self {
        Self {
            session: request.session.clone(),
            variant: request.name.clone(),
            state: match summary {
                Some(_) => State::There,
                None => State::Open,
            },
            replaces: summary.is_none() && request.replaces(),
            summary,
            official_mm: request.official_rmse_mm(),
            error: None,
        }
    }

    /// After its analysis. What counts is what is beside the session, as this computer sees it.
    pub(super) fn after(&self, request: &Request, answer: Answered) -> Self {
        let answer = answer.and_then(|()| {
            request.stored().ok_or_else(|| {
                Refusal::machine(format!(
                    "{}: expected results of the variant `{}` beside it, found none\n  next: check that no other program changes them, \
                     then repeat the command",
                    request.session.display(),
                    request.name
                ))
            })
        });
        let (state, summary, error) = match answer {
            Ok(stored) if self.replaces => (State::Replaced, Some(stored.summary), None),
            Ok(stored) => (State::Done, Some(stored.summary), None),
            Err(error) => (State::Failed, None, Some(error)),
        };
        Self {
            state,
            summary,
            error,
            ..self.clone()
        }
    }

    /// True if there are results, and their numbers must not be used.
    pub(super) fn is_invalid(&self) -> bool {
        self.summary.as_ref().is_some_and(|summary| !summary.valid)
    }

    fn rmse_mm(&self) -> Option<Estimate> {
        let summary = self.summary.as_ref().filter(|summary| summary.valid)?;
        Some(summary.rmse_mm)
    }

    /// File name of the session.
    fn name(&self) -> String {
        let name = self.session.file_name();
        let name = name.unwrap_or(self.session.as_os_str());
        name.to_string_lossy().into_owned()
    }

    /// Name of the session and why it failed, on one line.
    pub(super) fn failure(&self) -> Option<String> {
        let error = self.error.as_ref()?;
        let text = error.message.trim_start_matches("error: ");
        let lines: Vec<&str> = text.lines().map(str::trim).collect();
        Some(format!("failed    {}: {}", self.name(), lines.join(" ")))
    }

    /// Order of display: failed, then INVALID, then the others.
    fn rank(&self) -> u8 {
        match (&self.error, self.is_invalid()) {
            (Some(_), _) => 0,
            (None, true) => 1,
            (None, false) => 2,
        }
    }
}

/// Prints the rows, and how many there are of each state.
pub(super) fn print(args: &ReanalyzeArgs, changed: &[String], rows: &[Row], output: Output) {
    if output.json {
        crate::terminal::print_json(&document(args, changed, rows));
        return;
    }
    let mut shown: Vec<&Row> = rows.iter().collect();
    if !output.verbose {
        shown.sort_by_key(|row| row.rank());
        shown.truncate(ROWS);
    }
    let names: Vec<String> = shown.iter().map(|row| row.name()).collect();
    let width = widest(names.iter().map(String::as_str)).max(7);
    let table = Table::new([
        Column::left(width),
        Column::left(8),
        Column::left(24),
        Column::left(0),
    ]);
    outln!(
        "{}",
        table.row([
            "session",
            "state",
            "RMSE before -> after, mm",
            "presses located"
        ])
    );
    let number = |of: Option<Estimate>| {
        let mm = of.and_then(|of| of.value);
        mm.map_or("-".to_owned(), |mm| format!("{mm:.3}"))
    };
    let presses = |of: Option<Estimate>| of.map_or("-".to_owned(), |of| of.n.to_string());
    for (row, name) in shown.iter().zip(&names) {
        let rmse = match row.rank() {
            0 => "-".to_owned(),
            1 => format!("{} -> INVALID", number(row.official_mm)),
            _ => format!("{} -> {}", number(row.official_mm), number(row.rmse_mm())),
        };
        let located = match row.rank() {
            0 | 1 => String::new(),
            _ => format!("{} -> {}", presses(row.official_mm), presses(row.rmse_mm())),
        };
        let cells = [name.as_str(), row.state.word(), &rmse, &located];
        outln!("{}", table.row(cells).trim_end());
    }
    if shown.len() < rows.len() {
        outln!("and {} more: -v shows all", rows.len() - shown.len());
    }
    outln!("changed   {}", changed.join(", "));
    let [done, replaced, there, failed] = counts(rows);
    let invalid = rows.iter().filter(|row| row.is_invalid()).count();
    outln!(
        "sessions  {}: {done} done, {replaced} replaced, {there} already there, {failed} failed, {invalid} INVALID",
        rows.len(),
    );
}

/// Sessions by state: done, replaced, there, failed.
fn counts(rows: &[Row]) -> [usize; 4] {
    [State::Done, State::Replaced, State::There, State::Failed]
        .map(|state| rows.iter().filter(|row| row.state == state).count())
}

fn document(args: &ReanalyzeArgs, changed: &[String], rows: &[Row]) -> Value {
    let row = |row: &Row| {
        json!({
            "session": row.session, "variant": row.variant, "state": row.state.word(),
            "valid": row.summary.as_ref().map(|s| s.valid),
            "official_rmse_mm": row.official_mm.and_then(|of| of.value), "official_presses": row.official_mm.map(|of| of.n),
            "rmse_mm": row.rmse_mm().and_then(|of| of.value), "presses": row.rmse_mm().map(|of| of.n),
            "results_hash": row.summary.as_ref().map(|s| &s.results_hash),
            "error": row.error.as_ref().map(|e| &e.message),
        })
    };
    let [done, replaced, there, failed] = counts(rows);
    json!({
        "settings": args.settings, "changed": changed,
        "counts": {
            "done": done, "replaced": replaced, "there": there, "failed": failed,
            "invalid": rows.iter().filter(|row| row.is_invalid()).count(),
        },
        "sessions": rows.iter().map(row).collect::<Vec<_>>(),
    })
}

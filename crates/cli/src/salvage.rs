//! `skinrig salvage`.

use std::path::Path;

use skinrig_recorder::{
    RecorderError, SESSION_SUFFIX, SalvageReport, SessionReference, copy_session,
    salvage as recover,
};
use skinrig_text::{Column, Table};

use crate::args::SalvageArgs;
use crate::exit::{Exit, Failure, Outcome};
use crate::paths::{beside, file_name, shell_path};
use crate::phase::Phase;

/// Copies the intact part of a damaged session into a new one, and lists what was lost.
///
/// # Errors
/// [`Failure::input`] when the file holds no session data or the new file exists; [`Failure::limit`] when something is lost.
pub(crate) fn salvage(args: &SalvageArgs, json: bool) -> Outcome {
    let to = args
        .out
        .clone()
        .unwrap_or_else(|| beside(&args.session, &format!(".salvaged{SESSION_SUFFIX}")));
    let report = recovered(&args.session, &to).map_err(Failure::session)?;
    if json {
        let mut value = serde_json::to_value(&report).map_err(Failure::internal)?;
        value["whole"] = report.is_whole().into();
        value["salvaged"] = serde_json::json!(to);
        crate::terminal::print_json(&value);
    } else {
        print(&report);
        outln!("\n{}", to.display());
    }
    if report.is_whole() {
        return Ok(Exit::Ok);
    }
    let (word, session, to) = (shell_path(&to), args.session.display(), to.display());
    Err(Failure::limit(match &report.changed[..] {
        [] if report.contradictions > 0 => format!(
            "{session}: values contradict each other although nothing is lost: the file was changed\n  next: restore the session from \
             a copy; use no results of {to}"
        ),
        [] => format!(
            "{session}: some data are lost, as listed\n  next: `skinrig show {}` and `skinrig analyze` work on what was \
             recovered; keep the damaged file",
            word
        ),
        tables => format!(
            "{session}: values in {} are not those that were recorded, and it is unknown which\n  next: restore the session from \
             a copy; use no results of {to}",
            tables.join(", ")
        ),
    }))
}

/// Like `recover`, of a reference by a copy of its object.
fn recovered(session: &Path, to: &Path) -> Result<SalvageReport, RecorderError> {
    if SessionReference::of(session)?.is_none() {
        return recover(session, to);
    }
    let fetched = beside(to, ".fetched");
    // Of an earlier command that was killed.
    let _ = std::fs::remove_file(&fetched);
    let phase = Phase::begin(&format!("fetching {}", file_name(session)));
    let report = copy_session(session, &fetched).and_then(|()| {
        drop(phase);
        recover(&fetched, to)
    });
    let _ = std::fs::remove_file(&fetched);
    report
}

fn print(report: &SalvageReport) {
    let columns = Table::new([Column::left(16), Column::right(9), Column::right(9)]);
    outln!("{}", columns.row(["table", "recovered", "missing"]));
    for table in &report.tables {
        let missing = match table.missing {
            0 => "-".to_owned(),
            n => n.to_string(),
        };
        let rows = table.rows.to_string();
        outln!("{}", columns.row([&table.name, &rows, &missing]));
    }
    for lost in &report.lost {
        let chunks = if lost.first_seq == lost.last_seq {
            format!("chunk {}", lost.first_seq)
        } else {
            format!("chunks {} to {}", lost.first_seq, lost.last_seq)
        };
        let bytes = lost
            .bytes
            .map_or("an unknown number of".to_owned(), |n| n.to_string());
        outln!(
            "lost: {}: {chunks}, {bytes} bytes; kept as a gap in the stream",
            lost.camera
        );
    }
    for finding in &report.findings {
        outln!("found: {finding}");
    }
}

//! `skinrig prototypes`: results of each prototype over all sessions of a folder.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Serialize;
use skinrig_analysis::result::{Estimate, LEAST_LOCATED};
use skinrig_recorder::{SessionState, SessionSummary};
use skinrig_report::Variant;
use skinrig_text::{Blocks, Column, Table, sparkline};

use crate::args::PrototypesArgs;
use crate::exit::{Exit, Failure, Outcome};
use crate::paths::{file_name, shell_path, shell_word};
use crate::sessions::{copies, originals};
use crate::shelf::{Shelf, ShelfResult};

/// Number of sessions in a sparkline, the latest ones.
const SPARKS: usize = 16;

/// A session of a prototype.
#[derive(Debug, Serialize)]
struct Point {
    session: PathBuf,
    started_at: String,
    tags: Vec<String>,
    /// `None` without usable results.
    rmse_mm: Option<Estimate>,
    /// Why there are no usable results.
    without: Option<String>,
    /// Changes of the session's own settings; `None` for the official analysis.
    #[serde(skip_serializing_if = "Option::is_none")]
    variant: Option<Variant>,
    /// Values that were overridden when the session was recorded.
    overrides: Vec<String>,
}

/// Comparable sessions: one prototype, one protocol, one kind of rig, one set of changes of a variant. Of simulated rigs the kind is
/// the name, which says level and faults on purpose.
#[derive(Debug, Serialize)]
struct Series {
    protocol: String,
    rig_kind: String,
    /// The smallest RMSE.
    best: Option<Estimate>,
    /// The newest RMSE.
    last: Option<Estimate>,
    /// Oldest first.
    points: Vec<Point>,
}

/// A prototype.
#[derive(Debug, Serialize)]
struct Prototype {
    prototype: String,
    sessions: usize,
    last_started_at: String,
    series: Vec<Series>,
}

/// A session before it is grouped.
struct Entry {
    prototype: String,
    protocol: String,
    rig_kind: String,
    point: Point,
}

/// Lists the prototypes of a folder.
///
/// # Errors
/// [`Failure::input`] when the folder cannot be read, or has no session of the named prototype.
pub(crate) fn prototypes(args: &PrototypesArgs, json: bool) -> Outcome {
    let mut entries = entries(&args.folder, args.analysis.as_deref())?;
    if let Some(prototype_id) = &args.prototype {
        entries.retain(|e| e.prototype == *prototype_id);
        if entries.is_empty() {
            crate::sessions::of_prototype(&args.folder, prototype_id)?;
        }
    }
    if args.prototype.is_none() {
        name_without(&entries, &args.folder);
    }
    let all = group(entries);
    if json {
        crate::terminal::print_json(&serde_json::to_value(&all).map_err(Failure::internal)?);
    } else if all.is_empty() {
        outln!("no sessions in {}", args.folder.display());
    } else {
        print(&all, args.prototype.is_some());
    }
    Ok(Exit::Ok)
}

/// The prototypes of a folder by their official analyses, as JSON.
///
/// # Errors
/// As [`prototypes`].
pub(crate) fn document(folder: &Path) -> Result<serde_json::Value, Failure> {
    let shelf = Shelf::read(folder)?;
    serde_json::to_value(group(read(&shelf, None))).map_err(Failure::internal)
}

/// The sessions of a folder, oldest first.
fn entries(folder: &Path, analysis: Option<&str>) -> Result<Vec<Entry>, Failure> {
    let shelf = Shelf::told(folder)?;
    for copy in copies(&shelf.sessions) {
        errln!("note: {copy}");
    }
    for session in &shelf.sessions {
        if let SessionState::Broken { reason } = &session.state {
            errln!("note: left out: {reason}");
        }
    }
    Ok(read(&shelf, analysis))
}

/// Says which sessions are in no RMSE, and why the first of them is not.
fn name_without(entries: &[Entry], folder: &Path) {
    let mut without = entries
        .iter()
        .filter_map(|e| Some((e, e.point.without.as_ref()?)));
    let Some((first, why)) = without.next() else {
        return;
    };
    errln!(
        "note: {} of {} sessions are in no RMSE, the first: {}: {why}\n  next: skinrig prototypes {} --prototype {}",
        1 + without.count(),
        entries.len(),
        file_name(&first.point.session),
        shell_path(folder),
        shell_word(&first.prototype)
    );
}

/// RMSE of an analysis, or why it has none that can be used.
fn usable(found: &ShelfResult) -> (Option<Estimate>, Option<String>) {
    let few = found.located_rate.filter(|share| *share < LEAST_LOCATED);
    match (found.rmse_mm.value, few) {
        _ if !found.is_valid => (None, Some("INVALID: do not use".to_owned())),
        (None, _) => (None, Some("no scored press located".to_owned())),
        // As for `compare`: the error of those that are easy to locate is not that of the skin.
        (_, Some(share)) => {
            let percent = 100.0 * share;
            (
                None,
                Some(format!("only {percent:.1} % of presses located")),
            )
        }
        (Some(_), None) => (Some(found.rmse_mm), None),
    }
}

/// Reads the results of sessions, without copies of the same session; keeps their order.
fn read(shelf: &Shelf, analysis: Option<&str>) -> Vec<Entry> {
    let entry = |session: &SessionSummary| {
        let SessionState::Readable {
            session_id,
            started_at,
            prototype,
            protocol_name,
            rig_kind,
            rig_name,
            annotations,
            sealed,
            ..
        } = &session.state
        else {
            return None;
        };
        let found = shelf.result(&session.path, session_id, analysis);
        let (rmse_mm, without) = match &found {
            // As for `compare`: nothing shows that its rows are those that were recorded.
            Ok(_) if !sealed => (None, Some("not sealed".to_owned())),
            Ok(found) => usable(found),
            Err(why) => (None, Some(why.to_string())),
        };
        let (variant, overrides) =
            found.map_or_else(|_| (None, Vec::new()), |f| (f.variant, f.overrides));
        Some(Entry {
            prototype: prototype.clone(),
            protocol: protocol_name.clone(),
            rig_kind: match rig_kind.as_str() {
                "simulated" => rig_name.clone(),
                kind => kind.to_owned(),
            },
            point: Point {
                session: session.path.clone(),
                started_at: started_at.clone(),
                tags: annotations.tags.iter().cloned().collect(),
                rmse_mm,
                without,
                variant,
                overrides,
            },
        })
    };
    originals(&shelf.sessions)
        .into_iter()
        .filter_map(entry)
        .collect()
}

/// Groups sessions by prototype, then by protocol and kind of rig; keeps their order.
fn group(entries: Vec<Entry>) -> Vec<Prototype> {
    type Groups = BTreeMap<(String, String, String), Vec<Point>>;
    let mut all: BTreeMap<String, (usize, String, Groups)> = BTreeMap::new();
    for entry in entries {
        let (count, last, groups) = all.entry(entry.prototype).or_default();
        *count += 1;
        last.clone_from(&entry.point.started_at);
        let changed = entry.point.variant.as_ref().and_then(Variant::changes);
        let key = (entry.protocol, entry.rig_kind, changed.unwrap_or_default());
        groups.entry(key).or_default().push(entry.point);
    }
    let series = |((protocol, rig_kind, _), points): ((String, String, String), Vec<Point>)| {
        let usable = || points.iter().filter_map(|p| p.rmse_mm);
        let value = |e: &Estimate| e.value.unwrap_or(f64::INFINITY);
        Series {
            protocol,
            rig_kind,
            best: usable().min_by(|a, b| value(a).total_cmp(&value(b))),
            last: usable().next_back(),
            points,
        }
    };
    all.into_iter()
        .map(
            |(prototype, (sessions, last_started_at, groups))| Prototype {
                prototype,
                sessions,
                last_started_at,
                series: groups.into_iter().map(series).collect(),
            },
        )
        .collect()
}

fn print(all: &[Prototype], each: bool) {
    let table = Table::new([
        Column::left(18).clipped(),
        Column::left(22).clipped(),
        Column::left(20).clipped(),
        Column::right(8),
        Column::left(16),
        Column::left(27),
        Column::left(27),
    ]);
    outln!(
        "{}",
        table.row([
            "prototype",
            "protocol",
            "rig",
            "sessions",
            "last (UTC)",
            "best RMSE, mm",
            "last RMSE, mm",
            "trend"
        ])
    );
    for prototype in all {
        for (i, series) in prototype.series.iter().enumerate() {
            let name = if i == 0 { &prototype.prototype } else { "" };
            let last = series.points.last().map_or("", |p| p.started_at.as_str());
            let protocol = series.protocol.rsplit('/').next().unwrap_or_default();
            let rmse: Vec<f64> = series
                .points
                .iter()
                .filter_map(|p| p.rmse_mm?.value)
                .collect();
            let row = table.row([
                name,
                protocol,
                &series.rig_kind,
                &series.points.len().to_string(),
                &minute(last),
                &interval(series.best),
                &interval(series.last),
                &spark(&rmse[rmse.len().saturating_sub(SPARKS)..]),
            ]);
            outln!("{row}");
            if each {
                series.points.iter().for_each(print_point);
            } else {
                // Show what was changed for the two numbers of the line.
                let value = |p: &&Point, e: Option<Estimate>| e.is_some() && p.rmse_mm == e;
                let best = series.points.iter().find(|p| value(p, series.best));
                let last = series.points.iter().rev().find(|p| value(p, series.last));
                let same = best.zip(last).is_some_and(|(b, l)| std::ptr::eq(b, l));
                best.iter().for_each(|p| print_changes("  best: ", p));
                last.iter()
                    .filter(|_| !same)
                    .for_each(|p| print_changes("  last: ", p));
            }
        }
    }
}

fn print_point(point: &Point) {
    let name = point.session.file_name().unwrap_or_default();
    let found = match &point.without {
        Some(why) => why.clone(),
        None => interval(point.rmse_mm),
    };
    let tags = match point.tags[..] {
        [] => String::new(),
        _ => format!("  [{}]", point.tags.join(" ")),
    };
    let table = Table::new([Column::left(16), Column::left(27)]).indent(2);
    let file = format!("{}{tags}", name.to_string_lossy());
    outln!("{}", table.row([minute(&point.started_at), found, file]));
    print_changes("    ", point);
}

/// Prints what the analysis changed, and what was overridden when the session was recorded.
fn print_changes(indent: &str, point: &Point) {
    if let Some(variant) = &point.variant {
        outln!("{indent}{variant}");
    }
    if !point.overrides.is_empty() {
        outln!(
            "{indent}recorded with --set {}",
            point.overrides.join(" --set ")
        );
    }
}

/// `2026-11-21 18:00`.
fn minute(rfc3339: &str) -> String {
    rfc3339
        .chars()
        .take(16)
        .collect::<String>()
        .replace('T', " ")
}

/// `2.31 (2.05 to 2.60), n 162`.
fn interval(estimate: Option<Estimate>) -> String {
    match estimate.map(|e| (e.value, e.low, e.high, e.n)) {
        Some((Some(value), Some(low), Some(high), n)) => {
            format!("{value:.2} ({low:.2} to {high:.2}), n {n}")
        }
        Some((Some(value), .., n)) => format!("{value:.2}, n {n}"),
        _ => "-".to_owned(),
    }
}

/// One block per value, scaled between the smallest and the largest.
fn spark(values: &[f64]) -> String {
    let min = values.iter().copied().fold(f64::INFINITY, f64::min);
    let max = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let share = |value: &f64| match max - min {
        span if span > 0.0 => Some((value - min) / span),
        _ => Some(0.5),
    };
    sparkline(values.iter().map(share), Blocks::Unicode)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_rmse_states_its_presses() {
        let estimate = Estimate {
            value: Some(2.345),
            low: Some(2.0),
            high: Some(3.0),
            n: 27,
        };
        assert_eq!(interval(Some(estimate)), "2.35 (2.00 to 3.00), n 27");
        let alone = Estimate {
            low: None,
            ..estimate
        };
        assert_eq!(interval(Some(alone)), "2.35, n 27");
    }

    /// The questions in `crates/catalogue/questions` repeat the least share as text.
    #[test]
    fn questions_have_the_same_least_share() {
        assert_eq!(LEAST_LOCATED.to_string(), "0.5");
    }

    #[test]
    fn a_sparkline_spans_its_values() {
        assert_eq!(spark(&[1.0, 2.0, 3.0]), "▁▅█");
        assert_eq!(spark(&[2.0, 2.0]), "▅▅");
        assert_eq!(spark(&[]), "");
    }
}

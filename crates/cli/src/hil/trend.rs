//! `skinrig hil trend`: metrics that changed over the nights, since when, and the probable cause.

use std::path::{Path, PathBuf};

use glob::{Pattern, PatternError};
use skinrig_hil::history::{self, Filter, HistoryError};
use skinrig_nightly::trend::{Acceptance, Alarm, History, Report, judge};
use skinrig_nightly::{Night, NightExit};
use skinrig_report::trend::{Links, Style, page, terminal};

use super::alarms;
use super::args::HilTrendArgs;
use crate::exit::{Exit, Failure, Outcome};

/// `skinrig hil trend`.
///
/// # Errors
/// [`Failure::input`] if the file is not a history, or lacks the bench or the series; [`Failure::internal`] if a file cannot be
/// written.
pub(crate) fn trend(args: &HilTrendArgs, json: bool) -> Outcome {
    let skipped = match &args.rebuild {
        Some(folder) => super::rebuild::rebuild(&args.history, folder)?,
        None => 0,
    };
    let (history, report) = judge_history(args)?;
    let pattern = args.series.as_deref().unwrap_or("*");
    let series = series(pattern).map_err(|e| {
        Failure::input(format!(
            "--series: expected part of a series name or a pattern with `*`, found `{pattern}`: {e}"
        ))
    })?;
    let shown = |name: &str| series.matches(name);
    if args.series.is_some() && !report.charts.iter().any(|c| shown(&c.series.name)) {
        return Err(Failure::input(format!(
            "--series: expected part of a series name or a pattern with `*`, found `{pattern}`, which matches none of {} series\n  \
             next: omit --series to list all",
            report.charts.len()
        )));
    }
    let alarm_links = alarms::keep(&args.history, &report);
    if let Some(file) = &args.html {
        let links: Vec<Links> = alarm_links.iter().map(|k| k.links(file.parent())).collect();
        let html = page(&report, &links, &history.accepted);
        crate::results::write_named(file, html.as_bytes())?;
    }
    if json {
        let mut value = serde_json::to_value(&report).map_err(Failure::internal)?;
        value["accepted"] = serde_json::to_value(&history.accepted).map_err(Failure::internal)?;
        let sessions: Vec<_> = alarm_links
            .iter()
            .map(|k| k.session.as_ref().ok())
            .collect();
        value["sessions"] = serde_json::to_value(sessions).map_err(Failure::internal)?;
        crate::terminal::print_json(&value);
    } else {
        let links: Vec<Links> = alarm_links.iter().map(|k| k.links(None)).collect();
        let style = Style {
            unicode: !args.ascii && is_unicode(),
            color: crate::terminal::is_coloured(&std::io::stdout()),
            nights: args.nights,
        };
        let text = terminal(&report, &links, shown, style);
        outln!("{}", text.trim_end());
        if let Some(file) = &args.html {
            outln!("\n{}", file.display());
        }
    }
    let is_steady = report.alarms.is_empty() && report.unmeasured().next().is_none();
    if skipped > 0 {
        errln!(
            "warning: the trends leave out {skipped} nights that could not be read, named above"
        );
    }
    Ok(Exit::Night(match (is_steady, skipped) {
        (true, 0) => NightExit::Pass,
        (true, _) => NightExit::Infrastructure,
        (false, _) => NightExit::Fail,
    }))
}

fn judge_history(args: &HilTrendArgs) -> Result<(History, Report), Failure> {
    let filter = Filter {
        rig: args.rig.clone(),
        suite: args.suite.clone(),
        ..Filter::default()
    };
    let history = history::load(&args.history, &filter).map_err(Failure::input)?;
    let report = judge(&history);
    name_others(args)?;
    Ok((history, report))
}

/// Says which nights are judged, and which are not, if several suites and benches match the arguments.
fn name_others(args: &HilTrendArgs) -> Result<(), Failure> {
    let suites = history::suites(&args.history).map_err(Failure::input)?;
    let wanted = |asked: &Option<String>, name: &String| asked.as_ref().is_none_or(|a| a == name);
    let matching = suites
        .iter()
        .filter(|s| wanted(&args.rig, &s.rig) && wanted(&args.suite, &s.suite));
    let each: Vec<String> = matching
        .map(|s| format!("{} on {} ({} nights)", s.suite, s.rig, s.nights))
        .collect();
    if let Some((judged, others @ [_, ..])) = each.split_first() {
        errln!(
            "note: judged {judged}; not judged: {}\n  next: --rig NAME, --suite NAME",
            others.join(", ")
        );
    }
    Ok(())
}

/// Pattern for series names: with `*` it matches the whole name, otherwise any part of it.
fn series(pattern: &str) -> Result<Pattern, PatternError> {
    if pattern.contains('*') {
        Pattern::new(pattern)
    } else {
        Pattern::new(&format!("*{}*", Pattern::escape(pattern)))
    }
}

/// Whether the locale of the terminal is UTF-8.
fn is_unicode() -> bool {
    let set = |key| std::env::var(key).ok().filter(|v| !v.is_empty());
    let locale = ["LC_ALL", "LC_CTYPE", "LANG"].into_iter().find_map(set);
    locale.is_some_and(|l| l.to_lowercase().replace('-', "").contains("utf8"))
}

/// Trends up to a night.
pub(super) struct NightTrends {
    pub report: Report,
    /// Links by alarm, relative to the night's folder.
    pub links: Vec<Links>,
    /// Number of alarms that this night raised.
    pub raised: usize,
    /// Golden session that the first of them keeps.
    pub raised_session: Option<PathBuf>,
    accepted: Vec<Acceptance>,
}

impl NightTrends {
    /// Page of all charts, for the night's folder.
    pub(super) fn page(&self) -> String {
        page(&self.report, &self.links, &self.accepted)
    }
}

/// Adds a night, whose files are in `home`, to the history at `path`, and judges all nights up to it.
pub(super) fn after(path: &Path, night: &Night, home: &Path) -> Result<NightTrends, HistoryError> {
    history::append_newest(path, night, home)?;
    let filter = Filter {
        rig: Some(night.rig.clone()),
        suite: Some(night.suite.clone()),
        rig_kind: Some(night.rig_kind.clone()),
    };
    let history = history::load(path, &filter)?;
    let report = judge(&history);
    let alarm_links = alarms::keep(path, &report);
    let is_of_night = |alarm: &Alarm| report.nights[alarm.raised].id == night.id;
    let raised = report.alarms.iter().zip(&alarm_links);
    let raised: Vec<_> = raised.filter(|(alarm, _)| is_of_night(alarm)).collect();
    let sessions = raised.iter().map(|(_, kept)| kept.session.as_ref().ok());
    Ok(NightTrends {
        raised: raised.len(),
        raised_session: sessions.flatten().next().cloned(),
        report,
        links: alarm_links.iter().map(|k| k.links(Some(home))).collect(),
        accepted: history.accepted,
    })
}

#[cfg(test)]
mod tests {
    use super::series;

    #[test]
    fn patterns_are_parts_or_wholes() {
        for (pattern, name, expected) in [
            ("*", "a/b/c", true),
            ("b/", "a/b/c", true),
            ("x", "a/b/c", false),
            ("a*c", "a/b/c", true),
            ("a*b", "a/b/c", false),
            ("*b*", "a/b/c", true),
            ("golden/*/located", "golden/skin/located", true),
            ("b*", "a/b/c", false),
            ("a*bb*b", "a/bb", false),
            ("[x]", "a[x]", true),
            ("[x]", "ax", false),
        ] {
            let pattern = series(pattern).unwrap();
            assert_eq!(pattern.matches(name), expected, "{pattern} {name}");
        }
    }
}

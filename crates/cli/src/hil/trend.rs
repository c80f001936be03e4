//! `skinrig hil trend`: metrics that changed over the nights, since when, and the probable cause.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use glob::{Pattern, PatternError};
use skinrig_catalogue::{Access, Address, Catalogue};
use skinrig_hil::history::{self, HISTORY_FILE, HistoryError};
use skinrig_nightly::trend::{Acceptance, Alarm, Filter, History, Report, SuiteNights, judge};
use skinrig_nightly::{Night, NightExit};
use skinrig_report::trend::{Links, Style, page, terminal};

use super::alarms;
use super::args::HilTrendArgs;
use crate::catalogue::{WAIT, failure};
use crate::exit::{Exit, Failure, Outcome};

/// `skinrig hil trend`.
///
/// # Errors
/// [`Failure::input`] if the file is not a history or a catalogue, or lacks the bench or the series; [`Failure::internal`] if a file
/// cannot be written.
pub(crate) fn trend(args: &HilTrendArgs, json: bool) -> Outcome {
    let source = Source::of(args);
    let skipped = match (&source, &args.rebuild) {
        (Source::History(file), Some(folder)) => super::rebuild::rebuild(file, folder)?,
        _ => 0,
    };
    let Nights { history, outdated } = nights(args, &source)?;
    if let (Source::Catalogue(address), None) = (&source, &args.catalogue) {
        errln!("note: judged the nights of {address}, which SKINRIG_CATALOGUE names");
    }
    let report = judge(&history);
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
    let alarm_links = match &source {
        Source::History(file) => alarms::keep(file, &report),
        Source::Catalogue(_) => alarms::find(&report),
    };
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
    if outdated > 0 {
        errln!(
            "warning: the trends leave out {outdated} nights that an earlier version registered\n  \
             next: `skinrig catalogue register --nights FOLDER` with the folder of these nights"
        );
    }
    Ok(Exit::Night(match (is_steady, skipped + outdated) {
        (true, 0) => NightExit::Pass,
        (true, _) => NightExit::Infrastructure,
        (false, _) => NightExit::Fail,
    }))
}

/// Where the nights are.
enum Source {
    /// A history file.
    History(PathBuf),
    /// A catalogue.
    Catalogue(Address),
}

/// Nights of a suite on a bench.
struct Nights {
    history: History,
    /// Number of nights that are left out because an earlier version registered them.
    outdated: usize,
}

impl Source {
    /// What the arguments name, else the catalogue that the environment names, else the usual history.
    fn of(args: &HilTrendArgs) -> Self {
        let of_environment = || std::env::var_os("SKINRIG_CATALOGUE").filter(|a| !a.is_empty());
        let address = |text: OsString| Self::Catalogue(Address::parse(&text));
        match (&args.catalogue, &args.history, &args.rebuild) {
            (Some(named), _, _) => address(named.clone()),
            (None, Some(file), _) => Self::History(file.clone()),
            (None, None, None) => of_environment().map_or_else(Self::usual, address),
            (None, None, Some(_)) => Self::usual(),
        }
    }

    fn usual() -> Self {
        Self::History(Path::new("nights").join(HISTORY_FILE))
    }
}

/// The nights to judge; says which these are, and which not, if several suites and benches match the arguments.
fn nights(args: &HilTrendArgs, source: &Source) -> Result<Nights, Failure> {
    let filter = Filter {
        rig: args.rig.clone(),
        suite: args.suite.clone(),
        ..Filter::default()
    };
    let (nights, suites) = match source {
        Source::History(file) => {
            let history = history::load(file, &filter).map_err(Failure::input)?;
            let suites = history::suites(file).map_err(Failure::input)?;
            let outdated = 0;
            (Nights { history, outdated }, suites)
        }
        Source::Catalogue(address) => {
            let mut catalogue =
                Catalogue::open(address.clone(), Access::Read, WAIT).map_err(failure)?;
            let found = catalogue.nights(&filter).map_err(failure)?;
            let suites = catalogue.suites().map_err(failure)?;
            catalogue.close().map_err(failure)?;
            let (history, outdated) = (found.history, found.outdated);
            (Nights { history, outdated }, suites)
        }
    };
    name_others(&filter, &suites);
    Ok(nights)
}

fn name_others(filter: &Filter, suites: &[SuiteNights]) {
    let matching = suites.iter().filter(|suite| filter.matches(suite));
    let each: Vec<String> = matching
        .map(|suite| format!("{suite} ({} nights)", suite.nights))
        .collect();
    if let Some((judged, others @ [_, ..])) = each.split_first() {
        errln!(
            "note: judged {judged}; not judged: {}\n  next: --rig NAME, --suite NAME",
            others.join(", ")
        );
    }
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

//! Owns the presentation of trends: charts for the terminal, page with alarms first.

mod alarm;
mod figure;
mod page;
mod terminal;

use skinrig_nightly::trend::report::{day, figure as number, moved_by, name};
use skinrig_nightly::trend::{Alarm, Chart, Report};

pub(crate) use alarm::told;
pub use page::page;
pub use terminal::{Style, sentence, terminal};

/// How an alarm is told, on every page that does, and its style.
pub(crate) const ALARM_TEMPLATE: &str = include_str!("../../assets/trend/alarm.html");
pub(crate) const ALARM_CSS: &str = include_str!("../../assets/trend/alarm.css");

/// Where an alarm's files are, as links of the page that is written.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Links {
    /// The page of the night that raised it.
    pub night: Option<String>,
    /// The session that shows it.
    pub session: Option<String>,
    /// The commands that replay and recheck it.
    pub commands: Vec<String>,
    /// Why there is no session, when there is none.
    pub missing: Option<String>,
}

/// When an alarm began, for people.
pub(crate) fn since(report: &Report, alarm: &Alarm) -> String {
    let [from, to] = alarm.since.map(|n| &report.nights[n]);
    if alarm.since[0] == alarm.since[1] {
        format!("since the night of {}", day(from))
    } else {
        format!("since a night between {} and {}", day(from), day(to))
    }
}

/// What moved it, in a line.
fn cause(alarm: &Alarm) -> String {
    let a = &alarm.attribution;
    match a.cause {
        None => format!("not told by the rules: {}", a.reason),
        Some(cause) => format!("{}: {}", name(Some(cause)), a.reason),
    }
}

/// One word for the state of a series.
fn state(chart: &Chart) -> &'static str {
    match (chart.off(), chart.reference) {
        (Some(_), _) => "moved",
        (None, None) => "learning",
        (None, Some(_)) => "steady",
    }
}

/// A value with its unit.
fn with_unit(value: f64, unit: &str) -> String {
    if unit.is_empty() {
        number(value)
    } else {
        format!("{} {unit}", number(value))
    }
}

/// By how much a series that is off moved.
fn moved(chart: &Chart) -> String {
    let off = chart.off();
    off.map(|e| moved_by(e, &chart.series.unit))
        .unwrap_or_default()
}

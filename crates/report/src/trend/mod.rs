//! Owns the presentation of trends: terminal charts, and page with alarms first.

mod alarm;
mod figure;
mod name;
mod page;
mod terminal;

use skinrig_nightly::trend::report::{cause_name, day, format_change, format_number as number};
use skinrig_nightly::trend::{Alarm, Chart, Excursion, Report, SeriesState};

pub(crate) use alarm::alarms;
pub(crate) use name::with_names;
pub use page::page;
pub use terminal::{Style, sentence, terminal};

/// Style of an alarm on all pages.
pub(crate) const ALARM_CSS: &str = include_str!("../../assets/trend/alarm.css");

/// Files of an alarm, as links relative to the written page.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Links {
    /// Page of the night that raised the alarm.
    pub night: Option<String>,
    /// Session that shows the drift.
    pub session: Option<String>,
    /// Commands that replay and recheck the session.
    pub commands: Vec<String>,
    /// Why there is no session.
    pub missing: Option<String>,
}

/// Start of an alarm.
pub(crate) fn since(report: &Report, alarm: &Alarm) -> String {
    let [from, to] = alarm.since.map(|n| &report.nights[n]);
    if alarm.since[0] == alarm.since[1] {
        format!("since the night of {}", day(from))
    } else {
        format!("since a night between {} and {}", day(from), day(to))
    }
}

/// Cause of an alarm, in one line.
fn cause(alarm: &Alarm) -> String {
    let a = &alarm.attribution;
    match a.cause {
        None => format!("unknown: {}", a.reason),
        Some(cause) => format!("{}: {}", cause_name(Some(cause)), a.reason),
    }
}

/// State of a series, in a word or two.
const fn state(chart: &Chart) -> &'static str {
    match chart.state {
        SeriesState::Moved => "moved",
        SeriesState::Learning => "learning",
        SeriesState::NotMeasured => "not measured",
        SeriesState::Dropped => "dropped",
        SeriesState::Steady => "steady",
    }
}

/// State of a series, with the number of nights that it has not been measured.
fn state_in_words(chart: &Chart) -> String {
    match chart.state {
        SeriesState::NotMeasured => {
            format!("{} for {} nights", state(chart), chart.unmeasured_nights)
        }
        _ => state(chart).to_owned(),
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

/// Size of the drift that an alarm is about, also of one that has ended.
fn moved_by(chart: &Chart, alarm: &Alarm) -> String {
    let [first, last] = alarm.since;
    let is_of_alarm = |e: &&Excursion| e.change.nights[0] <= first && e.change.nights[1] >= last;
    let found = chart.excursions.iter().rev().find(is_of_alarm);
    let size = found.map(|e| format_change(e, &chart.series.unit));
    let ended = found.is_some_and(|e| e.ended.is_some());
    size.unwrap_or_default() + if ended { ", ended" } else { "" }
}

/// Size of the drift.
fn moved(chart: &Chart) -> String {
    let off = chart.open_excursion();
    off.map(|e| format_change(e, &chart.series.unit))
        .unwrap_or_default()
}

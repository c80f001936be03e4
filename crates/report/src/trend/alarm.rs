//! Owns how an alarm is told on a page: that of the trends, and that of a night.

use serde::Serialize;
use skinrig_nightly::Cause;
use skinrig_nightly::trend::{Alarm, Report};

use super::{Links, cause, moved, since};

/// An alarm as the macro in `assets/trend/alarm.html` takes it.
#[derive(Debug, Serialize)]
pub(crate) struct Told {
    pub id: String,
    pub title: String,
    /// `warn` or `bad`.
    pub tone: &'static str,
    pub cause: String,
    pub changed: Vec<String>,
    pub night: Option<String>,
    pub session: Option<String>,
    pub commands: Vec<String>,
    pub missing: Option<String>,
    pub series: Vec<Moved>,
}

/// A series of an alarm.
#[derive(Debug, Serialize)]
pub(crate) struct Moved {
    pub name: String,
    pub by: String,
    /// Which of the report's charts.
    #[serde(skip)]
    pub chart: usize,
}

/// The alarms of `report`, with what `links` has of each.
pub(crate) fn told(report: &Report, links: &[Links]) -> Vec<Told> {
    let none = Links::default();
    let links = links.iter().chain(std::iter::repeat(&none));
    let alarms = report.alarms.iter().zip(links);
    alarms.map(|(alarm, l)| one(report, alarm, l)).collect()
}

fn one(report: &Report, alarm: &Alarm, links: &Links) -> Told {
    let series = |at: &usize| Moved {
        name: report.charts[*at].series.name.clone(),
        by: moved(&report.charts[*at]),
        chart: *at,
    };
    Told {
        id: alarm.id.clone(),
        title: format!(
            "{} series moved, {}",
            alarm.charts.len(),
            since(report, alarm)
        ),
        tone: tone(alarm.attribution.cause),
        cause: cause(alarm),
        changed: alarm.attribution.changed.clone(),
        night: links.night.clone(),
        session: links.session.clone(),
        commands: links.commands.clone(),
        missing: links.missing.clone(),
        series: alarm.charts.iter().map(series).collect(),
    }
}

/// A class for the colour of a cause.
const fn tone(cause: Option<Cause>) -> &'static str {
    match cause {
        Some(Cause::Infrastructure) => "warn",
        _ => "bad",
    }
}

//! Owns the presentation of an alarm on a page, for trends and nights.

use serde::Serialize;
use skinrig_nightly::Cause;
use skinrig_nightly::trend::{Alarm, Report};

use super::name::{series_name, with_names};
use super::{Links, cause, moved, since};

/// An alarm for the macro in `assets/trend/alarm.html`.
#[derive(Debug, Serialize)]
pub(crate) struct AlarmCard {
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
    pub series: Vec<DriftedSeries>,
}

/// A series of an alarm.
#[derive(Debug, Serialize)]
pub(crate) struct DriftedSeries {
    pub name: String,
    pub by: String,
    /// Index of its chart in the report.
    #[serde(skip)]
    pub chart: usize,
}

/// Presents the alarms of `report`, with their links.
pub(crate) fn alarm_cards(report: &Report, links: &[Links]) -> Vec<AlarmCard> {
    let none = Links::default();
    let links = links.iter().chain(std::iter::repeat(&none));
    let alarms = report.alarms.iter().zip(links);
    alarms
        .map(|(alarm, l)| alarm_card(report, alarm, l))
        .collect()
}

fn alarm_card(report: &Report, alarm: &Alarm, links: &Links) -> AlarmCard {
    let series = |at: &usize| DriftedSeries {
        name: series_name(&report.charts[*at].series.name),
        by: moved(&report.charts[*at]),
        chart: *at,
    };
    AlarmCard {
        id: alarm.id.clone(),
        title: format!(
            "{} series moved, {}",
            alarm.charts.len(),
            since(report, alarm)
        ),
        tone: tone(alarm.attribution.cause),
        cause: with_names(&cause(alarm), report),
        changed: alarm.attribution.changed.clone(),
        night: links.night.clone(),
        session: links.session.clone(),
        commands: links.commands.clone(),
        missing: links.missing.clone(),
        series: alarm.charts.iter().map(series).collect(),
    }
}

/// CSS class for the colour of a cause.
const fn tone(cause: Option<Cause>) -> &'static str {
    match cause {
        Some(Cause::Infrastructure) => "warn",
        _ => "bad",
    }
}

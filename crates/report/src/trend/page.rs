//! Owns the page of the trends: inputs of its template.

use minijinja::value::Serde;
use minijinja::{Value, context};
use serde::Serialize;
use skinrig_nightly::trend::report::{day, format_number as number};
use skinrig_nightly::trend::{Acceptance, Alarm, Chart, Report};

use super::alarm::{self, AlarmCard};
use super::name::{series_name, with_names};
use super::{ALARM_CSS, ALARM_TEMPLATE, Links, cause, figure, moved, state, with_unit};
use crate::error::ReportError;
use crate::frame::Frame;
use crate::svg::FIGURE_CSS;

const TEMPLATE: &str = include_str!("../../assets/trend/page.html");
const CSS: &str = include_str!("../../assets/trend/page.css");

/// An alarm with its charts.
#[derive(Serialize)]
struct AlarmSection {
    card: AlarmCard,
    charts: Vec<ChartCard>,
}

/// Chart of a drifted series.
#[derive(Serialize)]
struct ChartCard {
    name: String,
    by: String,
    svg: String,
}

/// A series in the table.
#[derive(Serialize)]
struct Row {
    name: String,
    /// Identifier, for commands.
    id: String,
    svg: String,
    reference: String,
    last: String,
    state: &'static str,
    by: String,
}

/// A past alarm.
#[derive(Serialize)]
struct PastAlarm {
    id: String,
    series: String,
    cause: String,
    until: String,
}

/// A self-contained page: alarms first, then every series. `links`: one per alarm. `accepted`: changes accepted by an
/// operator.
///
/// # Errors
/// [`ReportError`] when rendering fails; no known input causes this.
pub fn page(
    report: &Report,
    links: &[Links],
    accepted: &[Acceptance],
) -> Result<String, ReportError> {
    let frame = Frame {
        templates: &[("trends.html", TEMPLATE), ("alarm.html", ALARM_TEMPLATE)],
        styles: &[FIGURE_CSS, ALARM_CSS, CSS],
        script: "",
    };
    let cards = alarm::alarm_cards(report, links).into_iter();
    let alarms: Vec<AlarmSection> = cards.map(|card| alarm_section(report, card)).collect();
    let rows = report.charts.iter().map(|c| row(report, c));
    let (learning, rows): (Vec<Row>, Vec<Row>) = rows.partition(|r| r.state == "learning");
    let past: Vec<PastAlarm> = report.past.iter().map(|a| past_alarm(report, a)).collect();
    let (first, last) = (report.nights.first(), report.nights.last());
    frame.render(context! {
        headline => with_names(&report.headline, report),
        badge => match alarms.len() {
            0 => "no alarm".to_owned(),
            1 => "1 alarm".to_owned(),
            n => format!("{n} alarms"),
        },
        suite => last.map(|n| n.suite.clone()),
        rig => last.map(|n| n.rig.clone()),
        rig_kind => last.map(|n| n.rig_kind.clone()),
        nights => match report.nights.len() {
            0 => None,
            1 => Some("1 night".to_owned()),
            n => Some(format!("{n} nights")),
        },
        first => first.map(day),
        last => last.map(day),
        alarms => Value::from(Serde(alarms)),
        rows => Value::from(Serde(rows)),
        learning => Value::from(Serde(learning)),
        contents => [("series", "All series")],
        past => Value::from(Serde(past)),
        accepted => accepted.iter().map(|a| context! {
            series => a.series.as_deref().map(series_name), ..Value::from(Serde(a))
        }).collect::<Vec<_>>(),
    })
}

fn alarm_section(report: &Report, card: AlarmCard) -> AlarmSection {
    let charts = card.series.iter().map(|s| ChartCard {
        name: s.name.clone(),
        by: s.by.clone(),
        svg: figure::large(report, &report.charts[s.chart]),
    });
    AlarmSection {
        charts: charts.collect(),
        card,
    }
}

fn row(report: &Report, chart: &Chart) -> Row {
    let unit = &chart.series.unit;
    let reference = chart.reference.map(|r| {
        let spread = with_unit(r.above.max(r.below), unit);
        format!("{} ± {spread}", number(r.centre))
    });
    let last = chart.nights.last();
    Row {
        name: series_name(&chart.series.name),
        id: chart.series.name.clone(),
        svg: figure::small(report, chart),
        reference: reference.unwrap_or_else(|| match chart.nights.len() {
            1 => "1 night so far".to_owned(),
            n => format!("{n} nights so far"),
        }),
        last: last.map_or_else(|| "-".to_owned(), |n| with_unit(n.value, unit)),
        state: state(chart),
        by: moved(chart),
    }
}

fn past_alarm(report: &Report, alarm: &Alarm) -> PastAlarm {
    let series = alarm
        .charts
        .iter()
        .map(|c| series_name(&report.charts[*c].series.name));
    let until = alarm.ended.map(|n| day(&report.nights[n]).to_owned());
    PastAlarm {
        id: alarm.id.clone(),
        series: series.collect::<Vec<_>>().join(", "),
        cause: with_names(&cause(alarm), report),
        until: until.unwrap_or_default(),
    }
}

//! Owns the page of the trends: what its template receives.

use minijinja::value::Serde;
use minijinja::{Value, context};
use serde::Serialize;
use skinrig_nightly::trend::report::{day, figure as number};
use skinrig_nightly::trend::{Acceptance, Alarm, Chart, Report};

use super::alarm::{self, Told};
use super::{ALARM_CSS, ALARM_TEMPLATE, Links, cause, figure, moved, state, with_unit};
use crate::error::ReportError;
use crate::frame::Frame;
use crate::svg::FIGURE_CSS;

const TEMPLATE: &str = include_str!("../../assets/trend/page.html");
const CSS: &str = include_str!("../../assets/trend/page.css");

/// An alarm with its charts.
#[derive(Serialize)]
struct Raised {
    told: Told,
    charts: Vec<Drawn>,
}

/// The chart of a series that moved.
#[derive(Serialize)]
struct Drawn {
    name: String,
    by: String,
    svg: String,
}

/// A series in the table.
#[derive(Serialize)]
struct Row {
    name: String,
    svg: String,
    reference: String,
    last: String,
    state: &'static str,
    by: String,
}

/// An alarm that is over.
#[derive(Serialize)]
struct Past {
    id: String,
    series: String,
    cause: String,
    until: String,
}

/// The page: alarms first, then every series; needs no network and no other file. `links`: one per alarm. `accepted`: what
/// somebody took as it is.
///
/// # Errors
/// [`ReportError`] when the template cannot be written; no input is known to cause it.
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
    let told = alarm::told(report, links).into_iter();
    let alarms: Vec<Raised> = told.map(|told| raised(report, told)).collect();
    let rows: Vec<Row> = report.charts.iter().map(|c| row(report, c)).collect();
    let past: Vec<Past> = report.past.iter().map(|a| past(report, a)).collect();
    let (first, last) = (report.nights.first(), report.nights.last());
    frame.render(context! {
        headline => report.headline.clone(),
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
        past => Value::from(Serde(past)),
        accepted => Value::from(Serde(accepted)),
    })
}

fn raised(report: &Report, told: Told) -> Raised {
    let charts = told.series.iter().map(|s| Drawn {
        name: s.name.clone(),
        by: s.by.clone(),
        svg: figure::large(report, &report.charts[s.chart]),
    });
    Raised {
        charts: charts.collect(),
        told,
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
        name: chart.series.name.clone(),
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

fn past(report: &Report, alarm: &Alarm) -> Past {
    let series = alarm.charts.iter().map(|c| &*report.charts[*c].series.name);
    let until = alarm.ended.map(|n| day(&report.nights[n]).to_owned());
    Past {
        id: alarm.id.clone(),
        series: series.collect::<Vec<_>>().join(", "),
        cause: cause(alarm),
        until: until.unwrap_or_default(),
    }
}

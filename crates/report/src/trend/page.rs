//! Owns the page of the trends: alarms first, then every series.

use skinrig_nightly::trend::report::{day, format_number as number};
use skinrig_nightly::trend::{Acceptance, Alarm, Chart, Report, SeriesState};

use super::alarm::alarms;
use super::name::{series_name, with_names};
use super::{ALARM_CSS, Links, cause, figure, moved, state, state_in_words, with_unit};
use crate::document::{Banner, Block, Document, Group, Row, Section, Table, Text, soft};

const CSS: &str = include_str!("../../assets/trend/page.css");

/// A self-contained page: alarms first, then every series. `links`: one per alarm. `accepted`: changes accepted by an
/// operator.
#[must_use]
pub fn page(report: &Report, links: &[Links], accepted: &[Acceptance]) -> String {
    let last = report.nights.last();
    let subject = last.map_or_else(String::new, |n| format!("{} on {}", n.suite, n.rig));
    let badge = match report.alarms.len() {
        0 => "no alarm".to_owned(),
        1 => "1 alarm".to_owned(),
        n => format!("{n} alarms"),
    };
    let unmeasured = report.unmeasured().count();
    let (tone, head) = match report.alarms.len() {
        0 if unmeasured > 0 => ("warn", String::new()),
        0 => ("ok", String::new()),
        _ => ("bad", format!("{badge} · ")),
    };
    let extent = report.nights.first().zip(last).map(|(first, last)| {
        let nights = counted(report.nights.len(), "night");
        format!("{subject}, {nights} from {} to {}", day(first), day(last))
    });
    let drifted = alarms(report, links).into_iter().map(|alarm| {
        let charts = alarm.charts.into_iter().flat_map(|(chart, name)| {
            let drawing = figure::large(report, chart);
            [Block::Heading("h3", name), Block::Markup(drawing)]
        });
        Section::new(&*alarm.id, alarm.title)
            .unlisted()
            .class("card alarm")
            .test_id("alarm")
            .with_all(alarm.blocks)
            .with_all(charts)
    });
    Document {
        title: format!("{head}{subject} · skinrig trends"),
        brand: "skinrig trends",
        heading: with_names(&report.headline, report),
        heading_id: "headline",
        subheads: extent.map(Text::from).into_iter().collect(),
        badges: vec![Text::new().named("alarms", &format!("badge {tone}"), badge)],
        banners: last
            .filter(|n| n.rig_kind == "emulated")
            .map(|_| Banner::stand_in("emulated"))
            .into_iter()
            .collect(),
        skip: ("#series", "Skip to all series"),
        sections: drifted
            .chain([series(report)])
            .chain(past(report))
            .chain(changes(accepted))
            .collect(),
        about: format!("Trends of {subject}."),
        styles: vec![ALARM_CSS, CSS],
        ..Document::default()
    }
    .html()
}

fn counted(n: usize, what: &str) -> String {
    format!("{n} {what}{}", if n == 1 { "" } else { "s" })
}

/// Tables of the series: those with a reference, and on request the others.
fn series(report: &Report) -> Section {
    let is_learning = |chart: &&Chart| chart.state == SeriesState::Learning;
    let (learning, known): (Vec<&Chart>, Vec<&Chart>) = report.charts.iter().partition(is_learning);
    let card = |card: Group, charts: &[&Chart]| {
        (!charts.is_empty()).then(|| card.with(table(report, charts)))
    };
    let learn = if learning.len() == 1 {
        "learns"
    } else {
        "learn"
    };
    let summary = format!("{} series still {learn} the reference", learning.len());
    let folded = Group::folded(summary).class("card").test_id("learning");
    Section::new("series", "All series")
        .with_all(card(Group::card().test_id("series"), &known))
        .with_all(card(folded, &learning))
        .with(soft(
            "Band: expected range of a night, from the reference nights. An alarm needs three nights in a row beyond the \
             band on one side, or nine with a smaller shift; a single outlier never raises one. Dashed: the first night \
             after the change.",
        ))
}

fn table(report: &Report, charts: &[&Chart]) -> Table {
    let row = |chart: &&Chart| {
        let unit = &chart.series.unit;
        let reference = chart.reference.map(|r| {
            let spread = with_unit(r.above.max(r.below), unit);
            format!("{} ± {spread}", number(r.centre))
        });
        let so_far = || format!("{} so far", counted(chart.nights.len(), "night"));
        let last = chart.nights.last();
        let state = state(chart);
        Row::new([
            series_name(&chart.series.name).into(),
            Text::new().drawing(figure::small(report, chart)),
            reference.unwrap_or_else(so_far).into(),
            last.map_or_else(|| "-".to_owned(), |n| with_unit(n.value, unit))
                .into(),
            Text::new().span(
                state.replace(' ', "-"),
                format!("{} {}", state_in_words(chart), moved(chart)),
            ),
        ])
        .attribute("title", &chart.series.name)
    };
    let columns = ["Series", "Nights", "#Reference", "#Last", "State"];
    Table::new(
        "all-series",
        "Series with their reference and last value",
        &columns,
    )
    .class("trends")
    .with(charts.iter().map(row))
}

fn past(report: &Report) -> Option<Section> {
    let row = |a: &Alarm| {
        let names = a
            .charts
            .iter()
            .map(|c| series_name(&report.charts[*c].series.name));
        let until = a.ended.map_or("", |n| day(&report.nights[n]));
        Row::new([
            a.id.clone(),
            names.collect::<Vec<_>>().join(", "),
            with_names(&cause(a), report),
            until.to_owned(),
        ])
    };
    let columns = ["Alarm", "Series", "Cause", "Until"];
    let table = Table::new("past", "Earlier alarms", &columns).class("past");
    listed("past", table, report.past.iter().map(row).collect())
}

fn changes(accepted: &[Acceptance]) -> Option<Section> {
    let row = |a: &Acceptance| {
        let series = a.series.as_deref().map(series_name);
        Row::new([
            a.night.clone(),
            series.unwrap_or_else(|| "all series".to_owned()),
            a.reason.clone(),
            format!("{}, {}", a.by, a.at),
        ])
    };
    let columns = ["From night", "Series", "Reason", "Accepted by"];
    let table = Table::new("accepted", "Accepted changes", &columns).class("accepted");
    listed(
        "accepted-changes",
        table,
        accepted.iter().map(row).collect(),
    )
}

/// A section with this table; `None` without rows.
fn listed(id: &str, table: Table, rows: Vec<Row>) -> Option<Section> {
    let section = Section::new(id, table.title());
    (!rows.is_empty()).then(|| section.with(Group::card().with(table.with(rows))))
}

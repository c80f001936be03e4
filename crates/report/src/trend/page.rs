//! Owns the page of the trends.

use skinrig_nightly::trend::report::{day, figure as number};
use skinrig_nightly::trend::{Acceptance, Chart, Report};

use super::{Links, cause, figure, moved, since, state, tone, with_unit};
use crate::svg::{FIGURE_CSS, Svg};

const CSS: &str = "main{padding-bottom:40px}.card{margin-top:14px}.alarm h2{margin:0 0 6px}.alarm pre{margin:6px 0;padding:8px 12px;\
background:var(--bg);border:1px solid var(--line);border-radius:6px;overflow-x:auto;font-size:13px}.alarm svg{max-width:100%;height:auto}\
.alarm h3{margin:14px 0 2px}.alarm a{color:var(--accent)}table.trends td{vertical-align:middle}table.trends svg{display:block}\
table.trends .moved{color:var(--bad);font-weight:600}table.trends .learning{color:var(--soft)}.scroll{overflow-x:auto}";

/// The page: alarms first, then every series; needs no network and no other file. `links`: one per alarm. `accepted`: what
/// somebody took as it is.
#[must_use]
pub fn page(report: &Report, links: &[Links], accepted: &[Acceptance]) -> String {
    let mut page = Svg::new();
    page.open("html", &[("lang", &"en")]);
    head(&mut page);
    page.open("body", &[]);
    top(&mut page, report);
    page.open("main", &[]);
    for (alarm, links) in report.alarms.iter().zip(links) {
        self::alarm(&mut page, report, alarm, links);
    }
    page.holding("h2", &[], "All series");
    page.open(
        "div",
        &[("class", &"card scroll"), ("data-testid", &"series")],
    );
    table(&mut page, report);
    page.close();
    past(&mut page, report);
    changes(&mut page, accepted);
    page.holding(
        "p",
        &[("class", &"soft")],
        "Band: where a night may lie, by the nights of the reference. Three nights in a row beyond it on one side raise an alarm, \
         or nine somewhat off; one odd night never does. Dashed: the first night that was off.",
    );
    format!("<!doctype html>\n{}\n", page.finish())
}

fn head(page: &mut Svg) {
    page.open("head", &[]);
    page.leaf("meta", &[("charset", &"utf-8")]);
    page.leaf(
        "meta",
        &[
            ("name", &"viewport"),
            ("content", &"width=device-width, initial-scale=1"),
        ],
    );
    page.leaf(
        "meta",
        &[("name", &"color-scheme"), ("content", &"light dark")],
    );
    page.holding("title", &[], "Trends");
    // Style sheets hold none of the characters that XML escapes but `>`, which CSS needs as it is.
    page.raw(&format!(
        "<style>{FIGURE_CSS}{}{CSS}</style>",
        crate::page::PAGE_CSS
    ));
    page.close();
}

fn top(page: &mut Svg, report: &Report) {
    page.open("header", &[])
        .open("div", &[("class", &"top")])
        .open("div", &[]);
    page.holding("p", &[("class", &"brand")], "skinrig hil trend");
    page.holding("h1", &[("data-testid", &"headline")], &report.headline);
    if let (Some(first), Some(last)) = (report.nights.first(), report.nights.last()) {
        let text = format!(
            "{} on {} ({}), {} nights from {} to {}",
            last.suite,
            last.rig,
            last.rig_kind,
            report.nights.len(),
            day(first),
            day(last)
        );
        page.holding("p", &[("class", &"sub")], &text);
    }
    page.close();
    let (class, badge) = match report.alarms.len() {
        0 => ("badge ok", "no alarm".to_owned()),
        1 => ("badge bad", "1 alarm".to_owned()),
        n => ("badge bad", format!("{n} alarms")),
    };
    page.open("div", &[("class", &"side")]);
    page.holding("span", &[("class", &class)], &badge);
    page.close().close().close();
}

fn alarm(page: &mut Svg, report: &Report, alarm: &skinrig_nightly::trend::Alarm, links: &Links) {
    page.open(
        "section",
        &[
            ("class", &"card alarm"),
            ("data-testid", &"alarm"),
            ("id", &alarm.id),
        ],
    );
    page.holding(
        "h2",
        &[],
        &format!(
            "{} series moved, {}",
            alarm.charts.len(),
            since(report, alarm)
        ),
    );
    let class = format!("notice {}", tone(alarm.attribution.cause));
    page.holding(
        "p",
        &[("class", &class)],
        &format!("Probable cause: {}", cause(alarm)),
    );
    for changed in &alarm.attribution.changed {
        page.holding("p", &[("class", &"soft")], &format!("Changed: {changed}"));
    }
    page.open("p", &[]);
    page.holding("span", &[], &format!("Raised by night {} ", alarm.id));
    if let Some(href) = &links.night {
        page.holding("a", &[("href", href)], "its page");
    }
    if let Some(href) = &links.session {
        page.holding("span", &[], " · ");
        page.holding("a", &[("href", href)], "the session that shows it");
    }
    page.close();
    if !links.commands.is_empty() {
        page.holding("pre", &[], &links.commands.join("\n"));
    }
    if let Some(missing) = &links.missing {
        page.holding(
            "p",
            &[("class", &"soft")],
            &format!("No session: {missing}"),
        );
    }
    for at in &alarm.charts {
        let chart = &report.charts[*at];
        page.holding(
            "h3",
            &[],
            &format!("{}: {}", chart.series.name, moved(chart)),
        );
        page.raw(&figure::large(report, chart));
    }
    page.close();
}

fn table(page: &mut Svg, report: &Report) {
    page.open("table", &[("class", &"trends")]);
    page.open("thead", &[]).open("tr", &[]);
    for (head, class) in [
        ("Series", ""),
        ("Nights", ""),
        ("Reference", "num"),
        ("Last", "num"),
        ("State", ""),
    ] {
        page.holding("th", &[("scope", &"col"), ("class", &class)], head);
    }
    page.close().close();
    page.open("tbody", &[]);
    for chart in &report.charts {
        row(page, report, chart);
    }
    page.close().close();
}

fn row(page: &mut Svg, report: &Report, chart: &Chart) {
    let unit = &chart.series.unit;
    page.open("tr", &[]);
    page.holding("th", &[("scope", &"row")], &chart.series.name);
    page.open("td", &[]);
    page.raw(&figure::small(report, chart));
    page.close();
    let reference = chart.reference.map_or_else(
        || format!("{} nights so far", chart.nights.len()),
        |r| {
            format!(
                "{} ± {}",
                number(r.centre),
                with_unit(r.above.max(r.below), unit)
            )
        },
    );
    page.holding("td", &[("class", &"num nowrap")], &reference);
    let last = chart
        .nights
        .last()
        .map_or_else(|| "-".to_owned(), |n| with_unit(n.value, unit));
    page.holding("td", &[("class", &"num nowrap")], &last);
    let state = state(chart);
    page.holding(
        "td",
        &[("class", &state)],
        &format!("{state} {}", moved(chart)),
    );
    page.close();
}

fn past(page: &mut Svg, report: &Report) {
    if report.past.is_empty() {
        return;
    }
    page.holding("h2", &[], "Earlier alarms");
    page.open("div", &[("class", &"card scroll")]);
    page.open("table", &[]).open("tbody", &[]);
    for alarm in &report.past {
        page.open("tr", &[]);
        page.holding("th", &[("scope", &"row")], &alarm.id);
        let names = alarm
            .charts
            .iter()
            .map(|c| report.charts[*c].series.name.as_str());
        page.holding("td", &[], &names.collect::<Vec<_>>().join(", "));
        page.holding("td", &[], &cause(alarm));
        let until = alarm
            .ended
            .map(|n| day(&report.nights[n]))
            .unwrap_or_default();
        page.holding("td", &[("class", &"nowrap")], &format!("until {until}"));
        page.close();
    }
    page.close().close().close();
}

fn changes(page: &mut Svg, accepted: &[Acceptance]) {
    if accepted.is_empty() {
        return;
    }
    page.holding("h2", &[], "Accepted changes");
    page.open("div", &[("class", &"card scroll")]);
    page.open("table", &[]).open("tbody", &[]);
    for a in accepted {
        page.open("tr", &[]);
        page.holding("th", &[("scope", &"row")], &format!("from {}", a.night));
        page.holding("td", &[], a.series.as_deref().unwrap_or("all series"));
        page.holding("td", &[], &a.reason);
        page.holding("td", &[], &format!("{}, {}", a.by, a.at));
        page.close();
    }
    page.close().close().close();
}

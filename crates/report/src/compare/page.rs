//! Owns the HTML page of a comparison: inputs of its template and script.

use minijinja::value::Serde;
use minijinja::{Value, context};
use serde::Serialize;
use skinrig_compare::statistics::Verdict;
use skinrig_compare::{Causes, Comparison, Severity};

use super::{figures, tables, text};
use crate::error::ReportError;
use crate::format::number;
use crate::frame::{Frame, safe};
use crate::grid::Grid;
use crate::page::script_json;
use crate::plot::Figure;
use crate::svg::{FIGURE_CSS, plain_css};

const TEMPLATE: &str = include_str!("../../assets/compare/page.html");
const CSS: &str = include_str!("../../assets/compare/page.css");
const SCRIPT: &str = include_str!("../../assets/compare/page.js");

/// A skin against the first, for the template.
#[derive(Serialize)]
struct SkinCard {
    letter: char,
    name: String,
    verdict: &'static str,
    headline: String,
    beyond: bool,
    margin: Option<String>,
    needed: Option<String>,
    rows: Vec<MetricLine>,
    figures: [Option<Figure>; 4],
    causes: Option<CausesCard>,
}

#[derive(Serialize)]
struct MetricLine {
    name: String,
    a: String,
    b: String,
    difference: String,
    interval: String,
    margin: String,
    verdict: &'static str,
    key: &'static str,
    note: String,
}

#[derive(Serialize)]
struct CausesCard {
    carried_by: Option<&'static str>,
    measured: Grid,
    exchanged: Grid,
    places: u32,
    presses: [u32; 2],
}

/// The comparison as a self-contained HTML page.
///
/// # Errors
/// [`ReportError`] when rendering fails; no known input causes this.
pub fn html(result: &Comparison) -> Result<String, ReportError> {
    let cards: Vec<SkinCard> = (1..result.skins.len())
        .map(|k| skin_card(result, k))
        .collect();
    let of = |severity: Severity| {
        let rows = result
            .differences
            .iter()
            .filter(move |d| d.severity == severity);
        rows.map(|d| {
            context! {
                key => d.key, what => d.what.clone(), reason => d.reason.clone(), overridden => d.overridden,
                values => result.skins.iter().zip(&d.values)
                    .map(|(s, v)| (s.letter.to_string(), v.clone())).collect::<Vec<_>>(),
            }
        })
        .collect::<Vec<Value>>()
    };
    let heading = match cards.as_slice() {
        [one] => format!("{} against {}", one.name, result.skins[0].name),
        many => format!("{} skins against {}", many.len(), result.skins[0].name),
    };
    let data = tables::script_data(result);
    let frame = Frame {
        templates: &[("comparison.html", TEMPLATE)],
        styles: &[FIGURE_CSS, CSS],
        script: SCRIPT,
    };
    frame.render(context! {
        plain_css => safe(&plain_css()),
        data => safe(&script_json(&data)?),
        contents => [("verdict", "Verdict"), ("metrics", "Metrics"), ("maps", "Maps"), ("why", "Why"), ("sessions", "Sessions")],
        heading,
        stand_in => text::stand_in(result),
        limits => result.limits.clone(),
        margins => result.table.iter().any(|r| r.margin.is_some()),
        alone => result.skins.iter().all(|s| s.sessions.len() == 1),
        several => result.skins.len() > 2,
        skins => result.skins.iter().map(|s| context! {
            letter => s.letter.to_string(), name => s.name.clone(), text => text::skin(s),
            sessions => s.sessions.iter().map(|f| context! {
                file => f.file.clone(), id => f.session_id.clone(), started => f.started.clone(), rig => f.rig_name.clone(),
            }).collect::<Vec<_>>(),
        }).collect::<Vec<_>>(),
        blocking => of(Severity::Blocking),
        confounding => of(Severity::Confounding),
        harmless => of(Severity::Harmless),
        versus => Value::from(Serde(cards)),
    })
}

fn skin_card(result: &Comparison, k: usize) -> SkinCard {
    let skin = &result.skins[k];
    let row = result.headline();
    let found = row.and_then(|r| r.against_first.iter().find(|a| a.subject == k));
    let compared = found.and_then(|f| f.comparison.as_ref());
    let margin = row.and_then(|r| Some(format!("{} mm", text::value(r, Some(r.margin?)))));
    let causes = result.causes.get(k - 1).and_then(Option::as_ref);
    let figures = [
        figures::maps(result, k),
        figures::margins(result, k),
        figures::locations(result, k),
        causes.map(|of| figures::causes(result, k, of)),
    ];
    SkinCard {
        letter: skin.letter,
        name: skin.name.clone(),
        verdict: text::verdict(found.and_then(|f| f.verdict)),
        headline: found.map(|f| text::headline(result, f)).unwrap_or_default(),
        beyond: compared.is_some_and(|c| c.beyond_margin),
        margin,
        needed: compared.and_then(text::needed),
        rows: lines(result, k),
        figures,
        causes: causes.map(|of| CausesCard {
            carried_by: of.carried_by.map(skinrig_compare::Factor::name),
            measured: measured(of, skin.letter),
            exchanged: exchanged(of),
            places: of.locations,
            presses: of.presses,
        }),
    }
}

fn measured(of: &Causes, letter: char) -> Grid {
    let rows = of.measured.iter().map(|m| {
        let digits = |v: Option<f64>| {
            if v.is_some_and(|v| v.abs() >= 100.0) {
                0
            } else {
                3
            }
        };
        let [a, b] = m.values.map(|v| number(v, digits(v)));
        [format!("{} ({})", m.what, m.unit), a, b]
    });
    let columns = ["Quantity", "#A", &format!("#{letter}")];
    Grid::new("measured", "Measured in both", &columns).with(rows)
}

/// Errors with the calibration and settings of each skin.
fn exchanged(of: &Causes) -> Grid {
    let rows = of.exchanged.iter().map(|x| {
        let [located, all] = x.located;
        let rmse = format!("{} ({located} of {all})", number(x.rmse_mm, 2));
        let skins = [x.presses, x.calibration, x.settings].map(|skin| skin.to_string());
        skins.into_iter().chain([rmse])
    });
    let columns = [
        "Presses of",
        "Calibration of",
        "Settings of",
        "#RMSE, mm (located)",
    ];
    Grid::new("exchanged", "Cross-evaluation", &columns).with(rows)
}

fn lines(result: &Comparison, k: usize) -> Vec<MetricLine> {
    let line = |row: &skinrig_compare::Row| {
        let found = row.against_first.iter().find(|a| a.subject == k)?;
        let c = found.comparison.as_ref();
        let own = |i: usize| row.values.get(i).and_then(|v| v.value).map(|v| v.value);
        let is_undecided = matches!(found.verdict, Some(Verdict::Undecided) | None);
        Some(MetricLine {
            name: text::heading(row),
            a: text::value(row, c.map(|c| c.a.value).or(own(0))),
            b: text::value(row, c.map(|c| c.b.value).or(own(k))),
            difference: c.map_or_else(
                || crate::format::NONE.to_owned(),
                |c| text::signed(row, c.difference.value),
            ),
            interval: c.map_or_else(
                || crate::format::NONE.to_owned(),
                |c| text::interval(row, &c.difference),
            ),
            margin: row.margin.map_or_else(
                || crate::format::NONE.to_owned(),
                |m| format!("± {}", text::value(row, Some(m))),
            ),
            verdict: text::verdict(found.verdict),
            key: row.metric.key(),
            note: match (c, &found.error) {
                (_, Some(why)) => why.clone(),
                (Some(c), None) if is_undecided && row.margin.is_some() => {
                    text::needed(c).unwrap_or_default()
                }
                _ => String::new(),
            },
        })
    };
    result.table.iter().filter_map(line).collect()
}

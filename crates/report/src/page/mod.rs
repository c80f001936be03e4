//! Owns the HTML page of a session.
//!
//! Controls that a script drives are markup in `assets/controls`; the script is `assets/script/*.js`. It gets one JSON value
//! with named column-wise tables: press table, tooltips and CSV downloads all read it.

mod alignment;
mod areas;
mod calibration;
mod cells;
mod comparison;
pub(crate) mod findings;
pub(crate) mod indentation;
mod latency;
mod locator;
mod notices;
mod reduction;
mod results;
mod session;

use skinrig_analysis::result::Analysis;
use skinrig_model::RunEnd;

use self::cells::missing;
use crate::document::{Banner, Block, Document, Group, Note, Section, Table, Text};
use crate::format::or_missing;
use crate::input::ReportInput;
use crate::{derive, figures, selection, tables};

/// One script: each part is wrapped in its own function.
const SCRIPT: &str = concat!(
    include_str!("../../assets/script/filter.js"),
    include_str!("../../assets/script/map.js"),
    include_str!("../../assets/script/rates.js"),
    include_str!("../../assets/script/presses.js"),
);
const FILTER: &str = include_str!("../../assets/controls/filter.html");
const INSPECTOR: &str = include_str!("../../assets/controls/inspector.html");
const PRESSES: &str = include_str!("../../assets/controls/presses.html");
const ZOOM: &str = include_str!("../../assets/controls/zoom.html");

/// See [`crate::html`].
pub(crate) fn render(input: &ReportInput<'_>) -> String {
    let (a, p) = (input.analysis, &input.provenance);
    let (heading, prototype) = (heading(&p.protocol_name), or_missing(&p.prototype));
    let session = or_missing(&p.session_id);
    let marks = [
        (!a.is_valid(), "INVALID · "),
        (p.variant.is_some(), "VARIANT · "),
    ];
    let marks = marks.iter().filter(|(is_so, _)| *is_so);
    let marks: String = marks.map(|(_, mark)| *mark).collect();
    let word = p.stand_in();
    let suffix = |what: &str| word.map_or_else(String::new, |word| format!(" ({word}{what})"));
    let run_end = or_missing(&p.run_end);
    let decided = p.run_end_cause.as_ref().and_then(RunEnd::decision);
    let tone = if p.run_end == "completed" || decided.is_some() {
        "ok"
    } else {
        "bad"
    };
    Document {
        title: format!(
            "{marks}{heading} · {prototype}{} · skinrig report",
            suffix("")
        ),
        brand: "skinrig session report",
        heading,
        heading_id: "heading",
        subheads: vec![
            Text::from("prototype ")
                .bold(prototype)
                .dot()
                .add(extent(input))
                .dot()
                .add(or_missing(&p.started))
                .dot()
                .add("session ")
                .code(session),
        ],
        badges: vec![
            Text::new().named(
                "run-end",
                &format!("badge {tone}"),
                format!("run {run_end}"),
            ),
            Text::new().span("badge", &*p.rig_kind),
        ],
        banners: banners(input),
        skip: ("#results", "Skip to the results"),
        sections: [
            Some(results::results(input)),
            Some(Section::plain().with(Block::Markup(FILTER.to_owned()))),
            Some(skin(input)),
            Some(errors(input)),
            Some(events(input)),
            single(input),
            Some(fitted(input)),
            indentation::indentation(input),
            Some(data_reduction(input)),
            Some(detection(input)),
            rates(a),
            Some(compared(input)),
            Some(session::session(input)),
            Some(presses(a)),
        ]
        .into_iter()
        .flatten()
        .collect(),
        about: format!("Session {session}{}.", suffix(" rig")),
        is_unusable: !a.is_valid(),
        data: Some(tables::script_data(input)),
        script: SCRIPT.to_owned(),
        ..Document::default()
    }
    .html()
}

fn banners(input: &ReportInput<'_>) -> Vec<Banner> {
    let (a, p) = (input.analysis, &input.provenance);
    let variant = p.variant.as_ref();
    let variant = variant.map(|v| Banner::note("variant", "Variant", v.to_string()));
    let rig = format!(" Rig: {}.", or_missing(&p.rig_name));
    let stand_in = p.stand_in().map(|word| Banner::stand_in(word).add(&rig));
    let invalid = (!a.is_valid()).then(|| {
        let why = a.invalid_because().join("; ");
        let words = format!("Do not use the numbers and figures of this session: {why}.");
        Banner::invalid("invalid", "INVALID", words)
    });
    let selected = selection::headline(input);
    let selected = selected.map(|text| {
        let without = selection::without(input).map_or_else(String::new, |w| format!(". RMSE {w}"));
        Banner::note("selection", "Selection", format!("{text}{without}."))
    });
    [selected, variant, stand_in, invalid]
        .into_iter()
        .flatten()
        .collect()
}

/// The card of a table of results; `None` for an invalid session.
fn card(a: &Analysis, table: Option<Table>) -> Option<Group> {
    table.filter(|_| a.is_valid()).map(Table::card)
}

fn skin(input: &ReportInput<'_>) -> Section {
    let a = input.analysis;
    let cells = a.coverage.as_ref().is_some_and(|c| c.cell_mm.is_some());
    let regions = a.presses.iter().any(|press| press.region.is_some());
    let layers = [
        ("fov", "fields of view", true),
        ("cells", "probed area", cells),
        ("path", "press path", true),
        ("regions", "95 % regions", regions),
        ("vectors", "error vectors", true),
        ("others", "not counted", true),
    ];
    let boxes = layers
        .iter()
        .filter(|(.., there)| *there)
        .map(|(layer, name, _)| {
            format!(
                "<label><input type=\"checkbox\" checked data-layer=\"{layer}\"> {name}</label>"
            )
        });
    let boxes: String = boxes.collect();
    let layers = format!(
        "<fieldset class=\"layers\"><legend class=\"hidden\">Layers</legend>{boxes}</fieldset>"
    );
    let map = Block::Figure(Box::new(figures::skin_map(input)), layers);
    let side = Block::Markup(INSPECTOR.to_owned());
    Section::new("skin", "Skin map")
        .with(Group::new("with-side").with(map).with(side))
        .with_all(card(a, areas::coverage(a)))
}

fn errors(input: &ReportInput<'_>) -> Section {
    let spread = Group::two()
        .with(figures::error_distribution(input))
        .with(figures::error_scatter(input));
    let maps = Group::two()
        .with(figures::repeat_map(input))
        .with_all(figures::threshold(input));
    Section::new("errors", "Errors").with(spread).with(maps)
}

fn events(input: &ReportInput<'_>) -> Section {
    let rates = Block::Figure(Box::new(figures::event_rates(input)), ZOOM.to_owned());
    Section::new("events", "Events")
        .with(rates)
        .with_all(figures::activity(input))
        .with(figures::centroid_tracks(input))
}

fn single(input: &ReportInput<'_>) -> Option<Section> {
    let drawn = [figures::press_rates(input), figures::press_pictures(input)];
    let section = Section::new("single", "Single presses");
    drawn
        .iter()
        .any(Option::is_some)
        .then(|| section.with_all(drawn.into_iter().flatten()))
}

fn fitted(input: &ReportInput<'_>) -> Section {
    let a = input.analysis;
    let left = Group::stack()
        .with(calibration::parameters(a))
        .with_all(card(a, calibration::fit(a)));
    let right = Group::stack()
        .with_all(figures::models(input))
        .with_all(figures::correlation(input));
    let reliability = Group::two()
        .with_all(figures::reliability(input))
        .with_all(card(a, locator::reliability(a)));
    Section::new("calibration", "Calibration")
        .with(Group::two().with(left).with(right))
        .with_all(card(a, calibration::models(a)))
        .with_all(card(a, locator::locators(a)))
        .with_all((!reliability.is_empty()).then_some(reliability))
        .with_all(figures::residuals(input))
}

fn data_reduction(input: &ReportInput<'_>) -> Section {
    let a = input.analysis;
    let study = figures::reduction(input).map(Block::from).unwrap_or_else(|| {
        let why = "The data-reduction study was not run: the settings disable it, or no scored press has events.";
        missing("", why)
    });
    let unreadable = input.tradeoff.and_then(Result::err);
    let tradeoff = match (figures::speed_accuracy(input), unreadable) {
        (Some(figure), _) => figure.into(),
        (None, Some(e)) => Note::new("Speed against accuracy.", e.to_string())
            .bad()
            .test_id("tradeoff-unreadable")
            .into(),
        (None, None) => {
            let why = Text::from("Speed against accuracy was not measured on this session. Run ");
            let next = why
                .code("skinrig tradeoff")
                .add("; the next report shows the result.");
            missing("no-tradeoff", next)
        }
    };
    Section::new("data-reduction", "Data reduction, speed against accuracy")
        .listed("Data reduction")
        .with(study)
        .with_all(card(a, reduction::reduction(a)))
        .with(tradeoff)
}

fn detection(input: &ReportInput<'_>) -> Section {
    let a = input.analysis;
    let section = Section::new("detection", "Detection latency");
    let felt = card(a, latency::felt(a)).map(|card| Group::two().with(card));
    let Some(table) = card(a, latency::latency(a)) else {
        let why = "The latency study was not run: the settings disable it, or no scored press has events.";
        return section.with_all(felt).with(missing("", why));
    };
    let from_contact = card(a, latency::from_contact(a)).map(Block::from);
    let from_contact = from_contact.unwrap_or_else(|| {
        let why = "No latency from contact: contacts come from a schedule, or a camera clock was aligned with the same \
            events whose latency would be measured.";
        missing("no-contact", why)
    });
    let curves = Group::two()
        .with_all(figures::latency_roc(input))
        .with_all(figures::latency_onsets(input));
    section
        .with_all(figures::latency_course(input))
        .with(curves)
        .with(Group::two().with(table).with(from_contact))
        .with_all(felt)
}

fn rates(a: &Analysis) -> Option<Section> {
    let cards = Group::two()
        .with_all(card(a, areas::bit_rates(a)))
        .with_all(card(a, areas::cmre(a)));
    let section = Section::new("rates", "Data rates and contact map");
    (!cards.is_empty()).then(|| section.listed("Data rates, contact map").with(cards))
}

fn compared(input: &ReportInput<'_>) -> Section {
    let a = input.analysis;
    let reference = card(a, comparison::reference(a));
    let mode = reference.is_some().then(|| {
        let text = "This analysis uses the settings of the public code. The public code evaluates in-sample.";
        Note::new("Reference-code mode.", text).warning().test_id("reference")
    });
    Section::new("comparison", "Comparison")
        .with_all(mode)
        .with_all(reference)
        .with_all(card(a, comparison::reference_reduction(a)))
        .with(comparison::msows(input).card())
        .with(comparison::skins(input).card())
        .with(comparison::sensors(input).card())
}

fn presses(a: &Analysis) -> Section {
    let printed = format!(
        "The press table ({} rows) is available on screen and as a CSV file.",
        a.presses.len()
    );
    let card = Group::titled("Presses that match the filter")
        .download("press-table", "presses", "the presses shown")
        .with(Block::Markup(PRESSES.to_owned()))
        .with(Block::Text("print-only", printed.into()));
    Section::new("presses", "Presses")
        .test_id("presses")
        .with(card)
}

/// Name of the protocol without folder and suffix.
fn heading(protocol: &str) -> String {
    let file = protocol.rsplit(['/', '\\']).next().unwrap_or(protocol);
    let stem = file
        .strip_suffix(".yaml")
        .or_else(|| file.strip_suffix(".yml"))
        .unwrap_or(file);
    or_missing(stem.strip_suffix(".schedule").unwrap_or(stem)).to_owned()
}

fn extent(input: &ReportInput<'_>) -> String {
    let (repetitions, locations) = derive::extent(input.analysis);
    let count = |n: u32, what: &str| format!("{n} {what}{}", if n == 1 { "" } else { "s" });
    format!(
        "{}, {}",
        count(repetitions, "repetition"),
        count(locations, "location")
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_heading_is_the_name_of_the_protocol() {
        assert_eq!(heading("protocols/paper-meander.yaml"), "paper-meander");
        assert_eq!(heading("C:\\lab\\a.b.yml"), "a.b");
        assert_eq!(
            heading("single-repetition.schedule.yaml"),
            "single-repetition"
        );
        assert_eq!(heading("replay of demo"), "replay of demo");
        assert_eq!(heading(""), "not recorded");
    }
}

//! Owns the first section of the page: headline and metrics, counts, remarks, exclusions, provenance.

use skinrig_analysis::result::Analysis;
use skinrig_model::level_bias::{CONDITIONS, LevelBias, SceneFigure};

use super::{findings, notices};
use crate::derive;
use crate::document::{Block, Column, Fact, Group, Note, Row, Section, Table, Text, soft};
use crate::format::{interval, number, or_missing};
use crate::input::ReportInput;
use crate::provenance::Provenance;
use crate::terminal::{MetricRow, metric_rows};

/// The first section; the contents list its provenance, too.
pub(super) fn results(input: &ReportInput<'_>) -> Section {
    let a = input.analysis;
    let title = if a.is_valid() {
        "Results"
    } else {
        "Results - INVALID"
    };
    let empty = a.presses.is_empty().then(|| {
        let text = "This session has no presses. There is nothing to measure.";
        Note::of(text).bad().test_id("empty")
    });
    let right = Group::stack()
        .with(counts(a))
        .with(notices::notices(input))
        .with(exclusions(a));
    let provenance = Group::titled("Provenance")
        .id("provenance")
        .test_id("provenance")
        .with(Block::Facts(provenance(&input.provenance, a.version)));
    let first = Group::new("first")
        .with(Group::stack().with(headline(a)))
        .with(right)
        .with(Group::stack().with(provenance));
    Section::new("results", title)
        .listed("Results")
        .lists("provenance", "Provenance")
        .test_id("results")
        .with_all(empty)
        .with_all(findings::card(&a.findings))
        .with(first)
}

fn headline(a: &Analysis) -> Group {
    let (rmse, others): (Vec<MetricRow>, Vec<MetricRow>) =
        metric_rows(a).into_iter().partition(|m| m.key == "rmse");
    let hero = rmse.iter().map(|m| hero(a, m));
    let metrics = others.into_iter().map(|m| {
        let value = Text::new().bold(m.value).add(" ").add(m.unit);
        let n = Text::from(format!("{} ", m.n)).span("soft", m.what_n);
        Row::new([m.name.into(), value, m.interval.into(), n])
            .attribute("data-testid", &format!("metric-{}", m.key))
    });
    let depths = (1..).zip(&a.depths).filter(|_| a.is_valid()).map(|(k, d)| {
        let rmse = &d.rmse_mm;
        let value = Text::new().bold(number(rmse.value, 2)).add(" mm");
        let name = format!("RMSE at depth {} mm", d.depth_mm);
        let n = Text::from(format!("{} ", rmse.n)).span("soft", "presses");
        Row::new([name.into(), value, interval(rmse, 1.0, 2).into(), n])
            .attribute("data-testid", &format!("metric-depth-{k}"))
    });
    let columns = ["Metric", "Value", "95 % interval", "n"];
    let table = Table::new(
        "metrics",
        "Localisation metrics of the scored presses",
        &columns,
    );
    Group::card()
        .class("headline")
        .with_all(hero)
        .with(table.class("metrics").with(metrics.chain(depths)))
}

fn hero(a: &Analysis, rmse: &MetricRow) -> Group {
    let usable = a.is_valid();
    let value = Text::from(&*rmse.value).span("unit", format!(" {}", rmse.unit));
    let mut remarks = vec![if !usable {
        Text::from("The alignment certificate is beyond its limits, see ")
            .link("#session", "Session")
            .add(".")
    } else if rmse.n == 0 {
        "No scored press counts, so there is no error.".into()
    } else if let Some(at) = derive::rmse_at_look(a) {
        Text::from(format!(
            "{} mm, {} % interval {} mm",
            at.value, at.level, at.interval
        ))
        .dot()
        .add(at.extent)
    } else {
        Text::from(format!("95 % interval {} mm", rmse.interval))
            .dot()
            .add(format!("n = {} scored presses", rmse.n))
    }];
    if usable {
        remarks.extend(derive::rmse_elsewhere(a).map(Text::from));
        remarks.extend(other_counts(a).into_iter().map(Text::from));
    }
    if let Some(note) = derive::geometry_note(a) {
        remarks.push(Text::new().bold(note));
    }
    if usable && !a.depths.is_empty() {
        let n = a.depths.len();
        remarks.push(format!("All {n} depths together; each on its own below.").into());
    }
    Group::new("hero")
        .test_id("metric-rmse")
        .with(Block::Text("name", "Localisation error, RMSE".into()))
        .with(Block::Text("value", value))
        .with_all(remarks.into_iter().map(|text| Block::Text("ci", text)))
}

/// The RMSE as a share, without exclusions, and with failures counted, where there are any.
fn other_counts(a: &Analysis) -> Vec<String> {
    let diagonal = a.scored.rmse_diagonal_percent;
    let diagonal = diagonal.map(|v| format!("{} % of the skin's diagonal", number(Some(v), 2)));
    let all = &a.scored_without_exclusions;
    let without = (*all != a.scored).then(|| {
        let rmse = &all.rmse_mm;
        let (value, interval) = (number(rmse.value, 2), interval(rmse, 1.0, 2));
        format!("{value} mm {interval} without exclusions (n = {})", rmse.n)
    });
    let p = &a.penalised;
    let failed = (p.failures > 0 && p.rmse_mm.value.is_some()).then(|| {
        let presses = if p.failures == 1 { "press" } else { "presses" };
        let beyond = match p.beyond_penalty {
            0 => String::new(),
            n => format!(", {n} of them as their own larger error"),
        };
        let interval = match p.rmse_mm.low {
            Some(_) => interval(&p.rmse_mm, 1.0, 2),
            None => "(no interval: too few locations)".to_owned(),
        };
        format!(
            "{} mm {interval} with {} failed {presses} counted as {} mm{beyond} (n = {})",
            number(p.rmse_mm.value, 2),
            p.failures,
            number(Some(p.penalty_mm), 1),
            p.rmse_mm.n
        )
    });
    [diagonal, without, failed].into_iter().flatten().collect()
}

fn counts(a: &Analysis) -> Group {
    let c = &a.counts;
    let kinds = [
        ("valid", c.valid),
        ("missed", c.missed),
        ("invalid", c.invalid),
        ("excluded", c.excluded),
    ];
    let mut sum = Text::new().bold(c.planned.to_string()).add(" planned ");
    for (i, (kind, n)) in kinds.into_iter().enumerate() {
        let part = Text::new()
            .key(kind)
            .bold(n.to_string())
            .add(format!(" {kind}"));
        let sign = if i == 0 { "=" } else { "+" };
        sum = sum.span("op", sign).add(" ").span("nowrap", part).add(" ");
    }
    let shares = kinds.iter().filter(|(_, n)| *n > 0);
    let shares: String = shares
        .map(|(kind, n)| format!("<i class=\"{kind}\" style=\"flex-grow:{n}\"></i>"))
        .collect();
    let bar = format!("<div class=\"share\" aria-hidden=\"true\">{shares}</div>");
    let wrong = (!c.add_up())
        .then(|| Note::of("These counts do not add up. Do not trust this result.").bad());
    let sync = (c.sync > 0).then(|| soft(format!("{} sync presses are counted apart.", c.sync)));
    Group::titled("Presses")
        .test_id("counts")
        .with(Block::Text("sum", sum))
        .with_all((c.planned > 0).then_some(Block::Markup(bar)))
        .with_all(wrong)
        .with_all(sync)
}

fn exclusions(a: &Analysis) -> Group {
    let threshold = a.threshold.as_ref().map(|t| {
        soft(format!(
            "A press needs {} cluster events in each camera. This threshold was chosen on the {} calibration presses \
             alone and rejects {} of them.",
            t.events, t.n, t.left_out
        ))
    });
    let title = "Presses that do not count";
    let counted = rejected(a, false, "Presses that are not valid, grouped by rule");
    let sync = rejected(a, true, "Sync presses that are not valid, grouped by rule");
    let apart = sync
        .is_some()
        .then(|| Block::Heading("h4", "Sync presses, counted apart".into()));
    Group::titled(title)
        .class("list")
        .test_id("exclusions")
        .region(title)
        .with_all(threshold)
        .with(counted.map_or_else(|| soft("None."), Block::from))
        .with_all(apart)
        .with_all(sync)
}

/// Rejected presses by rule; `None` without any.
fn rejected(a: &Analysis, sync: bool, caption: &str) -> Option<Table> {
    let rows: Vec<Row> = derive::rejections(a, sync)
        .into_iter()
        .map(|r| {
            let verdict = r.verdict.name();
            let mut rule = Text::from(r.rule);
            if let Some(example) = r.example {
                rule = rule
                    .line_break()
                    .span("soft", format!("for example: {example}"));
            }
            let verdict = Text::new().key(verdict).add(verdict);
            Row::new([verdict, rule, r.n.to_string().into()])
        })
        .collect();
    let columns = [
        Column::new("Verdict").class("nowrap"),
        Column::new("Rule or reason"),
        Column::new("#Presses"),
    ];
    (!rows.is_empty()).then(|| Table::of("rejected", caption, columns).with(rows))
}

fn provenance(p: &Provenance, analysis_version: u32) -> Vec<Fact> {
    let plain = |key: &str, value: &str| Fact::new(key, or_missing(value));
    let code = |key: &str, value: &str| {
        // The first characters of a digest identify it; the full value is in the title and in print.
        if value.len() == 64 && value.bytes().all(|b| b.is_ascii_hexdigit()) {
            return Fact::new(key, Text::new().digest(value));
        }
        let value = or_missing(value);
        Fact::new(key, Text::new().code(value)).wide(value.chars().count() > 40)
    };
    let mut facts = vec![
        code("session", &p.session_id),
        plain("started", &p.started),
        plain("operator", &p.operator),
        plain("prototype", &p.prototype),
        plain("rig", &p.rig_name),
        plain("rig kind", &p.rig_kind),
        plain("host", &p.host),
        code("seed", &p.seed.to_string()),
        plain("software", &p.software),
        plain("analysis version", &analysis_version.to_string()),
        plain("protocol", &p.protocol_name),
        code("protocol SHA-256", &p.protocol_sha256),
        code("plan SHA-256", &p.plan_sha256),
        code("results SHA-256", &p.results_hash),
        code("command line", &p.command_line),
    ];
    if !p.differences_from_optical.is_empty() {
        let difference = |(figure, bias): (&SceneFigure, &LevelBias)| {
            let LevelBias { mean, low, high } = bias;
            let (name, unit) = (figure.label(), figure.unit());
            format!("{name} {mean:+} {unit} [{low}, {high}]")
        };
        let all: Vec<String> = p.differences_from_optical.iter().map(difference).collect();
        let measured = format!("{} (measured {CONDITIONS})", all.join("; "));
        let fact = plain("minus the optical level", &measured);
        facts.push(fact.wide(true));
    }
    if !p.overrides.is_empty() {
        facts.push(code("overrides", &p.overrides.join("  ")));
    }
    facts
}

//! Owns the presentation of an alarm on a page, for trends and nights.

use skinrig_nightly::Cause;
use skinrig_nightly::trend::{Alarm, Chart, Report};

use super::name::{series_name, with_names};
use super::{Links, cause, moved_by, since};
use crate::document::{Block, Note, Text, Tone, paragraph, soft};

/// An alarm of a page.
pub(crate) struct AlarmView<'a> {
    pub id: String,
    pub title: String,
    /// Cause, changes, links and commands.
    pub blocks: Vec<Block>,
    /// Drifted series, with name and size of the drift.
    pub charts: Vec<(&'a Chart, Text)>,
}

/// Presents the alarms of `report`, with their links.
pub(crate) fn alarms<'a>(report: &'a Report, links: &[Links]) -> Vec<AlarmView<'a>> {
    let none = Links::default();
    let links = links.iter().chain(std::iter::repeat(&none));
    let alarms = report.alarms.iter().zip(links);
    alarms.map(|(alarm, l)| view(report, alarm, l)).collect()
}

fn view<'a>(report: &'a Report, alarm: &Alarm, links: &Links) -> AlarmView<'a> {
    let series = |at: &usize| {
        let chart = &report.charts[*at];
        let name = series_name(&chart.series.name);
        (chart, format!("{name}: {}", moved_by(chart, alarm)).into())
    };
    let title = format!(
        "{} series moved, {}",
        alarm.charts.len(),
        since(report, alarm)
    );
    let tone = match alarm.attribution.cause {
        Some(Cause::Infrastructure) => Tone::Warning,
        _ => Tone::Bad,
    };
    let cause = with_names(&cause(alarm), report);
    let cause = Note::of(format!("Probable cause: {cause}")).tone(tone);
    let changed = alarm.attribution.changed.iter();
    let mut raised = Text::from(format!("Raised by night {}", alarm.id));
    for (link, words) in [
        (&links.night, "its page"),
        (&links.session, "the session that shows it"),
    ] {
        if let Some(link) = link {
            raised = raised.dot().link(link, words);
        }
    }
    let mut blocks = vec![Block::Note(cause)];
    blocks.extend(changed.map(|c| soft(format!("Changed: {c}"))));
    blocks.push(paragraph(raised));
    if !links.commands.is_empty() {
        blocks.push(Block::Commands(links.commands.clone()));
    }
    blocks.extend(
        links
            .missing
            .iter()
            .map(|why| soft(format!("No session: {why}"))),
    );
    AlarmView {
        id: alarm.id.clone(),
        title,
        blocks,
        charts: alarm.charts.iter().map(series).collect(),
    }
}

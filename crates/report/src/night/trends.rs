//! Owns the trends section of a night's page.

use skinrig_nightly::trend::Report;
use skinrig_nightly::trend::report::cause_name;
use skinrig_nightly::{Cause, Night};

use super::text;
use crate::document::{Block, Group, Note, Section, Text, Tone, paragraph};
use crate::trend::{Links, alarms, since, with_names};

/// Series listed per alarm; the others are counted.
const MAX_LISTED: usize = 4;

/// Trends over previous nights, including this one.
#[derive(Debug, Clone, Copy)]
pub enum Trends<'a> {
    /// Not requested: the night is not added to a history.
    NotRequested,
    /// Could not be computed, with the reason.
    Unavailable(&'a str),
    /// Computed.
    Available {
        /// All series with their state.
        report: &'a Report,
        /// One per alarm.
        links: &'a [Links],
        /// Link to the page of the trends.
        page: &'a str,
    },
}

impl<'a> Trends<'a> {
    fn report(self) -> Option<&'a Report> {
        match self {
            Self::Available { report, .. } => Some(report),
            Self::NotRequested | Self::Unavailable(_) => None,
        }
    }

    /// Headline: violated limits, and what drifted.
    pub(super) fn headline(self, night: &Night) -> String {
        let limits = text::headline(night);
        let alarms = self.report().map_or(&[][..], |r| &r.alarms);
        if alarms.is_empty() {
            return limits;
        }
        let mut causes: Vec<&str> = Vec::new();
        for alarm in alarms {
            let cause = alarm.attribution.cause;
            let moved = cause.map_or("something", |cause| cause_name(Some(cause)));
            if !causes.contains(&moved) {
                causes.push(moved);
            }
        }
        let causes: Vec<String> = causes.into_iter().map(str::to_owned).collect();
        let moved = format!("{} probably moved", text::listed(&causes));
        if night.verdict.is_good() && text::causes(night).is_empty() && text::was_made(night) {
            format!("{limits}, but {moved}")
        } else {
            format!("{limits}; {moved}")
        }
    }

    /// Trend of one possible cause; `None` if unknown.
    pub(super) fn of(self, cause: Cause) -> Option<(bool, String)> {
        let report = self.report()?;
        let mut alarms = report.alarms.iter();
        let alarm = alarms.find(|a| a.attribution.cause == Some(cause));
        match alarm {
            Some(alarm) => Some((true, format!("probably moved, {}", since(report, alarm)))),
            None if report.is_learning() || report.unmeasured().next().is_some() => None,
            None => Some((false, "has not moved".to_owned())),
        }
    }

    /// The section of the page.
    pub(super) fn section(self) -> Section {
        let (state, tone, text) = match self {
            Self::NotRequested => {
                let text = "No trends: this night is not part of a history (--history FILE).";
                ("not-requested", Tone::Plain, text.to_owned())
            }
            Self::Unavailable(why) => {
                let text = format!("No trends tonight: {why}. Limits were checked nevertheless.");
                ("unavailable", Tone::Warning, text)
            }
            Self::Available { report, .. } => {
                let (state, tone) = if !report.alarms.is_empty() {
                    ("moved", Tone::Bad)
                } else if report.is_learning() {
                    ("learning", Tone::Plain)
                } else if report.unmeasured().next().is_some() {
                    ("unmeasured", Tone::Warning)
                } else {
                    ("steady", Tone::Good)
                };
                let text = format!("Trend: {}.", with_names(&report.headline, report));
                (state, tone, text)
            }
        };
        let mut text = Text::from(text);
        let mut groups = Vec::new();
        if let Self::Available {
            report,
            links,
            page,
        } = self
        {
            text = text.add(" ").named_link("trends-page", page, "All charts");
            groups.extend(alarms(report, links).into_iter().map(|alarm| {
                let title = Text::new().link(format!("{page}#{}", alarm.id), &alarm.title);
                let listed = alarm.charts.iter().take(MAX_LISTED);
                let mut series: Vec<String> = listed.map(|(_, name)| name.words()).collect();
                match alarm.charts.len().saturating_sub(MAX_LISTED) {
                    0 => {}
                    others => series.push(format!("and {others} more")),
                }
                Group::new("alarm")
                    .test_id("alarm")
                    .with(Block::Heading("h3", title))
                    .with(paragraph(series.join("; ")))
                    .with_all(alarm.blocks)
            }));
        }
        let card = Group::card().with(Note::of(text).tone(tone));
        Section::new("trends", "Trends")
            .hide_heading()
            .test_id(format!("trends-{state}"))
            .with(card.with_all(groups))
    }
}

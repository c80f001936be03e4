//! Owns the trends section of a night's page.

use minijinja::value::Serde;
use minijinja::{Value, context};
use skinrig_nightly::trend::Report;
use skinrig_nightly::trend::report::cause_name;
use skinrig_nightly::{Cause, Night};

use super::text;
use crate::trend::{Links, alarm_cards, since, with_names};

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
            None if report.is_learning() => None,
            None => Some((false, "has not moved".to_owned())),
        }
    }

    /// Template value.
    pub(super) fn value(self) -> Value {
        let (report, links, page) = match self {
            Self::NotRequested => {
                let text = "No trends: this night is not part of a history (--history FILE).";
                return context! { state => "not-requested", tone => "", text };
            }
            Self::Unavailable(why) => {
                let text = format!("No trends tonight: {why}. Limits were checked nevertheless.");
                return context! { state => "unavailable", tone => "warn", text };
            }
            Self::Available {
                report,
                links,
                page,
            } => (report, links, page),
        };
        let (state, tone) = if !report.alarms.is_empty() {
            ("moved", "bad")
        } else if report.is_learning() {
            ("learning", "")
        } else {
            ("steady", "ok")
        };
        let alarms = alarm_cards(report, links).into_iter().map(|mut alarm| {
            let others = alarm.series.len().saturating_sub(MAX_LISTED);
            alarm.series.truncate(MAX_LISTED);
            context! { card => Value::from(Serde(alarm)), others }
        });
        context! {
            state, tone, page,
            text => format!("Trend: {}.", with_names(&report.headline, report)),
            alarms => alarms.collect::<Vec<_>>(),
        }
    }
}

//! Owns what the page of a night says of the nights before it.

use minijinja::value::Serde;
use minijinja::{Value, context};
use skinrig_nightly::trend::Report;
use skinrig_nightly::trend::report::name;
use skinrig_nightly::{Cause, Night};

use super::words;
use crate::trend::{Links, since, told};

/// Series of an alarm that are named; of the others it is said how many they are.
const MOST_NAMED: usize = 4;

/// What is known of the nights before, and of this one among them.
#[derive(Debug, Clone, Copy)]
pub enum Trends<'a> {
    /// Nobody asked for them: the night is added to no history.
    NotKept,
    /// Why they could not be told.
    Untold(&'a str),
    /// What they say.
    Told {
        /// All series judged, this night among the nights.
        report: &'a Report,
        /// One per alarm.
        links: &'a [Links],
        /// The page of the trends, as a link of this page.
        page: &'a str,
    },
}

impl<'a> Trends<'a> {
    fn report(self) -> Option<&'a Report> {
        match self {
            Self::Told { report, .. } => Some(report),
            Self::NotKept | Self::Untold(_) => None,
        }
    }

    /// The first thing to know in the morning: where limits were broken, and what moved.
    pub(super) fn headline(self, night: &Night) -> String {
        let limits = words::headline(night);
        let alarms = self.report().map_or(&[][..], |r| &r.alarms);
        if alarms.is_empty() {
            return limits;
        }
        let mut causes: Vec<&str> = Vec::new();
        for alarm in alarms {
            let cause = alarm.attribution.cause;
            let moved = cause.map_or("something", |cause| name(Some(cause)));
            if !causes.contains(&moved) {
                causes.push(moved);
            }
        }
        let causes: Vec<String> = causes.into_iter().map(str::to_owned).collect();
        let moved = format!("{} probably moved", words::listed(&causes));
        if night.verdict.is_good() && words::causes(night).is_empty() && words::was_made(night) {
            format!("{limits}, but {moved}")
        } else {
            format!("{limits}; {moved}")
        }
    }

    /// What the trends say of one of the places to look at; nothing where they say nothing.
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

    /// For the template.
    pub(super) fn value(self) -> Value {
        let (report, links, page) = match self {
            Self::NotKept => {
                let text = "No trends: this night was added to no history (--history FILE).";
                return context! { state => "not-kept", tone => "", text };
            }
            Self::Untold(why) => {
                let text =
                    format!("No trends tonight: {why}. The limits were judged all the same.");
                return context! { state => "untold", tone => "warn", text };
            }
            Self::Told {
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
        let alarms = told(report, links).into_iter().map(|mut alarm| {
            let others = alarm.series.len().saturating_sub(MOST_NAMED);
            alarm.series.truncate(MOST_NAMED);
            context! { told => Value::from(Serde(alarm)), others }
        });
        context! {
            state, tone, page,
            text => format!("Over the nights: {}.", report.headline),
            alarms => alarms.collect::<Vec<_>>(),
        }
    }
}

//! Trend report of a bench: which series moved, since when, and the probable cause.

use serde::Serialize;

use super::cause::{self, Attribution};
use super::chart::{Chart, Direction, Excursion, SeriesState, chart};
use super::derived::{RATIO, ratios};
use super::history::{History, NightSummary};
use super::reference::MIN_NIGHTS;
use super::run_length::{Rule, rules};
use crate::cause::Cause;

/// Designed number of nights between two false alarms over all series, for known references and
/// independent normal scores. Real series deviate from that: the measured rate is about one in more
/// than 100 nights (`docs/reference/nightly.md`).
pub const NIGHTS_PER_FALSE_ALARM: f64 = 1200.0;

/// Metrics without a stable level: free disk space shrinks by design and has its own limit.
const NOT_CHARTED: &[&str] = &["free"];

/// False for a series that has no chart, and so no reference.
#[must_use]
pub fn is_charted(series: &str) -> bool {
    let metric = series.rsplit('/').next().unwrap_or_default();
    !NOT_CHARTED.contains(&metric)
}

/// Trend report of a bench.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// Summary in one sentence.
    pub headline: String,
    /// Open alarms, those with the most series first.
    pub alarms: Vec<Alarm>,
    /// Alarms that ended by recovery or acceptance, newest first.
    pub past: Vec<Alarm>,
    /// One chart per series, those of open alarms first.
    pub charts: Vec<Chart>,
    /// The nights, oldest first.
    pub nights: Vec<NightSummary>,
    /// Rules that raise alarms.
    pub rules: [Rule; 2],
}

/// Series that moved in the same night, within the uncertainty.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Alarm {
    /// ID: that of the night that raised the alarm.
    pub id: String,
    /// Indices into [`Report::charts`].
    pub charts: Vec<usize>,
    /// Night after which all series had recovered; `None` while one has not.
    pub ended: Option<usize>,
    /// Index of the night that raised the alarm.
    pub raised: usize,
    /// The earliest and the latest plausible first night of the change.
    pub since: [usize; 2],
    /// Probable cause.
    pub attribution: Attribution,
}

impl Report {
    /// Whether no series has a reference yet.
    #[must_use]
    pub fn is_learning(&self) -> bool {
        self.charts.iter().all(|c| c.reference.is_none())
    }

    /// Series of which the newest nights say nothing.
    pub fn unmeasured(&self) -> impl Iterator<Item = &Chart> {
        unmeasured(&self.charts)
    }
}

fn unmeasured(charts: &[Chart]) -> impl Iterator<Item = &Chart> {
    charts
        .iter()
        .filter(|c| c.state == SeriesState::NotMeasured)
}

/// Judges all series of `history` and the ratios derived from them.
#[must_use]
pub fn judge(history: &History) -> Report {
    let mut series: Vec<_> = history
        .series
        .iter()
        .filter(|s| is_charted(&s.name))
        .cloned()
        .collect();
    series.extend(ratios(history));
    let rules = rules(series.len(), NIGHTS_PER_FALSE_ALARM);
    let mut charts: Vec<Chart> = series
        .iter()
        .map(|s| chart(s, &history.nights, &history.accepted, rules))
        .collect();
    // Open excursions first, the largest first; then those that are not measured; the others by name.
    charts.sort_by(|a, b| {
        let is_open = |c: &Chart| c.open_excursion().is_some();
        let size = |c: &Chart| {
            c.open_excursion()
                .and_then(relative)
                .unwrap_or(f64::INFINITY)
                .abs()
        };
        let both = is_open(b).cmp(&is_open(a));
        let farther = if is_open(a) && is_open(b) {
            size(b).total_cmp(&size(a))
        } else {
            std::cmp::Ordering::Equal
        };
        let is_measured = |c: &Chart| c.state != SeriesState::NotMeasured;
        let silent = is_measured(a).cmp(&is_measured(b));
        both.then(farther)
            .then(silent)
            .then_with(|| a.series.name.cmp(&b.series.name))
    });
    let (alarms, past) = alarms(&charts, &history.nights);
    Report {
        headline: headline(&charts, &alarms, &history.nights),
        alarms,
        past,
        charts,
        nights: history.nights.clone(),
        rules,
    }
}

/// Groups excursions whose changes may have started in the same night into alarms: open ones and past ones.
fn alarms(charts: &[Chart], nights: &[NightSummary]) -> (Vec<Alarm>, Vec<Alarm>) {
    let each = charts.iter().enumerate();
    let mut all: Vec<(usize, &Excursion)> = each
        .flat_map(|(at, c)| c.excursions.iter().map(move |e| (at, e)))
        .collect();
    all.sort_by_key(|(at, e)| (e.change.nights, *at));
    let mut grouped: Vec<Alarm> = Vec::new();
    for (at, excursion) in all {
        let [first, last] = excursion.change.nights;
        // What had ended when another was raised is an alarm of its own.
        let before = |ended: Option<usize>, raised: usize| ended.is_some_and(|n| n < raised);
        let overlaps = |a: &&mut Alarm| {
            first <= a.since[1]
                && last >= a.since[0]
                && !before(a.ended, excursion.raised)
                && !before(excursion.ended, a.raised)
        };
        match grouped.iter_mut().find(overlaps) {
            Some(alarm) => {
                alarm.charts.push(at);
                alarm.raised = alarm.raised.min(excursion.raised);
                alarm.ended = alarm.ended.zip(excursion.ended).map(|(a, b)| a.max(b));
                alarm.since = [alarm.since[0].max(first), alarm.since[1].min(last)];
            }
            None => grouped.push(Alarm {
                id: String::new(),
                charts: vec![at],
                ended: excursion.ended,
                raised: excursion.raised,
                since: [first, last],
                attribution: Attribution::default(),
            }),
        }
    }
    for alarm in &mut grouped {
        alarm.charts.sort_unstable();
        alarm.id.clone_from(&nights[alarm.raised].id);
        let name = |c: &usize| charts[*c].series.name.as_str();
        let names: Vec<&str> = alarm.charts.iter().map(name).collect();
        let before = &nights[alarm.since[0].saturating_sub(1)];
        alarm.attribution = cause::attribute(before, &nights[alarm.since[1]], &names);
    }
    let (mut open, mut past): (Vec<_>, Vec<_>) =
        grouped.into_iter().partition(|a| a.ended.is_none());
    open.sort_by_key(|a| (std::cmp::Reverse(a.charts.len()), a.raised));
    past.sort_by_key(|a| std::cmp::Reverse(a.raised));
    (open, past)
}

/// Relative change; `None` if the level before the change was zero.
#[must_use]
pub fn relative(excursion: &Excursion) -> Option<f64> {
    let ratio = (excursion.after - excursion.before) / excursion.before.abs();
    ratio.is_finite().then_some(ratio)
}

/// Size of the change for display: `-15 %`, `up from 0 to 4`.
#[must_use]
pub fn format_change(excursion: &Excursion, unit: &str) -> String {
    match relative(excursion).map(|r| r * 100.0) {
        Some(percent) if percent.abs() < 1000.0 && unit != "%" => format!("{percent:+.0} %"),
        _ => {
            let way = if excursion.way == Direction::Up {
                "up"
            } else {
                "down"
            };
            let unit = if unit.is_empty() {
                String::new()
            } else {
                format!(" {unit}")
            };
            format!(
                "{way} from {} to {}{unit}",
                format_number(excursion.before),
                format_number(excursion.after)
            )
        }
    }
}

/// Formats a number with four significant digits, in exponent notation from 10,000 up and below 0.001.
#[must_use]
pub fn format_number(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return value.to_string();
    }
    let places = 3 - libm::log10(value.abs()).floor() as i32;
    if !(0..=6).contains(&places) {
        return format!("{value:.3e}").replace(".000e", "e");
    }
    let text = format!("{value:.*}", places as usize);
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

/// Date of a night.
#[must_use]
pub fn day(night: &NightSummary) -> &str {
    night.started.get(..10).unwrap_or(&night.started)
}

/// Display name of a probable cause.
#[must_use]
pub const fn cause_name(cause: Option<Cause>) -> &'static str {
    match cause {
        Some(Cause::Software) => "the software",
        Some(Cause::Rig) => "the rig",
        Some(Cause::Skin) => "the skin",
        Some(Cause::Infrastructure) => "the computer",
        None => "undetermined",
    }
}

fn headline(charts: &[Chart], alarms: &[Alarm], nights: &[NightSummary]) -> String {
    let silent = silent(charts, nights);
    let Some(alarm) = alarms.first() else {
        if let Some(silent) = silent {
            return format!("not known whether all is steady: {silent}; nothing else moved");
        }
        let in_state = |state| charts.iter().filter(|c| c.state == state).count();
        let learning = in_state(SeriesState::Learning);
        let dropped = match in_state(SeriesState::Dropped) {
            0 => String::new(),
            n => format!("; the suite no longer measures {n} more"),
        };
        let asked = charts.len() - in_state(SeriesState::Dropped);
        return if charts.is_empty() {
            "no trends: no night has a usable value yet".to_owned()
        } else if learning == charts.len() {
            format!(
                "too few nights for trends: {} of the {MIN_NIGHTS} that a reference needs",
                most_nights(charts)
            )
        } else if learning > 0 {
            format!(
                "nothing moved in {} nights; {learning} of {asked} series are still learning their reference{dropped}",
                nights.len(),
            )
        } else {
            format!(
                "nothing moved in {} nights ({asked} series){dropped}",
                nights.len(),
            )
        };
    };
    let first = &charts[alarm.charts[0]];
    let by = first
        .open_excursion()
        .map(|e| format_change(e, &first.series.unit))
        .unwrap_or_default();
    let others = match alarm.charts.len() - 1 {
        0 => String::new(),
        1 => " and 1 other series".to_owned(),
        n => format!(" and {n} other series"),
    };
    let [from, to] = alarm.since.map(|n| day(&nights[n]));
    let when = if from == to {
        format!("on {from}")
    } else {
        format!("between {from} and {to}")
    };
    let further = match alarms.len() - 1 {
        0 => String::new(),
        1 => "; 1 further alarm".to_owned(),
        n => format!("; {n} further alarms"),
    };
    let silent = silent.map_or_else(String::new, |silent| format!("; {silent}"));
    format!(
        "{} moved ({by}){others} {when}; probable cause: {} ({}){further}{silent}",
        first.series.name,
        cause_name(alarm.attribution.cause),
        alarm.attribution.reason,
    )
}

/// Which series the newest nights say nothing about, and since when; `None` if there are none.
fn silent(charts: &[Chart], nights: &[NightSummary]) -> Option<String> {
    let silent: Vec<&Chart> = unmeasured(charts).collect();
    // A ratio is missing because of what it is made of.
    let is_measured = |c: &Chart| c.series.unit != RATIO;
    let rank = |c: &&&Chart| (is_measured(c), c.unmeasured_nights);
    let first = silent.iter().rev().max_by_key(rank)?;
    let is_other =
        |c: &&Chart| c.series.name == first.series.name && c.series.unit != first.series.unit;
    let unit = charts
        .iter()
        .find(is_other)
        .map_or_else(String::new, |other| {
            format!(" in {}, now in {},", first.series.unit, other.series.unit)
        });
    let last = &nights[first.nights.last()?.night];
    let others = match silent.len() - 1 {
        0 => String::new(),
        n => format!(
            "; nor {} {n} other series",
            if n == 1 { "has" } else { "have" }
        ),
    };
    Some(format!(
        "{}{unit} has had no usable value since {} ({} nights){others}",
        first.series.name,
        day(last),
        first.unmeasured_nights
    ))
}

/// Largest number of reference nights of any series.
fn most_nights(charts: &[Chart]) -> usize {
    let count_nights = |c: &Chart| {
        let from = c.accepted.last().copied().unwrap_or(0);
        c.nights.iter().filter(|n| n.night >= from).count()
    };
    charts.iter().map(count_nights).max().unwrap_or(0)
}

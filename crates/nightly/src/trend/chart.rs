//! The control chart of one series: every night scored against the reference stretch, and runs of nights that are off.

use serde::Serialize;

use super::change::{self, Between};
use super::history::{Acceptance, NightHead, Point, Series};
use super::reference::{FEWEST, MOST, Reference, Sample};
use super::run_length::Rule;

/// Nights that a value waits before it may join the reference: when it began a change, that is known by then.
const JOINS_AFTER: usize = 5;
/// So many nights in a row that are not off end an excursion.
const BACK: usize = 5;

/// A series with its chart.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Chart {
    /// The series.
    pub series: Series,
    /// One per usable value, oldest first.
    pub nights: Vec<Charted>,
    /// The reference by which the newest nights are judged; `None`: it is being learnt.
    pub reference: Option<Reference>,
    /// Times at which it was off, oldest first.
    pub excursions: Vec<Excursion>,
    /// Nights from which on it was learnt anew.
    pub accepted: Vec<usize>,
}

/// A value on its chart.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Charted {
    /// Which of the nights.
    pub night: usize,
    /// The value.
    pub value: f64,
    /// Standard deviations of a new night from the centre; `None`: learnt from.
    pub score: Option<f64>,
}

/// Which way a series went.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Way {
    /// Higher.
    Up,
    /// Lower.
    Down,
}

impl Way {
    /// 1 for up, -1 for down.
    #[must_use]
    pub const fn sign(self) -> f64 {
        match self {
            Self::Up => 1.0,
            Self::Down => -1.0,
        }
    }

    const fn other(self) -> Self {
        match self {
            Self::Up => Self::Down,
            Self::Down => Self::Up,
        }
    }
}

/// A time at which a series was off.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Excursion {
    /// Which way.
    pub way: Way,
    /// The night that raised the alarm.
    pub raised: usize,
    /// The night after which it was back, or was accepted; `None`: it is still off.
    pub ended: Option<usize>,
    /// The first night that was off: the likeliest, and between which ones.
    pub change: Between,
    /// Centre of the reference.
    pub before: f64,
    /// Median of the nights from the change on.
    pub after: f64,
}

/// What a chart knows while it goes through the nights.
struct Walk {
    counts: bool,
    rules: [Rule; 2],
    learnt: Vec<Sample>,
    waiting: Vec<Sample>,
    reference: Option<Reference>,
    /// Scores against the present reference, oldest first.
    scores: Vec<f64>,
    open: Option<usize>,
    /// Where the nights of the present reference begin.
    from: usize,
}

/// The chart of `series` over `nights` under these rules.
#[must_use]
pub fn chart(
    series: &Series,
    nights: &[NightHead],
    accepted: &[Acceptance],
    rules: [Rule; 2],
) -> Chart {
    let whole = |p: &Point| p.value.is_none_or(|v| v >= 0.0 && v.fract() == 0.0);
    let mut walk = Walk {
        counts: series.unit.is_empty() && series.points.iter().all(whole),
        rules,
        learnt: Vec::new(),
        waiting: Vec::new(),
        reference: None,
        scores: Vec::new(),
        open: None,
        from: 0,
    };
    let mut chart = Chart {
        series: series.clone(),
        nights: Vec::new(),
        reference: None,
        excursions: Vec::new(),
        accepted: restarts(&series.name, nights, accepted),
    };
    let mut restarts = chart.accepted.clone().into_iter().peekable();
    for point in &series.points {
        while restarts.next_if(|night| *night <= point.night).is_some() {
            walk.restart(&mut chart);
        }
        if let Some(value) = point.usable() {
            walk.night(&mut chart, point, value);
        }
    }
    chart.reference = walk.reference;
    walk.finish(&mut chart);
    chart
}

/// The nights from which on the series is learnt anew, oldest first.
fn restarts(series: &str, nights: &[NightHead], accepted: &[Acceptance]) -> Vec<usize> {
    let concerns = |a: &&Acceptance| a.series.as_deref().is_none_or(|s| s == series);
    let place = |a: &Acceptance| nights.iter().position(|n| n.id == a.night);
    let mut all: Vec<usize> = accepted.iter().filter(concerns).filter_map(place).collect();
    all.sort_unstable();
    all.dedup();
    all
}

impl Walk {
    fn restart(&mut self, chart: &mut Chart) {
        self.close(chart);
        self.learnt.clear();
        self.waiting.clear();
        self.reference = None;
        self.scores.clear();
        self.from = chart.nights.len();
    }

    fn night(&mut self, chart: &mut Chart, point: &Point, value: f64) {
        let sample = Sample {
            value,
            half_interval: point.interval.map(|[low, high]| (high - low) / 2.0),
            of: point.n.filter(|_| chart.series.unit == "%"),
        };
        let score = self.reference.map(|reference| reference.score(value));
        self.scores.extend(score);
        chart.nights.push(Charted {
            night: point.night,
            value,
            score,
        });
        self.judge(chart);
        self.learn(sample);
    }

    /// Raises and ends alarms.
    fn judge(&mut self, chart: &mut Chart) {
        let Some(reference) = self.reference else {
            return;
        };
        let rules = self.rules;
        let speaks = |scores: &[f64], way: Way| rules.iter().any(|r| r.speaks(scores, way.sign()));
        if let Some(at) = self.open {
            let way = chart.excursions[at].way;
            let limit = rules[0].limit.min(rules[1].limit);
            let mut recent = self.scores.iter().rev().take(BACK);
            let back = recent.all(|z| way.sign() * z <= limit);
            // Back, or gone over to the other side.
            if !back && !speaks(&self.scores, way.other()) {
                return;
            }
            self.close(chart);
        }
        let Some(way) = [Way::Up, Way::Down]
            .into_iter()
            .find(|way| speaks(&self.scores, *way))
        else {
            return;
        };
        let last = chart.nights.len() - 1;
        self.open = Some(chart.excursions.len());
        chart.excursions.push(Excursion {
            way,
            raised: chart.nights[last].night,
            ended: None,
            change: change::locate(&chart.nights[self.from..], way),
            before: reference.centre,
            after: f64::NAN,
        });
    }

    /// A value joins the reference when it has waited and nothing is off.
    fn learn(&mut self, sample: Sample) {
        if self.learnt.len() < FEWEST {
            self.learnt.push(sample);
        } else if self.learnt.len() < MOST && self.open.is_none() {
            self.waiting.push(sample);
            if self.waiting.len() <= JOINS_AFTER {
                return;
            }
            self.learnt.push(self.waiting.remove(0));
        } else {
            return;
        }
        self.reference = Reference::of(&self.learnt, self.counts);
    }

    /// The series is back, or another reference begins.
    fn close(&mut self, chart: &mut Chart) {
        if let Some(at) = self.open.take() {
            let last = chart.nights.last().map(|n| n.night);
            chart.excursions[at].ended = last;
            level(chart, at);
        }
    }

    /// What all nights say of an excursion that is still open.
    fn finish(&self, chart: &mut Chart) {
        if let Some(at) = self.open {
            chart.excursions[at].change =
                change::locate(&chart.nights[self.from..], chart.excursions[at].way);
            level(chart, at);
        }
    }
}

/// Fills in the level since the change.
fn level(chart: &mut Chart, at: usize) {
    let excursion = &mut chart.excursions[at];
    let within = |n: &&Charted| {
        n.night >= excursion.change.likeliest && excursion.ended.is_none_or(|end| n.night <= end)
    };
    let mut values: Vec<f64> = chart
        .nights
        .iter()
        .filter(within)
        .map(|n| n.value)
        .collect();
    values.sort_by(f64::total_cmp);
    excursion.after = super::reference::quantile(&values, 0.5);
}

impl Chart {
    /// The excursion that is still open.
    #[must_use]
    pub fn off(&self) -> Option<&Excursion> {
        self.excursions.last().filter(|e| e.ended.is_none())
    }
}

//! The control chart of one series: every night scored against the reference stretch, two sums that gather what stays off.

use serde::Serialize;

use super::change::{self, Between};
use super::history::{Acceptance, NightHead, Point, Series};
use super::reference::{FEWEST, MOST, Reference, Sample};
use super::run_length::{ALLOWANCE, clip};

/// Nights that a value waits before it may join the reference: when it began a change, that is known by then.
const JOINS_AFTER: usize = 5;

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
    /// Standard deviations from the centre, clipped; `None`: learnt from.
    pub score: Option<f64>,
    /// The sum of what was too high, then of what was too low, over the decision interval: an alarm is raised above 1.
    pub sums: [f64; 2],
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
    interval: f64,
    learnt: Vec<Sample>,
    waiting: Vec<Sample>,
    reference: Option<Reference>,
    sums: [f64; 2],
    open: Option<usize>,
    /// Where the nights of the present reference begin.
    from: usize,
}

/// The chart of `series` over `nights` at this decision interval.
#[must_use]
pub fn chart(
    series: &Series,
    nights: &[NightHead],
    accepted: &[Acceptance],
    interval: f64,
) -> Chart {
    let whole = |p: &Point| p.value.is_none_or(|v| v >= 0.0 && v.fract() == 0.0);
    let mut walk = Walk {
        counts: series.unit.is_empty() && series.points.iter().all(whole),
        interval,
        learnt: Vec::new(),
        waiting: Vec::new(),
        reference: None,
        sums: [0.0; 2],
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
        self.sums = [0.0; 2];
        self.from = chart.nights.len();
    }

    fn night(&mut self, chart: &mut Chart, point: &Point, value: f64) {
        let sample = Sample {
            value,
            half_interval: point.interval.map(|[low, high]| (high - low) / 2.0),
            of: point.n.filter(|_| chart.series.unit == "%"),
        };
        let score = self.reference.map(|reference| {
            let most = clip(self.interval);
            reference.score(value).clamp(-most, most)
        });
        if let Some(score) = score {
            for (sum, score) in self.sums.iter_mut().zip([score, -score]) {
                // Not far above the alarm, so that it comes down within a week when the series is back.
                let most = self.interval * 1.5;
                *sum = (*sum + score - ALLOWANCE).clamp(0.0, most);
            }
        }
        chart.nights.push(Charted {
            night: point.night,
            value,
            score,
            sums: self.sums.map(|sum| sum / self.interval),
        });
        self.judge(chart);
        self.learn(sample);
    }

    /// Raises and ends alarms.
    fn judge(&mut self, chart: &mut Chart) {
        let Some(reference) = self.reference else {
            return;
        };
        // Two clipped nights end on the interval, up to rounding.
        let above = self.sums.map(|sum| sum > self.interval * (1.0 + 1e-9));
        if let Some(at) = self.open {
            let side = usize::from(chart.excursions[at].way == Way::Down);
            // Back, or gone over to the other side.
            if self.sums[side] > 0.0 && !above[1 - side] {
                return;
            }
            self.close(chart);
        }
        let way = match above {
            [true, _] => Way::Up,
            [_, true] => Way::Down,
            _ => return,
        };
        let last = chart.nights.len() - 1;
        self.open = Some(chart.excursions.len());
        self.waiting.clear();
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

//! Control chart of one series: scores every night against the reference nights and detects runs of outliers.

use serde::Serialize;
use skinrig_model::quantile;

use super::change::{self, ChangeWindow};
use super::drift;
use super::history::{Acceptance, NightSummary, Point, Series};
use super::reference::{MAX_NIGHTS, MIN_NIGHTS, Reference, Sample};
use super::run_length::Rule;

/// Nights by which a value is delayed before it joins the reference. A change that starts with it
/// is detected by then.
const REFERENCE_DELAY: usize = 5;
/// Consecutive nights within the limits that end an excursion.
const RECOVERY_NIGHTS: usize = 5;

/// Newest nights without a usable value that end what a series says: as many as an alarm needs.
const UNMEASURED_NIGHTS: usize = 3;

/// What is known of a series.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SeriesState {
    /// An excursion is open.
    Moved,
    /// There are too few nights for a reference.
    Learning,
    /// The newest nights have no usable value: it may have moved.
    NotMeasured,
    /// Another suite that does not ask for it has taken over.
    Dropped,
    /// Within its reference.
    Steady,
}

/// A series with its control chart.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Chart {
    /// The charted series.
    pub series: Series,
    /// One point per usable value, oldest first.
    pub nights: Vec<ChartPoint>,
    /// Reference for the newest nights; `None` while there are too few nights.
    pub reference: Option<Reference>,
    /// Excursions, oldest first.
    pub excursions: Vec<Excursion>,
    /// Indices of the nights at which the reference restarts.
    pub accepted: Vec<usize>,
    /// What is known of it after the newest night.
    pub state: SeriesState,
    /// Number of newest nights without a usable value.
    pub unmeasured_nights: usize,
}

/// A point of the chart.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ChartPoint {
    /// Index of the night.
    pub night: usize,
    /// The value.
    pub value: f64,
    /// Distance from the centre in standard deviations of a new night; `None` for nights that only
    /// build the reference.
    pub score: Option<f64>,
}

/// Direction of a change.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Direction {
    /// Higher.
    Up,
    /// Lower.
    Down,
}

impl Direction {
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

/// A period in which a series was outside its reference.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Excursion {
    /// Direction of the change.
    pub way: Direction,
    /// Whether the series drifted while its reference was learned; otherwise it changed within a few nights.
    pub is_drift: bool,
    /// Index of the night that raised the alarm.
    pub raised: usize,
    /// Index of the last night of the excursion, ended by recovery or acceptance; `None`: still
    /// open.
    pub ended: Option<usize>,
    /// When the change began. That of a drift is only known to follow the first nights of the reference.
    pub change: ChangeWindow,
    /// Centre of the reference.
    pub before: f64,
    /// Median of the nights after the change.
    pub after: f64,
}

/// State while the nights are processed in order.
struct ChartBuilder {
    is_count: bool,
    rules: [Rule; 2],
    learned: Vec<Sample>,
    waiting: Vec<Sample>,
    reference: Option<Reference>,
    /// Whether the reference stays as it is, because later nights drift away from it.
    is_frozen: bool,
    /// Scores against the current reference, oldest first.
    scores: Vec<f64>,
    open: Option<usize>,
    /// Index in the chart of the first night scored against the current reference.
    from: usize,
}

/// Builds the control chart of `series` over `nights`.
#[must_use]
pub fn chart(
    series: &Series,
    nights: &[NightSummary],
    accepted: &[Acceptance],
    rules: [Rule; 2],
) -> Chart {
    let whole = |p: &Point| p.value.is_none_or(|v| v >= 0.0 && v.fract() == 0.0);
    let mut builder = ChartBuilder {
        is_count: series.unit.is_empty() && series.points.iter().all(whole),
        rules,
        learned: Vec::new(),
        waiting: Vec::new(),
        reference: None,
        is_frozen: false,
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
        state: SeriesState::Learning,
        unmeasured_nights: 0,
    };
    let mut restarts = chart.accepted.clone().into_iter().peekable();
    for point in &series.points {
        while restarts.next_if(|night| *night <= point.night).is_some() {
            builder.restart(&mut chart);
        }
        if let Some(value) = point.usable() {
            builder.add_night(&mut chart, point, value);
        }
    }
    chart.reference = builder.reference;
    builder.finish(&mut chart);
    let next = chart.nights.last().map_or(0, |n| n.night + 1);
    chart.unmeasured_nights = nights.len().saturating_sub(next);
    chart.state = chart.state(nights);
    chart
}

/// Nights at which the reference of the series restarts, oldest first.
fn restarts(series: &str, nights: &[NightSummary], accepted: &[Acceptance]) -> Vec<usize> {
    let concerns = |a: &&Acceptance| a.series.as_deref().is_none_or(|s| s == series);
    let place = |a: &Acceptance| nights.iter().position(|n| n.id == a.night);
    let mut all: Vec<usize> = accepted.iter().filter(concerns).filter_map(place).collect();
    all.sort_unstable();
    all.dedup();
    all
}

impl ChartBuilder {
    fn restart(&mut self, chart: &mut Chart) {
        self.close(chart);
        self.learned.clear();
        self.waiting.clear();
        self.reference = None;
        self.is_frozen = false;
        self.scores.clear();
        self.from = chart.nights.len();
    }

    fn add_night(&mut self, chart: &mut Chart, point: &Point, value: f64) {
        let sample = Sample {
            value,
            half_interval: point.interval.map(|[low, high]| (high - low) / 2.0),
            trials: point.n.filter(|_| chart.series.unit == "%"),
        };
        let score = self.reference.map(|reference| reference.score(value));
        self.scores.extend(score);
        chart.nights.push(ChartPoint {
            night: point.night,
            value,
            score,
        });
        self.judge(chart);
        if self.learn(sample)
            && let Some(way) = drift::direction(&self.learned, self.is_count)
        {
            self.freeze(chart, way);
        }
    }

    /// Opens and closes excursions.
    fn judge(&mut self, chart: &mut Chart) {
        let Some(reference) = self.reference else {
            return;
        };
        let rules = self.rules;
        let raises_alarm = |scores: &[f64], way: Direction| {
            rules.iter().any(|r| r.raises_alarm(scores, way.sign()))
        };
        if let Some(at) = self.open {
            let way = chart.excursions[at].way;
            let limit = rules[0].limit.min(rules[1].limit);
            let mut recent = self.scores.iter().rev().take(RECOVERY_NIGHTS);
            let is_back = recent.all(|z| way.sign() * z <= limit);
            // The excursion ends within the limits, or beyond the opposite limit.
            if !is_back && !raises_alarm(&self.scores, way.other()) {
                return;
            }
            self.close(chart);
        }
        let Some(way) = [Direction::Up, Direction::Down]
            .into_iter()
            .find(|way| raises_alarm(&self.scores, *way))
        else {
            return;
        };
        self.open(chart, way, false, reference.centre);
    }

    fn open(&mut self, chart: &mut Chart, way: Direction, is_drift: bool, before: f64) {
        self.open = Some(chart.excursions.len());
        chart
            .excursions
            .extend(chart.nights.last().map(|last| Excursion {
                way,
                is_drift,
                raised: last.night,
                ended: None,
                change: self.locate(&chart.nights, way, is_drift),
                before,
                after: f64::NAN,
            }));
    }

    /// When the change towards `way` began that lasts until the newest night.
    fn locate(&self, nights: &[ChartPoint], way: Direction, is_drift: bool) -> ChangeWindow {
        let nights = &nights[self.from..];
        let mut change = change::locate(nights, way);
        if let Some(first) = nights.get(MIN_NIGHTS).filter(|_| is_drift) {
            change.nights[0] = first.night;
        }
        change
    }

    /// Adds a value to the reference once it has waited long enough and no excursion is open. Returns whether the reference changed.
    fn learn(&mut self, sample: Sample) -> bool {
        if self.learned.len() < MIN_NIGHTS {
            self.learned.push(sample);
        } else if self.learned.len() < MAX_NIGHTS && self.open.is_none() && !self.is_frozen {
            self.waiting.push(sample);
            if self.waiting.len() <= REFERENCE_DELAY {
                return false;
            }
            self.learned.push(self.waiting.remove(0));
        } else {
            return false;
        }
        self.reference = Reference::of(&self.learned, self.is_count);
        true
    }

    /// Keeps only the first nights of a reference that drifted, scores the nights after them against it, and opens an excursion.
    fn freeze(&mut self, chart: &mut Chart, way: Direction) {
        self.learned.truncate(MIN_NIGHTS);
        self.waiting.clear();
        self.is_frozen = true;
        self.reference = Reference::of(&self.learned, self.is_count);
        let Some(reference) = self.reference else {
            return;
        };
        self.scores.clear();
        for night in chart.nights[self.from..].iter_mut().skip(MIN_NIGHTS) {
            let score = reference.score(night.value);
            night.score = Some(score);
            self.scores.push(score);
        }
        self.open(chart, way, true, reference.centre);
    }

    /// Closes the open excursion.
    fn close(&mut self, chart: &mut Chart) {
        if let Some(at) = self.open.take() {
            let last = chart.nights.last().map(|n| n.night);
            chart.excursions[at].ended = last;
            set_level_after(chart, at);
        }
    }

    /// Re-estimates the open excursion from all nights.
    fn finish(&self, chart: &mut Chart) {
        if let Some(at) = self.open {
            let Excursion { way, is_drift, .. } = chart.excursions[at];
            chart.excursions[at].change = self.locate(&chart.nights, way, is_drift);
            set_level_after(chart, at);
        }
    }
}

/// Computes the level after the change.
fn set_level_after(chart: &mut Chart, at: usize) {
    let excursion = &mut chart.excursions[at];
    let within = |n: &&ChartPoint| {
        n.night >= excursion.change.likeliest && excursion.ended.is_none_or(|end| n.night <= end)
    };
    let mut values: Vec<f64> = chart
        .nights
        .iter()
        .filter(within)
        .map(|n| n.value)
        .collect();
    values.sort_by(f64::total_cmp);
    excursion.after = quantile(&values, 0.5).unwrap_or(f64::NAN);
}

impl Chart {
    fn state(&self, nights: &[NightSummary]) -> SeriesState {
        if self.open_excursion().is_some() {
            return SeriesState::Moved;
        }
        // What never had a value, this bench may be unable to measure: a limit for it would have failed.
        if self.unmeasured_nights < UNMEASURED_NIGHTS || self.nights.is_empty() {
            return match self.reference {
                Some(_) => SeriesState::Steady,
                None => SeriesState::Learning,
            };
        }
        let asked = self.series.points.last().and_then(|p| nights.get(p.night));
        let suites = asked.zip(nights.last());
        let measured = self.nights.last().map(|n| n.night);
        let is_asked_in_vain = self.series.points.last().map(|p| p.night) != measured;
        if !is_asked_in_vain && suites.is_some_and(|(a, b)| a.suite_sha256 != b.suite_sha256) {
            SeriesState::Dropped
        } else {
            SeriesState::NotMeasured
        }
    }

    /// The open excursion, if any.
    #[must_use]
    pub fn open_excursion(&self) -> Option<&Excursion> {
        self.excursions.last().filter(|e| e.ended.is_none())
    }
}

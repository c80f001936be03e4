//! Measures choices one after the other, and predicts those that the search picks.

use std::ops::ControlFlow;

use skinrig_model::{AnalysisSettings, CalibrationModel, Locator, SENSOR_WIDTH};

use super::choice::{self, Choice, Region};
use super::plan::{Plan, Progress};
use super::predict::{Predictions, predict};
use super::replay::Replay;
use super::rows::Row;
use super::rule::{Point, Rule};
use super::search;
use super::timing::{self, Candidate, Time};
use super::winner::PressErrors;

/// A choice does not compete if it locates fewer presses than the session's own by more than this share.
const LOCATED_MARGIN: f64 = 0.01;

/// Choices measured so far.
pub(super) struct Measuring<'a> {
    pub replay: &'a Replay<'a>,
    /// Settings of the session.
    pub session: &'a AnalysisSettings,
    /// The same with whole presses.
    pub reading: &'a AnalysisSettings,
    pub model: CalibrationModel,
    pub locator: Locator,
    pub press_s: f64,
    pub plan: Plan,
    pub rows: Vec<Row>,
    pub candidates: Vec<Candidate>,
    pub errors: Vec<PressErrors>,
    pub points: Vec<Point>,
    /// Index of the competing row with the smallest RMSE.
    pub best: Option<usize>,
    pub is_stopped: bool,
    pub watch: &'a mut dyn FnMut(&Progress<'_>) -> ControlFlow<()>,
}

impl Measuring<'_> {
    /// Minimum located rate to compete; that of the first row decides.
    pub(super) fn least_located(&self) -> f64 {
        let own = self.rows.first().and_then(|r| r.located_rate.value);
        let by_own = (own.unwrap_or(0.0) - LOCATED_MARGIN).max(0.0);
        self.plan.least_located.unwrap_or(by_own)
    }

    /// Measures a choice, except for its time, unless stopped. True if it competes.
    fn add(&mut self, choice: Choice) -> bool {
        if self.is_stopped {
            return false;
        }
        let Some(crop) = self.replay.region_rows(self.reading, choice.region) else {
            return false;
        };
        let settings = choice.settings(self.session, crop, self.model, self.locator);
        let outcome = self.replay.run(&settings);
        let bits = bits_per_event(&settings);
        self.errors.push(outcome.errors);
        self.rows.push(Row {
            choice,
            rows: crop,
            overrides: choice::overrides(self.session, &settings),
            rmse_mm: outcome.metrics.rmse_mm,
            penalised_rmse_mm: outcome.penalised.rmse_mm,
            located_rate: outcome.metrics.located_rate,
            within_rate: outcome.metrics.within_rate,
            events_per_press: outcome.events_per_press,
            bytes_per_s: outcome.events_per_press * bits / 8.0 / self.press_s,
            delay_ms: outcome.delay_ms,
            pixels: pixels(crop, settings.bin_px),
            cpu_us: 0.0,
            cpu_range_us: (0.0, 0.0),
            competes: false,
            fronts: Vec::new(),
        });
        self.candidates.push(Candidate {
            settings,
            locator: outcome.located.fitted(),
        });
        let located = outcome.metrics.located_rate.value.unwrap_or(0.0);
        let competes = located >= self.least_located();
        let rmse_mm = outcome
            .metrics
            .rmse_mm
            .value
            .filter(|v| competes && *v > 0.0);
        self.points.push(Point {
            choice,
            events: outcome.events_per_press,
            rmse_mm,
            cpu_us: 0.0,
        });
        let at = self.points.len() - 1;
        let is_best = |best: usize| self.points[best].rmse_mm > rmse_mm;
        if rmse_mm.is_some() && self.best.is_none_or(is_best) {
            self.best = Some(at);
        }
        let progress = Progress {
            measured: self.points.len(),
            best: self.best.map(|best| &self.rows[best]),
        };
        self.is_stopped = (self.watch)(&progress).is_break();
        rmse_mm.is_some()
    }

    /// The choices that the session can measure: without calibration presses nothing says which part of the rows to read.
    fn possible(&self, choices: Vec<Choice>) -> impl Iterator<Item = Choice> + use<> {
        let parts = self.replay.calibrates();
        let mut choices = choices;
        choices.retain(|c| parts || c.region == Region::Full);
        choices.into_iter()
    }

    /// Measures the choices of the plan. The curves and draws come first.
    pub(super) fn measure(&mut self) -> Predictions {
        let base = Choice::of(self.session);
        let all: Vec<Choice> = self.possible(choice::all(base)).collect();
        let combinations = all.len();
        if self.plan.full {
            all.into_iter().for_each(|choice| {
                self.add(choice);
            });
            return Predictions {
                combinations,
                ..Predictions::default()
            };
        }
        self.possible(choice::curves(base)).for_each(|choice| {
            self.add(choice);
        });
        let curves = self.points.clone();
        let rule = Rule::new(base, &curves);
        let mut pools = search::pools(&all, &rule);
        let seed = self.session.seed;
        let mut order = search::shuffled(&pools[0], &curves, seed).into_iter();
        search::draw(&mut order, search::DRAWS, |choice| self.add(choice));
        let draw_rows = self.points.len() - curves.len();
        search::draw(&mut order, self.plan.checks, |choice| self.add(choice));
        let check_rows = self.points.len() - curves.len() - draw_rows;
        for point in self.points.iter().filter(|p| p.rmse_mm.is_some()) {
            search::admit(&mut pools, point.choice);
        }
        for turn in 0..search::PROMISING {
            let picked = search::promising(&pools[0], &self.points, &rule, turn);
            let Some(choice) = picked.filter(|_| !self.is_stopped) else {
                break;
            };
            if self.add(choice) {
                search::admit(&mut pools, choice);
            }
        }
        let best = self.best.map(|best| self.points[best].choice);
        for about in [Some(base), best].into_iter().flatten() {
            for choice in self.possible(choice::grids(about)) {
                if search::is_fresh(choice, &self.points) {
                    self.add(choice);
                }
            }
        }
        Predictions {
            combinations,
            curve_rows: curves.len(),
            draw_rows,
            check_rows,
            of: Vec::new(),
        }
    }

    /// Times all choices. Returns the number of timed presses.
    pub(super) fn time(&mut self, repeats: u32, stopwatch: &mut dyn FnMut() -> f64) -> u32 {
        let outline = self.replay.outline();
        let (times, presses) =
            timing::run(self.replay, outline, &self.candidates, repeats, stopwatch);
        let rows = self.rows.iter_mut().zip(&mut self.points);
        for ((row, point), time) in rows.zip(times) {
            let Time {
                median_us,
                range_us,
            } = time;
            (row.cpu_us, row.cpu_range_us) = (median_us, range_us);
            point.cpu_us = median_us;
        }
        presses
    }

    /// Predicts the choices that are neither part of the curves nor of the draws.
    pub(super) fn predict(&self, how: &mut Predictions) {
        let (curves, rest) = self.points.split_at(how.curve_rows);
        let (draws, tested) = rest.split_at(how.draw_rows);
        let rule = Rule::new(Choice::of(self.session), curves);
        let first = how.curve_rows + how.draw_rows;
        let tested = (0..).zip(tested);
        let numbered = tested.map(|(i, p)| (first + i, i < how.check_rows, *p));
        how.of = predict(&rule, draws, numbered, search::DRAWS);
    }
}

/// Pixels of the camera that reads more rows, in bins of this side.
fn pixels(rows: [(u16, u16); 2], bin_px: u16) -> u32 {
    let bins = |count: u16| u32::from(count.div_ceil(bin_px.max(1)));
    let rows = rows.map(|(first, last)| bins(last.abs_diff(first).saturating_add(1)));
    bins(SENSOR_WIDTH) * rows[0].max(rows[1])
}

/// Bits per event of the settings; halving columns or rows shortens a pixel address by one bit.
fn bits_per_event(settings: &AnalysisSettings) -> f64 {
    let saved = 2 * u32::from(settings.bin_px).trailing_zeros();
    (settings.bits_per_event - f64::from(saved)).max(1.0)
}

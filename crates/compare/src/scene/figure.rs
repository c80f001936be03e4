//! Figures of a session that a scene predicts, and how they are found.

use serde::{Deserialize, Serialize};
use skinrig_analysis::Analysis;
use skinrig_analysis::event_statistics::{
    EventStatistics, PressCourse, PressPolarity, PressStatistics,
};
use skinrig_analysis::metrics::quantile;
use skinrig_analysis::result::{PressResult, PressView};

/// The lift itself ends this long after its start, ms; events that follow come from the skin's relaxation.
const AFTER_LIFT_MS: f64 = 200.0;
/// The rate that is left counts until this, ms.
const FADING_MS: f64 = 600.0;
/// Least time in which it counts, ms.
const LEAST_MS: f64 = 100.0;

/// A figure of a session: events and presses of both cameras together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SessionFigure {
    /// Events per second in the window of a press, median of the presses.
    PressRate,
    /// Standard deviation between presses of the logarithm of that rate.
    PressSpread,
    /// Events per second between presses, median.
    IdleRate,
    /// Share of ON events after a contact.
    OnAtPress,
    /// Share of ON events after a lift.
    OnAtLift,
    /// Time from the contact until the mean rate has risen half of the way to its peak, ms.
    Rise,
    /// Mean rate 200 to 600 ms after a lift over that of the first 200 ms, both above the rate before a press.
    Fading,
    /// Width of a touch in columns, median, px.
    Width,
    /// Variance over mean of the counts in 10 ms.
    Dispersion,
    /// How many times chance an event has one 8 px away in the millisecond before.
    Neighbours,
    /// Share of the pixels with events.
    ActivePixels,
    /// Share of the events from the busiest 1 % of the pixels.
    BusiestPixels,
    /// Share of events with the timestamp of the event before.
    EqualTimes,
    /// Share of the scored presses that are located.
    Located,
    /// RMSE of the scored presses, mm.
    Rmse,
    /// Standard deviation between repetitions, mm.
    RepeatStd,
}

/// Scale on which replicates are taken for normal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Scale {
    Linear,
    Logarithm,
    /// Arcsine of the root, of a share.
    Share,
}

impl Scale {
    pub(crate) fn of(self, x: f64) -> f64 {
        match self {
            Self::Linear => x,
            Self::Logarithm => libm::log(x),
            Self::Share => libm::asin(x.sqrt()),
        }
    }

    pub(crate) fn back(self, x: f64) -> f64 {
        match self {
            Self::Linear => x,
            Self::Logarithm => libm::exp(x),
            Self::Share => {
                let root = libm::sin(x.clamp(0.0, core::f64::consts::FRAC_PI_2));
                root * root
            }
        }
    }
}

impl SessionFigure {
    /// All, in the order of the tables.
    pub const ALL: [Self; 16] = [
        Self::PressRate,
        Self::PressSpread,
        Self::IdleRate,
        Self::OnAtPress,
        Self::OnAtLift,
        Self::Rise,
        Self::Fading,
        Self::Width,
        Self::Dispersion,
        Self::Neighbours,
        Self::ActivePixels,
        Self::BusiestPixels,
        Self::EqualTimes,
        Self::Located,
        Self::Rmse,
        Self::RepeatStd,
    ];

    pub(crate) const fn scale(self) -> Scale {
        match self {
            Self::Rise | Self::Fading => Scale::Linear,
            Self::OnAtPress
            | Self::OnAtLift
            | Self::ActivePixels
            | Self::BusiestPixels
            | Self::EqualTimes
            | Self::Located => Scale::Share,
            _ => Scale::Logarithm,
        }
    }

    /// Least standard deviation on the scale: that of a binomial share of the session's presses.
    pub(super) fn least_deviation(self, session: &SessionFigures) -> f64 {
        match self {
            Self::Located if session.presses > 0 => 0.5 / f64::from(session.presses).sqrt(),
            _ => 0.0,
        }
    }
}

/// Figures of one session.
#[derive(Debug, Clone, PartialEq)]
pub struct SessionFigures {
    pub(super) values: [Option<f64>; SessionFigure::ALL.len()],
    /// Attempted scored presses.
    pub(super) presses: u32,
}

impl SessionFigures {
    /// The nearest value that a session can have: a share of presses is one of whole presses, all others are as they are.
    pub(crate) fn attainable(&self, figure: SessionFigure, value: f64) -> f64 {
        let presses = f64::from(self.presses);
        match figure {
            SessionFigure::Located if self.presses > 0 => (value * presses).round() / presses,
            _ => value,
        }
    }
}

impl SessionFigures {
    /// Of an analysis and the statistics of its cameras. A figure that does not exist, or is no number, is left out.
    #[must_use]
    pub fn of(analysis: &Analysis, cameras: &[EventStatistics]) -> Self {
        let around = cameras.iter().map(|c| PressStatistics {
            polarity: c.polarity,
            course: c.course.clone(),
        });
        let mut found = Self::of_presses(analysis, &around.collect::<Vec<_>>());
        for (value, figure) in found.values.iter_mut().zip(SessionFigure::ALL) {
            let of_stream = of_stream(figure, cameras);
            *value = value.or(of_stream.filter(|x| figure.scale().of(*x).is_finite()));
        }
        found
    }

    /// Of an analysis and the statistics of its cameras around the presses: without the figures of whole streams.
    #[must_use]
    pub fn of_presses(analysis: &Analysis, cameras: &[PressStatistics]) -> Self {
        let values = SessionFigure::ALL.map(|figure| {
            let value = value(figure, analysis, cameras);
            value.filter(|x| figure.scale().of(*x).is_finite())
        });
        Self {
            values,
            presses: analysis.scored.located_rate.n,
        }
    }

    /// With these values.
    #[cfg(test)]
    pub(crate) fn with(values: &[(SessionFigure, f64)]) -> Self {
        let of = |figure| values.iter().find(|(f, _)| *f == figure).map(|(_, x)| *x);
        Self {
            values: SessionFigure::ALL.map(of),
            presses: 40,
        }
    }

    /// Value of a figure, in its unit.
    #[must_use]
    pub fn get(&self, figure: SessionFigure) -> Option<f64> {
        let at = SessionFigure::ALL.iter().position(|f| *f == figure)?;
        self.values[at]
    }
}

/// A figure of all events of the streams.
fn of_stream(figure: SessionFigure, cameras: &[EventStatistics]) -> Option<f64> {
    let mean = |of: fn(&EventStatistics) -> Option<f64>| mean(cameras.iter().map(of));
    match figure {
        SessionFigure::Dispersion => mean(|c| c.dispersion),
        SessionFigure::Neighbours => mean(|c| {
            let chance = c.correlation_by_chance.filter(|c| *c > 0.0)?;
            let ring = c.correlation.iter().find(|r| r.distance_px == 8.0)?;
            Some(ring.active / chance)
        }),
        SessionFigure::ActivePixels => mean(|c| Some(c.active_pixels)),
        SessionFigure::BusiestPixels => mean(|c| c.hottest_share),
        SessionFigure::EqualTimes => mean(|c| c.equal_times),
        _ => None,
    }
}

fn value(figure: SessionFigure, analysis: &Analysis, cameras: &[PressStatistics]) -> Option<f64> {
    let mean = |of: fn(&PressStatistics) -> Option<f64>| mean(cameras.iter().map(of));
    let polarity = |events: fn(&PressPolarity) -> (u64, Option<f64>)| {
        let both = cameras
            .iter()
            .map(|c| Some(events(c.polarity.as_ref()?)))
            .collect::<Option<Vec<_>>>()?;
        let all: u64 = both.iter().map(|(n, _)| n).sum();
        let on = both
            .iter()
            .map(|(n, share)| *n as f64 * share.unwrap_or(0.0));
        (all > 0).then(|| on.sum::<f64>() / all as f64)
    };
    let scored = &analysis.scored;
    match figure {
        SessionFigure::PressRate => median(press_rates(analysis).collect()),
        SessionFigure::PressSpread => {
            let rates = press_rates(analysis).filter(|rate| *rate > 0.0);
            deviation(&rates.map(libm::log).collect::<Vec<_>>())
        }
        SessionFigure::IdleRate => {
            let known = views(analysis).filter(|v| v.iter().all(|v| v.idle_s > 0.0));
            let idle = known.map(|v| v.iter().map(|v| v.idle_rate_per_s).sum());
            median(idle.collect())
        }
        SessionFigure::OnAtPress => polarity(|p| (p.at_press, p.on_at_press)),
        SessionFigure::OnAtLift => polarity(|p| (p.at_lift, p.on_at_lift)),
        SessionFigure::Rise => mean(|c| rise_ms(c.course.as_ref()?)),
        SessionFigure::Fading => mean(|c| fading(c.course.as_ref()?)),
        SessionFigure::Width => {
            let widths = views(analysis).flatten().filter_map(|v| v.width_u);
            median(widths.collect())
        }
        SessionFigure::Dispersion
        | SessionFigure::Neighbours
        | SessionFigure::ActivePixels
        | SessionFigure::BusiestPixels
        | SessionFigure::EqualTimes => None,
        SessionFigure::Located => scored.located_rate.value,
        SessionFigure::Rmse => scored.rmse_mm.value,
        SessionFigure::RepeatStd => scored.repeat_std_mm.value,
    }
}

/// Both views of each press that has them.
fn views(analysis: &Analysis) -> impl Iterator<Item = [PressView; 2]> {
    let views = |press: &PressResult| Some([press.views[0]?, press.views[1]?]);
    analysis.presses.iter().filter_map(views)
}

fn press_rates(analysis: &Analysis) -> impl Iterator<Item = f64> {
    views(analysis).map(|views| views.iter().map(|v| v.rate_per_s).sum())
}

/// Time at which the mean rate first reaches the middle between that before a press and its peak, between the middles of bins.
fn rise_ms(course: &PressCourse) -> Option<f64> {
    let before = course.before_per_s?;
    let rates = &course.contact_per_s;
    let peak = rates.iter().copied().fold(before, f64::max);
    let half = 0.5 * (before + peak);
    let at = rates.iter().position(|rate| *rate >= half)?;
    let last = at.checked_sub(1).map_or(before, |k| rates[k]);
    let step = rates[at] - last;
    (step > 0.0).then(|| course.bin_ms * (at as f64 - 0.5 + (half - last) / step))
}

fn fading(course: &PressCourse) -> Option<f64> {
    let before = course.before_per_s?;
    let bins = |ms: f64| (ms / course.bin_ms) as usize;
    let (lift, rest) = course.lift_per_s.split_at_checked(bins(AFTER_LIFT_MS))?;
    if rest.len() < bins(LEAST_MS) {
        return None;
    }
    let rest = &rest[..bins(FADING_MS - AFTER_LIFT_MS).min(rest.len())];
    let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64 - before;
    let first = mean(lift);
    (first > 0.0).then(|| mean(rest) / first)
}

/// `None` unless all have a value.
fn mean(values: impl Iterator<Item = Option<f64>>) -> Option<f64> {
    let values = values.collect::<Option<Vec<f64>>>()?;
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    quantile(&mut values, 0.5)
}

fn deviation(values: &[f64]) -> Option<f64> {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|x| (x - mean) * (x - mean)).sum();
    (values.len() > 1).then(|| (squares / (n - 1.0)).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn course(contact_per_s: &[f64], lift_per_s: Vec<f64>) -> PressCourse {
        PressCourse {
            bin_ms: 10.0,
            before_per_s: Some(100.0),
            contact_per_s: contact_per_s.to_vec(),
            lift_per_s,
        }
    }

    #[test]
    fn the_rise_ends_half_way_to_the_peak() {
        // From 100 to 1100: half is 600, half way between the bins with 400 and 800, whose middles are 15 and 25 ms.
        let rising = course(&[100.0, 400.0, 800.0, 1100.0, 900.0], Vec::new());
        assert_eq!(rise_ms(&rising), Some(20.0));
        assert_eq!(rise_ms(&course(&[100.0; 5], Vec::new())), None);
        let unknown = PressCourse {
            before_per_s: None,
            ..rising
        };
        assert_eq!(rise_ms(&unknown), None);
    }

    #[test]
    fn fading_compares_what_is_left_with_the_lift() {
        let lift = |rest: f64, bins: usize| {
            let lift = std::iter::repeat_n(1100.0, 20);
            course(&[], lift.chain(std::iter::repeat_n(rest, bins)).collect())
        };
        assert_eq!(fading(&lift(350.0, 40)), Some(0.25));
        assert_eq!(fading(&lift(100.0, 40)), Some(0.0));
        // What comes after 600 ms does not count; less than 100 ms say nothing.
        let mut long = lift(350.0, 40);
        long.lift_per_s.extend([9_000.0; 30]);
        assert_eq!(fading(&long), Some(0.25));
        assert_eq!(fading(&lift(350.0, 9)), None);
    }

    #[test]
    fn every_scale_comes_back() {
        for scale in [Scale::Linear, Scale::Logarithm, Scale::Share] {
            for x in [0.01, 0.3, 0.99] {
                assert!((scale.back(scale.of(x)) - x).abs() < 1e-12, "{scale:?} {x}");
            }
        }
        // Ends of intervals of a share stay shares.
        assert_eq!(
            (Scale::Share.back(-0.3), Scale::Share.back(2.0)),
            (0.0, 1.0)
        );
    }
}

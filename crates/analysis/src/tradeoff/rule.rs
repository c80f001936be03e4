//! Composition rule: the error, the data and the CPU time of a whole choice from measured changes of single options.
//!
//! The mean square error is noise plus systematic parts. Noise depends on the number of events alone: thinning, window and rows
//! multiply their shares of the events, and the thinning curve of the estimator gives the noise at that number. A window, rows
//! or a bin add what their single change adds beyond the noise at its own number of events.

use skinrig_model::Precision;

use super::choice::{Choice, Region, WHOLE_PRESS_MS};

/// A choice that was measured.
#[derive(Debug, Clone, Copy)]
pub(super) struct Point {
    pub choice: Choice,
    /// Events per press, both cameras.
    pub events: f64,
    /// RMSE, mm, if the choice competes.
    pub rmse_mm: Option<f64>,
    /// CPU time per press, µs; 0 if not measured yet.
    pub cpu_us: f64,
}

/// The rule with the curves of one session.
pub(super) struct Rule<'a> {
    /// The session's own choice.
    base: Choice,
    points: &'a [Point],
}

/// An option whose change has a systematic part.
#[derive(Clone, Copy, PartialEq)]
enum Part {
    Window,
    Rows,
    Bin,
}

/// Choices with equal errors: the number width changes the last digits only.
pub(super) fn class(choice: Choice) -> Choice {
    Choice {
        precision: Precision::F64,
        ..choice
    }
}

/// Value at `x` by linear interpolation between points in ascending order. Below the first its neighbour's slope continues;
/// beyond the last its value.
fn interpolate(points: &[(f64, f64)], x: f64) -> Option<f64> {
    let slope = |a: (f64, f64), b: (f64, f64)| {
        if b.0 > a.0 {
            (b.1 - a.1) / (b.0 - a.0)
        } else {
            0.0
        }
    };
    let along = |a: (f64, f64), b: (f64, f64)| a.1 + slope(a, b) * (x - a.0);
    match points {
        [] => None,
        [one] => Some(one.1),
        [first, second, ..] if x <= first.0 => Some(along(*first, *second)),
        [.., last] if x >= last.0 => Some(last.1),
        all => all
            .windows(2)
            .find(|w| x <= w[1].0)
            .map(|w| along(w[0], w[1])),
    }
}

impl<'a> Rule<'a> {
    pub(super) const fn new(base: Choice, points: &'a [Point]) -> Self {
        Self { base, points }
    }

    /// The session's choice with the estimator of another.
    fn base_of(&self, choice: Choice) -> Choice {
        Choice {
            estimator: choice.estimator,
            centroid: choice.centroid,
            precision: choice.precision,
            ..self.base
        }
    }

    fn point(&self, choice: Choice) -> Option<&Point> {
        let same = |p: &&Point| class(p.choice) == class(choice);
        self.points.iter().find(same)
    }

    /// Share of the session's events that windows and rows leave.
    fn share(&self, window_ms: Option<f64>, region: Region) -> Option<f64> {
        let own = self.point(self.base)?.events;
        let of = |choice| Some(self.point(choice)?.events / own);
        let window = of(Choice {
            window_ms,
            ..self.base
        })?;
        let rows = of(Choice {
            region,
            ..self.base
        })?;
        (own > 0.0).then_some(window * rows)
    }

    /// Events per press of a choice.
    pub(super) fn events(&self, choice: Choice) -> Option<f64> {
        let own = self.point(self.base)?.events;
        let thinned = f64::from(self.base.thinning) / f64::from(choice.thinning);
        let events = own * thinned * self.share(choice.window_ms, choice.region)?;
        (events > 0.0).then_some(events)
    }

    /// Mean square error of noise at this number of events.
    fn noise(&self, estimator: Choice, events: f64) -> Option<f64> {
        let base = class(self.base_of(estimator));
        let knots = self.points.iter().filter(|p| {
            let thinning = p.choice.thinning;
            class(p.choice) == Choice { thinning, ..base }
        });
        let mut curve: Vec<(f64, f64)> = knots
            .filter_map(|p| Some((libm::log(p.events), 2.0 * libm::log(p.rmse_mm?))))
            .collect();
        curve.sort_by(|a, b| a.0.total_cmp(&b.0));
        interpolate(&curve, libm::log(events)).map(libm::exp)
    }

    /// Coordinate of an option on its curve.
    fn coordinate(part: Part, choice: Choice) -> f64 {
        match part {
            Part::Window => libm::log(choice.window_ms.unwrap_or(WHOLE_PRESS_MS)),
            Part::Rows => match choice.region {
                Region::Full => 2.0,
                Region::Half => 1.0,
                Region::Quarter => 0.0,
            },
            Part::Bin => -f64::from(choice.bin_px.trailing_zeros()),
        }
    }

    /// `base` with one option of `choice`.
    fn with(part: Part, base: Choice, choice: Choice) -> Choice {
        match part {
            Part::Window => Choice {
                window_ms: choice.window_ms,
                ..base
            },
            Part::Rows => Choice {
                region: choice.region,
                ..base
            },
            Part::Bin => Choice {
                bin_px: choice.bin_px,
                ..base
            },
        }
    }

    /// Curve of one option: (coordinate, log of the mean square error) of single changes of an estimator that compete.
    fn curve(&self, part: Part, estimator: Choice) -> Vec<(f64, f64)> {
        let base = class(self.base_of(estimator));
        let knots = self
            .points
            .iter()
            .filter(|p| class(p.choice) == Self::with(part, base, p.choice));
        let mut curve: Vec<(f64, f64)> = knots
            .filter_map(|p| {
                let at = Self::coordinate(part, p.choice);
                Some((at, 2.0 * libm::log(p.rmse_mm?)))
            })
            .collect();
        curve.sort_by(|a, b| a.0.total_cmp(&b.0));
        curve
    }

    /// What an option adds to the mean square error beyond noise, mm².
    fn systematic(&self, part: Part, choice: Choice) -> Option<f64> {
        let base = self.base_of(choice);
        let single = Self::with(part, base, choice);
        if single == base {
            return Some(0.0);
        }
        let curve = self.curve(part, choice);
        let curve = if curve.len() > 1 {
            curve
        } else {
            self.curve(part, self.base)
        };
        let at = Self::coordinate(part, choice);
        let own = interpolate(&curve, at).map(libm::exp)?;
        Some((own - self.noise(choice, self.events(single)?)?).max(0.0))
    }

    /// Predicted RMSE of a choice, mm; `None` without the curves that it takes.
    pub(super) fn rmse_mm(&self, choice: Choice) -> Option<f64> {
        let noise = self.noise(choice, self.events(choice)?)?;
        let parts = [Part::Window, Part::Rows, Part::Bin];
        let added: Option<f64> = parts
            .into_iter()
            .map(|part| self.systematic(part, choice))
            .sum();
        Some((noise + added?).sqrt()).filter(|rmse| rmse.is_finite() && *rmse > 0.0)
    }

    /// Predicted CPU time of a choice, µs: its estimator's at the number of events, times the ratio of its bin.
    pub(super) fn cpu_us(&self, choice: Choice) -> Option<f64> {
        let timed = |p: &&Point| p.cpu_us > 0.0;
        let base = class(self.base_of(choice));
        let time = |choice: Choice| {
            let mut points = self.points.iter().filter(timed);
            points.find(|p| p.choice == choice).map(|p| p.cpu_us)
        };
        let knots = |of: &dyn Fn(&Point) -> Option<f64>| {
            let all = self.points.iter().filter(timed);
            let mut curve: Vec<(f64, f64)> = all
                .filter_map(|p| Some((of(p)?, libm::log(p.cpu_us))))
                .collect();
            curve.sort_by(|a, b| a.0.total_cmp(&b.0));
            curve
        };
        let thinned = knots(&|p| {
            let thinning = p.choice.thinning;
            (p.choice == Choice { thinning, ..base }).then(|| libm::log(p.events))
        });
        let binned = knots(&|p| {
            let at = Self::coordinate(Part::Bin, p.choice);
            (p.choice == Self::with(Part::Bin, base, p.choice)).then_some(at)
        });
        let at_events = interpolate(&thinned, libm::log(self.events(choice)?))?;
        let at_bin = interpolate(&binned, Self::coordinate(Part::Bin, choice))?;
        let log_base = libm::log(time(base)?);
        let width = time(self.base_of(choice)).map_or(0.0, |us| libm::log(us) - log_base);
        Some(libm::exp(at_events + at_bin - log_base + width))
    }

    /// True if a choice leaves at least as many events as its estimator needs, judged by the measured choices.
    pub(super) fn locates(&self, choice: Choice) -> bool {
        let of = |competes: bool| {
            self.points.iter().filter(move |p| {
                let same =
                    p.choice.estimator == choice.estimator && p.choice.centroid == choice.centroid;
                same && p.rmse_mm.is_some() == competes && p.events > 0.0
            })
        };
        let least = of(true).map(|p| p.events).fold(f64::INFINITY, f64::min);
        let too_few = of(false).map(|p| p.events).filter(|n| *n < least);
        let most = too_few.fold(0.0, f64::max);
        let border = if most > 0.0 {
            (least * most).sqrt()
        } else {
            least
        };
        self.events(choice).is_some_and(|n| n >= border)
    }
}

//! Owns the compared metrics: definition, unit and direction of each.

use serde::{Deserialize, Serialize};

use crate::locations::{Attempt, Locations};
use crate::subject::Subject;
use skinrig_statistics::{Count, ImprovementDirection, Position, Sample, SampleFault};

/// A compared metric.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Metric {
    /// Root mean square error.
    Rmse,
    /// Root mean square error along x.
    RmseX,
    /// Root mean square error along y.
    RmseY,
    /// Mean error along x.
    BiasX,
    /// Mean error along y.
    BiasY,
    /// Standard deviation between repetitions.
    RepeatStd,
    /// Share of attempted presses that were located.
    LocatedRate,
    /// Share of attempted presses located within X mm.
    WithinRate,
    /// Median time from contact to detection.
    Latency,
    /// Time from the 5th to the 95th percentile of the detections.
    LatencyWidth,
    /// False alarms per second without a press.
    FalseAlarms,
    /// Idle events per second.
    IdleEvents,
    /// Events per second during presses.
    PressEvents,
    /// Bytes per second during presses.
    PressBytes,
    /// Number of distinguishable locations: area / (pi RMSE²).
    Taxels,
}

/// Format of a metric's values for people.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct DisplayFormat {
    /// Factor from stored to displayed values.
    pub scale: f64,
    /// Displayed unit.
    pub unit: &'static str,
    /// Decimals.
    pub digits: usize,
}

impl Metric {
    /// All metrics, in display order.
    pub const ALL: [Self; 15] = [
        Self::Rmse,
        Self::RmseX,
        Self::RmseY,
        Self::BiasX,
        Self::BiasY,
        Self::RepeatStd,
        Self::LocatedRate,
        Self::WithinRate,
        Self::Latency,
        Self::LatencyWidth,
        Self::FalseAlarms,
        Self::IdleEvents,
        Self::PressEvents,
        Self::PressBytes,
        Self::Taxels,
    ];

    /// Name in limits, JSON and files.
    #[must_use]
    pub const fn key(self) -> &'static str {
        match self {
            Self::Rmse => "rmse",
            Self::RmseX => "rmse_x",
            Self::RmseY => "rmse_y",
            Self::BiasX => "bias_x",
            Self::BiasY => "bias_y",
            Self::RepeatStd => "repeat_std",
            Self::LocatedRate => "located_rate",
            Self::WithinRate => "within_rate",
            Self::Latency => "latency",
            Self::LatencyWidth => "latency_width",
            Self::FalseAlarms => "false_alarms",
            Self::IdleEvents => "idle_events",
            Self::PressEvents => "press_events",
            Self::PressBytes => "press_bytes",
            Self::Taxels => "taxels",
        }
    }

    /// Display name; `within_mm` is the limit of the pass rate.
    #[must_use]
    pub fn name(self, within_mm: f64) -> String {
        match self {
            Self::Rmse => "RMSE",
            Self::RmseX => "RMSE along x",
            Self::RmseY => "RMSE along y",
            Self::BiasX => "bias along x",
            Self::BiasY => "bias along y",
            Self::RepeatStd => "std of repetitions",
            Self::LocatedRate => "located rate",
            Self::WithinRate => return format!("within {within_mm} mm"),
            Self::Latency => "latency, median",
            Self::LatencyWidth => "latency, 5-95 % width",
            Self::FalseAlarms => "false alarms",
            Self::IdleEvents => "events, idle",
            Self::PressEvents => "events, press",
            Self::PressBytes => "data, press",
            Self::Taxels => "taxels",
        }
        .to_owned()
    }

    /// Display format of its values.
    #[must_use]
    pub(crate) const fn display_format(self) -> DisplayFormat {
        let (scale, unit, digits) = match self {
            Self::LocatedRate | Self::WithinRate => (100.0, "%", 1),
            Self::Latency | Self::LatencyWidth => (1.0, "ms", 1),
            Self::FalseAlarms => (1.0, "/s", 3),
            Self::IdleEvents | Self::PressEvents => (1e-3, "kev/s", 2),
            Self::PressBytes => (1e-3, "kB/s", 1),
            Self::Taxels => (1.0, "", 0),
            _ => (1.0, "mm", 2),
        };
        DisplayFormat {
            scale,
            unit,
            digits,
        }
    }

    /// Unit of the values in JSON.
    #[must_use]
    pub const fn unit(self) -> &'static str {
        match self {
            Self::LocatedRate | Self::WithinRate => "share",
            Self::Latency | Self::LatencyWidth => "ms",
            Self::FalseAlarms => "1/s",
            Self::IdleEvents | Self::PressEvents => "events/s",
            Self::PressBytes => "bytes/s",
            Self::Taxels => "locations",
            _ => "mm",
        }
    }

    /// Converts a margin from the unit of the limits file (mm, s, percentage points, ...) to the unit of the values.
    #[must_use]
    pub const fn margin(self, of_limits: f64) -> f64 {
        match self {
            Self::LocatedRate | Self::WithinRate => of_limits / 100.0,
            Self::Latency | Self::LatencyWidth => of_limits * 1e3,
            _ => of_limits,
        }
    }

    /// Direction in which the metric improves.
    #[must_use]
    pub const fn better(self) -> ImprovementDirection {
        match self {
            Self::BiasX | Self::BiasY => ImprovementDirection::NearerZero,
            Self::LocatedRate | Self::WithinRate | Self::Taxels => ImprovementDirection::Higher,
            _ => ImprovementDirection::Lower,
        }
    }

    /// Sample of `subject` for this metric. `within_mm`: limit of the pass rate; `area_mm2`: area that the taxels cover.
    ///
    /// # Errors
    /// [`SampleFault`] when results contain NaN or infinity.
    pub(crate) fn sample(
        self,
        subject: &Subject,
        locations: &Locations,
        within_mm: f64,
        area_mm2: f64,
    ) -> Result<Sample, SampleFault> {
        let attempts = || locations.attempts(subject);
        let counted = |value: fn(&Attempt<'_>) -> Option<f64>| {
            attempts().filter_map(move |p| Some((p.location, value(&p)?)))
        };
        match self {
            Self::Rmse => Sample::rms(counted(|p| p.error_mm())),
            Self::RmseX => Sample::rms(counted(|p| Some(p.error()?.0))),
            Self::RmseY => Sample::rms(counted(|p| Some(p.error()?.1))),
            Self::BiasX => Sample::mean(counted(|p| Some(p.error()?.0))),
            Self::BiasY => Sample::mean(counted(|p| Some(p.error()?.1))),
            Self::RepeatStd => Sample::repeat_std(attempts().filter_map(|p| {
                p.error()?;
                let at = p.press.estimate()?;
                let position = Position {
                    series: p.series,
                    x_mm: at.x_mm,
                    y_mm: at.y_mm,
                };
                Some((p.location, position))
            })),
            Self::LocatedRate => Ok(Sample::share(
                attempts().map(|p| (p.location, p.own_error_mm().is_some())),
            )),
            Self::WithinRate => Ok(Sample::share(attempts().map(|p| {
                let error_mm = p.own_error_mm();
                (p.location, error_mm.is_some_and(|e| e <= within_mm))
            }))),
            Self::Latency => Sample::median(onsets(subject, locations)),
            Self::LatencyWidth => Sample::width(onsets(subject, locations)),
            Self::FalseAlarms => Sample::count_rate(alarms(subject, locations)),
            Self::IdleEvents => Sample::mean(counted(idle_per_s)),
            Self::PressEvents => Sample::mean(counted(press_per_s)),
            Self::PressBytes => Sample::mean(counted(|p| {
                Some(press_per_s(p)? * p.session.analysis.settings.bits_per_event / 8.0)
            })),
            Self::Taxels => Sample::taxels(area_mm2, counted(|p| p.error_mm())),
        }
    }
}

/// Events per second of both cameras during a counting press.
fn press_per_s(p: &Attempt<'_>) -> Option<f64> {
    p.error()?;
    Some(p.press.views[0]?.rate_per_s + p.press.views[1]?.rate_per_s)
}

/// Events per second of both cameras in the idle time before a counting press.
fn idle_per_s(p: &Attempt<'_>) -> Option<f64> {
    p.error()?;
    let views = [p.press.views[0]?, p.press.views[1]?];
    let known = views.iter().all(|v| v.idle_s > 0.0);
    known.then(|| views.iter().map(|v| v.idle_rate_per_s).sum())
}

/// (location, onset after contact in ms) of each press in the latency study; `None` if never detected.
fn onsets<'a>(
    subject: &'a Subject,
    locations: &'a Locations,
) -> impl Iterator<Item = (u32, Option<f64>)> + 'a {
    locations.attempts(subject).filter_map(|p| {
        let onsets = &p.session.analysis.latency.as_ref()?.onsets;
        let at = onsets
            .binary_search_by_key(&p.press.press, |(press, _)| *press)
            .ok()?;
        Some((p.location, onsets[at].1))
    })
}

/// (location, false alarms) of each idle period in the latency study.
fn alarms<'a>(
    subject: &'a Subject,
    locations: &'a Locations,
) -> impl Iterator<Item = (u32, Count)> + 'a {
    locations.attempts(subject).filter_map(|p| {
        let all = &p.session.analysis.latency.as_ref()?.backgrounds;
        let at = all.binary_search_by_key(&p.press.press, |b| b.press).ok()?;
        let count = Count {
            events: all[at].alarms,
            exposure: all[at].length_s,
        };
        (count.exposure > 0.0).then_some((p.location, count))
    })
}

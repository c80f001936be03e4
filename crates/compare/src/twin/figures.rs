//! Figures of a session that its calibration presses alone determine, and errors by place.

use serde::{Deserialize, Serialize};
use skinrig_analysis::Analysis;
use skinrig_analysis::event_statistics::PressStatistics;
use skinrig_analysis::result::LocatorComparison;
use skinrig_analysis::result::PressResult;
use skinrig_model::{LocationId, Locator, Point2, PressRole, Verdict};

use crate::scene::{Scale, SessionFigure, SessionFigures};

/// A press is weak if it adds less than this share of the median's events to the idle rate.
const WEAK: f64 = 0.5;

/// A figure of the calibration presses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CalibrationFigure {
    /// Of their events.
    Events(SessionFigure),
    /// Share of weak presses.
    Weak,
    /// RMSE of the calibration in its own presses, mm.
    Fitted,
    /// RMSE of the locator in use at locations left out of its fit, mm.
    LeftOut,
    /// The same of the geometry alone, mm.
    LeftOutGeometry,
}

impl CalibrationFigure {
    /// All, in the order of the tables.
    pub const ALL: [Self; 12] = [
        Self::Events(SessionFigure::PressRate),
        Self::Events(SessionFigure::PressSpread),
        Self::Events(SessionFigure::IdleRate),
        Self::Events(SessionFigure::OnAtPress),
        Self::Events(SessionFigure::OnAtLift),
        Self::Events(SessionFigure::Rise),
        Self::Events(SessionFigure::Fading),
        Self::Events(SessionFigure::Width),
        Self::Weak,
        Self::Fitted,
        Self::LeftOut,
        Self::LeftOutGeometry,
    ];

    /// Scale on which it is near normal.
    pub(super) const fn scale(self) -> Scale {
        match self {
            Self::Events(figure) => figure.scale(),
            Self::Weak => Scale::Share,
            Self::Fitted | Self::LeftOut | Self::LeftOutGeometry => Scale::Logarithm,
        }
    }
}

/// What the calibration presses of a session tell of its skin.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CalibrationFigures {
    /// In the order of [`CalibrationFigure::ALL`], each in its unit.
    pub values: Vec<Option<f64>>,
    /// Calibration presses that were made.
    pub presses: u32,
}

impl CalibrationFigures {
    /// Of a session. `of_calibration`: its analysis with the calibration presses alone ([`calibration_only`]); `cameras`: statistics of
    /// the events around them.
    #[must_use]
    pub fn of(of_calibration: &Analysis, cameras: &[PressStatistics]) -> Self {
        let events = SessionFigures::of_presses(of_calibration, cameras);
        let fit = of_calibration.calibration.as_ref();
        let compared = || of_calibration.locator.iter().flat_map(|l| &l.compared);
        let left_out = |row: Option<&LocatorComparison>| row?.rmse_mm.value;
        let value = |figure| match figure {
            CalibrationFigure::Events(figure) => events.get(figure),
            CalibrationFigure::Weak => weak_share(of_calibration),
            CalibrationFigure::Fitted => fit.map(|fit| fit.rmse_after_mm),
            CalibrationFigure::LeftOut => left_out(compared().find(|row| row.chosen)),
            CalibrationFigure::LeftOutGeometry => {
                left_out(compared().find(|row| row.locator == Locator::Geometry))
            }
        };
        let finite =
            |figure: CalibrationFigure| value(figure).filter(|x| figure.scale().of(*x).is_finite());
        let made = of_calibration.presses.iter().filter(|p| p.truth.is_some());
        Self {
            values: CalibrationFigure::ALL.map(finite).to_vec(),
            presses: made.count() as u32,
        }
    }
}

/// The analysis with the calibration presses alone: what comes of its presses is blind to the scored ones.
#[must_use]
pub fn calibration_only(analysis: &Analysis) -> Analysis {
    let mut found = analysis.clone();
    found.presses.retain(|p| p.role == PressRole::Calibrate);
    found
}

/// Figures of the scored presses alone.
#[must_use]
pub fn outcomes(analysis: &Analysis) -> SessionFigures {
    let mut scored = analysis.clone();
    scored.presses.retain(|p| p.role == PressRole::Score);
    SessionFigures::of_presses(&scored, &[])
}

/// Events that a press adds to the idle rate, per second, both cameras.
fn response(press: &PressResult) -> Option<f64> {
    let [one, two] = press.views;
    let added = |view: skinrig_analysis::result::PressView| view.rate_per_s - view.idle_rate_per_s;
    Some(added(one?) + added(two?))
}

fn weak_share(analysis: &Analysis) -> Option<f64> {
    let found: Vec<f64> = analysis.presses.iter().filter_map(response).collect();
    let median = skinrig_analysis::metrics::quantile(&mut found.clone(), 0.5)?;
    let weak = found.iter().filter(|x| **x < WEAK * median).count();
    Some(weak as f64 / found.len() as f64)
}

/// What a session shows at one location.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PlaceErrors {
    /// The location.
    pub location: LocationId,
    /// Where, skin frame, mm.
    pub at: Point2,
    /// Root mean square error of its calibration presses, mm.
    pub calibration_mm: Option<f64>,
    /// Events per second that its calibration presses add, both cameras, mean.
    pub response_per_s: Option<f64>,
    /// Size of the 95 % regions of its calibration presses, mean of the logarithm of their axes, mm.
    pub region_mm: Option<f64>,
    /// Root mean square error of its scored presses, mm.
    pub scored_mm: Option<f64>,
}

/// A simulated skin: a draw of the constants and what a session of it shows.
#[derive(Debug, Clone, PartialEq)]
pub struct SkinDraw {
    /// Each constant as a share of its range's probability, above 0 and below 1, in the order of [`super::TwinConstant::ALL`].
    pub shares: Vec<f64>,
    /// What its calibration presses show.
    pub figures: CalibrationFigures,
    /// What its whole session shows.
    pub outcomes: SessionFigures,
    /// The same of the changed protocol, if there is one.
    pub changed: Option<SessionFigures>,
    /// Its errors by place.
    pub places: Vec<PlaceErrors>,
}

/// A session that is to have a twin.
#[derive(Debug, Clone, PartialEq)]
pub struct Observed {
    /// What its calibration presses show: all that the fit sees.
    pub figures: CalibrationFigures,
    /// What the whole session shows, to compare with.
    pub outcomes: SessionFigures,
    /// Its errors by place; those of the scored presses are only compared.
    pub places: Vec<PlaceErrors>,
}

/// Errors of every location, in order.
#[must_use]
pub fn place_errors(analysis: &Analysis) -> Vec<PlaceErrors> {
    let mut locations: Vec<(LocationId, Point2)> = analysis
        .presses
        .iter()
        .map(|p| (p.location, p.planned))
        .collect();
    locations.sort_by_key(|(id, _)| *id);
    locations.dedup_by_key(|(id, _)| *id);
    let of = |location: LocationId, role: PressRole| {
        let presses = analysis
            .presses
            .iter()
            .filter(move |p| p.location == location);
        presses.filter(move |p| p.role == role && p.verdict == Verdict::Valid)
    };
    let error = |presses: &mut dyn Iterator<Item = &PressResult>| {
        root_mean_square(presses.filter_map(PressResult::error_mm))
    };
    locations
        .into_iter()
        .map(|(location, at)| {
            let responses: Vec<f64> = of(location, PressRole::Calibrate)
                .filter_map(response)
                .collect();
            let n = responses.len() as f64;
            PlaceErrors {
                location,
                at,
                calibration_mm: error(&mut of(location, PressRole::Calibrate)),
                response_per_s: (n > 0.0).then(|| responses.iter().sum::<f64>() / n),
                region_mm: region(of(location, PressRole::Calibrate)),
                scored_mm: error(&mut of(location, PressRole::Score)),
            }
        })
        .collect()
}

fn region<'a>(presses: impl Iterator<Item = &'a PressResult>) -> Option<f64> {
    let regions = presses.filter_map(|p| p.region);
    let logs: Vec<f64> = regions
        .flat_map(|region| region.semi_axes_mm.map(libm::log))
        .collect();
    let n = logs.len() as f64;
    (n > 0.0).then(|| libm::exp(logs.iter().sum::<f64>() / n))
}

fn root_mean_square(errors: impl Iterator<Item = (f64, f64)>) -> Option<f64> {
    let (mut sum, mut n) = (0.0, 0.0);
    for (x, y) in errors {
        sum += x * x + y * y;
        n += 1.0;
    }
    (n > 0.0).then(|| (sum / n).sqrt())
}

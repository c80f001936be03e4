//! Owns the inputs of the decomposition: counting scored presses, with the error under the used and a refitted geometry.

use std::collections::{BTreeMap, BTreeSet};

use skinrig_analysis::calibrate::{calibrate, largest_supported_model, parameter_count};
use skinrig_analysis::locator::held_out_errors;
use skinrig_analysis::result::{PressResult, PressView};
use skinrig_analysis::sets::CalibrationSet;
use skinrig_analysis::triangulate::locate;
use skinrig_model::{CalibrationModel, Locator, PressId, PressRole, StereoGeometry};

use super::factor::FactorMeasurement;
use crate::locations::{Attempt, Locations};
use crate::subject::{Session, Subject};

/// Quantities of one press that the decomposition uses.
#[derive(Debug, Clone, Copy)]
pub(super) struct PressFactors {
    /// Error with the session's geometry, mm.
    pub used: [f64; 2],
    /// Error with the locator fitted to the scored presses, mm.
    pub fitted: [f64; 2],
    /// Measured minus planned position, mm.
    pub off_plan: [f64; 2],
    /// Mean over cameras of 1 / (events added by the press).
    pub per_event: f64,
    /// Mean over cameras of the squared width of the press, px².
    pub width2: f64,
    /// Mean over cameras of the squared spread of clustered columns divided by their number, px².
    pub cluster: f64,
    /// Idle events per second, both cameras together.
    pub idle_per_s: f64,
}

/// Presses of one skin, grouped by location.
#[derive(Debug, Clone, Default)]
pub(super) struct SkinPresses {
    by_place: BTreeMap<u32, Vec<PressFactors>>,
    calibration_cost: f64,
}

/// Fitting `p` parameters to `n` calibration presses adds `p / 2n` of their scatter on average; up to twice that is chance.
const CHANCE_FACTOR: f64 = 2.0;

impl SkinPresses {
    pub(super) fn of(subject: &Subject, locations: &Locations, shared: &BTreeSet<u32>) -> Self {
        let mut all: BTreeMap<u32, Vec<PressFactors>> = BTreeMap::new();
        for session in &subject.sessions {
            let id = session.facts.session_id.as_str();
            let of_session = |p: &Attempt<'_>| p.session.facts.session_id == id;
            let attempts: Vec<Attempt<'_>> = locations
                .attempts(subject)
                .filter(|p| of_session(p) && shared.contains(&p.location) && p.error().is_some())
                .collect();
            let refitted = refit(session, &attempts);
            for attempt in &attempts {
                let error = refitted.error(attempt);
                if let Some(factors) = press_factors(attempt, error) {
                    all.entry(attempt.location).or_default().push(factors);
                }
            }
        }
        let cost = |s: &Session| {
            let c = s.analysis.calibration.as_ref()?;
            Some(CHANCE_FACTOR * c.names.len() as f64 / (2.0 * f64::from(c.n.max(1))))
        };
        let costs = subject.sessions.iter().map(|s| cost(s).unwrap_or(0.0));
        Self {
            calibration_cost: costs.sum::<f64>() / subject.sessions.len().max(1) as f64,
            by_place: all,
        }
    }

    #[cfg(test)]
    pub(super) fn new(by_place: BTreeMap<u32, Vec<PressFactors>>, calibration_cost: f64) -> Self {
        Self {
            by_place,
            calibration_cost,
        }
    }

    pub(super) fn locations(&self) -> impl Iterator<Item = u32> {
        self.by_place.keys().copied()
    }

    pub(super) fn contains(&self, location: u32) -> bool {
        self.by_place.contains_key(&location)
    }

    /// Drops all other locations.
    pub(super) fn retain_locations(&mut self, locations: &[u32]) {
        self.by_place
            .retain(|location, _| locations.contains(location));
    }

    /// Error added by the calibration fit, as a share of the scatter of its presses.
    pub(crate) const fn calibration_cost(&self) -> f64 {
        self.calibration_cost
    }

    pub(super) fn count(&self) -> u32 {
        self.by_place.values().map(Vec::len).sum::<usize>() as u32
    }

    /// Presses at the i-th location.
    pub(super) fn at(&self, i: usize) -> &[PressFactors] {
        self.by_place.values().nth(i).map_or(&[], Vec::as_slice)
    }

    fn mean(&self, of: impl Fn(&PressFactors) -> f64) -> Option<f64> {
        let values: Vec<f64> = self
            .by_place
            .values()
            .flatten()
            .map(of)
            .filter(|v| v.is_finite())
            .collect();
        (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
    }
}

/// Geometry and field that locate the scored presses best.
struct RefittedGeometry {
    geometry: StereoGeometry,
    /// Correction factor for errors of the presses that the geometry was fitted to.
    inflation: f64,
    /// Errors under a field learnt from the presses at other locations, by press; empty for the geometry alone.
    held_out: BTreeMap<PressId, Option<[f64; 2]>>,
}

impl RefittedGeometry {
    /// Error of a press, mm.
    fn error(&self, attempt: &Attempt<'_>) -> Option<[f64; 2]> {
        let press = attempt.press;
        if let Some(error) = self.held_out.get(&press.press) {
            return *error;
        }
        let columns = press.views.map(|v| v.and_then(|v| v.centroid_u));
        let outline = &attempt.session.analysis.rig.outline;
        let (estimate, truth) = (
            locate(&self.geometry, outline, columns).estimate()?,
            press.truth?,
        );
        let error = [estimate.x_mm - truth.x_mm, estimate.y_mm - truth.y_mm];
        Some(error.map(|e| e * self.inflation))
    }
}

/// Fits a geometry to the scored presses as if they were calibration presses. This diagnoses the
/// calibration and never scores. Residuals of `n` presses (two numbers each) under `p` fitted
/// parameters are too small by `sqrt(1 - p / 2n)`; the inflation corrects this. Falls back to the
/// session's geometry with too few presses. A session that was judged by a field is diagnosed by a field of the same kind,
/// with each press located by the presses at other locations.
fn refit(session: &Session, attempts: &[Attempt<'_>]) -> RefittedGeometry {
    let used = session.analysis.geometry;
    let presses: Vec<PressResult> = attempts
        .iter()
        .map(|p| PressResult {
            role: PressRole::Calibrate,
            ..p.press.clone()
        })
        .collect();
    let set = CalibrationSet::from_presses(&presses);
    let model = largest_supported_model(&set, CalibrationModel::Full);
    let numbers = 2.0 * set.sights().len() as f64;
    let free = numbers - parameter_count(model) as f64;
    let settings = &session.analysis.settings;
    let fit = calibrate(&set, &used, model, settings.seed).filter(|_| free > 0.0);
    let Some((geometry, calibration)) = fit else {
        return RefittedGeometry {
            geometry: used,
            inflation: 1.0,
            held_out: BTreeMap::new(),
        };
    };
    let locator = session.analysis.locator.as_ref().map(|l| l.locator);
    let errors = locator
        .filter(|l| *l != Locator::Geometry)
        .and_then(|l| held_out_errors(&set, &geometry, Some(&calibration), settings, l));
    let sights = set.sights().iter().map(|s| s.press);
    RefittedGeometry {
        geometry,
        inflation: (numbers / free).sqrt(),
        held_out: errors.map_or_else(BTreeMap::new, |e| sights.zip(e).collect()),
    }
}

fn press_factors(attempt: &Attempt<'_>, fitted: Option<[f64; 2]>) -> Option<PressFactors> {
    let press = attempt.press;
    let views = [press.views[0]?, press.views[1]?];
    let truth = press.truth?;
    let (x, y) = attempt.error()?;
    let mean = |of: fn(&PressView) -> f64| 0.5 * (of(&views[0]) + of(&views[1]));
    Some(PressFactors {
        used: [x, y],
        fitted: fitted?,
        off_plan: [
            truth.x_mm - press.planned.x_mm,
            truth.y_mm - press.planned.y_mm,
        ],
        per_event: mean(|v| 1.0 / added_events(v).max(1.0)),
        width2: mean(|v| v.width_u.map_or(f64::NAN, |w| w * w)),
        cluster: mean(|v| {
            let spread = v.spread_u.map_or(f64::NAN, |s| s * s);
            spread / f64::from(v.cluster_events.max(1))
        }),
        idle_per_s: views.iter().map(|v| v.idle_rate_per_s).sum(),
    })
}

/// Events in the window minus those expected from the idle rate.
fn added_events(view: &PressView) -> f64 {
    let events = f64::from(view.events);
    if view.rate_per_s > 0.0 {
        events - view.idle_rate_per_s * events / view.rate_per_s
    } else {
        0.0
    }
}

/// Supporting measurements shown beside the contributions.
pub(super) fn measurements(of: [&SkinPresses; 2]) -> Vec<FactorMeasurement> {
    let row = |what, unit, value: &dyn Fn(&SkinPresses) -> Option<f64>| FactorMeasurement {
        what,
        unit,
        values: of.map(value),
    };
    let rms = |p: &SkinPresses, of: fn(&PressFactors) -> [f64; 2]| {
        let squares = p.mean(|o| of(o)[0].powi(2) + of(o)[1].powi(2));
        squares.map(f64::sqrt)
    };
    vec![
        row("RMSE as calibrated", "mm", &|p| rms(p, |o| o.used)),
        row(
            "RMSE with the locator fitted to these presses",
            "mm",
            &|p| rms(p, |o| o.fitted),
        ),
        row(
            "measured positions about their mean offset from plan",
            "mm",
            &|p| {
                let x = p.mean(|o| o.off_plan[0])?;
                let y = p.mean(|o| o.off_plan[1])?;
                let squares = p.mean(|o| (o.off_plan[0] - x).powi(2) + (o.off_plan[1] - y).powi(2));
                squares.map(f64::sqrt)
            },
        ),
        row(
            "events added by a press, per camera (harmonic mean)",
            "events",
            &|p| p.mean(|o| o.per_event).map(|v| 1.0 / v),
        ),
        row("idle events, both cameras", "events/s", &|p| {
            p.mean(|o| o.idle_per_s)
        }),
        row(
            "width of a press: columns with half of its events",
            "px",
            &|p| p.mean(|o| o.width2).map(f64::sqrt),
        ),
        row(
            "standard error of the centroid: column spread / sqrt(events)",
            "px",
            &|p| p.mean(|o| o.cluster).map(f64::sqrt),
        ),
    ]
}

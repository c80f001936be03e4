//! Owns what the causes look at: the scored presses of a skin that count, with the error that a better geometry leaves.

use std::collections::{BTreeMap, BTreeSet};

use skinrig_analysis::calibrate::{affordable_model, calibrate, parameter_count};
use skinrig_analysis::result::{PressResult, PressView};
use skinrig_analysis::sets::CalibrationSet;
use skinrig_analysis::triangulate::locate;
use skinrig_model::{CalibrationModel, PressRole, StereoGeometry};

use super::factor::Measured;
use crate::places::{Attempt, Places};
use crate::subject::{Session, Subject};

/// One press.
#[derive(Debug, Clone, Copy)]
pub(super) struct One {
    /// Error with the geometry that was used, mm.
    pub used: [f64; 2],
    /// Error with a geometry fitted to the scored presses, mm.
    pub fitted: [f64; 2],
    /// Measured position less planned one, mm.
    pub off_plan: [f64; 2],
    /// Mean over cameras: 1 / events that the press added.
    pub per_event: f64,
    /// Mean over cameras: squared width of the touch, px².
    pub width2: f64,
    /// Mean over cameras: squared spread of the clustered columns over their number, px².
    pub cluster: f64,
    /// Events per second between presses, both cameras.
    pub idle_per_s: f64,
}

/// The presses of a skin by place.
#[derive(Debug, Clone, Default)]
pub(super) struct Pressed {
    by_place: BTreeMap<u32, Vec<One>>,
    calibration_cost: f64,
}

/// A fit of `p` parameters to `n` calibrating presses adds `p / 2n` of their scatter on average; twice that is chance.
const CHANCE: f64 = 2.0;

impl Pressed {
    pub fn of(subject: &Subject, places: &Places, shared: &BTreeSet<u32>) -> Self {
        let mut all: BTreeMap<u32, Vec<One>> = BTreeMap::new();
        for session in &subject.sessions {
            let id = session.facts.session_id.as_str();
            let of_session = |p: &Attempt<'_>| p.session.facts.session_id == id;
            let attempts: Vec<Attempt<'_>> = places
                .attempts(subject)
                .filter(|p| of_session(p) && shared.contains(&p.place) && p.error().is_some())
                .collect();
            let fitted = fitted(session, &attempts);
            for attempt in &attempts {
                if let Some(one) = one(attempt, &fitted) {
                    all.entry(attempt.place).or_default().push(one);
                }
            }
        }
        let cost = |s: &Session| {
            let c = s.analysis.calibration.as_ref()?;
            Some(CHANCE * c.names.len() as f64 / (2.0 * f64::from(c.n.max(1))))
        };
        let costs = subject.sessions.iter().map(|s| cost(s).unwrap_or(0.0));
        Self {
            calibration_cost: costs.sum::<f64>() / subject.sessions.len().max(1) as f64,
            by_place: all,
        }
    }

    pub fn places(&self) -> impl Iterator<Item = u32> {
        self.by_place.keys().copied()
    }

    pub fn has(&self, place: u32) -> bool {
        self.by_place.contains_key(&place)
    }

    /// Leaves only these places.
    pub fn keep(&mut self, places: &[u32]) {
        self.by_place.retain(|place, _| places.contains(place));
    }

    /// What a calibration costs by the scatter of its presses alone, as a share of that scatter.
    pub(crate) const fn calibration_cost(&self) -> f64 {
        self.calibration_cost
    }

    pub fn count(&self) -> u32 {
        self.by_place.values().map(Vec::len).sum::<usize>() as u32
    }

    /// The presses of the i-th place.
    pub fn at(&self, i: usize) -> &[One] {
        self.by_place.values().nth(i).map_or(&[], Vec::as_slice)
    }

    fn mean(&self, of: impl Fn(&One) -> f64) -> Option<f64> {
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

/// A geometry, and what errors under it are multiplied by.
struct Fitted {
    geometry: StereoGeometry,
    inflation: f64,
}

/// The geometry that the scored presses themselves ask for, as if they calibrated: a diagnosis of the calibration, never a
/// score. Errors of `n` presses, two numbers each, under `p` parameters fitted to them are too small by
/// `sqrt(1 - p / 2n)`: they are scaled up by it. The geometry that was used where the presses are too few to ask.
fn fitted(session: &Session, attempts: &[Attempt<'_>]) -> Fitted {
    let used = session.analysis.geometry;
    let presses: Vec<PressResult> = attempts
        .iter()
        .map(|p| PressResult {
            role: PressRole::Calibrate,
            ..p.press.clone()
        })
        .collect();
    let set = CalibrationSet::from_presses(&presses);
    let model = affordable_model(&set, CalibrationModel::Full);
    let numbers = 2.0 * set.sights().len() as f64;
    let free = numbers - parameter_count(model) as f64;
    match calibrate(&set, &used, model, session.analysis.settings.seed) {
        Some((geometry, _)) if free > 0.0 => Fitted {
            geometry,
            inflation: (numbers / free).sqrt(),
        },
        _ => Fitted {
            geometry: used,
            inflation: 1.0,
        },
    }
}

fn one(attempt: &Attempt<'_>, fitted: &Fitted) -> Option<One> {
    let press = attempt.press;
    let views = [press.views[0]?, press.views[1]?];
    let truth = press.truth?;
    let (x, y) = attempt.error()?;
    let columns = [views[0].centroid_u, views[1].centroid_u];
    let outline = &attempt.session.analysis.rig.outline;
    let again = locate(&fitted.geometry, outline, columns).estimate()?;
    let mean = |of: fn(&PressView) -> f64| 0.5 * (of(&views[0]) + of(&views[1]));
    Some(One {
        used: [x, y],
        fitted: [again.x_mm - truth.x_mm, again.y_mm - truth.y_mm].map(|e| e * fitted.inflation),
        off_plan: [
            truth.x_mm - press.planned.x_mm,
            truth.y_mm - press.planned.y_mm,
        ],
        per_event: mean(|v| 1.0 / added(v).max(1.0)),
        width2: mean(|v| v.width_u.map_or(f64::NAN, |w| w * w)),
        cluster: mean(|v| {
            let spread = v.spread_u.map_or(f64::NAN, |s| s * s);
            spread / f64::from(v.cluster_events.max(1))
        }),
        idle_per_s: views.iter().map(|v| v.idle_rate_per_s).sum(),
    })
}

/// Events that a press added to those that the idle rate makes of its window.
fn added(view: &PressView) -> f64 {
    let events = f64::from(view.events);
    if view.rate_per_s > 0.0 {
        events - view.idle_rate_per_s * events / view.rate_per_s
    } else {
        0.0
    }
}

/// What is shown beside the contributions.
pub(super) fn measured(of: [&Pressed; 2]) -> Vec<Measured> {
    let row = |what, unit, value: &dyn Fn(&Pressed) -> Option<f64>| Measured {
        what,
        unit,
        values: of.map(value),
    };
    let rms = |p: &Pressed, of: fn(&One) -> [f64; 2]| {
        let squares = p.mean(|o| of(o)[0].powi(2) + of(o)[1].powi(2));
        squares.map(f64::sqrt)
    };
    vec![
        row("RMSE as calibrated", "mm", &|p| rms(p, |o| o.used)),
        row("RMSE with a geometry fitted to these presses", "mm", &|p| {
            rms(p, |o| o.fitted)
        }),
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
            "events that a press adds, per camera (harmonic mean)",
            "events",
            &|p| p.mean(|o| o.per_event).map(|v| 1.0 / v),
        ),
        row("events between presses, both cameras", "events/s", &|p| {
            p.mean(|o| o.idle_per_s)
        }),
        row(
            "width of a touch: columns with half of its events",
            "px",
            &|p| p.mean(|o| o.width2).map(f64::sqrt),
        ),
        row(
            "spread of clustered columns over their root number",
            "px",
            &|p| p.mean(|o| o.cluster).map(f64::sqrt),
        ),
    ]
}

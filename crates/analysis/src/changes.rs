//! Owns whether a camera gives at the end of a session what it gave at its start: the events of a press, the share of ON events, and
//! how long after the contact they come.
//!
//! Presses of one place and depth are compared, so that neither matters. That columns move is a law of the audit.

use std::collections::BTreeMap;

use skinrig_model::{CameraId, LocationId, PressId, PressRole, Verdict};

use crate::bursts::PressBurst;
use crate::input::SessionInput;
use crate::metrics::quantile;
use crate::result::{Analysis, CameraChange, Changed, PressResult, Warning, WarningCause};

/// Places pressed before and after a change, at least,
const LEAST_PLACES: usize = 6;
/// and the share of them at which half of the change, at least, is seen.
const AGREE: f64 = 0.8;
/// Events that a press tells from, at least.
const LEAST_EVENTS: f64 = 10.0;
/// Instants of a change that are tried.
const INSTANTS: usize = 64;

/// A press, and what it tells of a camera.
#[derive(Clone, Copy)]
struct Told {
    press: PressId,
    place: (LocationId, u64),
    value: f64,
}

/// The first of these changes, per camera: a camera that sends fewer events sends them later, too.
pub(crate) fn changes(
    analysis: &Analysis,
    input: &SessionInput,
    bursts: &[Vec<Option<PressBurst>>; 2],
) -> Vec<Warning> {
    let of_camera = |camera: CameraId| {
        let k = camera.index();
        let burst = |row: usize| bursts[k].get(row).copied().flatten();
        let told = |of: &dyn Fn(usize, &PressResult) -> Option<f64>| -> Vec<Told> {
            let rows = analysis.presses.iter().enumerate();
            let alike = |p: &PressResult| {
                let done = matches!(p.verdict, Verdict::Valid | Verdict::Excluded);
                done && p.role != PressRole::Sync && !input.stopped.contains(&p.press)
            };
            rows.filter(|(_, p)| alike(p))
                .filter_map(|(row, p)| {
                    Some(Told {
                        press: p.press,
                        place: (p.location, p.depth_mm.to_bits()),
                        value: of(row, p)?,
                    })
                })
                .collect()
        };
        let events = told(&|row, _| Some(libm::log(burst(row)?.excess()?.max(LEAST_EVENTS))));
        let on_share = told(&|_, p| {
            let view = p.views[k]?;
            let share = f64::from(view.on_events) / f64::from(view.events);
            (f64::from(view.events) >= LEAST_EVENTS).then_some(share)
        });
        let delay_ms = told(&|row, _| burst(row)?.delay_ms);
        let all = [
            (Changed::Events, events),
            (Changed::OnShare, on_share),
            (Changed::DelayMs, delay_ms),
        ];
        let found = all.into_iter().find_map(|(what, told)| change(what, &told));
        found.map(|change| Warning::of_camera(camera, WarningCause::CameraChanged(change)))
    };
    CameraId::ALL.into_iter().filter_map(of_camera).collect()
}

/// The least change that matters: our choice. A skin that settles, or light that warms up, changes the events by tens of percent.
fn least(what: Changed) -> f64 {
    match what {
        Changed::Events => std::f64::consts::LN_2,
        Changed::OnShare => 0.08,
        Changed::DelayMs => 20.0,
    }
}

/// Sum and number of the values at a place, before and after an instant.
#[derive(Clone, Copy, Default)]
struct Sides([(f64, u32); 2]);

impl Sides {
    /// Means before and after, if the place was pressed before and after.
    fn means(&self) -> Option<[f64; 2]> {
        let mean = |(sum, n): (f64, u32)| (n > 0).then(|| sum / f64::from(n));
        Some([mean(self.0[0])?, mean(self.0[1])?])
    }
}

/// A change between two presses, if it matters at most places pressed on both sides of it.
fn change(what: Changed, told: &[Told]) -> Option<CameraChange> {
    let least = least(what);
    let mut places: BTreeMap<(LocationId, u64), Sides> = BTreeMap::new();
    for t in told {
        let after = &mut places.entry(t.place).or_default().0[1];
        *after = (after.0 + t.value, after.1 + 1);
    }
    let step = told.len().div_ceil(INSTANTS).max(1);
    let mut best: Option<(f64, usize, Vec<[f64; 2]>)> = None;
    for (from, t) in told.iter().enumerate() {
        if from > 0 && from % step == 0 {
            let sides: Vec<[f64; 2]> = places.values().filter_map(Sides::means).collect();
            let sum: f64 = sides.iter().map(|[before, after]| after - before).sum();
            let clear = sum.abs() / (sides.len() as f64).sqrt();
            if sides.len() >= LEAST_PLACES && best.as_ref().is_none_or(|b| clear > b.0) {
                best = Some((clear, from, sides));
            }
        }
        let sides = places.entry(t.place).or_default();
        let [before, after] = &mut sides.0;
        *before = (before.0 + t.value, before.1 + 1);
        *after = (after.0 - t.value, after.1 - 1);
    }
    let (_, from, sides) = best?;
    let middle = |of: &dyn Fn(&[f64; 2]) -> f64| {
        quantile(&mut sides.iter().map(of).collect::<Vec<_>>(), 0.5)
    };
    let changed = middle(&|[before, after]| after - before)?;
    let along = |[before, after]: &&[f64; 2]| (after - before) * changed.signum() >= least / 2.0;
    let agree = sides.iter().filter(along).count() as f64 >= AGREE * sides.len() as f64;
    (changed.abs() >= least && agree).then_some(CameraChange {
        what,
        from: told[from].press,
        before: what.of(middle(&|sides| sides[0])?),
        after: what.of(middle(&|sides| sides[1])?),
        places: sides.len(),
    })
}

#[cfg(test)]
mod tests {
    use skinrig_statistics::seeded;

    use super::*;

    /// Presses of `places` in `repetitions`: a value of the place, scattered by `scatter`, changed by `by` from a press on.
    fn told(places: u32, repetitions: u32, scatter: f64, from: u32, by: f64) -> Vec<Told> {
        let mut rng = seeded::generator(5, u64::from(places));
        let at = |index: u32| {
            let place = index % places;
            let noise = scatter * seeded::signed_unit(&mut rng);
            let changed = if index >= from { by } else { 0.0 };
            Told {
                press: PressId::from_index(index),
                place: (LocationId::from_index(place), 2.0f64.to_bits()),
                value: 6.0 + f64::from(place % 5) + noise + changed,
            }
        };
        (0..places * repetitions).map(at).collect()
    }

    #[test]
    fn a_steady_camera_has_not_changed() {
        for (places, repetitions) in [(9, 1), (9, 2), (25, 4), (600, 4), (1, 50)] {
            let told = told(places, repetitions, 0.5, 9999, 0.0);
            for what in [Changed::Events, Changed::OnShare, Changed::DelayMs] {
                let found = change(what, &told);
                assert!(what == Changed::OnShare || found.is_none(), "{found:?}");
            }
        }
        assert!(change(Changed::Events, &[]).is_none());
    }

    /// Halfway, or in the middle of a repetition: the first press that is different is found within the instants tried.
    #[test]
    fn what_changes_from_some_press_on_is_named() {
        for (repetitions, from) in [(2, 40), (2, 60), (4, 70), (4, 130)] {
            let told = told(40, repetitions, 0.3, from, -1.5);
            let found = change(Changed::Events, &told).unwrap();
            let off = found.from.index().abs_diff(from);
            assert!(off <= 40 * repetitions / 20, "{found:?}, {from}");
            let ratio = libm::log(found.after / found.before);
            assert!((ratio + 1.5).abs() < 0.3, "{found:?}");
        }
        // Too little, or at few places.
        assert!(change(Changed::Events, &told(40, 4, 0.3, 80, 0.4)).is_none());
        assert!(change(Changed::Events, &told(5, 4, 0.0, 10, 3.0)).is_none());
    }
}

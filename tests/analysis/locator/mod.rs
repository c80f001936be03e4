//! Locators on planted skins: accuracy, choice, regions, symmetries, degenerate sets.

#![expect(clippy::unwrap_used, reason = "tests")]

mod design;
mod regions;
mod remount;
mod skins;
mod symmetries;

use skinrig_analysis::locator::{FitError, FittedLocator, LocatorModelError};
use skinrig_analysis::result::{LocatorFallback, WarningCause};
use skinrig_analysis::sets::CalibrationSet;
use skinrig_model::Locator;
use skins::{Skin, Spreads, errors, learn, rms};

/// Columns bend by several pixels, as behind a skin of uneven thickness.
fn uneven(seed: u64) -> Skin {
    Skin {
        bend_px: 14.0,
        ..Skin::new(seed)
    }
}

#[test]
fn a_field_removes_structured_error_and_is_chosen() {
    let mut ratios = Vec::new();
    for seed in 0..4 {
        let skin = uneven(seed);
        let auto = learn(&skin, Locator::Auto);
        assert_eq!(
            auto.result.locator,
            Locator::Field,
            "{:?}",
            auto.result.compared
        );
        let geometry = learn(&skin, Locator::Geometry);
        ratios.push(rms(&skin, &auto) / rms(&skin, &geometry));
    }
    let mean = ratios.iter().sum::<f64>() / 4.0;
    assert!(mean < 0.8 && ratios.iter().all(|r| *r < 0.9), "{ratios:?}");
}

/// Nothing to learn: one choice in ten may be wrong, and a wrong one costs a few percent.
#[test]
fn scatter_alone_teaches_nothing_and_costs_little() {
    let mut retained = 0;
    let mut ratios = Vec::new();
    for seed in 0..8 {
        let skin = Skin {
            noise_px: 8.0,
            ..Skin::new(seed)
        };
        let auto = learn(&skin, Locator::Auto);
        retained += u32::from(auto.result.locator == Locator::Geometry);
        let geometry = learn(&skin, Locator::Geometry);
        ratios.push(rms(&skin, &auto) / rms(&skin, &geometry));
    }
    assert!(retained >= 6, "{retained} of 8");
    assert!(ratios.iter().all(|r| *r < 1.06), "{ratios:?}");
}

/// The rays of both cameras are nearly parallel between them: there the spreads tell where along the rays a press is.
#[test]
fn spreads_that_tell_the_distance_make_a_field_better() {
    for seed in 0..3 {
        let columns = Skin {
            noise_px: 8.0,
            ..uneven(seed)
        };
        let spreads = Skin {
            spreads: Spreads::Near(0.08),
            ..columns.clone()
        };
        for locator in [Locator::Field, Locator::Direct] {
            let without = rms(&columns, &learn(&columns, locator));
            let with = rms(&spreads, &learn(&spreads, locator));
            assert!(with < 0.85 * without, "{locator:?}: {with} {without}");
        }
    }
}

#[test]
fn spreads_by_chance_change_little() {
    for seed in 0..3 {
        let columns = uneven(seed);
        let spreads = Skin {
            spreads: Spreads::Chance,
            ..columns.clone()
        };
        let without = rms(&columns, &learn(&columns, Locator::Field));
        let with = rms(&spreads, &learn(&spreads, Locator::Field));
        assert!(with < 1.03 * without, "{with} {without}");
    }
}

#[test]
fn what_is_too_little_to_learn_from_gives_the_geometry_and_a_reason() {
    for presses in [0, 1, 2, 3, 4, 6, 11] {
        let skin = Skin {
            calibrating: presses,
            ..uneven(1)
        };
        let named = learn(&skin, Locator::Field);
        assert_eq!(named.result.locator, Locator::Geometry);
        let wanted = Locator::Field;
        let Some(LocatorFallback::CannotLearn {
            why: why @ FitError::Locations { needed: 12, .. },
            ..
        }) = named.result.fallback
        else {
            panic!("{:?}", named.result.fallback);
        };
        assert_eq!(
            named.warnings,
            [WarningCause::LocatorUnfit { wanted, why }.into()]
        );
        let auto = learn(&skin, Locator::Auto);
        assert_eq!(auto.result.locator, Locator::Geometry);
        assert_eq!(auto.warnings, []);
        assert!(errors(&skin, &auto).iter().all(|e| e.is_finite()));
    }
}

/// Every column equal, all on a line, all presses the same; or all presses on a line: no number is not a number.
#[test]
fn degenerate_presses_end_in_numbers_or_reasons() {
    let skin = uneven(2);
    for kind in 0..4 {
        let rows = skin.presses().into_iter().enumerate().map(|(i, mut p)| {
            for (k, view) in p.views.iter_mut().enumerate() {
                let u = match kind {
                    0 => 300.0,
                    1 => 250.0 + 0.5 * i as f64,
                    2 => 300.0 + 1e-9 * (i + k) as f64,
                    _ => continue,
                };
                *view = view.map(|v| skinrig_analysis::result::PressView {
                    centroid_u: Some(u),
                    ..v
                });
            }
            if kind == 3 {
                p.truth = Some(skinrig_model::Point2::new(
                    0.1 * i as f64,
                    5.0 + 0.2 * i as f64,
                ));
            }
            p
        });
        let set = CalibrationSet::from_presses(&rows.collect::<Vec<_>>());
        if kind == 3 {
            let direct = skins::learn_set(&set, Locator::Direct);
            assert_eq!(direct.result.locator, Locator::Geometry);
            assert_eq!(
                direct.result.fallback,
                Some(LocatorFallback::CannotLearn {
                    wanted: Locator::Direct,
                    why: FitError::Line
                })
            );
        }
        for locator in [Locator::Auto, Locator::Field, Locator::Direct] {
            let choice = skins::learn_set(&set, locator);
            for p in skin.presses() {
                let found = choice.fitted.locate(&skins::features(&p));
                let finite = |v: &f64| v.is_finite();
                assert!(found.is_none_or(|l| l.at.iter().all(finite)));
                let region = found.and_then(|l| l.region);
                assert!(region.is_none_or(|r| r.semi_axes_mm.iter().all(finite)));
            }
        }
    }
}

/// Calibrated in one corner: far away a field fades to the geometry, and no locator states a region.
#[test]
fn beyond_the_calibrating_presses_a_field_fades_to_the_geometry() {
    let skin = Skin {
        corner: true,
        ..uneven(3)
    };
    let field = learn(&skin, Locator::Field);
    assert_eq!(field.result.locator, Locator::Field);
    let geometry = learn(&skin, Locator::Geometry);
    for choice in [&field, &geometry] {
        let mut found = [0, 0];
        for press in skin.presses() {
            let Some(location) = choice.fitted.locate(&skins::features(&press)) else {
                continue;
            };
            assert_eq!(location.region.is_none(), location.extrapolated);
            found[usize::from(location.extrapolated)] += 1;
        }
        let [near, far] = found;
        assert!(near > 30 && far > 50, "{found:?}");
    }
    assert!(rms(&skin, &field) < 1.1 * rms(&skin, &geometry));
}

#[test]
fn the_stored_form_locates_to_the_same_bits() {
    let skin = uneven(5);
    for locator in [Locator::Geometry, Locator::Field, Locator::Direct] {
        let choice = learn(&skin, locator);
        let text = serde_json::to_string(&choice.result).unwrap();
        let stored: skinrig_analysis::result::LocatorResult = serde_json::from_str(&text).unwrap();
        assert_eq!(stored, choice.result);
        let geometry = skins::calibrated(&skin.set()).geometry;
        let restored = FittedLocator::new(locator, geometry, stored.model).unwrap();
        for press in skin.presses() {
            let features = skins::features(&press);
            assert_eq!(restored.locate(&features), choice.fitted.locate(&features));
        }
    }
}

/// Rays of the drawn geometry would give other positions without a word.
#[test]
fn an_analysis_with_a_changed_locator_has_none() {
    let (input, source) = skinrig_planted::grid::session();
    let mut analysis = skinrig_analysis::analyze(&input, &source).unwrap();
    assert!(FittedLocator::of(&analysis).is_ok());
    let model = &mut analysis.locator.as_mut().unwrap().model;
    model.geometry_covariance = Some(vec![vec![1.0]]);
    assert_eq!(
        FittedLocator::of(&analysis).err(),
        Some(LocatorModelError::CovarianceSize)
    );
}

#[test]
fn every_number_of_threads_learns_the_same_bits() {
    let skin = uneven(6);
    let in_pool = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new();
        let pool = pool.num_threads(threads).build().unwrap();
        pool.install(|| learn(&skin, Locator::Auto).result)
    };
    let one = in_pool(1);
    assert_eq!(one, in_pool(2));
    assert_eq!(one, in_pool(5));
}

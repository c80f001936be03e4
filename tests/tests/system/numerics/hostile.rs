//! Analysis results never contain NaN or infinity, whatever the input.

use proptest::prelude::*;
use skinrig_analysis::{Analysis, analyze};
use skinrig_model::{CalibrationModel, HostTime, LensModel, Point2};

use crate::numerics::laws::runner;
use skinrig_planted::Memory;
use skinrig_planted::grid::session;

/// Serialising and parsing must change nothing: NaN and infinity would be lost.
pub(crate) fn holds_only_numbers(a: &Analysis) {
    let text = serde_json::to_string(a).unwrap();
    let back: Analysis = serde_json::from_str(&text)
        .unwrap_or_else(|e| panic!("{e}: {}", around(&text, e.column())));
    assert!(back == *a, "a number is lost: {}", lost(a));
}

fn around(text: &str, column: usize) -> &str {
    &text[column.saturating_sub(200)..column.min(text.len())]
}

/// Positions of unserialisable numbers in the debug text.
fn lost(a: &Analysis) -> String {
    let text = format!("{a:?}");
    let places = text.match_indices("NaN").chain(text.match_indices("inf,"));
    places
        .take(5)
        .map(|(at, _)| around(&text, at + 4).to_owned())
        .collect::<Vec<_>>()
        .join(" ... ")
}

/// Extreme numbers.
fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        Just(f64::NAN),
        Just(f64::INFINITY),
        Just(f64::NEG_INFINITY),
        Just(0.0),
        Just(-1.0),
        Just(f64::MAX),
        Just(f64::MIN_POSITIVE),
        Just(1e-300),
        Just(-1e300),
        -1e3..1e3f64,
    ]
}

/// A defect of a session: kind, amount, and press.
fn faults() -> impl Strategy<Value = Vec<(u8, f64, usize)>> {
    prop::collection::vec((0u8..26, number(), 0usize..53), 1..4)
}

fn corrupt(
    input: &mut skinrig_analysis::SessionInput,
    source: &mut Memory,
    fault: (u8, f64, usize),
) {
    let (what, x, row) = fault;
    let settings = &mut input.settings;
    let camera = &mut input.rig.nominal.cameras[row % 2];
    let time = || HostTime((x * 1e9) as i64 / 4);
    let outcome = input.outcomes[row].as_mut();
    match what {
        0 => camera.position.x_mm = x,
        1 => camera.position.y_mm = x,
        2 => camera.aim.x_mm = x,
        3 => camera.skew_deg = x,
        4 => {
            camera.lens = LensModel::Exponential {
                half_fov_deg: x,
                w: 0.1,
            };
        }
        5 => {
            camera.lens = LensModel::Exponential {
                half_fov_deg: 60.0,
                w: x,
            };
        }
        6 => input.rig.outline.width_mm = x,
        7 => input.rig.outline.radius_mm = x,
        8 => input.rig.outline.centre.y_mm = x,
        9 => settings.eps_px = x,
        10 => settings.window_before_ms = x,
        11 => settings.within_mm = x,
        12 => settings.failure_penalty_mm = Some(x),
        13 => settings.bits_per_event = x,
        14 => settings.min_response_sigma = x,
        15 => settings.min_ray_sine = x,
        16 => settings.cmre.cell_mm = x,
        17 => settings.cmre.sigma_mm = x,
        18 => settings.cmre.sr_mm = x,
        19 => settings.latency.bin_ms = x,
        20 => settings.latency.alpha = x,
        21 => input.planned[row].at = Point2::new(x, 2.0),
        22 => input.planned[row].depth_mm = x,
        23 => {
            if let Some(o) = outcome {
                o.measured_at = Some(Point2::new(10.0, x));
            }
        }
        24 => {
            if let Some(t) = outcome.and_then(|o| o.timing.as_mut()) {
                t.contact = time();
            }
        }
        _ => source.events[row % 2].truncate((x.abs() as usize).min(60_000)),
    }
}

#[test]
fn analysis_results_are_always_finite() {
    let (mut plain, source) = session();
    plain.settings.bootstrap_resamples = 20;
    plain.settings.calibration = CalibrationModel::Positions;
    plain.settings.study_presses = 2;
    plain.settings.reduction.seeds = 1;
    plain.settings.reduction.max_power = 2;
    let (mut analysed, mut refused) = (0, 0);
    let counts = std::cell::RefCell::new((&mut analysed, &mut refused));
    runner(120)
        .run(&faults(), |faults| {
            let mut input = plain.clone();
            let mut memory = Memory {
                events: source.events.clone(),
                slice: 4096,
            };
            for fault in &faults {
                corrupt(&mut input, &mut memory, *fault);
            }
            match analyze(&input, &memory) {
                Ok(a) => {
                    holds_only_numbers(&a);
                    assert!(a.counts.add_up());
                    *counts.borrow_mut().0 += 1;
                }
                Err(error) => {
                    assert!(error.to_string().starts_with("expected "), "{error}");
                    *counts.borrow_mut().1 += 1;
                }
            }
            Ok(())
        })
        .unwrap();
    assert!(analysed > 10 && refused > 10, "{analysed} {refused}");
}

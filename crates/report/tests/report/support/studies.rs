//! Made-up studies for the report tests, shaped like real ones. None of their numbers was measured.

use skinrig_analysis::locator::FitError;
use skinrig_analysis::result::*;
use skinrig_model::*;

use super::Noise;

/// A value with an interval `spread` to either side.
pub(crate) fn estimate(value: f64, spread: f64, n: u32) -> Estimate {
    Estimate {
        value: Some(value),
        low: Some(value - spread),
        high: Some(value + spread),
        n,
    }
}

/// Two curves over 2^0 ..= 2^12.
pub(crate) fn reduction() -> Reduction {
    let curve = |thinning, loss: f64| ReductionCurve {
        thinning,
        rows: (0..=12)
            .map(|power| {
                let x = f64::from(power);
                let rmse = 2.5 + 0.004 * libm::pow(x, 3.1);
                let share = |v: f64, spread: f64| {
                    let e = estimate(v, spread, 300);
                    Estimate {
                        high: e.high.map(|h| h.min(1.0)),
                        ..e
                    }
                };
                let kept = 0.5f64.powi(power);
                ReductionRow {
                    factor: 1 << power,
                    events_per_view: 11_600.0 * kept,
                    rmse_mm: estimate(rmse, 0.1 + 0.02 * x, 300),
                    rmse_of_seeds_mm: Some((rmse - 0.05 * x, rmse + 0.06 * x)),
                    pass_rate: share(0.95 - loss * (x / 12.0).powi(5), 0.02),
                    within_rate: share(0.93 - 1.3 * loss * (x / 12.0).powi(4), 0.025),
                    located_rate: share(0.99 - 0.4 * loss * (x / 12.0).powi(7), 0.008),
                    press_bytes_per_s: estimate(75_000.0 * kept, 1_600.0 * kept, 300),
                    idle_bytes_per_s: estimate(24_000.0 * kept, 240.0 * kept, 300),
                }
            })
            .collect(),
    };
    Reduction {
        eps_px: 10.0,
        min_samples: 10,
        seeds: 10,
        presses: 300,
        pass_threshold_mm: Some(4.76),
        within_mm: 5.0,
        curves: vec![
            curve(Thinning::Exact, 0.35),
            curve(Thinning::Bernoulli, 0.5),
        ],
    }
}

/// A detector with onsets 9 to 40 ms after contact.
pub(crate) fn latency(noise: &mut Noise, presses: &[PressResult]) -> Latency {
    let onsets: Vec<(PressId, Option<f64>)> = presses
        .iter()
        .filter(|p| p.role == PressRole::Score && p.timing.is_some())
        .take(300)
        .map(|p| {
            let onset = 18.0 + 5.0 * noise.normal() + 12.0 * noise.uniform().powi(3);
            let onset = match p.press.index() % 97 {
                5 => None,
                6 => None,
                _ => Some(onset),
            };
            (p.press, onset)
        })
        .collect();
    let early = onsets.iter().filter(|(press, _)| press.index() % 97 == 6);
    let false_detections = early
        .map(|(press, _)| (*press, -41.0))
        .collect::<Vec<_>>()
        .into_iter();
    let sweep: Vec<ThresholdRow> = (0..20)
        .map(|i| {
            let h = 1.0 + f64::from(i);
            ThresholdRow {
                threshold: h,
                onsets: 299,
                detected_rate: 1.0 - 0.0001 * libm::pow(h, 2.2),
                median_ms: Some(12.0 + 0.4 * h),
                width_ms: Some(26.0 + 0.25 * h),
                false_alarms: if i < 15 { 60 - 4 * i } else { 3 },
                at_risk_s: 241.7,
                false_alarms_per_s: f64::from(if i < 15 { 60 - 4 * i } else { 3 }) / 241.7,
            }
        })
        .collect();
    let bump = |t: f64, at: f64, width: f64| libm::exp(-((t - at) / width).powi(2));
    let course = |gain: f64, noise: &mut Noise| {
        (0..850)
            .map(|i| {
                let t = -700.0 + 2.0 * f64::from(i);
                let rate = 21_000.0 + 4e5 * bump(t, 130.0, 70.0) + 2.6e5 * bump(t, 640.0, 90.0);
                (gain * rate * (0.93 + 0.14 * noise.uniform())) as f32
            })
            .collect()
    };
    Latency {
        settings: LatencySettings::default(),
        trials: 300,
        unusable: 2,
        shortened: 1,
        covered_ms: (700.0, 850.0),
        zero_padded: false,
        decision_delay_ms: 1.4,
        earliest_ms: -2.6,
        background_s: 150.0,
        at_risk_s: 241.7,
        background_rate_per_s: 20_900.0,
        chosen: Some(15),
        detected_rate: estimate(0.983, 0.012, 300),
        width_ms: estimate(28.6, 2.1, 295),
        median_ms: estimate(19.4, 0.8, 295),
        false_alarms_per_s: Estimate {
            value: Some(3.0 / 241.7),
            low: Some(0.619 / 241.7),
            high: Some(8.767 / 241.7),
            n: 300,
        },
        false_detections: false_detections.collect(),
        from_contact: Some(ContactLatency {
            p5_ms: estimate(10.2, 0.9, 295),
            median_ms: estimate(19.5, 0.7, 295),
            p95_ms: estimate(33.1, 1.9, 295),
            before_contact: 3,
            missed: 4,
            uncertainty_ms: 0.31,
            from_bins_ms: 0.058,
            from_clocks_ms: 0.012,
            from_contact_ms: 0.289,
        }),
        reduced: Some(ReducedLatency {
            factor: 1024,
            thresholds: ThresholdGrid {
                from: 3.0,
                to: 8.0,
                count: 6,
            },
            target_rate: 0.85,
            threshold: Some(3.0),
            detected_rate: estimate(0.89, 0.03, 300),
            width_ms: estimate(102.0, 9.0, 267),
            false_alarms_per_s: estimate(1.7, 0.3, 300),
        }),
        course: LatencyCourse {
            start_ms: -700.0,
            bin_ms: 2.0,
            press_per_s: [course(0.55, noise), course(1.0, noise), course(1.6, noise)],
            background_per_s: [14_000.0, 20_900.0, 31_000.0],
        },
        sweep,
        backgrounds: Vec::new(),
        onsets,
    }
}

/// The four nested models and the ten-parameter one, the second smallest chosen.
pub(crate) fn models() -> Vec<ModelComparison> {
    let rows = [
        (CalibrationModel::None, 0, 5.87, 5.87),
        (CalibrationModel::Positions, 4, 3.61, 3.48),
        (CalibrationModel::PositionsSkews, 6, 3.47, 3.33),
        (CalibrationModel::Full, 8, 3.45, 3.31),
        (CalibrationModel::FullScale, 10, 3.52, 3.3),
    ];
    rows.map(|(model, parameters, validated, fitted)| ModelComparison {
        model,
        parameters,
        rmse_mm: estimate(validated, 0.2, 256),
        bounded_rmse_mm: Some(validated - 0.05),
        test: (parameters > 0).then_some(PairedTest {
            against: CalibrationModel::None,
            gain_mm: 5.87 - validated,
            standard_error_mm: 0.1,
            ratio: (5.87 - validated) / 0.1,
            needed: 1.29,
        }),
        fitted_rmse_mm: Some(fitted),
        chosen: model == CalibrationModel::Full,
    })
    .to_vec()
}

/// Correlations that fall with the distance of two parameters; the last one is not determined.
pub(crate) fn correlation(parameters: usize) -> Vec<Vec<Option<f64>>> {
    let last = parameters - 1;
    let at = |i: usize, k: usize| {
        (i != last && k != last).then(|| {
            let sign = if (i + k).is_multiple_of(3) && i != k {
                -1.0
            } else {
                1.0
            };
            sign * 0.8f64.powi(i.abs_diff(k) as i32)
        })
    };
    (0..parameters)
        .map(|i| (0..parameters).map(|k| at(i, k)).collect())
        .collect()
}

/// A cost that is flat, dips, and rises.
pub(crate) fn threshold() -> ThresholdChoice {
    let cost = |events: u32| {
        let x = libm::log(f64::from(events));
        2.9 + 0.35 * (x - 4.2).powi(2)
    };
    ThresholdChoice {
        events: 67,
        penalty_mm: 28.3,
        n: 256,
        left_out: 3,
        chance: Some(0.001),
        candidates: [20, 31, 45, 67, 90, 140, 260, 410, 900, 1900, 3200]
            .map(|e| (e, cost(e)))
            .to_vec(),
    }
}

/// The published skin with its fields of view, as measured by hand.
pub(crate) fn coverage(cell_mm: f64, places: &[Point2]) -> Coverage {
    let locations = places.len() as u32;
    let polygon =
        |points: &[(f64, f64)]| vec![points.iter().map(|p| Point2::new(p.0, p.1)).collect()];
    Coverage {
        skin_mm2: 9331.75,
        seen_by_both_mm2: 8760.1,
        probed_mm2: Some(f64::from(locations) * cell_mm * cell_mm),
        cell_mm: Some(cell_mm),
        locations,
        places: places.to_vec(),
        views: [
            polygon(&[
                (44.0, -32.0),
                (60.0, 10.0),
                (60.0, 32.0),
                (40.0, 52.0),
                (-15.0, 52.0),
                (-40.0, 27.0),
                (-40.0, -28.0),
            ]),
            polygon(&[
                (49.7, 39.8),
                (-40.0, 30.0),
                (-40.0, -23.0),
                (-15.0, -48.0),
                (40.0, -48.0),
                (58.0, -30.0),
            ]),
        ],
        overlap: polygon(&[
            (44.0, -32.0),
            (57.5, 4.0),
            (49.7, 39.8),
            (-40.0, 27.0),
            (-40.0, -28.0),
        ]),
        taxels_skin: estimate(483.0, 60.0, 2271),
        taxels_probed: estimate(332.0, 40.0, 2271),
    }
}

/// The parameters are those of the settings.
pub(crate) fn cmre() -> Cmre {
    Cmre {
        settings: CmreSettings::default(),
        cells: (20, 20),
        percent: estimate(31.4, 2.2, 2271),
        without_score: 2,
    }
}

/// About the published rates.
pub(crate) fn bit_rates() -> BitRates {
    BitRates {
        bits_per_event: 21.0,
        press_events_per_s: estimate(28_570.0, 600.0, 2294),
        idle_events_per_s: estimate(9_140.0, 90.0, 2294),
        press_bytes_per_s: estimate(74_996.0, 1_575.0, 2294),
        idle_bytes_per_s: estimate(23_992.0, 236.0, 2294),
        press_s: estimate(1.2, 0.01, 2294),
    }
}

/// A bright band about row 270 under a faint rim, with a few hot pixels.
pub(crate) fn activity(noise: &mut Noise, camera: CameraId) -> Activity {
    let (width, height) = (320u16, 240u16);
    let mut counts = vec![0; usize::from(width) * usize::from(height)];
    for (i, count) in counts.iter_mut().enumerate() {
        let (u, v) = ((i % 320) as f64, (i / 320) as f64);
        let band =
            4e4 * libm::exp(-((v - 135.0) / 22.0).powi(2)) * (0.4 + libm::sin(u / 40.0).abs());
        let rim = libm::hypot(u - 160.0, 1.2 * (v - 120.0));
        let seen = if rim < 165.0 { band + 30.0 } else { 0.4 };
        *count = (seen * (0.5 + noise.uniform())) as u64;
        if noise.uniform() < 0.0002 {
            *count = 900_000;
        }
    }
    Activity {
        camera,
        cell_px: 2,
        width,
        height,
        counts,
    }
}

/// The published evaluation.
pub(crate) fn reference() -> ReferenceCode {
    ReferenceCode {
        presses: 256,
        calibrated: true,
        parameters: vec![("x1".to_owned(), -61.2), ("skew2".to_owned(), 1.37)],
        with_centroids: 251,
        inside: 244,
        rmse_mm: Some(3.02),
        rmse_x_mm: Some(2.31),
        rmse_y_mm: Some(1.94),
        std_of_errors_mm: Some(1.71),
        reduction: (0..=10)
            .map(|power| ReferenceReduction {
                factor: 1 << power,
                rmse_mm: Some(3.1 + 0.05 * f64::from(power).powi(2)),
                pass_rate: 0.948 - 0.006 * f64::from(power),
                honest_pass_rate: 0.940 - 0.009 * f64::from(power),
            })
            .collect(),
    }
}

/// Two violations.
pub(crate) fn findings() -> Vec<Finding> {
    vec![
        Finding {
            law: Law::CentroidFollowsPosition,
            fault: Fault::CamerasSwapped,
            camera: None,
            evidence: Evidence::OtherReading {
                off_deg: [Some(14.2), Some(13.9)],
                other_off_deg: [Some(0.9), Some(1.1)],
                reading: OtherReading::CamerasExchanged,
                log_odds: 812.0,
                places: 256,
            },
            advice:
                "check which camera wrote which file, and import again with the files exchanged"
                    .into(),
            invalidates: false,
        },
        Finding {
            law: Law::ClockDrift,
            fault: Fault::ClockWrong,
            camera: Some(CameraId::Two),
            evidence: Evidence::ClockDrift {
                camera: CameraId::Two,
                limit_ppm: 100.0,
                drift_ppm: 312.4,
                error_ppm: 0.2,
                n: 2500,
            },
            advice: "check the alignment of camera 2 before any time of it is used".into(),
            invalidates: false,
        },
    ]
}

/// A map with a distant rejected point, and a bent one.
pub(crate) fn clock_residuals() -> Vec<ClockResiduals> {
    let map = |map, size_us: f64| ClockResiduals {
        map,
        n: 200,
        points: (0..200)
            .map(|k| ClockResidual {
                host_s: f64::from(k) * 3.0,
                residual_us: if k == 77 {
                    900.0
                } else {
                    size_us * libm::sin(f64::from(k) * 0.7)
                },
                used: k != 77,
            })
            .collect(),
    };
    vec![
        map(MapName::HostFromBox, 60.0),
        map(MapName::Camera1FromBox, 0.6),
        map(MapName::Camera2FromBox, 0.7),
    ]
}

/// A tip that lags by 10 ms.
pub(crate) fn motion() -> Motion {
    let path = |t: f64| [0.0, 0.0, 5.0 - 20.0 * t.clamp(0.0, 0.35)];
    let samples = (0..300).map(|k| f64::from(k) * 2e-3);
    Motion {
        samples: 600_000,
        broken: 2,
        rms_mm: 0.05,
        max_mm: 0.3,
        bin_s: 0.4,
        course: (0..1500)
            .map(|k| MotionBin {
                start_s: f64::from(k) * 0.4,
                rms_mm: 0.05,
                max_mm: 0.2 + 0.1 * f64::from(k % 2),
            })
            .collect(),
        presses: vec![PressMotion {
            press: PressId::from_index(9),
            kept_each: 2,
            samples: samples
                .map(|t| TipSample {
                    since_contact_s: t - 0.25,
                    commanded_mm: path(t),
                    measured_mm: path(t - 0.01),
                })
                .collect(),
        }],
    }
}

/// A field that won against the geometry.
pub(crate) fn locator() -> LocatorResult {
    let around = |value: f64, n: u32| Estimate {
        value: Some(value),
        low: Some(0.9 * value),
        high: Some(1.1 * value),
        n,
    };
    let row = |locator, rmse: f64, chosen| LocatorComparison {
        locator,
        rmse_mm: around(rmse, 40),
        bounded_rmse_mm: Some(0.97 * rmse),
        over_repetitions_mm: Some(0.9 * rmse),
        test: None,
        unfit: None,
        chosen,
    };
    LocatorResult {
        locator: Locator::Field,
        version: 1,
        fallback: None,
        compared: vec![
            row(Locator::Geometry, 3.0, false),
            LocatorComparison {
                test: Some(PairedTest {
                    against: Locator::Geometry,
                    gain_mm: 0.9,
                    standard_error_mm: 0.2,
                    ratio: 4.5,
                    needed: 1.7,
                }),
                ..row(Locator::Field, 2.1, true)
            },
            LocatorComparison {
                rmse_mm: Estimate {
                    value: None,
                    low: None,
                    high: None,
                    n: 0,
                },
                bounded_rmse_mm: None,
                over_repetitions_mm: None,
                unfit: Some(FitError::Locations {
                    needed: 16,
                    found: 14,
                }),
                ..row(Locator::Direct, 0.0, false)
            },
        ],
        bound_mm: Some(12.0),
        model: LocatorModel {
            reference_events: 800.0,
            scatter: None,
            geometry_covariance: None,
            remount_covariance: None,
            cameras: None,
            prior: None,
            inflation: 1.0,
            levels: Vec::new(),
            learnt: None,
        },
        reliability: [0.5, 0.8, 0.95]
            .map(|level| ReliabilityRow {
                level,
                inside: Estimate {
                    value: Some(level - 0.02),
                    low: Some(level - 0.08),
                    high: Some((level + 0.04).min(1.0)),
                    n: 80,
                },
            })
            .to_vec(),
    }
}

//! A made-up, seeded analysis for the report tests. None of its numbers was measured.

pub(crate) mod studies;

use skinrig_analysis::exclusion::Exclusion;
use skinrig_analysis::result::*;
use skinrig_model::*;
use skinrig_report::{DeviceRow, InterruptionRow, LegRow, LossRow, NoteRow, Provenance, RetakeRow};

/// A small generator (SplitMix64), sufficient for the report.
pub(crate) struct Noise(pub u64);

impl Noise {
    /// Uniform in 0..1.
    pub(crate) fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// About normal, mean 0, standard deviation 1 (sum of 12 uniforms).
    pub(crate) fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

/// `side * side` locations pressed `repetitions` times, three sync presses first.
pub(crate) fn analysis(side: u32, repetitions: u32) -> Analysis {
    let mut noise = Noise(7);
    let geometry = StereoGeometry::PAPER;
    let outline = SkinOutline::PAPER;
    let mut presses = vec![];
    for i in 0..3 {
        presses.push(press(
            &mut noise,
            &geometry,
            i,
            PressRole::Sync,
            0,
            0,
            Point2::new(10.0, 2.0),
        ));
    }
    let pitch = 76.0 / f64::from((side - 1).max(1));
    for repetition in 0..repetitions {
        for location in 0..side * side {
            let (row, along) = (location / side, location % side);
            let column = if row % 2 == 0 {
                along
            } else {
                side - 1 - along
            };
            let at = Point2::new(
                -28.0 + pitch * f64::from(column),
                -36.0 + pitch * f64::from(row),
            );
            let role = if repetition == 0 {
                PressRole::Calibrate
            } else {
                PressRole::Score
            };
            let id = presses.len() as u32;
            presses.push(press(
                &mut noise, &geometry, id, role, repetition, location, at,
            ));
        }
    }
    let count = |verdict: Verdict| {
        presses
            .iter()
            .filter(|p| p.role != PressRole::Sync && p.verdict == verdict)
            .count() as u32
    };
    let counts = PressCounts {
        planned: presses.len() as u32 - 3,
        valid: count(Verdict::Valid),
        missed: count(Verdict::Missed),
        invalid: count(Verdict::Invalid),
        excluded: count(Verdict::Excluded),
        sync: 3,
    };
    let of_first = presses
        .iter()
        .filter(|p| p.role != PressRole::Sync && p.repetition.index() == 0);
    let places: Vec<Point2> = of_first.map(|p| p.planned).collect();
    let scored = metrics(&presses, true);
    let scored_without_exclusions = metrics(&presses, false);
    let length_s = presses.len() as f64 * 2.9 + 6.0;
    let bins = 3000.min((length_s / 0.01) as usize);
    let rates = [1.0, 1.4].map(|gain| {
        let bin_s = length_s / bins as f64;
        let mean: Vec<f32> = (0..bins)
            .map(|i| {
                let t = i as f64 * bin_s % 2.9;
                let burst = if (1.0..1.4).contains(&t) || (1.9..2.2).contains(&t) {
                    9e4
                } else {
                    2e3
                };
                (gain * burst * (0.7 + 0.6 * noise.uniform())) as f32
            })
            .collect();
        let peak = mean.iter().map(|m| m * 2.2).collect();
        RateSeries {
            start_s: -1.0,
            bin_s,
            mean_per_s: mean,
            peak_per_s: peak,
        }
    });
    let shown: Vec<u32> = (1..=3).map(|k| presses.len() as u32 * k / 4).collect();
    let pictures = shown
        .iter()
        .flat_map(|id| [CameraId::One, CameraId::Two].map(|c| (*id, c)))
        .map(|(id, camera)| picture(&mut noise, &presses[id as usize], camera))
        .collect();
    let zooms = shown
        .iter()
        .flat_map(|id| [CameraId::One, CameraId::Two].map(|c| (*id, c)))
        .map(|(id, camera)| zoom(&mut noise, id, camera))
        .collect();
    let latency = studies::latency(&mut noise, &presses);
    let activity = CameraId::ALL
        .map(|c| studies::activity(&mut noise, c))
        .to_vec();
    Analysis {
        locator: Some(locator()),
        version: ANALYSIS_VERSION,
        alignment: alignment(),
        legs: Vec::new(),
        contact_timing: Default::default(),
        settings: AnalysisSettings::default(),
        rig: RigGeometry { outline, nominal: geometry, trigger_channel: Some(0), trigger_delay_us: [0; 2] },
        geometry,
        counts,
        clocks: [fit(ClockMethod::TriggerMarks, 12.345_6), fit(ClockMethod::EventRates, -3.21)],
        calibration: Some(CalibrationResult {
            model: CalibrationModel::Full,
            lens: LensKind::Exponential,
            correlation: studies::correlation(8),
            condition: Some(184.0),
            rank: 8,
            outliers: 4,
            starts: 10,
            starts_agreeing: 9,
            compared: studies::models(),
            bound_mm: Some(10.4),
            start: geometry,
            names: ["camera 1 x (mm)", "camera 1 y (mm)", "camera 2 x (mm)", "camera 2 y (mm)", "camera 1 skew (deg)",
                "camera 2 skew (deg)", "camera 1 distortion W (1)", "camera 2 distortion W (1)"].map(str::to_owned).to_vec(),
            start_values: vec![45.0, -30.0, 50.0, 40.0, -2.0, -1.0, -0.1, 0.05],
            values: vec![44.1, -32.2, 49.9, 39.6, -1.8, -1.5, -0.16, 0.071],
            standard_errors: vec![Some(0.21), Some(0.18), Some(0.25), Some(0.2), Some(0.1), Some(0.11), Some(0.02), None],
            rmse_before_mm: 5.87,
            rmse_after_mm: 3.31,
            n: side * side,
            termination: "converged: relative reduction of the sum of squares below 1e-10".into(),
        }),
        scored,
        scored_without_exclusions,
        penalised: PenalisedRmse {
            penalty_mm: 28.3,
            derived: true,
            raised: false,
            failures: 4,
            beyond_penalty: 1,
            rmse_mm: scored_without_exclusions.rmse_mm,
        },
        threshold: Some(studies::threshold()),
        coverage: Some(studies::coverage(pitch, &places)),
        cmre: Some(studies::cmre()),
        bit_rates: Some(studies::bit_rates()),
        reduction: Some(studies::reduction()),
        latency: Some(latency),
        reference: None,
        findings: vec![],
        activity,
        off_sensor: [OffSensor::default(); 2],
        depths: vec![],
        rates,
        presses,
        warnings: vec!["camera 2 has no trigger marks; its clock was fitted from the event rates of the sync presses".into()],
        pictures,
        zooms,
        motion: Some(studies::motion()),
    }
}

fn alignment() -> Alignment {
    let map = |map, rms, half_us: f64| ClockMap {
        map,
        pieces: 120,
        n: 9_700,
        rejected: 3,
        drift_ppm: Some(-211.37),
        residual_rms_us: Some(rms),
        residual_max_us: Some(4.0 * rms),
        interval_us: Some((0.25, 0.5)),
        bound_us: Some((half_us, 1.2 * half_us)),
        coverage: Some(0.951),
        coverage_n: 9_700,
    };
    let line = LineCounts {
        trains_sent: 9_703,
        trains_seen: 9_700,
        trains_unrecorded: 0,
        sent: 620_992,
        seen: 620_100,
        lost: 892,
        doubled: 12,
        spurious: 3,
    };
    Alignment {
        status: AlignmentStatus::Valid,
        violations: vec![],
        warnings: Vec::new(),
        maps: vec![
            map(MapName::HostFromBox, 41.0, 171.5),
            map(MapName::Camera1FromBox, 0.41, 2.1),
            map(MapName::Camera2FromBox, 0.43, 2.2),
        ],
        lines: vec![line; 2],
        rates: None,
        resets: 0,
        camera_from_host: [vec![], vec![]],
        residuals: studies::clock_residuals(),
    }
}

fn fit(method: ClockMethod, drift_ppm: f64) -> Option<ClockFit> {
    Some(ClockFit {
        method,
        offset_us: 1_234_567.8,
        drift_ppm,
        drift_se_ppm: 0.012_3,
        residual_rms_us: 0.61,
        residual_max_us: 2.4,
        n: 2500,
        rejected: 3,
    })
}

fn recorded(text: &str) -> Exclusion {
    let text = text.to_owned();
    Exclusion::Excluded(ExcludedReason::Recorded { text })
}

fn press(
    noise: &mut Noise,
    geometry: &StereoGeometry,
    id: u32,
    role: PressRole,
    repetition: u32,
    location: u32,
    at: Point2,
) -> PressResult {
    let truth = Point2::new(
        at.x_mm + 0.02 * noise.normal(),
        at.y_mm + 0.02 * noise.normal(),
    );
    let far = (60.0 - at.x_mm) / 100.0;
    let sigma = 0.8 + 3.0 * far * far;
    let bias = (
        1.6 * far * (at.y_mm / 20.0).sin(),
        1.1 * (at.x_mm / 25.0).cos(),
    );
    let estimate = Point2::new(
        truth.x_mm + bias.0 + sigma * noise.normal(),
        truth.y_mm + bias.1 + 0.7 * sigma * noise.normal(),
    );
    let inside = SkinOutline::PAPER.contains(estimate);
    let (verdict, cause) = match id % 211 {
        13 => (
            Verdict::Invalid,
            Some(Exclusion::Invalid(InvalidReason::Recorded {
                text: "settled 0.31 mm from the planned position, limit 0.10 mm".to_owned(),
                kinds: vec![PressFaultKind::Hold],
                is_cut_off: false,
            })),
        ),
        47 => (
            Verdict::Missed,
            Some(Exclusion::Missed(MissedReason::Recorded {
                text: "the run stopped before it".to_owned(),
            })),
        ),
        90 => (
            Verdict::Excluded,
            Some(recorded(
                "min_cluster_events: 12 clustered events in camera 1, at least 20 needed",
            )),
        ),
        _ if !inside => (
            Verdict::Excluded,
            Some(recorded(
                "exclude_outside: the estimate lies outside the skin",
            )),
        ),
        _ => (Verdict::Valid, None),
    };
    let missed = verdict == Verdict::Missed;
    let start = 2.9 * f64::from(id);
    let t = |s: f64| HostTime::from_secs_f64(start + s);
    let view = |camera: usize, noise: &mut Noise| {
        (!missed).then(|| {
            let events = 900 + (noise.uniform() * 22_000.0) as u32;
            PressView {
                events,
                on_events: events * 2 / 5,
                clusters: 1 + u32::from(noise.uniform() > 0.85),
                cluster_events: events * 9 / 10,
                centroid_u: geometry.cameras[camera]
                    .column_of_point(truth)
                    .map(|u| u + 2.0 * noise.normal()),
                centroid_v: Some(270.0 + 4.0 * noise.normal()),
                rate_per_s: f64::from(events) / 0.9,
                idle_rate_per_s: 2100.0,
                idle_s: 0.8,
                spread_u: Some(14.0),
                spread_v: None,
                width_u: Some(19.0),
            }
        })
    };
    let views = [view(0, noise), view(1, noise)];
    PressResult {
        region: None,
        extrapolated: false,
        press: PressId::from_index(id),
        role,
        repetition: RepetitionId::from_index(repetition),
        location: LocationId::from_index(location),
        planned: at,
        depth_mm: 2.0,
        truth: (!missed).then_some(truth),
        verdict,
        cause,
        timing: (!missed).then(|| PressTiming {
            approach: t(0.8),
            contact: t(1.0),
            at_depth: t(1.4),
            retract: t(1.9),
            release: t(2.2),
            clear: t(2.5),
        }),
        views,
        location_outcome: match (missed, inside) {
            (true, _) => LocationOutcome::Missing,
            (false, true) => LocationOutcome::Located {
                at: estimate,
                sine: 0.8,
            },
            (false, false) => LocationOutcome::Outside {
                at: estimate,
                sine: 0.4,
            },
        },
    }
}

fn metrics(presses: &[PressResult], valid_only: bool) -> Metrics {
    let scored: Vec<_> = presses
        .iter()
        .filter(|p| p.role == PressRole::Score)
        .collect();
    let errors: Vec<(f64, f64)> = scored
        .iter()
        .filter(|p| !valid_only || p.verdict == Verdict::Valid)
        .filter_map(|p| p.error_mm())
        .collect();
    let n = errors.len() as u32;
    let mean =
        |f: &dyn Fn(&(f64, f64)) -> f64| errors.iter().map(f).sum::<f64>() / f64::from(n.max(1));
    let e = |v: f64, n: u32| Estimate {
        value: (n > 0).then_some(v),
        low: (n > 0).then_some(v * 0.95 - 0.02),
        high: (n > 0).then_some(v * 1.06 + 0.02),
        n,
    };
    let mut lengths: Vec<f64> = errors.iter().map(|(x, y)| x.hypot(*y)).collect();
    lengths.sort_by(f64::total_cmp);
    let quantile = |q: f64| {
        lengths
            .get((lengths.len().saturating_sub(1) as f64 * q) as usize)
            .copied()
            .unwrap_or(0.0)
    };
    let rmse = mean(&|v| v.0 * v.0 + v.1 * v.1).sqrt();
    let attempted = scored
        .iter()
        .filter(|p| p.verdict != Verdict::Missed)
        .count() as u32;
    Metrics {
        rmse_mm: e(rmse, n),
        rmse_x_mm: e(mean(&|v| v.0 * v.0).sqrt(), n),
        rmse_y_mm: e(mean(&|v| v.1 * v.1).sqrt(), n),
        bias_x_mm: e(mean(&|v| v.0), n),
        bias_y_mm: e(mean(&|v| v.1), n),
        median_mm: e(quantile(0.5), n),
        p95_mm: e(quantile(0.95), n),
        repeat_std_mm: e(1.83, if n > 0 { 250 } else { 0 }),
        located_rate: Estimate {
            high: Some(1.0),
            ..e(f64::from(n) / f64::from(attempted.max(1)), attempted)
        },
        within_rate: e(
            lengths.iter().filter(|l| **l <= 5.0).count() as f64 / f64::from(attempted.max(1)),
            attempted,
        ),
        rmse_diagonal_percent: (n > 0).then_some(rmse / 141.42 * 100.0),
    }
}

fn picture(noise: &mut Noise, press: &PressResult, camera: CameraId) -> PressPicture {
    let rows = [(185u16, 360u16), (200, 355)][camera.index()];
    let u0 = press.views[camera.index()]
        .and_then(|v| v.centroid_u)
        .unwrap_or(320.0);
    let mut pixels = std::collections::BTreeMap::new();
    for i in 0..2600 {
        let stray = i % 9 == 0;
        let (u, v) = if stray {
            (
                640.0 * noise.uniform(),
                f64::from(rows.0) + 150.0 * noise.uniform(),
            )
        } else {
            (u0 + 9.0 * noise.normal(), 275.0 + 16.0 * noise.normal())
        };
        let (u, v) = (
            u.clamp(0.0, 639.0) as u16,
            v.clamp(f64::from(rows.0), f64::from(rows.1)) as u16,
        );
        let pixel = pixels.entry((v, u)).or_insert(PicturePixel {
            u,
            v,
            on: 0,
            off: 0,
            clustered: !stray,
        });
        if noise.uniform() < 0.4 {
            pixel.on += 1
        } else {
            pixel.off += 1
        }
    }
    PressPicture {
        press: press.press,
        camera,
        rows,
        pixels: pixels.into_values().collect(),
    }
}

fn zoom(noise: &mut Noise, press: u32, camera: CameraId) -> RateZoom {
    let bump = |i: i32, centre: f64| (-((f64::from(i) * 0.01 - 0.5 - centre) / 0.09).powi(2)).exp();
    let mut bins = |on: f64, off: f64| {
        (0..230)
            .map(|i| {
                (900.0
                    + 9e4
                        * (on * bump(i, 0.2) + off * bump(i, 1.05))
                        * (0.8 + 0.4 * noise.uniform())) as f32
            })
            .collect()
    };
    RateZoom {
        press: PressId::from_index(press),
        camera,
        start_s: -0.5,
        bin_s: 0.01,
        on_per_s: bins(0.4, 0.9),
        off_per_s: bins(1.0, 0.3),
        release_s: 1.2,
    }
}

/// Provenance of a simulated session.
pub(crate) fn provenance() -> Provenance {
    let device = |role: &str, model: &str, serial: &str, firmware: &str| DeviceRow {
        role: role.into(),
        model: model.into(),
        serial: serial.into(),
        firmware: firmware.into(),
    };
    Provenance {
        session_id: "2026-03-02_14-05-09_meander".into(),
        started: "2026-03-02T14:05:09+01:00".into(),
        prototype: "waveguide 3, second pour".into(),
        operator: "A. Example".into(),
        protocol_name: "protocols/meander.yaml".into(),
        protocol_sha256: "3f5b".repeat(16),
        overrides: vec!["path.repetitions=10".into()],
        variant: None,
        plan_sha256: "a90c".repeat(16),
        seed: 20_260_302,
        rig_kind: "simulated".into(),
        rig_name: "simulated (geometric)".into(),
        simulated: true,
        emulated: false,
        preflight: Vec::new(),
        devices: vec![
            device("indenter", "simulated Omega.3", "sim-robot", "0.1.0"),
            device(
                "camera1",
                "simulated Prophesee EVK1 Gen3.1",
                "sim-cam-1",
                "0.1.0",
            ),
            device(
                "camera2",
                "simulated Prophesee EVK1 Gen3.1",
                "sim-cam-2",
                "0.1.0",
            ),
            device("trigger_box", "simulated trigger box", "sim-box", "0.1.0"),
        ],
        software: "skinrig 0.1.0".into(),
        host: "bench-2".into(),
        command_line: "skinrig run protocols/meander.yaml --set path.repetitions=10".into(),
        results_hash: "77e1".repeat(16),
        run_end: "completed".into(),
        run_end_reason: None,
        run_end_cause: Some(RunEnd::Completed),
        legs: vec![
            LegRow {
                number: 1,
                started: "2026-03-02T14:05:09+01:00".into(),
                start_s: 0.0,
                end: "cut off".into(),
                apart_s: None,
            },
            LegRow {
                number: 2,
                started: "2026-03-02T22:10:30+01:00".into(),
                start_s: 1210.0,
                end: "completed".into(),
                apart_s: Some(27_913.5),
            },
        ],
        retaken: [
            (41, "camera 2 lost 4096 bytes during the press"),
            (77, "cut off: leg 1 ended during the press"),
            (93, "camera 2 lost 4096 bytes during the press"),
        ]
        .map(|(press, reason)| RetakeRow {
            press,
            attempt: 1,
            reason: reason.into(),
            cause: None,
        })
        .to_vec(),
        interruptions: vec![InterruptionRow {
            t_s: 1803.2,
            kind: "pause".into(),
            reason: "operator paused".into(),
            ended_run: false,
        }],
        notes: vec![NoteRow {
            t_s: 2.0,
            text: "blinds closed".into(),
        }],
        lost_bytes: [0, 4096],
        losses: vec![LossRow {
            camera: 2,
            bytes: 4096,
            time: LostTime {
                from_us: Some(61_250_000),
                to_us: Some(61_262_500),
            },
        }],
    }
}

/// An empty session.
pub(crate) fn empty() -> Analysis {
    let full = analysis(2, 1);
    Analysis {
        counts: PressCounts::default(),
        clocks: [None, None],
        calibration: None,
        scored: metrics(&[], true),
        scored_without_exclusions: metrics(&[], false),
        rates: [RateSeries::default(), RateSeries::default()],
        presses: vec![],
        warnings: vec![],
        pictures: vec![],
        zooms: vec![],
        penalised: PenalisedRmse {
            failures: 0,
            ..full.penalised
        },
        threshold: None,
        coverage: None,
        cmre: None,
        bit_rates: None,
        reduction: None,
        latency: None,
        activity: vec![],
        off_sensor: [OffSensor::default(); 2],
        ..full
    }
}

/// A field that won against the geometry.
fn locator() -> LocatorResult {
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
                test: Some(LocatorTest {
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
                unfit: Some("it needs 16 calibration locations, found 14".to_owned()),
                ..row(Locator::Direct, 0.0, false)
            },
        ],
        bound_mm: Some(12.0),
        model: LocatorModel {
            reference_events: 800.0,
            scatter: None,
            geometry_covariance: None,
            cameras: None,
            prior: None,
            inflation: 1.0,
            levels: Vec::new(),
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

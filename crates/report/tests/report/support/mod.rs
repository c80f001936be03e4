//! A made-up, seeded analysis for the report tests. None of its numbers was measured.

mod presses;
mod provenance;
pub(crate) mod studies;

use skinrig_analysis::clock::MarksError;
use skinrig_analysis::result::*;
use skinrig_model::*;

use presses::{metrics, picture, press, zoom};
pub(crate) use provenance::provenance;

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
        indentation: None,
        recalibration: None,
        locator: Some(studies::locator()),
        version: ANALYSIS_VERSION,
        alignment: alignment(),
        legs: Vec::new(),
        contact_timing: Default::default(),
        hot_pixels: Default::default(),
        settings: AnalysisSettings::default(),
        rig: RigGeometry {
            outline,
            nominal: geometry,
            trigger_channel: Some(0),
            trigger_delay_us: [0; 2],
        },
        geometry,
        counts,
        clocks: [
            fit(ClockMethod::TriggerMarks, 12.345_6),
            fit(ClockMethod::EventRates, -3.21),
        ],
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
            names: [
                "camera 1 x (mm)",
                "camera 1 y (mm)",
                "camera 2 x (mm)",
                "camera 2 y (mm)",
                "camera 1 skew (deg)",
                "camera 2 skew (deg)",
                "camera 1 distortion W (1)",
                "camera 2 distortion W (1)",
            ]
            .map(str::to_owned)
            .to_vec(),
            start_values: vec![45.0, -30.0, 50.0, 40.0, -2.0, -1.0, -0.1, 0.05],
            values: vec![44.1, -32.2, 49.9, 39.6, -1.8, -1.5, -0.16, 0.071],
            standard_errors: vec![
                Some(0.21),
                Some(0.18),
                Some(0.25),
                Some(0.2),
                Some(0.1),
                Some(0.11),
                Some(0.02),
                None,
            ],
            rmse_before_mm: 5.87,
            rmse_after_mm: 3.31,
            n: side * side,
            termination: Termination::NoChange,
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
        campaign: None,
        findings: vec![],
        activity,
        off_sensor: [OffSensor::default(); 2],
        depths: vec![],
        rates,
        presses,
        warnings: vec![Warning {
            leg: None,
            camera: Some(CameraId::Two),
            cause: WarningCause::NoMarksClock {
                sent: 14,
                edges: 3,
                why: MarksError::NoneSeen,
            },
        }],
        pictures,
        zooms,
        felt: None,
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

/// A warning whose text contains `name`.
pub(crate) fn warning(name: String) -> Warning {
    WarningCause::OpenParameters {
        determined: 7,
        parameters: 8,
        model: CalibrationModel::Full,
        open: vec![name],
    }
    .into()
}

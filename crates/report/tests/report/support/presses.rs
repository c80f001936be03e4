//! Made-up presses with their metrics, pictures and close-ups.

use skinrig_analysis::exclusion::Exclusion;
use skinrig_analysis::result::*;
use skinrig_model::*;

use super::Noise;

fn recorded(text: &str) -> Exclusion {
    let text = text.to_owned();
    Exclusion::Excluded(ExcludedReason::Recorded { text })
}

pub(crate) fn press(
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
        1.6 * far * libm::sin(at.y_mm / 20.0),
        1.1 * libm::cos(at.x_mm / 25.0),
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
                core_threshold: Some(10),
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

pub(crate) fn metrics(presses: &[PressResult], valid_only: bool) -> Metrics {
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
    let mut lengths: Vec<f64> = errors.iter().map(|(x, y)| libm::hypot(*x, *y)).collect();
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

pub(crate) fn picture(noise: &mut Noise, press: &PressResult, camera: CameraId) -> PressPicture {
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

pub(crate) fn zoom(noise: &mut Noise, press: u32, camera: CameraId) -> RateZoom {
    let bump =
        |i: i32, centre: f64| libm::exp(-((f64::from(i) * 0.01 - 0.5 - centre) / 0.09).powi(2));
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

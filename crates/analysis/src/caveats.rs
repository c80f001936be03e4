//! Owns caveats about the results as a whole: settings that do not fit the data, contradictory results.

use skinrig_model::{AnalysisSettings, CameraId, Estimator, Point2, PressId, PressRole};

use crate::background::{Background, CoreThreshold};
use crate::metrics::quantile;
use crate::result::{
    Analysis, Estimate, PressResult, PressView, Reduction, ReductionRow, Warning, WarningCause,
};
use crate::storms::storms;
use crate::unused_settings::unused_settings;

/// A thinned row is comparable if it locates at least this share of what all events locate.
const COMPARABLE: f64 = 0.95;
/// Fewest presses in a row whose equal positions are suspicious, and fewest groups of equal ones beside them.
const REPEATED: usize = 3;
/// Errors beyond this multiple of the median are none of those of the others: of normal errors, one in 10^10 is (Rayleigh: 7 standard
/// deviations).
const FAR_OFF: f64 = 6.0;
/// RMSE, relative to that without such errors, from which they decide it.
const DECIDES: f64 = 1.25;
/// Least number of errors of which one stands out.
const ERRORS: usize = 10;
/// Share of presses with a dense background that is worth a caveat.
const MANY: f64 = 0.1;

/// Caveats of a finished analysis.
pub(crate) fn caveats(analysis: &Analysis) -> Vec<Warning> {
    let dense = CameraId::ALL
        .into_iter()
        .filter_map(|camera| dense_background(&analysis.settings, &analysis.presses, camera));
    let left_out = analysis.left_out_one_by_one();
    let is_known = analysis.scores_calibrating_places() == Some(true);
    let disagree =
        left_out.and_then(|l| calibration_disagrees(&analysis.scored.rmse_mm, &l, is_known));
    let fewer = analysis.reduction.iter().filter_map(fewer_events_do_better);
    let storms = storms(&analysis.presses);
    let made = analysis.presses.iter();
    let made = made.filter(|p| p.role != PressRole::Sync);
    let measured: Vec<_> = made.filter_map(|p| Some((p.press, p.truth?))).collect();
    let scored = analysis.presses.iter().filter(|p| p.is_in_headline());
    let error = |p: &PressResult| p.error_mm().map(|(x, y)| (p.press, libm::hypot(x, y)));
    let errors: Vec<_> = scored.filter_map(error).collect();
    let unknown = analysis
        .left_out_rmse()
        .and_then(|rmse| left_out_unknown(&rmse, &measured));
    dense
        .chain(disagree)
        .chain(fewer)
        .chain(storms)
        .chain(repeated_positions(&measured))
        .chain(few_decide(&errors))
        .chain(unknown)
        .chain(unused_settings(&analysis.settings))
        .collect()
}

/// A caveat if at least three presses in a row have one position to the last digit, and longer so than most do. Measured positions never
/// repeat exactly; those of a plan do, if it presses each location so many times.
fn repeated_positions(measured: &[(PressId, Point2)]) -> Option<Warning> {
    let runs: Vec<&[(PressId, Point2)]> = measured.chunk_by(|a, b| a.1 == b.1).collect();
    let longest = runs.iter().max_by_key(|run| run.len())?;
    let mut lengths: Vec<f64> = runs.iter().map(|run| run.len() as f64).collect();
    let usual = quantile(&mut lengths, 0.5)?;
    if longest.len() < REPEATED || longest.len() as f64 <= usual || runs.len() < REPEATED {
        return None;
    }
    let ((first, _), (last, _)) = longest.first().zip(longest.last())?;
    let (first, last) = (*first, *last);
    Some(WarningCause::RepeatedPositions { first, last }.into())
}

/// A caveat if a few presses, at most a tenth, decide the RMSE: their rows of the press list may be wrong, or their events not theirs.
fn few_decide(errors: &[(PressId, f64)]) -> Option<Warning> {
    let mut lengths: Vec<f64> = errors.iter().map(|(_, mm)| *mm).collect();
    let limit_mm = FAR_OFF * quantile(&mut lengths, 0.5)?;
    let rmse =
        |all: &[f64]| libm::sqrt(all.iter().map(|mm| mm * mm).sum::<f64>() / all.len() as f64);
    lengths.sort_by(f64::total_cmp);
    let near = lengths.partition_point(|mm| *mm <= limit_mm);
    let far = errors.iter().filter(|(_, mm)| *mm > limit_mm);
    let presses: Vec<PressId> = far.map(|(press, _)| *press).collect();
    let is_few = !presses.is_empty() && 10 * presses.len() <= errors.len();
    let (rmse_mm, without_mm) = (rmse(&lengths), rmse(&lengths[..near]));
    let decide = errors.len() >= ERRORS && is_few && rmse_mm > DECIDES * without_mm;
    decide.then(|| {
        let cause = WarningCause::FewDecide {
            presses,
            limit_mm,
            rmse_mm,
            without_mm,
        };
        cause.into()
    })
}

/// A caveat if the interval of the RMSE where no press calibrated is wider than the area that was pressed.
fn left_out_unknown(rmse: &Estimate, measured: &[(PressId, Point2)]) -> Option<Warning> {
    let extent = |of: fn(&Point2) -> f64| {
        let values = || measured.iter().map(|(_, at)| of(at));
        let (low, high) = (values().reduce(f64::min)?, values().reduce(f64::max)?);
        Some(high - low)
    };
    let extent_mm = libm::hypot(extent(|at| at.x_mm)?, extent(|at| at.y_mm)?);
    let is_wide = rmse.high? - rmse.low? > extent_mm && extent_mm > 0.0;
    let rmse_mm = *rmse;
    is_wide.then(|| WarningCause::LeftOutUnknown { rmse_mm, extent_mm }.into())
}

/// A caveat if the background alone creates core events in some presses: the events expected in a neighbourhood plus two standard
/// deviations (Poisson) reach the core threshold of DBSCAN. Where the threshold follows the background, that happens only to presses
/// without idle time of their own; the median of the others stands in for it.
fn dense_background(
    settings: &AnalysisSettings,
    presses: &[PressResult],
    camera: CameraId,
) -> Option<Warning> {
    if settings.estimator != Estimator::Dbscan || settings.bin_px != 1 {
        return None;
    }
    let views = || presses.iter().filter_map(|p| p.views[camera.index()]);
    let mut idle_rates: Vec<f64> = views()
        .filter(|v| v.idle_s > 0.0)
        .map(|v| v.idle_rate_per_s)
        .collect();
    let background = Background {
        events: quantile(&mut idle_rates, 0.5)?.round() as u64,
        idle_us: 1_000_000,
    };
    let dense = |view: &PressView| {
        let window_s = f64::from(view.events) / view.rate_per_s;
        let window_us = (window_s.is_finite()).then_some((window_s * 1e6) as u64)?;
        let neighbours = background.neighbours(settings, camera, window_us);
        let reach = neighbours + 2.0 * neighbours.sqrt();
        (reach >= f64::from(view.core_threshold?)).then_some(neighbours)
    };
    let mut of_dense: Vec<f64> = views().filter_map(|v| dense(&v)).collect();
    if (of_dense.len() as f64) < MANY * views().count() as f64 {
        return None;
    }
    let neighbours = quantile(&mut of_dense, 0.5)?;
    let cause = WarningCause::DenseBackground {
        neighbours,
        eps_px: settings.eps_px,
        min_samples: settings.min_samples,
        advised_min_samples: f64::from(CoreThreshold::ADVISED.at(neighbours)),
    };
    Some(Warning::of_camera(camera, cause))
}

/// A caveat if the scored presses and the held-out calibration locations have errors that differ by more than both
/// intervals, with the same locator. At locations that calibrated, scored presses may have smaller ones.
fn calibration_disagrees(
    scored: &Estimate,
    left_out: &Estimate,
    is_known: bool,
) -> Option<Warning> {
    let is_smaller = scored.high? < left_out.low?;
    let apart = scored.low? > left_out.high? || is_smaller && !is_known;
    let cause = WarningCause::CalibrationDisagrees {
        scored_rmse_mm: *scored,
        held_out_rmse_mm: *left_out,
    };
    apart.then_some(cause.into())
}

/// A caveat if fewer events locate better than all events.
fn fewer_events_do_better(reduction: &Reduction) -> Option<Warning> {
    reduction.curves.iter().find_map(|curve| {
        let (all, fewer) = curve.rows.split_first()?;
        let located = COMPARABLE * all.located_rate.value?;
        let better = |row: &&ReductionRow| {
            let below = row.rmse_mm.high.zip(all.rmse_mm.low);
            below.is_some_and(|(high, low)| high < low)
                && row.located_rate.value.is_some_and(|share| share >= located)
        };
        let row = fewer.iter().find(better)?;
        let cause = WarningCause::FewerEventsBetter {
            factor: row.factor,
            rmse_mm: row.rmse_mm,
            rmse_of_all_mm: all.rmse_mm,
        };
        Some(cause.into())
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::result::{ReductionCurve, Thinning};

    fn estimate(value: f64, half_width: f64) -> Estimate {
        Estimate {
            value: Some(value),
            low: Some(value - half_width),
            high: Some(value + half_width),
            n: 100,
        }
    }

    #[test]
    fn intervals_that_touch_do_not_disagree() {
        let say = |scored, left_out| calibration_disagrees(&scored, &left_out, false);
        assert_eq!(say(estimate(2.0, 0.5), estimate(1.25, 0.25)), None);
        let found = say(estimate(2.0, 0.5), estimate(1.0, 0.25))
            .unwrap()
            .to_string();
        assert!(
            found.contains("2.00 mm [1.50, 2.50]") && found.contains("1.00 mm [0.75, 1.25]"),
            "{found}"
        );
        assert!(say(estimate(1.0, 0.25), estimate(2.0, 0.5)).is_some());
        // Where the presses calibrated, smaller errors are expected; larger ones never.
        let known = |scored, left_out| calibration_disagrees(&scored, &left_out, true);
        assert_eq!(known(estimate(1.0, 0.25), estimate(2.0, 0.5)), None);
        assert!(known(estimate(2.0, 0.5), estimate(1.0, 0.25)).is_some());
    }

    #[test]
    fn fewer_events_are_called_better_only_when_they_locate_as_many() {
        let row = |factor, rmse, located| ReductionRow {
            factor,
            events_per_view: 100.0,
            rmse_mm: estimate(rmse, 0.1),
            rmse_of_seeds_mm: None,
            pass_rate: estimate(1.0, 0.0),
            within_rate: estimate(1.0, 0.0),
            located_rate: estimate(located, 0.0),
            press_bytes_per_s: estimate(1.0, 0.0),
            idle_bytes_per_s: estimate(1.0, 0.0),
        };
        let say = |rows| {
            let curves = vec![ReductionCurve {
                thinning: Thinning::Exact,
                rows,
            }];
            fewer_events_do_better(&Reduction {
                eps_px: 10.0,
                min_samples: 10,
                seeds: 1,
                presses: 100,
                pass_threshold_mm: None,
                within_mm: 5.0,
                curves,
            })
        };
        let all = row(1, 2.0, 1.0);
        assert_eq!(say(vec![all, row(2, 1.9, 1.0), row(4, 0.5, 0.9)]), None);
        let found = say(vec![all, row(2, 1.9, 1.0), row(4, 0.5, 0.96)])
            .unwrap()
            .to_string();
        assert!(found.starts_with("a random 1/4 of the events"), "{found}");
    }

    /// Presses at these places along x.
    fn measured(along: &[f64]) -> Vec<(PressId, Point2)> {
        let at = |(n, x): (u32, &f64)| (PressId::from_index(n), Point2::new(*x, 2.0));
        (0..).zip(along).map(at).collect()
    }

    #[test]
    fn positions_that_repeat_where_others_do_not_are_named() {
        let say = |along: &[f64]| repeated_positions(&measured(along));
        for sound in [
            &[][..],
            &[1.0; 9],
            &[1.0, 2.0, 3.0, 4.0],
            // Twice by chance, and each location three times.
            &[1.0, 1.0, 2.0, 3.0, 4.0],
            &[1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 3.0, 3.0, 3.0],
        ] {
            assert_eq!(say(sound), None, "{sound:?}");
        }
        let found = say(&[1.0, 2.0, 3.0, 3.0, 3.0, 4.0, 5.0]).unwrap();
        let (first, last) = (PressId::from_index(2), PressId::from_index(4));
        assert_eq!(
            found,
            WarningCause::RepeatedPositions { first, last }.into()
        );
        assert!(found.cause.is_grave());
    }

    #[test]
    fn presses_far_off_that_decide_the_rmse_are_named() {
        let say = |mm: &[f64]| {
            let numbered = (0..).zip(mm).map(|(n, mm)| (PressId::from_index(n), *mm));
            few_decide(&numbered.collect::<Vec<_>>())
        };
        let usual = [
            1.0, 0.5, 2.0, 1.5, 1.0, 0.8, 1.2, 1.0, 0.9, 1.1, 1.3, 0.7, 1.0,
        ];
        assert_eq!(say(&usual), None);
        let with = |far: &[f64]| [&usual[..], &usual[..], far].concat();
        let found = say(&with(&[30.0, 1.0, 7.0])).unwrap();
        let WarningCause::FewDecide {
            presses, limit_mm, ..
        } = &found.cause
        else {
            panic!("{found}");
        };
        assert_eq!(*presses, [26, 28].map(PressId::from_index));
        assert_eq!(*limit_mm, 6.0);
        assert!(found.cause.is_grave());
        // It makes no difference; too many to be few; too few to tell.
        assert_eq!(say(&[usual.repeat(10), vec![6.1]].concat()), None);
        assert_eq!(say(&with(&[30.0; 4])), None);
        assert_eq!(say(&[1.0, 1.0, 1.0, 1.0, 30.0]), None);
        assert_eq!(say(&[]), None);
    }

    #[test]
    fn an_interval_wider_than_the_pressed_area_is_called_unknown() {
        let area = measured(&[0.0, 30.0, 60.0]);
        assert_eq!(left_out_unknown(&estimate(30.0, 29.0), &area), None);
        let found = left_out_unknown(&estimate(30.0, 31.0), &area)
            .unwrap()
            .to_string();
        assert!(
            found.contains("is unknown") && found.contains("60 mm"),
            "{found}"
        );
        assert_eq!(left_out_unknown(&estimate(30.0, 31.0), &area[..1]), None);
    }
}

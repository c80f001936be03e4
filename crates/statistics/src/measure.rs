//! Computes the value of a metric and the influence of its presses from a sample.

use super::error::{ComparisonError, Side};
use super::influence::{InferenceData, Measure, RatioTransform, from_terms};
use super::quantiles;
use super::sample::{Clusters, Count, Data};
use super::spread::{self, RepeatEstimator};

/// Measures the locations for which `keep` returns true.
///
/// # Errors
/// [`ComparisonError::Empty`], or the reason why the metric has no value.
pub(super) fn measure(
    data: &Data,
    estimator: RepeatEstimator,
    side: Side,
    keep: impl Fn(u32) -> bool,
) -> Result<Measure, ComparisonError> {
    let empty = ComparisonError::Empty { side };
    let found = match data {
        Data::Mean(c) => ratio(c, &keep, RatioTransform::Same, |v| (*v, 1.0)),
        Data::Rms(c) => ratio(c, &keep, RatioTransform::Root, |v| (v * v, 1.0)),
        Data::Taxels(area_mm2, c) => {
            let found = ratio(c, &keep, RatioTransform::Circles(*area_mm2), |v| {
                (v * v, 1.0)
            });
            if found.as_ref().is_some_and(|m| !m.value.is_finite()) {
                return Err(ComparisonError::NoError { side });
            }
            found
        }
        Data::RepeatStd(c) => spread::repeat_std(c, estimator, &keep),
        Data::Share(times, c) => {
            let share = ratio(c, &keep, RatioTransform::Same, |v| {
                (f64::from(u8::from(*v)), 1.0)
            });
            share.map(|m| Measure {
                shape: InferenceData::Share(m.presses() / times),
                ..m
            })
        }
        Data::CountRate(c) => {
            let rate = ratio(c, &keep, RatioTransform::Same, |v| {
                (f64::from(v.events), v.exposure)
            });
            let retained = || c.iter().filter(|(k, _)| keep(**k)).flat_map(|(_, v)| v);
            let events = retained()
                .map(|v: &Count| v.events)
                .fold(0, u32::saturating_add);
            let exposure = retained().map(|v| v.exposure).sum();
            rate.map(|m| Measure {
                shape: match m.shape {
                    InferenceData::Ratio(ratio) => InferenceData::Counts(events, exposure, ratio),
                    other => other,
                },
                ..m
            })
        }
        Data::Quantile(q, c) => return quantiles::quantile(c, &keep, *q, side),
        Data::Width(c) => return quantiles::width(c, &keep, side),
    };
    found.ok_or(empty)
}

fn ratio<T>(
    clusters: &Clusters<T>,
    keep: impl Fn(u32) -> bool,
    scale: RatioTransform,
    term: impl Fn(&T) -> (f64, f64),
) -> Option<Measure> {
    let retained = clusters.iter().filter(|(k, _)| keep(**k));
    let locations = retained.map(|(k, v)| (*k, v.iter().map(&term).collect()));
    from_terms(locations.collect(), scale)
}

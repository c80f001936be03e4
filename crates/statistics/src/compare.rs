//! Compares two samples.

use super::comparison::{Comparison, Design, Interval, Tost, Verdict, direction};
use super::error::{ComparisonError, Side};
use super::inference::Inference;
use super::influence::Measure;
use super::measure::measure;
use super::question::{ComparisonTarget, ImprovementDirection, Pairing, Settings};
use super::sample::{Data, Kind, Sample};
use super::sessions::SessionSpread;
use super::spread::RepeatEstimator;
use super::{components, notes, presses_needed};

/// Value of one sample over all its locations, with its interval.
///
/// # Errors
/// [`ComparisonError`].
pub fn estimate(sample: &Sample, settings: &Settings) -> Result<Interval, ComparisonError> {
    settings.check()?;
    let of = measure(sample.data(), RepeatEstimator::All, Side::A, |_| true)?;
    let locations = of.locations() as u32;
    if locations < 2 {
        return Err(ComparisonError::TooFewLocations { locations });
    }
    Ok(alone(sample, &of, settings))
}

/// Interval of one sample; a value that is never below 0 has no limit below 0.
fn alone(sample: &Sample, of: &Measure, settings: &Settings) -> Interval {
    let mut interval = Inference::alone(of, settings).interval(settings.alpha);
    if sample.is_positive() {
        interval.low = interval.low.map(|low| low.max(0.0));
    }
    interval
}

/// Compares B with A. Differences are B - A.
///
/// # Errors
/// [`ComparisonError`].
pub fn compare(
    a: &Sample,
    b: &Sample,
    question: &ComparisonTarget,
    settings: &Settings,
) -> Result<Comparison, ComparisonError> {
    settings.check()?;
    question.check()?;
    if a.kind() != b.kind() {
        let (a, b) = (a.kind(), b.kind());
        return Err(ComparisonError::Kinds { a, b });
    }
    let data = [a.data(), b.data()];
    let Measured {
        of,
        left_out,
        sessions,
    } = measured([a, b], settings.pairing)?;
    let both = [&of[0], &of[1]];
    let difference = Inference::difference(both, 1.0, sessions, settings);
    let whole = difference.interval(settings.alpha);
    if whole.low.is_some() && whole.low == whole.high {
        return Err(ComparisonError::NoSpread {
            a: of[0].value,
            b: of[1].value,
            locations: of[0].locations() as u32,
        });
    }
    let tost = question.margin.map(|margin| Tost {
        margin,
        interval: difference.interval(2.0 * settings.alpha),
        p: difference.p_above(-margin).max(difference.p_below(margin)),
    });
    let p_difference =
        if question.better == ImprovementDirection::NearerZero && a.kind() == Kind::Mean {
            p_of_distance(
                &difference,
                &Inference::difference(both, -1.0, sessions, settings),
            )
        } else {
            2.0 * difference.p_above(0.0).min(difference.p_below(0.0))
        }
        .min(1.0);
    let values = [of[0].value, of[1].value];
    let verdict = verdict(values, p_difference, tost.map(|t| t.p), question, settings);
    let components = components::of(&of, settings.pairing, sessions);
    Ok(Comparison {
        kind: a.kind(),
        a: alone(a, &of[0], settings),
        b: alone(b, &of[1], settings),
        difference: whole,
        p_difference,
        tost,
        verdict,
        beyond_margin: question.margin.is_some_and(|margin| {
            whole.low.is_some_and(|l| l > margin) || whole.high.is_some_and(|h| h < -margin)
        }),
        design: Design {
            pairing: settings.pairing,
            locations: of.each_ref().map(|m| m.locations() as u32),
            presses: of.each_ref().map(Measure::presses),
            left_out,
        },
        needed: presses_needed::presses_needed(verdict, question, &components, &of, settings),
        components,
        notes: notes::notes(data, &of),
    })
}

/// Derives the verdict from p values; equivalence takes precedence.
pub(super) fn verdict(
    [a, b]: [f64; 2],
    p_difference: f64,
    p_tost: Option<f64>,
    question: &ComparisonTarget,
    settings: &Settings,
) -> Verdict {
    if p_tost.is_some_and(|p| p <= settings.alpha) {
        Verdict::Equivalent
    } else if p_difference <= settings.alpha {
        direction(a, b, question.better)
    } else {
        Verdict::Undecided
    }
}

/// Two-sided p value for `|a| = |b|`, from their difference and their sum. "Nearer to zero" requires both to have the same
/// sign (intersection-union test: Berger 1982).
fn p_of_distance(difference: &Inference, sum: &Inference) -> f64 {
    let [above, below] = [difference.p_above(0.0), difference.p_below(0.0)];
    let [positive, negative] = [sum.p_above(0.0), sum.p_below(0.0)];
    let further = above.max(positive).min(below.max(negative));
    let nearer = below.max(positive).min(above.max(negative));
    2.0 * further.min(nearer)
}

/// Two samples over the locations that are compared.
struct Measured {
    of: [Measure; 2],
    /// Locations that each leaves out.
    left_out: [u32; 2],
    /// How their sessions differ, if they can be told apart.
    sessions: Option<SessionSpread>,
}

fn measured(samples: [&Sample; 2], pairing: Pairing) -> Result<Measured, ComparisonError> {
    let data = samples.map(Sample::data);
    let estimator = RepeatEstimator::for_samples(data);
    let sets = data.map(Data::locations);
    for (side, set) in [Side::A, Side::B].into_iter().zip(&sets) {
        if set.is_empty() {
            return Err(ComparisonError::Empty { side });
        }
    }
    let total = sets.each_ref().map(|p| p.len() as u32);
    let shared = sets[0].intersection(&sets[1]).count() as u32;
    let (locations, left_out) = match pairing {
        Pairing::SharedLocations => (shared, total.map(|t| t - shared)),
        Pairing::Independent => (total[0].min(total[1]), [0, 0]),
    };
    if locations == 0 {
        let [a, b] = total;
        return Err(ComparisonError::NoSharedLocation { a, b });
    }
    if locations < 2 {
        return Err(ComparisonError::TooFewLocations { locations });
    }
    let keep = |other: usize| {
        let sets = &sets;
        move |k: u32| pairing == Pairing::Independent || sets[other].contains(&k)
    };
    let of = [
        measure(data[0], estimator, Side::A, keep(1))?,
        measure(data[1], estimator, Side::B, keep(0))?,
    ];
    // A session in which the metric has no value tells nothing of the spread.
    let by_session = [0, 1].map(|i| {
        let keep = keep(1 - i);
        let values = samples[i].sessions().iter().filter_map(|session| {
            let of = measure(session, estimator, Side::A, keep).ok()?;
            Some(of.value).filter(|value| value.is_finite())
        });
        values.collect::<Vec<f64>>()
    });
    let sessions = SessionSpread::of(by_session.each_ref().map(Vec::as_slice));
    Ok(Measured {
        of,
        left_out,
        sessions,
    })
}

//! Compares two samples.

use super::comparison::{Comparison, Design, Interval, Note, Tost, Verdict};
use super::distributions::{student_cdf, student_quantile};
use super::influence::{Influences, influences};
use super::question::{Better, Pairing, Question, Settings};
use super::refusal::{Refusal, Side};
use super::sample::{Data, Sample};
use super::{components, needed};

/// The value of one sample over all its locations, with its interval.
///
/// # Errors
/// [`Refusal`].
pub fn estimate(sample: &Sample, settings: &Settings) -> Result<Interval, Refusal> {
    let of = influences(sample.data(), Side::A, |_| true)?;
    let k = of.places.len();
    if k < 2 {
        let locations = k as u32;
        return Err(Refusal::TooFewLocations { locations });
    }
    let half = student_quantile(1.0 - 0.5 * settings.alpha, k as f64 - 1.0) * error(&of.totals());
    Ok(around(of.value, half))
}

/// Compares B with A.
///
/// # Errors
/// [`Refusal`].
pub fn compare(
    a: &Sample,
    b: &Sample,
    question: &Question,
    settings: &Settings,
) -> Result<Comparison, Refusal> {
    if a.kind() != b.kind() {
        let (a, b) = (a.kind(), b.kind());
        return Err(Refusal::Kinds { a, b });
    }
    let all = [
        influences(a.data(), Side::A, |_| true)?,
        influences(b.data(), Side::B, |_| true)?,
    ];
    let (of, left_out) = kept(&[a.data(), b.data()], all, settings.pairing)?;
    let locations = [0, 1].map(|i| of[i].places.len() as u32);
    let (error_of, df) = spread(&of, settings.pairing);
    let difference = of[1].value - of[0].value;
    if error_of <= 0.0 {
        return Err(Refusal::NoSpread {
            a: of[0].value,
            b: of[1].value,
            locations: locations[0],
        });
    }
    let above = |border: f64| 1.0 - student_cdf((difference - border) / error_of, df);
    let below = |border: f64| student_cdf((difference - border) / error_of, df);
    let interval = |alpha: f64| {
        around(
            difference,
            student_quantile(1.0 - 0.5 * alpha, df) * error_of,
        )
    };
    let tost = question.margin.map(|margin| Tost {
        margin,
        interval: interval(2.0 * settings.alpha),
        p: above(-margin).max(below(margin)),
    });
    let p_difference = (2.0 * above(0.0).min(below(0.0))).min(1.0);
    let own = |i: usize| {
        let df = of[i].places.len() as f64 - 1.0;
        let half = student_quantile(1.0 - 0.5 * settings.alpha, df) * error(&of[i].totals());
        around(of[i].value, half)
    };
    let verdict = if tost.is_some_and(|t| t.p <= settings.alpha) {
        Verdict::Equivalent
    } else if p_difference > settings.alpha {
        Verdict::Undecided
    } else {
        direction(of[0].value, of[1].value, question.better)
    };
    let components = components::of(&of, settings.pairing);
    let whole = interval(settings.alpha);
    Ok(Comparison {
        kind: a.kind(),
        a: own(0),
        b: own(1),
        difference: whole,
        p_difference,
        tost,
        verdict,
        beyond_margin: question.margin.is_some_and(|margin| {
            whole.low.is_some_and(|l| l > margin) || whole.high.is_some_and(|h| h < -margin)
        }),
        design: Design {
            pairing: settings.pairing,
            locations,
            presses: [of[0].presses(), of[1].presses()],
            left_out,
        },
        components,
        needed: needed::needed(verdict, difference, question, &components, &of, settings),
        notes: Vec::<Note>::new(),
    })
}

/// The locations that are compared, and how many are left out.
fn kept(
    data: &[&Data; 2],
    all: [Influences; 2],
    pairing: Pairing,
) -> Result<([Influences; 2], [u32; 2]), Refusal> {
    let has = |i: usize, location: u32| {
        let places = &all[i].places;
        places.binary_search_by_key(&location, |p| p.0).is_ok()
    };
    let total = [0, 1].map(|i| all[i].places.len() as u32);
    let too_few = |locations| Err(Refusal::TooFewLocations { locations });
    if pairing == Pairing::Independent {
        return match total[0].min(total[1]) {
            few @ 0..2 => too_few(few),
            _ => Ok((all, [0, 0])),
        };
    }
    let shared = all[0].places.iter().filter(|p| has(1, p.0)).count() as u32;
    match shared {
        0 => {
            let [a, b] = total;
            return Err(Refusal::NoSharedLocation { a, b });
        }
        1 => return too_few(1),
        _ => {}
    }
    let of = [
        influences(data[0], Side::A, |k| has(1, k))?,
        influences(data[1], Side::B, |k| has(0, k))?,
    ];
    Ok((of, total.map(|t| t - shared)))
}

/// The standard error of the difference and its degrees of freedom (Welch 1947 for independent samples).
fn spread(of: &[Influences; 2], pairing: Pairing) -> (f64, f64) {
    let totals = of.each_ref().map(Influences::totals);
    let free = |i: usize| totals[i].len() as f64 - 1.0;
    match pairing {
        Pairing::SharedLocations => {
            let pairs = totals[0].iter().zip(&totals[1]);
            let both: Vec<f64> = pairs.map(|(a, b)| b - a).collect();
            (error(&both), free(0))
        }
        Pairing::Independent => {
            let [a, b] = [error(&totals[0]).powi(2), error(&totals[1]).powi(2)];
            let df = (a + b).powi(2) / (a * a / free(0) + b * b / free(1));
            ((a + b).sqrt(), df)
        }
    }
}

/// Standard error of a sum over locations whose terms add up to 0.
fn error(totals: &[f64]) -> f64 {
    let k = totals.len() as f64;
    (k / (k - 1.0) * totals.iter().map(|e| e * e).sum::<f64>()).sqrt()
}

const fn around(value: f64, half: f64) -> Interval {
    Interval {
        value,
        low: Some(value - half),
        high: Some(value + half),
    }
}

/// Better or worse by the values alone.
pub(super) fn direction(a: f64, b: f64, better: Better) -> Verdict {
    let gain = match better {
        Better::Lower => a - b,
        Better::Higher => b - a,
        Better::NearerZero => a.abs() - b.abs(),
    };
    if gain > 0.0 {
        Verdict::Better
    } else {
        Verdict::Worse
    }
}

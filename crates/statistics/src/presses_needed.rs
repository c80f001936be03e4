//! Computes how many more presses would decide a comparison.

use super::comparison::{Components, PressesNeeded, RequiredDesign, Verdict, direction};
use super::influence::Measure;
use super::question::{ComparisonTarget, ImprovementDirection, Settings};
use crate::distributions::student_quantile;

/// Upper limit of the search for locations.
const MAX_LOCATIONS: u32 = 100_000;

/// Presses required for a decision, if the measured difference and variance are the true ones.
pub(super) fn presses_needed(
    verdict: Verdict,
    question: &ComparisonTarget,
    components: &Components,
    of: &[Measure; 2],
    settings: &Settings,
) -> PressesNeeded {
    if verdict != Verdict::Undecided {
        return PressesNeeded::Nothing;
    }
    let within = components.within.unwrap_or_default();
    if components.between + within[0] + within[1] <= 0.0 {
        return PressesNeeded::Unknown;
    }
    let apart = direction(of[0].value, of[1].value, question.better);
    let tails = [1.0 - 0.5 * settings.alpha, 1.0 - settings.alpha];
    let powers = [settings.power, 0.5 * (1.0 + settings.power)];
    let difference = of[1].value - of[0].value;
    // Values of opposite sign can be equally far from zero and still differ.
    let distance = match question.better {
        ImprovementDirection::NearerZero => of[1].value.abs() - of[0].value.abs(),
        _ => difference,
    };
    let room = question.margin.map(|margin| margin - difference.abs());
    let goals = [
        (apart, Some(distance.abs()).filter(|d| *d > 0.0), 0),
        (Verdict::Equivalent, room.filter(|r| *r > 0.0), 1),
    ];
    let now = of.each_ref().map(|i| i.by_location.len() as u32);
    let locations = now[0].min(now[1]);
    // Standard errors from the border, by degrees of freedom.
    let times =
        |i: usize, df: f64| student_quantile(tails[i], df) + student_quantile(powers[i], df);
    let by_presses = goals.iter().filter_map(|(towards, distance, i)| {
        let distance = (*distance)?;
        // More presses leave what varies between sessions.
        let sessions = components.sessions;
        let taken = sessions.map_or(0.0, |s| times(*i, s.df) * s.error());
        let need = |k: u32| {
            // Largest variance per location that still decides.
            let left = (distance * distance - taken * taken).max(0.0);
            f64::from(k) * left / times(*i, f64::from(k - 1)).powi(2)
        };
        required_design(*towards, need, locations, components, of)
    });
    if let Some(best) = by_presses.min_by_key(|e| e.more_presses_by_locations) {
        return PressesNeeded::More(best);
    }
    let by_sessions = goals.iter().filter_map(|(towards, distance, i)| {
        let error = components.error_over_locations(f64::from(locations));
        let rest = times(*i, f64::from(locations - 1)) * error;
        let each = components
            .sessions?
            .enough((*distance)?, rest, |df| times(*i, df))?;
        Some((*towards, each))
    });
    by_sessions
        .min_by_key(|(_, each)| *each)
        .map_or(PressesNeeded::OutOfReach, |(towards, each)| {
            PressesNeeded::Sessions { towards, each }
        })
}

fn required_design(
    towards: Verdict,
    allowed: impl Fn(u32) -> f64,
    now: u32,
    components: &Components,
    of: &[Measure; 2],
) -> Option<RequiredDesign> {
    let within = components.within.unwrap_or_default();
    let variance = components.error_over_locations(1.0).powi(2);
    if allowed(MAX_LOCATIONS) < variance {
        return None;
    }
    // The present number did not decide.
    let (mut low, mut high) = (now.max(1) + 1, MAX_LOCATIONS);
    while low < high {
        let middle = low.midpoint(high);
        if allowed(middle) >= variance {
            high = middle;
        } else {
            low = middle + 1;
        }
    }
    let presses = of.iter().map(Measure::presses).max().unwrap_or(0);
    let each = f64::from(presses) / f64::from(now);
    let room = allowed(now.max(2)) - components.between;
    let both = within[0] + within[1];
    let repetitions = components
        .within
        .filter(|_| room > 0.0 && both > 0.0)
        .map(|_| (both / room).ceil())
        .filter(|r| *r < f64::from(MAX_LOCATIONS))
        // The present number did not decide.
        .map(|r| (r as u32).max(each.floor() as u32 + 1));
    Some(RequiredDesign {
        towards,
        locations: low,
        repetitions,
        more_presses_by_locations: (f64::from(low - now) * each).ceil() as u32,
        more_presses_by_repetitions: repetitions.map(|r| (r * now).saturating_sub(presses)),
    })
}
